#!/usr/bin/env bash
# Makes a virtual environment with the packages that a file lists: environment.sh FOLDER REQUIREMENTS.
# One that has them is left as it is, so that a network is needed once and after a change of requirements.txt.
# uv, itself fetched by pip, installs ten times as fast as pip; where it cannot, as behind a mirror that only pip's
# configuration knows, pip does.
set -euo pipefail
folder=$1
wanted=$2
# what was installed last; written when all of it is there
installed=$folder/requirements.txt

if cmp -s "$wanted" "$installed" && "$folder/bin/python" -c 'pass' 2>/dev/null; then
  exit 0
fi
echo "environment: installing the packages of $wanted into $folder"
rm -f "$installed"
python3 -m venv --clear "$folder" || {
  echo "environment: python3 cannot make a virtual environment in $folder; Debian: apt-get install python3-venv" >&2
  exit 1
}
log=$folder/pip.log
pip=("$folder/bin/python" -m pip install --quiet --disable-pip-version-check)
{ "${pip[@]}" uv==0.13.9 && "$folder/bin/uv" pip install --quiet --python "$folder/bin/python" --requirement "$wanted"; } >"$log" 2>&1 ||
  "${pip[@]}" --requirement "$wanted" >"$log" 2>&1 || {
  echo "environment: the packages of $wanted cannot be installed: $(grep -m 1 '^ERROR' "$log" || tail -n 1 "$log") (all of it: $log)" >&2
  exit 1
}
cp "$wanted" "$installed"
