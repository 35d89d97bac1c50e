"""Touches anywhere on simulated skins, every object at five places: IoU of decoders that need no scans, as docs/decoders.md shows it.

python scripts/anywhere.py        (needs `spts`, the command; about two minutes)
"""

import json
import random
import subprocess
import tempfile

PLACES = 5
SIDE = 10
MEASUREMENTS = [7, 20, 50]
DECODERS = ["nn_lmmse", "amortised", "tv", "mixture"]


def spts(*arguments, folder):
    done = subprocess.run(["spts", *arguments], cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return done.stdout


def scores(seeding):
    """Mean IoU of every object by decoder and number of measurements, over places and three windows each."""
    draw = random.Random(1)
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        listed = json.loads(spts("simulate", "--list", "--json", folder=folder))
        # a finger comes down on a skin under preload, whose image has no truth of its own
        objects = [one["name"] for one in listed["objects"] if one["name"] != "finger"]
        for seed, name in enumerate(objects, 1):
            places = [[round(draw.uniform(1.5, SIDE - 2.5), 2) for _ in range(2)] for _ in range(PLACES)]
            settings = [f"press.places={places}", f"rows.seeding={seeding}", f"seed={seed}"]
            settings = [text for setting in settings for text in ("--set", setting)]
            spts(
                "simulate", f"press/{name}", "--presses", str(PLACES), *settings, "--out", f"all/{name}", folder=folder
            )
        options = [
            "--decoder",
            ",".join(DECODERS),
            "--measurements",
            ",".join(map(str, MEASUREMENTS)),
            "--windows",
            "3",
        ]
        for row in json.loads(spts("decode", "all", *options, "--out", "d", "--json", folder=folder))["rows"]:
            objects = found.setdefault((row["decoder"], row["m"]), {})
            objects.setdefault(row["session"], []).append(row["iou"])
    return {key: [sum(own) / len(own) for own in objects.values()] for key, objects in found.items()}


def main():
    mixed, published = scores("mixed"), scores("address")
    print("| decoder | mixed seeds | published seeds |\n|---|---|---|")
    for decoder in DECODERS:
        of = [[found[decoder, m] for m in MEASUREMENTS] for found in (mixed, published)]
        cells = [", ".join(f"{sum(own) / len(own):.2f} ({min(own):.2f})" for own in all_m) for all_m in of]
        print(f"| `{decoder}` | {cells[0]} | {cells[1]} |")


if __name__ == "__main__":
    main()
