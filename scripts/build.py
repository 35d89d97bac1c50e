#!/usr/bin/env python3
"""Runs `cargo build` with the arguments given, and says how far it is and how long the rest takes.

On a terminal one line is kept up to date; elsewhere there is a line every half minute. Cargo's errors and warnings are
shown as they are.
"""

import bisect
import os
import re
import subprocess
import sys
import time

# Share of the time that has passed when a share of the crates is done: mean of two builds on two cores. The few
# crates around two thirds take longer than hundreds of small ones before them.
CRATES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.65, 0.7, 0.72, 0.75, 0.8, 0.9, 0.95, 0.98, 1.0)
TIME = (0.0, 0.03, 0.05, 0.08, 0.14, 0.25, 0.35, 0.47, 0.61, 0.73, 0.76, 0.77, 0.82, 0.89, 0.95, 1.0)


def share_of_time(crates):
    """The share of the time that has passed when this share of the crates is done."""
    k = min(max(bisect.bisect_right(CRATES, crates), 1), len(CRATES) - 1)
    low, high = CRATES[k - 1], CRATES[k]
    return TIME[k - 1] + (TIME[k] - TIME[k - 1]) * (crates - low) / (high - low)


def spoken(seconds):
    """A time in words: to ten seconds below two minutes, to half minutes above."""
    if seconds < 115:
        return f"{max(10, round(seconds, -1)):.0f} s"
    return f"{round(seconds / 30) / 2:g} min"


def pieces(stream):
    """Cargo's lines, which end in a line feed, or in a carriage return where the next one replaces them."""
    rest = ""
    while chunk := stream.read1(4096).decode(errors="replace"):
        *whole, rest = re.split(r"[\r\n]", rest + chunk)
        yield from whole
    yield rest


def main():
    shown = sys.stdout.isatty()
    environment = dict(os.environ, CARGO_TERM_PROGRESS_WHEN="always", CARGO_TERM_PROGRESS_WIDTH="100")
    cargo = subprocess.Popen(["cargo", "build", *sys.argv[1:]], stderr=subprocess.PIPE, env=environment)
    began = said = time.monotonic()
    first = None
    for line in pieces(cargo.stderr):
        line = re.sub(r"\x1b\[[0-9;]*[A-Za-z]", "", line)
        progress = re.search(r"Building \[.*\] (\d+)/(\d+)", line)
        if progress is None:
            if line.strip() and not re.match(r"\s+(Compiling|Downloading|Downloaded|Updating|Finished|Locking) ", line):
                print(line, flush=True)
            continue
        done, crates = int(progress[1]), int(progress[2])
        now, passed = time.monotonic(), share_of_time(done / crates)
        if first is None:
            first = passed
        pause = 1 if shown else 30
        if now - said < pause or passed - first < 0.01:
            continue
        left = (now - began) * (1 - passed) / (passed - first)
        text = f"  {done} of {crates} crates built, about {spoken(left)} left"
        print(f"\r{text:<60}" if shown else text, end="" if shown else "\n", flush=True)
        said = now
    if shown:
        print("\r" + 60 * " ", end="\r", flush=True)
    return cargo.wait()


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
