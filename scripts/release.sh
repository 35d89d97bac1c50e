#!/usr/bin/env bash
# The programs of a release beside its wheels: release.sh TOOLS FOLDER TARGET... For each target of Linux an archive
# with `spts`, which asks for glibc 2.17 and no library but the system's own, and for all of them the licences of what
# is linked and the SHA-256 of every file. TOOLS is the virtual environment of python/release-requirements.txt.
set -euo pipefail
cd "$(dirname "$0")/.."
tools=$(realpath "$1")
folder=$(realpath "$2")
shift 2
export PATH="$tools/bin:$PATH"
version=$(sed -n '/^\[workspace.package\]/,/^$/s/^version = "\(.*\)"/\1/p' Cargo.toml)

rm -f "$folder"/spts-*.tar.gz
for target in "$@"; do
  (
    . scripts/cross.sh "$target"
    cargo zigbuild --quiet --locked --profile dist --package spts-cli --target "$target.2.17" --target-dir target/dist
  )
  name=spts-$version-${target/-unknown-linux-gnu/-linux}
  rm -rf "target/dist/$name"
  install -D -m 755 "target/dist/$target/dist/spts" "target/dist/$name/bin/spts"
  cp LICENSE-MIT LICENSE-APACHE CHANGELOG.md experiments/report/assets/OFL.txt "target/dist/$name"
  # the same bytes from the same program, whoever packs it and when
  tar --create --sort=name --mtime=@0 --owner=0 --group=0 --numeric-owner --directory target/dist "$name" |
    gzip --no-name --best >"$folder/$name.tar.gz"
done
python3 scripts/licences.py "$@" >"$folder/licences.csv"
(cd "$folder" && sha256sum -- *.whl *.tar.gz licences.csv >SHA256SUMS && cat SHA256SUMS && du --apparent-size --block-size=kB -- *)
