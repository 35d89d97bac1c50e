#!/usr/bin/env bash
# Builds wheels of the Python package: wheel.sh TOOLS FOLDER [TARGET...]. TOOLS is a virtual environment. Without a
# TARGET, it has python/build-requirements.txt, and the wheel is for this machine, of what the workspace has built. With
# targets, it has python/release-requirements.txt: for Linux (x86_64-unknown-linux-gnu, aarch64-unknown-linux-gnu) zig
# links the wheels for glibc 2.17, and auditwheel says that they ask for no more. Wheels for macOS
# (aarch64-apple-darwin, x86_64-apple-darwin) are linked by the compiler of a Mac; nobody has run this part yet.
set -euo pipefail
cd "$(dirname "$0")/.."
tools=$(realpath "$1")
folder=$2
shift 2
# zig and auditwheel are run by their names
export PATH="$tools/bin:$PATH"
build=(maturin build --quiet --locked --strip --manifest-path python/Cargo.toml --out "$folder")

if [ $# = 0 ]; then
  rm -f "$folder"/spts_twin-*.whl
  "${build[@]}" --release --target-dir target
  exit
fi
for target in "$@"; do
  machine=${target%%-*}
  case $target in
    *-linux-*) system=linux how=(--zig --compatibility manylinux2014) ;;
    *-apple-darwin) system=macosx machine=${machine/aarch64/arm64} how=() ;;
    *)
      echo "wheel: no wheels are made for $target" >&2
      exit 2
      ;;
  esac
  rm -f "$folder"/spts_twin-*"$system"*"$machine".whl
  # a compiler of its own for each target
  (
    . scripts/cross.sh "$target"
    # an empty list is an error to the bash of macOS
    "${build[@]}" --profile dist --target "$target" --target-dir target/dist ${how[@]+"${how[@]}"}
  )
  if [ "$system" = linux ]; then
    auditwheel show "$folder"/spts_twin-*"$system"*"$machine".whl | tr '\n' ' ' | grep -q 'tag: *"manylinux_2_17_' || {
      echo "wheel: the wheel for $target asks for more than manylinux2014 has" >&2
      exit 1
    }
  fi
done
