#!/usr/bin/env bash
# Installs the command line into a folder: install.sh [FOLDER], ~/.local unless given. FOLDER/bin/spts finds the MuJoCo
# library in FOLDER/lib, so that the folder can be moved, and the repository deleted. Needs what scripts/setup.sh has
# fetched.
set -euo pipefail
prefix=$(realpath --canonicalize-missing "${1:-$HOME/.local}")
cd "$(dirname "$0")/.."
library=third_party/mujoco/lib/libmujoco.so.3.17.0
[ -f "$library" ] || { echo "install: $library is missing; run scripts/setup.sh first" >&2; exit 1; }

cargo install --locked --path experiments/cli --root "$prefix" --force --no-track
install -D -m 755 "$library" "$prefix/lib/$(basename "$library")"
"$prefix/bin/spts" --version
echo "install: $prefix/bin/spts"
