"""Which decoder of those that need no recordings is best on which skin, and so what `spts.auto` names.

python scripts/python_decoders.py [--presses N] [--skins NAME,...] [--json]

Objects are pressed on taxels chosen at random ("middle": those within 20 mm of the middle), turned anyhow, 0.8 to 2 mm
deep, on simulated skins, each press on another specimen. Every decoder sees the same windows. It prints the mean
intersection over union with the true pressure for M of 7, 20 and 50 % of the taxels, skin by skin and object by object,
and the time of a decode. Needs `mujoco` and `gymnasium`, whose humanoid has the links.
"""

from __future__ import annotations

import argparse
import json
import os
import pathlib
import time

import gymnasium
import mujoco
import numpy as np
import spts
import spts.mujoco

DECODERS = ["nn_lasso", "nn_lmmse", "tv", "patches", "mixture", "amortised"]
SHARES = [0.07, 0.2, 0.5]
READOUTS = ["ideal", "as_built"]
OBJECTS = {
    "bead, 10 mm": spts.Body.sphere(0.005),
    "ball, 60 mm": spts.Body.sphere(0.03),
    "tip of a rod, 12 mm": spts.Body.capsule(0.006, 0.06),
    "bar, 100 x 8 mm": spts.Body.box((0.1, 0.008, 0.02)),
    "box, 60 x 40 mm": spts.Body.box((0.06, 0.04, 0.02)),
    "cup, 60 mm": spts.Body.cylinder(0.03, 0.08),
}


def dome(taxels, radius):
    """A half ball with taxels along a spiral: one row, in which neighbours on the skin have any numbers."""
    k = np.arange(taxels)
    z, turn = 1.0 - (k + 0.5) / taxels, k * np.pi * (3.0 - 5.0**0.5)
    normals = np.stack([np.cos(turn), np.sin(turn), z / np.sqrt(1.0 - z**2)], axis=1) * np.sqrt(1.0 - z**2)[:, None]
    return spts.Skin.from_points(radius * normals, normals, np.full(taxels, 2 * np.pi * radius**2 / taxels))


def link(name):
    """A link of gymnasium's humanoid with a taxel every 2 cm."""
    file = pathlib.Path(gymnasium.__file__).parent / "envs/mujoco/assets/humanoid.xml"
    model = mujoco.MjModel.from_xml_path(str(file))
    robot = spts.mujoco.dress(model, mujoco.MjData(model), pitch=0.02)
    return robot.skins[robot.names.index(name)]


SKINS = {
    "flat, 10 x 10": lambda: spts.Skin(10, 10, 0.015),
    "flat, 10 x 10, middle": lambda: spts.Skin(10, 10, 0.015),
    "flat, 8 x 8": lambda: spts.Skin(8, 8, 0.01),
    "flat, 20 x 20": lambda: spts.Skin(20, 20, 0.0075),
    "strip, 1 x 64": lambda: spts.Skin(1, 64, 0.01),
    "strip, 3 x 60": lambda: spts.Skin(3, 60, 0.01),
    "half a tube, 12 x 16": lambda: spts.Skin.cylinder(0.04, 12, 16, span=(-0.06, 0.06), arc=(-1.5, 1.5)),
    "fingertip, 40 points": lambda: dome(40, 0.012),
    "dome, 150 points": lambda: dome(150, 0.03),
    "dome, 600 points": lambda: dome(600, 0.03),
    "foot, 172 points": lambda: link("left_foot"),
    "upper arm, 244 points": lambda: link("left_upper_arm"),
    "torso, 800 points": lambda: link("torso"),
}


def press(skin, taxels, body, rng):
    """Presses the lowest point of `body` on one of `taxels`, along its normal."""
    taxel = rng.choice(taxels)
    normal = skin.normals[taxel]
    half = 0.5 * np.arccos(np.clip(normal[2], -1.0, 1.0))
    axis = np.array([-normal[1], normal[0], 0.0])
    axis = axis / np.linalg.norm(axis) if np.linalg.norm(axis) > 1e-9 else np.array([1.0, 0.0, 0.0])
    tilt, turn = (np.cos(half), *np.sin(half) * axis), rng.uniform(0.0, 2 * np.pi) / 2
    w, x, y, z = tilt
    cos, sin = np.cos(turn), np.sin(turn)
    # first about its own axis, then to the normal
    quat = (w * cos - z * sin, x * cos + y * sin, y * cos - x * sin, z * cos + w * sin)
    place = skin.positions[taxel] - normal * (body.mesh[0][:, 2].min() + rng.uniform(8e-4, 2e-3))
    return skin.touch({body: (place, quat)}, dt=0.1)


