"""A humanoid in 230,400 taxels, about as many as human skin has receptors: it falls and lies on the floor, n wires
record the touch, the wires that feel something are decoded, and what they show is drawn.

python scripts/humanoid_large.py [--taxels 230400] [--wires 20] [--measurements 1024] [--json] [--picture PNG]

It is gymnasium's humanoid, and MuJoCo's contact moves it (mode "sense"). Times are of one core. Rows of the sensing
matrix are made for one wire at a time, of those whose sums have a larger variance than when idle (F-test; one false
alarm in 1,000 runs). `spts.decode` looks for contacts among neighbours on a sheet of rows and columns. The taxels of a
link are therefore laid out as a sheet: slices along a principal axis, and the angle about it. One sum in eight is kept
back: it tells which of the three axes is best, and when there are sums enough, up to --measurements a wire.
"""

import argparse
import copy
import functools
import json
import os
import sys
import time

import gymnasium
import mujoco
import numpy as np
import spts.metrics
import spts.mujoco
from matplotlib import colormaps
from matplotlib.figure import Figure
from scipy.stats import f as f_distribution

# Steps until it lies, steps that are timed, sums for the test of a wire and for the first attempt at an image; share
# of the standard deviation of what is kept back that may be left unexplained, and chance of a false alarm in a run.
FALL, TIMED, FIRST, LEFT, FALSE_ALARMS = 1000, 400, 256, 0.2, 1e-3


def dressed(taxels, wires, seed, pitch=0.02):
    """The robot, whose number of taxels is within a hundredth of `taxels`, its pitch, m, and the time of `dress`, s."""
    path = os.path.join(os.path.dirname(gymnasium.__file__), "envs/mujoco/assets/humanoid.xml")
    for _ in range(8):
        model = mujoco.MjModel.from_xml_path(path)
        begin = time.perf_counter()
        robot = spts.mujoco.dress(model, mujoco.MjData(model), pitch=pitch, wires=wires, seed=seed)
        spent = time.perf_counter() - begin
        print(f"pitch {1e3 * pitch:.3f} mm: {robot.taxels} taxels, {spent:.1f} s", file=sys.stderr)
        if abs(robot.taxels - taxels) <= 0.01 * taxels:
            break
        pitch *= (robot.taxels / taxels) ** 0.5
    return robot, pitch, spent


class Line:
    """A wire of a robot, with its links, and its taxels among those of all links."""

    def __init__(self, robot, wire, first):
        self.robot, self.wire = robot, wire
        self.taxels = np.arange(first, first + wire.shape[0] * wire.shape[1])
        self.link_of = np.repeat(np.arange(len(robot.skins)), [len(s.areas) for s in robot.skins])[self.taxels]
        self.links = np.unique(self.link_of)

    def record(self, measurements, weights=False):
        """As Dress.record of this wire, without its rows of Φ unless they are asked for."""
        return self.wire.record([self.robot.attachments[k].last for k in self.links], measurements, weights=weights)

    def sheet(self, places, axis):
        """The taxels as rows and columns, -1 where there is none."""
        cols, rows = round(len(self.taxels) ** 0.5), []
        for link in self.links:
            of = np.flatnonzero(self.link_of == link)
            at = places[self.taxels[of]] - places[self.taxels[of]].mean(axis=0)
            x, y, along = (at @ np.roll(np.linalg.eigh(at.T @ at)[1], axis, axis=1)).T
            order = np.argsort(along, kind="stable")
            for part in np.split(order, range(cols, len(of), cols)):
                part = part[np.argsort(np.arctan2(y, x)[part], kind="stable")]
                rows.append(np.full(cols, -1))
                rows[-1][np.linspace(0, cols - 1, len(part)).round().astype(int)] = of[part]
        return np.array(rows)

    def image(self, phi, y, sheet):
        """What the sums show, a value a taxel, by the decoder that "auto" names for the sheet."""
        there, image = sheet >= 0, np.zeros(len(self.taxels))
        padded = np.zeros((len(y), sheet.size))
        padded[:, there.ravel()] = phi[:, sheet[there]]
        image[sheet[there]] = spts.decode(padded, y, sheet.shape)[there]
        return image

    def decode(self, places, most):
        """The image from at most so many sums, and what it took."""
        begin, y, phi = time.perf_counter(), np.empty(0), np.empty((0, len(self.taxels)))
        sheets = [self.sheet(places, axis) for axis in range(3)]
        for wanted in sorted({min(FIRST << k, most) for k in range(20)}):
            more_y, more_phi = self.record(wanted - len(y), weights=True)
            y, phi = np.append(y, more_y), np.append(phi, more_phi, axis=0)
            # the lowest and the highest values may be ends of the converter's range
            good = (y > y.min()) & (y < y.max())
            seen, rows, kept, left = y[good], phi[good], good.sum() // 8, []
            for sheet in sheets:
                rest = seen[-kept:] - rows[-kept:] @ self.image(rows[:-kept], seen[:-kept], sheet)
                left.append(float(rest.std() / seen[-kept:].std()))
                if left[-1] <= LEFT:
                    break
            if min(left) <= LEFT:
                break
        image = self.image(rows, seen, sheets[int(np.argmin(left))])
        spent, clipped = time.perf_counter() - begin, int((~good).sum())
        return image, {"sums": wanted, "clipped": clipped, "left": min(left), "s": spent}


