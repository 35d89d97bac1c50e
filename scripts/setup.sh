#!/usr/bin/env bash
# Makes a fresh Debian/Ubuntu machine ready to build and run the twin: setup.sh [PACKAGE …], which are Debian packages
# to install as well. Idempotent; needs no environment variable.
#   1. system libraries for off-screen rendering, the circuit simulator that the tests compare
#      with, and the compiler of the cells' firmware (apt, when root; otherwise prints the command)
#   2. the MuJoCo library, taken out of its Python wheel by pinned hash, into third_party/mujoco/lib. The hash of the
#      library itself is checked every time: a file that was damaged or replaced since is fetched again.
set -euo pipefail
cd "$(dirname "$0")/.."

packages=(libegl1 libegl-mesa0 libgl1-mesa-dri build-essential ngspice gcc-avr binutils-avr "$@")
missing=()
if command -v dpkg-query >/dev/null; then
  for p in "${packages[@]}"; do
    dpkg-query -W -f '${db:Status-Status}' "$p" 2>/dev/null | grep -qx installed || missing+=("$p")
  done
fi
if [ ${#missing[@]} -gt 0 ]; then
  if [ "$(id -u)" = 0 ]; then
    echo "setup: installing ${missing[*]}"
    (apt-get update -qq && DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "${missing[@]}") >/dev/null
  else
    echo "setup: system packages are missing. Run this once, then repeat your command:" >&2
    echo "  sudo apt-get install -y --no-install-recommends ${missing[*]}" >&2
    exit 1
  fi
fi

version=3.17.0
wheel_sha256=d66928d86a2d1b601bbaa4dc11db50214d17d5301bb8afd84721313b67ff0874
lib_sha256=23496b023ee80fb61ab71167e94bc649f9941710fde96b18bb8204fb332523ad
lib=third_party/mujoco/lib

# Prints what is wrong with the library, nothing when it has the right bytes. Takes about 25 ms.
fault() {
  local name=$lib/libmujoco.so.$version found
  [ -f "$name" ] || { echo "$name is missing"; return; }
  found=$(sha256sum <"$name" | cut -d ' ' -f 1)
  [ "$found" = "$lib_sha256" ] || echo "$name is not MuJoCo $version: SHA-256 is $found, must be $lib_sha256"
}

if [ -n "$(fault)" ]; then
  echo "setup: $(fault)" >&2
  case "$(uname -s)-$(uname -m)" in
    Linux-x86_64) ;;
    *) echo "setup: only Linux on x86_64 is supported (this is $(uname -s) $(uname -m))" >&2; exit 1 ;;
  esac
  command -v cargo >/dev/null || { echo "setup: cargo not found; install Rust 1.95 or newer first" >&2; exit 1; }
  python3 -m pip --version >/dev/null 2>&1 || { echo "setup: Python 3 with pip is needed: sudo apt-get install -y python3-pip" >&2; exit 1; }
  echo "setup: fetching MuJoCo $version (26 MB)"
  tmp=$(mktemp -d)
  trap 'rm -rf "$tmp"' EXIT
  echo "mujoco==$version --hash=sha256:$wheel_sha256" >"$tmp/req.txt"
  python3 -m pip download -q --disable-pip-version-check --no-deps --only-binary=:all: --platform manylinux_2_28_x86_64 \
    --python-version 3.11 --implementation cp --require-hashes -r "$tmp/req.txt" -d "$tmp" || {
    echo "setup: MuJoCo $version could not be fetched; repeat this command with a network" >&2
    exit 1
  }
  mkdir -p "$lib"
  python3 - "$tmp" "$lib" "$version" <<'PY'
import glob, os, sys, zipfile
tmp, lib, version = sys.argv[1:]
with zipfile.ZipFile(glob.glob(os.path.join(tmp, "*.whl"))[0]) as wheel:
    data = wheel.read(f"mujoco/libmujoco.so.{version}")
part = os.path.join(lib, "part")
with open(part, "wb") as f:
    f.write(data)
os.chmod(part, 0o755)
os.replace(part, os.path.join(lib, f"libmujoco.so.{version}"))
PY
  [ -z "$(fault)" ] || { echo "setup: $(fault), although it was just fetched; delete $lib and repeat this command" >&2; exit 1; }
fi
echo "setup: ready (MuJoCo $version)"
