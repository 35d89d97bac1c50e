"""What a step costs with 10,000 to a million taxels, beside MuJoCo's bare step, its tactile sensor, and MIMo's way.

python scripts/python_scale.py [--taxels 10000 100000] [--touched 1 5 20] [--steps 500] [--json]

Twenty plates wear taxels 5 mm apart; a ball of 50 mm radius and 1 kg slides to and fro on each of the touched ones.
What is touched is the same for any number of taxels. All that is compared is stepped by turns, fifty steps at a time,
in one process, on one core. "sense+wires" also takes 20 sums of each plate's wire at every step.

Peers: `mj_step`; the same with `<tactile>` sensors of as many taxels (depth of a point in the other geom, no force), for
the touched plates and the others alike; and in the style of MIMo (its touch.py): the force of every contact, shared among the
taxels within 25 mm of it by their distance, in NumPy and SciPy.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time

import mujoco
import numpy as np
import spts
import spts.mujoco
from scipy.spatial import cKDTree

PLATES, PITCH, RADIUS = 20, 0.005, 0.05
MEASUREMENTS, BLOCK = 20, 50


def scene(side, touched, sensor=False):
    """Plates of side x side taxels, with balls on the first ones."""
    half = 0.5 * side * PITCH
    step = 2.0 * half + 0.3
    plates, balls, motors, sensors = "", "", "", ""
    for k in range(PLATES):
        pad = (
            f'<geom name="pad{k}" type="mesh" mesh="pad" pos="0 0 .0001" contype="0" conaffinity="0"/>'
            if sensor
            else ""
        )
        plates += (
            f'<body name="plate{k}" pos="{k * step} 0 0"><geom name="plate{k}" type="box" size="{half} {half} .01" '
            f'pos="0 0 -.01" condim="1"/><site name="plate{k}"/>{pad}</body>'
        )
        if sensor:
            sensors += f'<tactile name="t{k}" geom="pad{k}" mesh="pad"/>'
    for k in range(touched):
        balls += (
            f'<body name="ball{k}" pos="{k * step} 0 {RADIUS - 1e-4}"><joint name="x{k}" type="slide" axis="1 0 0"/>'
            f'<joint type="slide" axis="0 0 1"/><geom type="sphere" size="{RADIUS}" mass="1" condim="1"/></body>'
        )
        motors += f'<velocity joint="x{k}" kv="1000"/>'
    mesh = f'<asset><mesh name="pad" builtin="plate" params="{side} {side}" scale="{half} {half} .001"/></asset>'
    text = (
        f'<mujoco><option timestep="0.001" integrator="implicitfast"/><size memory="64M"/>{mesh if sensor else ""}'
        f"<worldbody>{plates}{balls}</worldbody><actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>"
    )
    model = mujoco.MjModel.from_xml_string(text)
    return model, mujoco.MjData(model)


def plate_skin(side):
    """A taxel a square of a plate, at its middle."""
    line = (np.arange(side) - 0.5 * side + 0.5) * PITCH
    x, y = np.meshgrid(line, -line)
    places = np.stack([x.ravel(), y.ravel(), np.zeros(side * side)], axis=1)
    normals = np.tile((0.0, 0.0, 1.0), (side * side, 1))
    return spts.Skin.from_points(places, normals, np.full(side * side, PITCH**2), rows=side, cols=side, thickness=0.003)


def skins(model, data, side, mode, touched):
    """A skin on every plate, felt by all balls."""
    bodies = [f"ball{k}" for k in range(touched)]
    return [
        spts.mujoco.attach(
            model,
            data,
            plate_skin(side),
            site=f"plate{k}",
            bodies=bodies,
            link_geoms=[f"plate{k}"],
            mode=mode,
        )
        for k in range(PLATES)
    ]


def in_mimos_style(model, data, side):
    """A step that shares the forces of contacts among taxels, as MIMo's touch does."""
    line = (np.arange(side) - 0.5 * side + 0.5) * PITCH
    places = np.stack([*map(np.ravel, np.meshgrid(line, line)), np.zeros(side * side)], axis=1)
    trees = [cKDTree(places)] * PLATES
    plates = {model.body(f"plate{k}").id: k for k in range(PLATES)}
    forces = np.zeros((PLATES, side * side, 3))
    force = np.zeros(6)

    def step():
        mujoco.mj_step(model, data)
        forces[:] = 0.0
        for number in range(data.ncon):
            contact = data.contact[number]
            # the ball comes first in the pair: the contact's force is that on the plate
            body = model.geom_bodyid[contact.geom2]
            plate = plates[body]
            mujoco.mj_contactForce(model, data, number, force)
            at = contact.pos - data.xpos[body]
            near = trees[plate].query_ball_point(at, 5.0 * PITCH)
            share = np.maximum(1.0 - np.linalg.norm(places[near] - at, axis=1) / (5.0 * PITCH), 0.0)
            forces[plate, near] += (share / share.sum())[:, None] * (contact.frame.reshape(3, 3).T @ force[:3])

    return step


