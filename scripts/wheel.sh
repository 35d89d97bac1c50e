#!/usr/bin/env bash
# Builds the wheel of the Python package: wheel.sh MATURIN FOLDER. First the part that needs MuJoCo, python/spts/_scenes.abi3.so, which finds the library of
# PyPI's mujoco beside it and has no path of this machine in it; then the rest, and the wheel of both.
set -euo pipefail
cd "$(dirname "$0")/.."
maturin=$1
wheels=$2

# the flags are in place of the workspace's own; linking across crates would take minutes, and its speed is MuJoCo's
RUSTFLAGS="-C link-arg=-Wl,-rpath,\$ORIGIN/../mujoco -C strip=symbols" \
  cargo build --quiet --release --locked --config profile.release.lto=false --manifest-path python/scenes/Cargo.toml --target-dir target/scenes
install -m 755 target/scenes/release/lib_scenes.so python/spts/_scenes.abi3.so

rm -f "$wheels"/spts_twin-*.whl
"$maturin" build --quiet --release --locked --manifest-path python/Cargo.toml --target-dir target/python --out "$wheels"
