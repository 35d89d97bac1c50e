#!/usr/bin/env bash
# Builds the part of the Python package that needs MuJoCo into python/spts/_scenes.abi3.so. It finds the library of PyPI's mujoco beside
# it, and has no path of this machine in it.
set -euo pipefail
cd "$(dirname "$0")/.."
target="${1:-target/python}"
# in place of the workspace's own flags
RUSTFLAGS="-C link-arg=-Wl,-rpath,\$ORIGIN/../mujoco" \
  cargo build --config profile.release.lto=false --quiet --release --locked --manifest-path python/scenes/Cargo.toml --target-dir "$target"
install -m 755 "$target/release/lib_scenes.so" python/spts/_scenes.abi3.so
strip --strip-unneeded python/spts/_scenes.abi3.so
