# Everything a user needs: `make demo` runs the twin and writes a report, `make test` checks it; `make validate` runs the slow tests too.
# RECORDINGS=DIR scores recordings of the real skin beside the twin, and lets the tests use them.

RECORDINGS ?= $(wildcard ../shared/recordings)
OUT ?= out/report
# where the tests look for them; they do not start in this folder
ifneq ($(RECORDINGS),)
export SPTS_RECORDINGS ?= $(abspath $(RECORDINGS))
endif

.PHONY: demo test validate readers bench firmware setup clean

demo: setup
	@echo "building (a few minutes the first time), then simulating and scoring (about three minutes on two cores)"
	cargo build --release --locked --quiet --package spts-cli
	./target/release/spts reproduce --out "$(OUT)" $(if $(RECORDINGS),--recordings "$(RECORDINGS)")

test: setup
	cargo test --release --locked --workspace

# The slow tests, which `make test` leaves out, some minutes: ngspice's speed, MuJoCo's finite elements, a million edges of a hundred
# cells, the processor against yasimavr, and with recordings the score curves of twin and skin. Without recordings, ngspice or yasimavr,
# what needs them says so and is skipped.
validate: setup
	cargo test --release --locked --workspace -- --ignored

# Data sets, read with the programs that people read them with (pyarrow, DuckDB, polars, pandas, Hugging Face `datasets`, Croissant), and
# made by many workers, Ray among them. A minute or two; the first time, and after a change of their versions, it fetches Python packages of about 1 GB.
READERS ?= out/readers
readers: setup
	./scripts/dataset/environment.sh "$(READERS)"
	cargo build --release --locked --quiet --package spts-cli
	"$(READERS)/bin/python" -m pytest --quiet --tb=short -rs --disable-warnings -p no:cacheprovider scripts/dataset

# Speed, beside the named peers.
bench: setup
	cargo bench --locked --workspace

# Flash images of the cells, from source: the committed ones again, byte for byte.
firmware: setup
	$(MAKE) -C firmware/cell

setup:
	./scripts/setup.sh

clean:
	rm -rf out
	cargo clean
