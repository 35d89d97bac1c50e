#!/usr/bin/env bash
# Builds the wheel of the Python package: wheel.sh MATURIN FOLDER. First the part that needs MuJoCo,
# python/spts/_scenes.abi3.so, which finds the library of PyPI's mujoco beside it and has no path of this machine in it;
# then the rest, and the wheel of both. What they need of other crates is that of the workspace, and built once.
set -euo pipefail
cd "$(dirname "$0")/.."
maturin=$1
wheels=$2

cargo rustc --quiet --release --locked --manifest-path python/scenes/Cargo.toml --target-dir target -- -C strip=symbols
install -m 755 target/release/lib_scenes.so python/spts/_scenes.abi3.so

rm -f "$wheels"/spts_twin-*.whl
"$maturin" build --quiet --release --strip --locked --manifest-path python/Cargo.toml --target-dir target --out "$wheels"