def measure(skins, presses):
    """IoU (share, readout, object, press) and seconds a decode (share,), by skin and decoder."""
    found = {}
    for name in skins:
        skin = SKINS[name]()
        taxels = len(skin.positions)
        # where the shapes are that `amortised` was trained on
        pressed = np.flatnonzero(
            np.linalg.norm(skin.positions[:, :2], axis=1) < 0.02 if "middle" in name else taxels * [1]
        )
        for decoder in DECODERS:
            # learns
            spts.decode(np.ones((1, taxels)), np.ones(1), skin, decoder)
            iou = np.zeros((len(SHARES), len(READOUTS), len(OBJECTS), presses))
            seconds = np.zeros((len(SHARES), iou[0].size))
            for s, r, o, p in np.ndindex(iou.shape):
                rng = np.random.default_rng([p, o])
                skin.reset()
                wire = spts.Wire(skin, readout=READOUTS[r], seed=100 * o + p)
                touch = press(skin, pressed, list(OBJECTS.values())[o], rng)
                y, phi = wire.record(touch, max(1, round(SHARES[s] * taxels)))
                begin = time.perf_counter()
                image = spts.decode(phi, y, skin, decoder)
                seconds[s].flat[np.ravel_multi_index((r, o, p), iou.shape[1:])] = time.perf_counter() - begin
                iou[s, r, o, p] = spts.iou(image[None], touch.pressure[None])[0]
            found[name, decoder] = iou, np.median(seconds, axis=1)
    return found


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("|" + "---|" * len(head))
    for row in rows:
        print("| " + " | ".join(row) + " |")
    print()


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--presses", type=int, default=10, help="presses of every object (default: 10)")
    options.add_argument(
        "--skins", default=",".join(SKINS).replace(", ", " "), help="skins, by their names without commas"
    )
    options.add_argument("--json", action="store_true", help="print the numbers as JSON")
    chosen = options.parse_args()
    skins = [name for name in SKINS if name.replace(", ", " ") in chosen.skins.split(",")]
    if not skins or chosen.presses < 1:
        options.error("--skins names none, or --presses is below 1")
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    found = measure(skins, chosen.presses)

    if chosen.json:
        rows = [
            {"skin": skin, "decoder": decoder, "iou": iou.mean(axis=-1).tolist(), "seconds": seconds.tolist()}
            for (skin, decoder), (iou, seconds) in found.items()
        ]
        print(json.dumps({"shares": SHARES, "readouts": READOUTS, "objects": list(OBJECTS), "rows": rows}, indent=2))
        return

    def cells(of, skin):
        return [of(*found[skin, decoder]) for decoder in DECODERS]

    def means(iou, _):
        return ", ".join(f"{iou[s].mean():.2f}" for s in range(len(SHARES)))

    print("IoU at M of 7, 20, 50 % of the taxels; mean over readouts and objects\n")
    table(["skin", *DECODERS], [[skin, *cells(means, skin)] for skin in skins])
    print("time of a decode at 20 %, ms\n")
    table(["skin", *DECODERS], [[skin, *cells(lambda _, s: f"{1e3 * s[1]:.2f}", skin)] for skin in skins])
    print("IoU at 20 %, by readout and by object; mean over the skins\n")
    every = {decoder: np.stack([found[skin, decoder][0][1] for skin in skins]) for decoder in DECODERS}
    rows = [[name, *(f"{every[d][:, r].mean():.2f}" for d in DECODERS)] for r, name in enumerate(READOUTS)]
    rows += [[name, *(f"{every[d][:, :, o].mean():.2f}" for d in DECODERS)] for o, name in enumerate(OBJECTS)]
    table(["", *DECODERS], rows)
    best = {d: np.mean([found[skin, d][0].mean() for skin in skins]) for d in DECODERS}
    print(f"best on average: {max(best, key=best.get)}")


if __name__ == "__main__":
    main()
