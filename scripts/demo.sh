#!/usr/bin/env bash
# What `make demo` does after set-up: builds the twin, shows a first image, and makes the report: demo.sh REPORT
# [RECORDINGS].
# Says before each step what it is and how long it takes, and after it how long it took.
set -euo pipefail
cd "$(dirname "$0")/.."
report=$1
recordings=${2:-}

began=$SECONDS
# step NUMBER WHAT COMMAND...
step() {
  local start=$SECONDS title="[$1/4] $2"
  shift 2
  printf '\n%s\n' "$title"
  "$@"
  printf '%s: done in %d min %02d s\n' "${title%%:*}" $(((SECONDS - start) / 60)) $(((SECONDS - start) % 60))
}

since="what has changed since the last time"
twin="building the twin: about four minutes on two cores the first time"
[ -x target/release/press ] && twin="building the twin: $since"
rest="building the command line: another four to five minutes the first time"
[ -x target/release/spts ] && rest="building the command line: $since"
page="the report, three to six minutes on two cores: 17 objects pressed, a ball bounced, decoders learned and scored"
[ -n "$recordings" ] && page="the report, six minutes or more on two cores: 17 objects and a ball, beside the recordings in $recordings"

build=(./scripts/build.py --release --locked --package)
step 1 "$twin" "${build[@]}" examples --bin press --no-default-features
step 2 "a first image: the letter T on the skin, as fifty samples of its one wire tell it" ./target/release/press T out/first_press
step 3 "$rest" "${build[@]}" spts-cli
step 4 "$page" ./target/release/spts reproduce --out "$report" ${recordings:+--recordings "$recordings"}
printf '\nAll of it took %d min %02d s. Open %s/index.html\n' $(((SECONDS - began) / 60)) $(((SECONDS - began) % 60)) "$report"