def entries(side, touched, kinds):
    """Name and step of all that is compared; each has a data of its own."""
    for kind in kinds:
        if kind == "tactile":
            model, data = scene(side, touched, sensor=True)
        else:
            model, data = scene(side, touched)
        worn = None
        if kind in ("bare", "tactile"):
            step = lambda model=model, data=data: mujoco.mj_step(model, data)  # noqa: E731
        elif kind == "mimo":
            step = in_mimos_style(model, data, side)
        else:
            mode = kind.split("+")[0]
            worn = skins(model, data, side, mode, touched)
            group = spts.mujoco._Group(worn)
            if kind.endswith("wires"):
                wires = [spts.Wire(a.skin, seed=k) for k, a in enumerate(worn)]

                def step(group=group, wires=wires, worn=worn):
                    group.step()
                    for wire, attachment in zip(wires, worn):
                        wire.record(attachment.last, MEASUREMENTS, weights=False)
            else:

                def step(group=group, worn=worn):
                    group.step()
                    for attachment in worn:
                        attachment.last  # noqa: B018

        yield kind, model, data, step, worn


def moved(model, data, count):
    """Lets the balls go to and fro, 20 mm, once a second."""
    data.ctrl[:] = 0.02 * 2.0 * np.pi * np.cos(2.0 * np.pi * count * model.opt.timestep)


def timed(side, touched, kinds, steps):
    """Percentiles of the time of a step, µs, of each kind; and the points that are touched, the median over steps."""
    made = list(entries(side, touched, kinds))
    times, areas = {kind: [] for kind in kinds}, [0.0]
    for first in range(-4 * BLOCK, steps, BLOCK):
        for kind, model, data, step, worn in made:
            for count in range(first, min(first + BLOCK, steps)):
                moved(model, data, count)
                begin = time.perf_counter_ns()
                step()
                if count >= 0:
                    times[kind].append(time.perf_counter_ns() - begin)
                    areas += [sum(a.last.area for a in worn)] if worn else []
    points = round(float(np.median(areas)) / PITCH**2)
    return {kind: [1e-3 * float(np.percentile(t, p)) for p in (50, 99)] for kind, t in times.items()}, points


def resident():
    """Memory of the process, bytes."""
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGESIZE")


def set_up(side):
    """Time, s, and memory a taxel, bytes, of the skins of all plates, and of their wires."""
    marks = [(time.perf_counter(), resident())]
    skins = [plate_skin(side) for _ in range(PLATES)]
    marks.append((time.perf_counter(), resident()))
    wires = [spts.Wire(skin, seed=k) for k, skin in enumerate(skins)]
    marks.append((time.perf_counter(), resident()))
    del wires
    taxels = PLATES * side * side
    return [[end[0] - begin[0], (end[1] - begin[1]) / taxels] for begin, end in zip(marks, marks[1:])]


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--taxels", type=int, nargs="+", default=[10_000, 100_000, 1_000_000])
    options.add_argument("--touched", type=int, nargs="+", default=[1, 5, 20])
    options.add_argument("--steps", type=int, default=500)
    options.add_argument("--kinds", nargs="+", default=["bare", "tactile", "mimo", "sense", "foam", "sense+wires"])
    options.add_argument("--json", action="store_true", help="print the numbers as JSON")
    chosen = options.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    found = []
    for taxels in chosen.taxels:
        side = round((taxels / PLATES) ** 0.5)
        # in a process of its own, whose memory nothing else has used before
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            made = pool.apply(set_up, (side,))
        if not chosen.json:
            text = ", ".join(f"{what} {s:.1f} s, {n:.0f} B a taxel" for what, (s, n) in zip(("skins", "wires"), made))
            print(f"{PLATES * side * side:8} taxels set up: {text}", flush=True)
        for touched in chosen.touched:
            begin = time.perf_counter()
            times, points = timed(side, touched, chosen.kinds, chosen.steps)
            found.append(
                {"taxels": PLATES * side**2, "set_up": made, "touched": touched, "points": points, "us": times}
            )
            if not chosen.json:
                text = "  ".join(f"{kind} {a:.0f} / {b:.0f}" for kind, (a, b) in times.items())
                print(
                    f"{PLATES * side * side:8} taxels, {touched:2} touched, {points:5} points: {text}   ({time.perf_counter() - begin:.0f} s)",
                    flush=True,
                )
    if chosen.json:
        print(json.dumps(found, indent=2))


if __name__ == "__main__":
    main()
