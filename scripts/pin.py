#!/usr/bin/env python3
"""Prints digests of what the twin gives, to show that a change of the code leaves its results as they are.

    make demo; scripts/pin.py > before.txt      # then change the code and build
    scripts/pin.py | diff before.txt -

A line is a file of results with its digest, or a value of the report's headline. Pictures, times and revisions are left
out. RECORDINGS=DIR adds what is measured on recordings of the real skin; names after the options run those alone:
scripts/pin.py press board. SPTS=PROGRAM takes another program. Some minutes on two cores.
"""

import csv
import hashlib
import io
import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

PROGRAM = Path(os.environ.get("SPTS", Path(__file__).resolve().parent.parent / "target/release/spts")).resolve()
REAL = os.environ.get("RECORDINGS") and str(Path(os.environ["RECORDINGS"]).resolve())

# command by name; {out} is its folder, {real} the recordings
RUNS = {
    "press": "simulate press/T --presses 2 --seed 5 --out {out}",
    "bounce": "simulate bounce --seed 3 --out {out}",
    "arm": "simulate arm --seed 2 --out {out}",
    "layer": "simulate press/T --contact layer --cells 2 --out {out}",
    "decode": "decode press --measurements 7,20 --json",
    "board": "score --twin press/T press/tape --quick --measurements 20,50 --no-times --out {out}",
    "unlearned": "score --twin press/T --quick --learn-from shapes --measurements 20 --no-times --json",
    "anytime": "score --twin press/T press/tape --quick --anytime --json",
    "shapes": "dataset make random-shapes --rows 40 --out {out}",
    "courses": "dataset make courses --rows 40 --out {out}",
    "skins": "dataset make skins --rows 20 --out {out}",
    "budget": "budget --quick --objects T,tape --measurements 20 --out {out}",
    "bench": "bench data drift --out {out}",
    "fidelity": "fidelity --scene T --cells 3 --out {out}",
    "circuit": "circuit --taxels 100 --out {out}",
    "design": "design --area 0.15x0.15 --resolution 15mm --latency 2ms --iou 0.7 --objects large --out {out}",
    "rows": "sensing design --out {out}",
    "weights": "firmware weights --mode analog --edges 2000 --seeding mixed --out {out}/analog.npy",
    "verify": "firmware verify --cells 20 --edges 2000 --json",
    "reproduce": "reproduce --quick --out {out}",
}
ON_RECORDINGS = {
    "validate": "validate {real} --json",
    "published": "score {real} --left-out --decoder matched,evidence,nn_lmmse --measurements 7,20 --no-times --out {out}",
    "in_time": "score {real} --in-time --out {out}",
    "calibrate": "calibrate {real} --json",
    "gains": "calibrate {real} --skin --json",
    "compare": "compare {real} --no-curves --json",
    "compare_arm": "compare {real} --arm --skins 2 --json",
}

# what stands in the names of keys and columns that change from run to run
CHANGING = ("revision", "version", "cpu", "threads", "seconds", "provenance", "wall", "cost", "_us_", "per_s")
PICTURES = {".png", ".svg", ".gif", ".html"}
# times and revisions, and what has them
OTHERS = {"timing.json", "timings.csv", "manifest.json", "provenance.json", "summary.md", "README.md", "croissant.json"}


def kept(name):
    return not any(part in name for part in CHANGING)


def results(value):
    """The JSON `value` without what changes from run to run."""
    if isinstance(value, dict):
        return {key: results(inner) for key, inner in value.items() if kept(key)}
    return [results(inner) for inner in value] if isinstance(value, list) else value


def digest(name, content):
    if name.endswith(".json"):
        content = json.dumps(results(json.loads(content)), sort_keys=True).encode()
    if name.endswith(".csv"):
        head, *rows = list(csv.reader(io.StringIO(content.decode()))) or [[]]
        rows = [[cell for key, cell in zip(head, row) if kept(key)] for row in rows]
        content = json.dumps([[key for key in head if kept(key)], rows]).encode()
    if name.endswith(".parquet"):
        # its footer, whose length stands at its end, names the revision
        content = content[: -8 - int.from_bytes(content[-8:-4], "little")]
    return hashlib.sha256(content).hexdigest()[:16]


def main():
    runs = RUNS | (ON_RECORDINGS if REAL else {})
    chosen = sys.argv[1:] or list(runs)
    unknown = [name for name in chosen if name not in runs]
    if unknown or any(name.startswith("-") for name in chosen):
        sys.exit(__doc__ + "\nnames: " + ", ".join(runs))
    if "decode" in chosen and "press" not in chosen:
        chosen.insert(0, "press")
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen:
            out = Path(folder, name)
            command = runs[name]
            if command.startswith("firmware weights"):
                out.mkdir()
            arguments = command.format(out=name, real=REAL).split()
            ended = subprocess.run([PROGRAM, *arguments], cwd=folder, capture_output=True)
            if ended.returncode:
                print(f"{name} ended with {ended.returncode}: {ended.stderr.decode().strip()}", flush=True)
                continue
            if "--json" in command:
                print(f"{name} {digest('.json', ended.stdout)}")
            for path in sorted(out.rglob("*")) if out.is_dir() else []:
                if path.is_file() and path.suffix not in PICTURES and path.name not in OTHERS:
                    print(f"{path.relative_to(folder)} {digest(path.name, path.read_bytes())}")
            if name == "reproduce":
                headline = json.loads((out / "summary.json").read_text())["headline"]
                for key, value in sorted(results(headline).items()):
                    print(f"headline {key} {json.dumps(value)}")
            sys.stdout.flush()


if __name__ == "__main__":
    main()
