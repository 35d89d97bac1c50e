# Everything a user needs: `make demo` runs the twin and writes a report, `make test` checks it all.
# RECORDINGS=DIR scores recordings of the real skin beside the twin.

RECORDINGS ?= $(wildcard ../shared/recordings)
OUT ?= out/report

.PHONY: demo test bench firmware setup clean

demo: setup
	@echo "building (a few minutes the first time), then simulating and scoring (about three minutes on two cores)"
	cargo build --release --locked --quiet --package spts-experiments
	./target/release/spts reproduce --out "$(OUT)" $(if $(RECORDINGS),--recordings "$(RECORDINGS)")

test: setup
	cargo test --release --locked --workspace

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
