#!/usr/bin/env bash
# Builds wheels of the Python package: wheel.sh TOOLS FOLDER [TARGET...]. TOOLS is the virtual environment of
# python/build-requirements.txt. Without a TARGET, one for this machine, of what the workspace has built. With targets,
# those of a release: for Linux (x86_64-unknown-linux-gnu, aarch64-unknown-linux-gnu) zig links them for glibc 2.17, and
# auditwheel says that they ask for no more; one for macOS is built on macOS.
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
  case $target in
    *-linux-gnu)
      # a compiler of its own for each target
      (
        . scripts/cross.sh "$target"
        "${build[@]}" --profile dist --target "$target" --target-dir target/dist --zig --compatibility manylinux2014
      )
      auditwheel show "$folder"/spts_twin-*manylinux_2_17_"${target%%-*}"*.whl | tr '\n' ' ' | grep -q 'manylinux_2_17' || {
        echo "wheel: the wheel for $target asks for more than manylinux2014 has" >&2
        exit 1
      } ;;
    *) "${build[@]}" --profile dist --target "$target" --target-dir target/dist ;;
  esac
done
