#!/usr/bin/env bash
# Tries a release where nothing else is: smoke.sh FOLDER. Lays Debian's smallest system and its Python into an empty
# root (debootstrap, as root), unpacks the archive and installs the wheel there without a network, and runs both: their
# data sets, and that of target/release/spts where it is built, must have the same digest.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=$(realpath "$1")
root=$(mktemp -d)
trap 'rm -rf "$root"' EXIT

debootstrap --variant=minbase --include=python3-venv bookworm "$root" >"$root.log" || { tail -n 5 "$root.log" >&2; exit 1; }
rm -f "$root.log"
mkdir "$root/wheels"
cp "$folder"/spts_twin-*x86_64.whl "$root/wheels"
python3 -m pip download --quiet --disable-pip-version-check --only-binary=:all: --python-version 3.11 \
  --platform manylinux_2_28_x86_64 --platform manylinux2014_x86_64 --dest "$root/wheels" numpy
tar -xzf "$folder"/spts-*-x86_64-linux.tar.gz --directory "$root/opt"
inside() { chroot "$root" /usr/bin/env -i HOME=/root LANG=C.UTF-8 PATH=/venv/bin:/usr/bin:/bin "$@"; }
digest() { sed -n 's/^digest: //p'; }
shapes=(dataset make random-shapes --rows 200 --out)

inside python3 -m venv /venv
inside pip install --quiet --no-index --find-links /wheels spts-twin
inside spts --version
program=$(cd "$root" && echo opt/spts-*/bin/spts)
inside "/$program" firmware verify --edges 200 | tail -n 1
inside "/$program" design --area 0.15x0.15 --resolution 15mm --latency 2ms --iou 0.7 --objects large --out /design | sed -n '/^expected/p'
inside python3 -c 'import spts; print(spts.Skin(rows=10, cols=10, pitch=0.015))'
found=("$(inside "/$program" "${shapes[@]}" /by_program | digest)" "$(inside spts "${shapes[@]}" /by_wheel | digest)")
if [ -x target/release/spts ]; then
  found+=("$(target/release/spts "${shapes[@]}" "$root/by_clone" | digest)")
fi
printf '%s\n' "${found[@]}"
[ "$(printf '%s\n' "${found[@]}" | sort -u | wc -l)" = 1 ] || { echo "smoke: the digests differ" >&2; exit 1; }
