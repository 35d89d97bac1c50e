# Everything a user needs: `make demo` runs the twin and writes a report, `make test` checks it; `make validate` runs
# the slow tests too. RECORDINGS=DIR scores recordings of the real skin beside the twin, and lets the tests use them.

RECORDINGS ?= $(wildcard ../shared/recordings)
OUT ?= out/report
# where the tests look for them; they do not start in this folder
ifneq ($(RECORDINGS),)
export SPTS_RECORDINGS ?= $(abspath $(RECORDINGS))
endif

.PHONY: demo install test validate readers wheel wheels release smoke python book browser bench firmware setup clean

demo: setup
	./scripts/demo.sh "$(OUT)" $(if $(RECORDINGS),"$(RECORDINGS)")

# The command line and the MuJoCo library, in PREFIX/bin and PREFIX/lib (docs/install.md).
PREFIX ?= $(HOME)/.local
install: setup
	./scripts/install.sh "$(PREFIX)"

# maturin builds the Python package, and sets what a build depends on
ALL = --release --locked --workspace --exclude spts-python

# KINDS="--doc" runs the tests in the documentation alone
KINDS ?=
test: setup
	cargo test $(ALL) $(KINDS)

# The slow tests, which `make test` leaves out, twenty minutes: ngspice's speed, MuJoCo's finite elements, a million
# edges of a hundred cells, the processor against yasimavr, the same results on other numbers of threads, and with
# recordings the score curves of twin and skin. Without recordings, ngspice or yasimavr, what needs them says so and is
# skipped. ONLY="NAME..." runs those tests alone.
ONLY ?=
validate: setup
	cargo test $(ALL) --lib --bins --tests -- --ignored $(ONLY)

# Data sets, read with the programs that people read them with (pyarrow, DuckDB, polars, pandas, Hugging Face
# `datasets`, Croissant), and made by many workers, Ray among them. A minute or two; the first time, and after a change
# of their versions, it fetches Python packages of about 1 GB.
READERS ?= out/readers
# a file of tests on a core
PARALLEL = --numprocesses logical --dist loadfile
readers: setup
	./scripts/environment.sh "$(READERS)" scripts/dataset/requirements.txt
	cargo build $(ALL) --quiet
	"$(READERS)/bin/python" -m pytest $(PARALLEL) --quiet --tb=short -rs --disable-warnings -p no:cacheprovider scripts/dataset

# The wheel of the Python package `spts` for this machine, in out/wheels: two minutes after `make demo`.
MATURIN ?= out/maturin
WHEELS ?= out/wheels
wheel: setup
	./scripts/environment.sh "$(MATURIN)" python/build-requirements.txt
	./scripts/wheel.sh "$(MATURIN)" "$(WHEELS)"

# What a release gives away, in out/release: wheels and programs for Linux from glibc 2.17 on, the licences of what is
# in them, and SHA-256. `make wheels` builds the wheels alone. A quarter of an hour a target on two cores. `make smoke`
# tries them in an empty Debian, as root.
TOOLS ?= out/tools
RELEASE ?= out/release
TARGETS ?= x86_64-unknown-linux-gnu aarch64-unknown-linux-gnu
wheels:
	./scripts/environment.sh "$(TOOLS)" python/release-requirements.txt
	./scripts/wheel.sh "$(TOOLS)" "$(RELEASE)" $(TARGETS)

release: wheels
	./scripts/release.sh "$(TOOLS)" "$(RELEASE)" $(TARGETS)

smoke:
	./scripts/smoke.sh "$(RELEASE)"

# The Python package installed into a virtual environment, out/python, with everything that it can work with, and tested
# there. It fetches Python packages of about 500 MB once.
PYTHON ?= out/python
python: wheel
	./scripts/environment.sh "$(PYTHON)" python/requirements.txt
	"$(PYTHON)/bin/ruff" check --quiet --config python/pyproject.toml python scripts/python_*.py
	"$(PYTHON)/bin/ruff" format --quiet --check --config python/pyproject.toml python/spts python/tests scripts/python_*.py
	"$(PYTHON)/bin/python" -m pip install --quiet --disable-pip-version-check --force-reinstall --no-deps "$(WHEELS)"/spts_twin-*.whl
	"$(PYTHON)/bin/python" -m pytest $(PARALLEL) --quiet --tb=short -rs --disable-warnings -p no:cacheprovider python/tests

# The book, out/book/index.html: its links are checked, its commands and its Python are run. BLOCKS="--with slow" runs
# what takes long, too. MkDocs is not told to be quiet: it would then count no warning. Where the Python package is
# not built (`make python`), its examples are left out.
BOOK ?= out/mkdocs
BLOCKS ?=
book: setup
	./scripts/environment.sh "$(BOOK)" scripts/docs/requirements.txt
	cargo build $(ALL) --quiet
	python3 scripts/docs/links.py
	NO_MKDOCS_2_WARNING=1 "$(BOOK)/bin/mkdocs" build --strict
	$(if $(wildcard $(PYTHON)/bin/python),"$(PYTHON)/bin/python" scripts/docs/run_blocks.py,"$(BOOK)/bin/python" scripts/docs/run_blocks.py --without python) $(BLOCKS)

# The pages that people look at, in a real browser: Debian's Chromium. SHOTS=DIR keeps pictures of them. The report is
# made before the tests, one of which asks how often the live page is updated; SPTS_REPORT=DIR names one that is there.
# A core that has no test left takes one of the other's.
BROWSER ?= out/browser
SHOTS ?=
browser: setup
	./scripts/setup.sh chromium
	./scripts/environment.sh "$(BROWSER)" scripts/browser/requirements.txt
	cargo build $(ALL) --quiet
	test -n "$$SPTS_REPORT" || target/release/spts reproduce --quick --out "$(BROWSER)/report" >/dev/null
	SPTS_REPORT="$${SPTS_REPORT:-$(BROWSER)/report}" "$(BROWSER)/bin/python" -m pytest $(PARALLEL:loadfile=worksteal) --quiet --tb=short -rs -p no:cacheprovider scripts/browser $(if $(SHOTS),--shots "$(SHOTS)")

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
