#!/usr/bin/env bash
# Tries one wheel with every Python that is here and MuJoCo 3.17.0 and 4.0.0 beside it, imported before and after, and
# without it: python_versions.sh WHEEL PYTHON... . Every environment is fresh; that it takes less than a minute is a
# part of it.
set -euo pipefail
wheel=$1
shift
tried=$(mktemp -d)
trap 'rm -rf "$tried"' EXIT
six='
skin = spts.Skin(rows=10, cols=10, pitch=0.015)
cup = spts.Body.cylinder(radius=0.03, length=0.08)
wire = spts.Wire(skin, readout="as_built", seeds="mixed", seed=1)
touch = skin.touch({cup: ((0, 0, 0.0385), (1, 0, 0, 0))}, {cup: (0,) * 6}, 0.05)
y, phi = wire.record(touch, 20)
image = spts.decode(phi, y, shape=(10, 10), decoder="nn_lmmse")
assert image.shape == (10, 10) and image.max() > 0'

for python in "$@"; do
  for mujoco in none 3.17.0 4.0.0; do
    began=$SECONDS
    folder=$tried/env
    "$python" -m venv --clear "$folder"
    "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "$wheel"
    said="$("$python" --version), numpy alone"
    if [ "$mujoco" != none ]; then
      said="$("$python" --version), mujoco $mujoco"
      if ! "$folder/bin/python" -m pip install --quiet --disable-pip-version-check "mujoco==$mujoco" 2>/dev/null; then
        echo "$said: not to be had"
        continue
      fi
      for order in "mujoco, spts" "spts, mujoco"; do
        "$folder/bin/python" -c "import $order
import spts.mujoco
$six"
      done
    else
      "$folder/bin/python" -c "import spts$six"
    fi
    echo "$said: works, $((SECONDS - began)) s with the installation"
  done
done
