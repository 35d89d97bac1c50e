"""Press, record, decode and score skins of growing size: CPU time, memory and IoU at M = N/20, and the M that an IoU of
0.8 takes, as docs/skins.md shows it.

python scripts/large.py [--wires N] [SIDE ...]     (needs `spts`, the command; sides of the skins in taxels)

Balls are pressed with 10 N each: one up to 1,024 taxels, five at once on larger skins. Nothing is learned.
"""

import argparse
import json
import math
import os
import subprocess
import tempfile

SIDES = [10, 32, 64, 100, 256, 480]
WANTED_IOU = 0.8
GOLDEN_RAD = math.pi * (3 - math.sqrt(5))


def scene(side, wires):
    """The scene of a skin: pitch 15 mm as published for the smallest, else 5 mm."""
    balls = 1 if side <= 32 else 5
    text = f"""
readout = "as_built"
[[wires]]
bands = {wires}
[skin]
rows = {side}
cols = {side}
pitch_m = {0.015 if side <= 10 else 0.005}
[contact]
model = "footprint"
[press]
presses = 1
force_n = {10 * balls}
"""
    for ball in range(balls):
        share = 0.35 * math.sqrt(2 * (ball + 0.5) / balls) if balls > 1 else 0.0
        place = [share * math.cos(GOLDEN_RAD * ball), share * math.sin(GOLDEN_RAD * ball)]
        place = [round(min(0.35, max(-0.35, at)), 3) for at in place]
        text += f'[[press.objects]]\nobject = "tennis"\nposition_share = {place}\n'
    return text


def spts(*arguments, folder):
    """What the command prints, its CPU time, s, and its largest memory, MB."""
    with tempfile.TemporaryFile() as output:
        started = subprocess.Popen(["spts", *arguments], cwd=folder, stdout=output, stderr=subprocess.PIPE)
        _, errors = started.stderr, started.stderr.read()
        _, status, used = os.wait4(started.pid, 0)
        started.returncode = os.waitstatus_to_exitcode(status)
        if started.returncode != 0:
            raise SystemExit(errors.decode())
        output.seek(0)
        return output.read().decode(), used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def enough(side, folder):
    """The least power of two of measurements with the wanted IoU, up to a half of the taxels; a dash for none."""
    tried = [2**k for k in range(4, 15) if 2 * 2**k <= side * side]
    if not tried:
        return "–"
    measurements = ",".join(map(str, tried))
    text, _, _ = spts(
        "decode", "s", "--measurements", measurements, "--decoder", "auto", "--json", "--out", "m", folder=folder
    )
    best = {}
    for row in json.loads(text)["rows"]:
        best.setdefault(row["m"], []).append(row["iou"])
    good = [m for m, ious in sorted(best.items()) if sum(ious) / len(ious) >= WANTED_IOU]
    return f"{good[0]:,}" if good else "–"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--wires", type=int, default=1, help="wires of every skin [default: 1]")
    parser.add_argument("sides", type=int, nargs="*", default=SIDES, help="taxels along a side")
    asked = parser.parse_args()
    print("| taxels | M | press, s | decode, s | score, s | largest memory, MB | IoU | M for an IoU of 0.8 |")
    print("|---|---|---|---|---|---|---|---|")
    points = []
    for side in asked.sides:
        taxels, few = side * side, -(-side * side // 20)
        with tempfile.TemporaryDirectory() as folder:
            with open(os.path.join(folder, "scene.toml"), "w") as file:
                file.write(scene(side, asked.wires))
            _, press, held = spts("simulate", "scene.toml", "--out", "s", folder=folder)
            options = ["--measurements", str(few)]
            text, decode, decoding = spts(
                "decode", "s", *options, "--decoder", "auto", "--json", "--out", "d", folder=folder
            )
            row = json.loads(text)["rows"][0]
            scoring = ["score", "s", *options, "--decoder", row["decoder"], "--no-times", "--no-ball", "--out", "c"]
            _, score, scoring = spts(*scoring, folder=folder)
            iou = row["iou"]
            most = max(held, decoding, scoring)
            print(
                f"| {taxels:,} | {few:,} | {press:.1f} | {decode:.1f} | {score:.1f} | {most:.0f} | {iou:.2f} "
                f"| {enough(side, folder)} |",
                flush=True,
            )
            points.append((math.log(taxels), math.log(press + decode + score)))
    large = [point for point in points if point[0] > math.log(1000)]
    if len(large) > 2:
        mean = [sum(point[k] for point in large) / len(large) for k in range(2)]
        slope = sum((x - mean[0]) * (y - mean[1]) for x, y in large) / sum((x - mean[0]) ** 2 for x, _ in large)
        print(f"time grows as taxels^{slope:.2f} from 1,024 taxels on")


if __name__ == "__main__":
    main()
