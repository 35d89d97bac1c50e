#!/usr/bin/env bash
# Tries a release where nothing else is: smoke.sh FOLDER. Lays Debian's smallest system and its Python into an empty
# root (debootstrap, as root), unpacks the archive and installs the wheel there without a network, and runs both. Where
# qemu-aarch64-static is installed, archive and wheel for aarch64 run in it, on the libraries and the Python of that
# Debian. All data sets, and that of target/release/spts where it is built, must have the same digest.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(realpath "$1")
work=$(mktemp -d)
# not into what a debootstrap that was stopped has mounted there
trap 'rm -rf --one-file-system "$work"' EXIT
root=$work/x86_64
# system FOLDER ARGUMENT...: Debian's smallest system with a Python
system() {
  debootstrap --variant=minbase --include=python3-venv "${@:2}" bookworm "$1" >"$work/log" || { tail -n 5 "$work/log" >&2; exit 1; }
}
# wheels MACHINE FOLDER: NumPy's wheel, and the release's
wheels() {
  mkdir -p "$2"
  cp "$folder"/spts_twin-*"$1".whl "$2"
  python3 -m pip download --quiet --disable-pip-version-check --only-binary=:all: --python-version 3.11 \
    --platform "manylinux_2_28_$1" --platform "manylinux2014_$1" --dest "$2" numpy
}

system "$root"
wheels x86_64 "$root/wheels"
tar -xzf "$folder"/spts-*-x86_64-linux.tar.gz --directory "$root/opt"
inside() { chroot "$root" /usr/bin/env -i HOME=/root LANG=C.UTF-8 PATH=/venv/bin:/usr/bin:/bin "$@"; }
digest() { sed -n 's/^digest: //p'; }
shapes=(dataset make random-shapes --rows 200 --out)

inside python3 -m venv /venv
inside pip install --quiet --no-index --find-links /wheels spts-twin
inside spts --version
echo "$(inside du --summarize --block-size=MB /venv | cut -f 1) with NumPy"
program=$(cd "$root" && echo opt/spts-*/bin/spts)
inside "/$program" firmware verify --edges 200 | tail -n 1
inside "/$program" design --area 0.15x0.15 --resolution 15mm --latency 2ms --iou 0.7 --objects large --out /design | sed -n '/^expected/p'
inside python3 -c 'import spts; print(spts.Skin(rows=10, cols=10, pitch=0.015))'
found=("$(inside "/$program" "${shapes[@]}" /by_program | digest)" "$(inside spts "${shapes[@]}" /by_wheel | digest)")
if command -v qemu-aarch64-static >/dev/null && ls "$folder"/spts_twin-*aarch64.whl >/dev/null 2>&1; then
  arm=$work/aarch64
  # its programs cannot install it: it is unpacked
  system "$arm" --arch=arm64 --foreign
  for package in "$arm"/var/cache/apt/archives/*.deb; do dpkg --extract "$package" "$arm"; done
  wheels aarch64 "$work/arm_wheels"
  for wheel in "$work"/arm_wheels/*.whl; do python3 -m zipfile --extract "$wheel" "$work/site"; done
  for archive in "$folder"/spts-*-aarch64-linux.tar.gz; do
    [ -e "$archive" ] || { echo "skipped: no archive for aarch64"; continue; }
    mkdir -p "$work/arm_program"
    tar -xzf "$archive" --directory "$work/arm_program"
    found+=("$(qemu-aarch64-static -L "$arm" "$work"/arm_program/*/bin/spts "${shapes[@]}" "$work/by_aarch64_program" | digest)")
  done
  emulated() { qemu-aarch64-static -L "$arm" -E PYTHONHOME="$arm/usr" -E PYTHONPATH="$work/site" "$arm/usr/bin/python3.11" "$@"; }
  emulated -c 'import platform, spts; print(platform.machine(), spts.Skin(rows=10, cols=10, pitch=0.015))'
  found+=("$(emulated -m spts "${shapes[@]}" "$work/by_aarch64_wheel" | digest)")
fi
if [ -x target/release/spts ]; then
  found+=("$(target/release/spts "${shapes[@]}" "$work/by_clone" | digest)")
fi
printf '%s\n' "${found[@]}"
[ "$(printf '%s\n' "${found[@]}" | sort -u | wc -l)" = 1 ] || { echo "smoke: the digests differ" >&2; exit 1; }
