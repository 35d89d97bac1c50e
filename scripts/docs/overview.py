"""Draws docs/overview.png, from press over wire to image, out of what the program simulates.

`python scripts/docs/overview.py` needs the built `spts`, the Python package of this project and Matplotlib.
"""

import argparse
import pathlib
import subprocess
import tempfile

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import spts
from matplotlib.patches import FancyArrowPatch

ROOT = pathlib.Path(__file__).resolve().parents[2]
M = 20
INK, ACCENT = "#263238", "#00796b"


def simulate(program, folder):
    """A session of a pressed T, read with designed rows, and the picture of its scene."""
    rows, out = folder / "rows", folder / "T"
    design = ["sensing", "design", "--designer", "separable", "--rows", str(M), "--out", rows]
    press = ["simulate", "press/T", "--contact", "footprint", "--set", f"rows.patterns_file={rows}/rows.txt"]
    for arguments in (design, [*press, "--render", "--out", out]):
        subprocess.run([program, *arguments], check=True, stdout=subprocess.DEVNULL)
    return spts.load(out), plt.imread(out / "scene_close.png")


def draw(session, scene, path):
    """The three panels and the arrows between them."""
    phi, y = session.compressive.windows(0, M)
    decoded = spts.decode(phi[0], y[0], shape=session.shape, decoder="amortised")
    _, scan = session.raster.windows(0, session.shape[0] * session.shape[1])
    truth = scan[0].reshape(session.shape)

    figure = plt.figure(figsize=(12, 3.8), dpi=110, facecolor="white")
    left = figure.add_axes([0.012, 0.04, 0.32, 0.8])
    left.imshow(crop(scene, 12 * 0.32 / (3.8 * 0.8)))
    wire = figure.add_axes([0.405, 0.2, 0.235, 0.56])
    time_us = [1e6 * k / session.compressive.sample_rate for k in range(M)]
    wire.axhline(0, color="#b0bec5", lw=0.8)
    wire.step(time_us, y[0], where="mid", color=ACCENT, lw=1.8)
    wire.plot(time_us, y[0], "o", color=ACCENT, ms=4)
    wire.set_xlabel("µs", color=INK)
    wire.set_ylabel("V on the wire", color=INK)
    for side in ("top", "right"):
        wire.spines[side].set_visible(False)
    wire.tick_params(colors=INK, labelsize=8)
    panels = [(0.692, decoded, f"decoded from {M} sums\n(amortised)"), (0.85, truth, "scan of\n100 samples")]
    for x, image, label in panels:
        axes = figure.add_axes([x, 0.235, 0.143, 0.46])
        axes.imshow(image, cmap="magma", vmin=0)
        axes.set_xticks([])
        axes.set_yticks([])
        axes.set_xlabel(label, color=INK, fontsize=9.5)
    left.axis("off")
    titles = [(0.172, "1  press"), (0.522, "2  one wire"), (0.848, "3  image")]
    for x, text in titles:
        figure.text(x, 0.905, text, ha="center", color=INK, fontsize=15, weight="bold")
    for start, end in ((0.338, 0.366), (0.652, 0.682)):
        arrow = FancyArrowPatch((start, 0.46), (end, 0.46), transform=figure.transFigure, mutation_scale=22)
        arrow.set(color=ACCENT, arrowstyle="-|>", linewidth=2.5)
        figure.add_artist(arrow)
    figure.savefig(path, metadata={"Software": None})


def crop(picture, aspect):
    """The middle of a picture, `aspect` times as wide as high."""
    height, width = picture.shape[:2]
    wanted_w, wanted_h = min(width, int(height * aspect)), min(height, int(width / aspect))
    x, y = (width - wanted_w) // 2, (height - wanted_h) // 2
    return picture[y : y + wanted_h, x : x + wanted_w]


def main():
    parser = argparse.ArgumentParser(description="Draws docs/overview.png.")
    parser.add_argument("--spts", type=pathlib.Path, default=ROOT / "target/release/spts", help="the program")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "docs/overview.png")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        session, scene = simulate(options.spts, pathlib.Path(folder))
        draw(session, scene, options.out)


if __name__ == "__main__":
    main()
