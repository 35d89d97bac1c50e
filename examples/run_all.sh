#!/usr/bin/env bash
# Runs every example once, as CI does; results go to out/examples. The decoder in Python runs where there is a Python
# with NumPy: that of PYTHON (python3 unless given).
set -euo pipefail
cd "$(dirname "$0")"
python=${PYTHON:-python3}
out=../out/examples

# with all of the workspace that the tests need
cargo build --locked --release --quiet --workspace --exclude spts-python
mkdir -p "$out"
programs=$PWD/../target/release
run() { printf '\n-- %s\n' "$*"; "$programs/$@"; }

run press T "$out/press"
(cd "$out" && run own_mesh)
run other_skin
run own_transducer
run own_readout
# a second run keeps the files of the first
rm -rf "$out/data_set"
run data_set "$out/data_set"
run data_set "$out/data_set"
if "$python" -c 'import numpy' 2>/dev/null; then
  run own_decoder "ridge=$python python/decoder.py"
else
  run own_decoder
  echo "skipped: python/decoder.py needs NumPy"
fi
# the others have their time-consuming parts run elsewhere; here they are read
"$python" -c 'import ast, sys; [ast.parse(open(file).read(), file) for file in sys.argv[1:]]' python/*.py
