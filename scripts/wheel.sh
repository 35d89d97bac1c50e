#!/usr/bin/env bash
# Builds the wheel of the Python package: wheel.sh MATURIN FOLDER. First the part that needs MuJoCo,
# python/spts/_scenes.abi3.so, which finds the library of PyPI's mujoco beside it and has no path of this machine in it;
# then the rest, and the wheel of both.
set -euo pipefail
cd "$(dirname "$0")/.."
maturin=$1
wheels=$2

# in place of the workspace's own flags, which name a folder of this repository; the same for both, which share what
# they are built of
export RUSTFLAGS="-C strip=symbols"
cargo build --quiet --release --locked --manifest-path python/scenes/Cargo.toml --target-dir target/python
install -m 755 target/python/release/lib_scenes.so python/spts/_scenes.abi3.so

rm -f "$wheels"/spts_twin-*.whl
"$maturin" build --quiet --release --locked --manifest-path python/Cargo.toml --target-dir target/python --out "$wheels"
