#!/usr/bin/env bash
# What `make demo` does after set-up: builds, draws a first picture, and makes the report: demo.sh REPORT [RECORDINGS].
# Says before each step what it is and how long it takes, and after it how long it took.
set -euo pipefail
cd "$(dirname "$0")/.."
report=$1
recordings=${2:-}
first=out/first_press

began=$SECONDS
# step NUMBER WHAT COMMAND...
step() {
  local start=$SECONDS title="[$1/3] $2"
  shift 2
  printf '\n%s\n' "$title"
  "$@"
  printf '%s: done in %d min %02d s\n' "${title%%:*}" $(((SECONDS - start) / 60)) $(((SECONDS - start) % 60))
}

build="building: four to eight minutes on two cores the first time, seconds after that"
[ -x target/release/spts ] && build="building what has changed since the last time"
press="a first press, some seconds: the letter T on the skin, and what one wire tells of it"
page="the report, three to six minutes on two cores: 17 objects pressed, a ball bounced, decoders learned and scored"
[ -n "$recordings" ] && page="the report, six minutes or more on two cores: 17 objects and a ball, beside the recordings in $recordings"

step 1 "$build" ./scripts/build.py --release --locked --package spts-cli
step 2 "$press" ./target/release/spts simulate press/T --out "$first"
echo "first picture: $first/decoded.png"
step 3 "$page" ./target/release/spts reproduce --out "$report" ${recordings:+--recordings "$recordings"}
printf '\nAll of it took %d min %02d s. Open %s/index.html\n' $(((SECONDS - began) / 60)) $(((SECONDS - began) % 60)) "$report"