def timed(robot, lines, most):
    """Percentiles 50 and 99 of the time of a step, ms; with the sums that fit into a time step, and with `most`."""
    data = copy.copy(robot.data)
    step = functools.partial(mujoco.mj_step, robot.model, data)
    counts = [int(robot.model.opt.timestep * lines[0].wire.sample_rate), most]
    names = ["bare", "touch", *(f"touch, {count} sums a wire" for count in counts)]
    times = {name: [] for name in names}
    for k in range(TIMED):
        marks = [time.perf_counter()]
        for act in (step, robot.step, *(functools.partial(line.record, counts[k % 2]) for line in lines)):
            act()
            marks.append(time.perf_counter())
        bare, touch, *sums = 1e3 * np.diff(marks)
        for name, spent in (("bare", bare), ("touch", touch), (names[2 + k % 2], touch + sum(sums))):
            times[name].append(spent)
    assert (data.qpos == robot.data.qpos).all(), "the skin has moved the robot"
    return {name: [float(np.percentile(spent, p)) for p in (50, 99)] for name, spent in times.items()}


def draw(path, robot, wire_of, truth, image):
    """Draws the robot from below, a pixel a taxel, and one contact enlarged."""
    links = [(skin, robot.data.body(name)) for skin, name in zip(robot.skins, robot.names)]
    at = np.concatenate([skin.positions @ link.xmat.reshape(3, 3).T + link.xpos for skin, link in links])
    down = np.concatenate([-skin.normals @ link.xmat[6:] for skin, link in links])
    axes = np.linalg.eigh(np.cov(at[:, :2].T))[1]
    flat, pixel = at[:, :2] @ (axes * (np.linalg.det(axes), 1.0)), 1.5 * np.sqrt(np.median(robot.skins[0].areas))
    x, y = ((flat - flat.min(axis=0)) / pixel).astype(int).T + 20
    order = np.array([k for k in np.argsort(-at[:, 2], kind="stable") if down[k] > 0.0])
    light = (0.45 + 0.5 * down)[:, None]
    panels = {f"{wire_of[-1] + 1} wires": colormaps["tab20"](wire_of % 20)[:, :3] * (0.3 + light) / 1.25}
    for title, values in (("what the taxels conduct", truth), ("decoded from the sums of the wires", image)):
        share = values / np.percentile(values[values > 0.0], 95) if values.any() else values
        panels[title] = np.where(share[:, None] > 0.05, colormaps["autumn_r"](share)[:, :3], light * (0.92, 0.92, 0.95))
    best = order[truth[order].argmax()]
    figure = Figure(figsize=(9.6, 6.6), layout="constrained")
    for (whole, part), (title, colours) in zip(figure.subplots(2, 3, height_ratios=(2.2, 1.0)).T, panels.items()):
        canvas = np.ones((y.max() + 21, x.max() + 21, 3))
        canvas[y[order], x[order]] = colours[order]
        whole.imshow(canvas, interpolation="none")
        whole.set_title(title, fontsize=10)
        part.imshow(canvas[y[best] - 20 : y[best] + 21, x[best] - 20 : x[best] + 21], interpolation="none")
        whole.axis("off"), part.axis("off")
    figure.savefig(path, dpi=110, bbox_inches="tight")


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    numbers = {"taxels": (230_400, "about how many"), "wires": (20, "how many"), "seed": (0, "of skins and noise")}
    for name, (value, text) in {**numbers, "measurements": (1024, "most sums of a wire")}.items():
        options.add_argument(f"--{name}", type=int, default=value, help=f"{text} [default: {value}]")
    options.add_argument("--json", action="store_true", help="print the numbers as JSON")
    options.add_argument("--picture", help="draw it into this PNG")
    asked = options.parse_args()
    if asked.measurements < 32:
        options.error(f"--measurements {asked.measurements}: at least 32 are needed")
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    robot, pitch, setup = dressed(asked.taxels, asked.wires, asked.seed)
    counts = [wire.shape[0] * wire.shape[1] for wire in robot.wires]
    lines = [Line(robot, wire, first) for wire, first in zip(robot.wires, np.cumsum([0, *counts]))]
    idle = [line.record(FIRST)[0].var() for line in lines]
    robot.step(FALL)
    print(f"it lies after {FALL} steps; {TIMED} more are timed", file=sys.stderr)
    result = {"taxels": robot.taxels, "pitch_mm": 1e3 * pitch, "wires": len(lines), "setup_s": setup}
    result["step_ms"] = timed(robot, lines, asked.measurements)
    limit = f_distribution.isf(FALSE_ALARMS / len(lines), FIRST - 1, FIRST - 1)
    loud = [k for k, line in enumerate(lines) if line.record(FIRST)[0].var() > limit * idle[k]]
    places = np.concatenate([skin.positions for skin in robot.skins])
    truth = np.concatenate([line.wire.conductance.ravel() for line in lines])
    image, begin, rows = np.zeros(len(truth)), time.perf_counter(), []
    for k in loud:
        here = lines[k].taxels
        image[here], took = lines[k].decode(places, asked.measurements)
        iou = float(spts.metrics.iou(image[here][None], truth[here][None])[0])
        touched, links = int((truth[here] > 0.23 * truth[here].max()).sum()), [robot.names[i] for i in lines[k].links]
        rows.append({"wire": k, "links": links, "touched": touched, **took, "iou": iou})
    result |= {"decode_s": time.perf_counter() - begin, "conducting_taxels": int((truth > 0.0).sum())}
    result |= {"conducting_wires": sum(int(truth[line.taxels].any()) for line in lines), "decoded": rows}
    if asked.picture:
        draw(asked.picture, robot, np.repeat(np.arange(len(lines)), counts), truth, image)
    if asked.json:
        return print(json.dumps(result, indent=2))
    print(f"{robot.taxels} taxels, {1e3 * pitch:.3f} mm apart, on {len(lines)} wires: {setup:.1f} s, one core")
    for name, (half, most) in result["step_ms"].items():
        print(f"a step, {name}: {half:.2f} ms (p99 {most:.2f})")
    print(f"{result['conducting_taxels']} taxels conduct, on {result['conducting_wires']} wires")
    text = "wire {wire}: {touched} touched, {sums} sums, {clipped} clipped, left {left:.2f}, IoU {iou:.2f}, {s:.1f} s"
    for row in rows:
        print(text.format(**row), *row["links"])
    sums, iou = sum(row["sums"] for row in rows), np.mean([row["iou"] for row in rows] or 0)
    print(f"{len(rows)} wires decoded from {sums} sums in {result['decode_s']:.1f} s, IoU {iou:.2f}")


if __name__ == "__main__":
    main()
