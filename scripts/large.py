"""Press, record, decode and score skins of growing size: CPU time, memory and IoU, as docs/skins.md shows it.

python scripts/large.py [SIDE ...]        (needs `spts`, the command; sides of the skins in taxels)
"""

import json
import os
import subprocess
import sys
import tempfile

EXTENT_M = 0.15
SIDES = [32, 64, 100]


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


def main():
    print("| taxels | M | press, s | decode, s | score, s | largest memory, MB | IoU |\n|---|---|---|---|---|---|---|")
    for side in [int(text) for text in sys.argv[1:]] or SIDES:
        taxels, few = side * side, -(-side * side // 20)
        settings = [f"skin.rows={side}", f"skin.cols={side}", f"skin.pitch_m={EXTENT_M / side!r}", "press.lift_s=2.0"]
        settings += ["press.duration_s=2.3", "readout=as_built"]
        settings = [text for setting in settings for text in ("--set", setting)]
        with tempfile.TemporaryDirectory() as folder:
            scene = ["simulate", "press/T", "--contact", "footprint", "--presses", "1", *settings, "--out", "s"]
            _, press, held = spts(*scene, folder=folder)
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
                f"| {taxels:,} | {few:,} | {press:.1f} | {decode:.1f} | {score:.1f} | {most:.0f} | {iou:.2f} |",
                flush=True,
            )


if __name__ == "__main__":
    main()
