"""What the calls of the package cost, on one core, beside MuJoCo's own tactile sensor and its bare step.

python scripts/python_speed.py [--json] [--leak]
"""

from __future__ import annotations

import argparse
import functools
import json
import os
import threading
import time

import gymnasium
import mujoco
import numpy as np
import spts
import spts.mujoco

UPRIGHT = (1.0, 0.0, 0.0, 0.0)
REPEATS = 7


def cost_us(call, seconds=0.15):
    """Median over runs of the mean time of a call, µs."""
    call()
    count, begin = 0, time.perf_counter()
    while time.perf_counter() - begin < seconds / 3:
        call()
        count += 1
    count = max(1, count)
    runs = []
    for _ in range(REPEATS):
        begin = time.perf_counter()
        for _ in range(count):
            call()
        runs.append((time.perf_counter() - begin) / count)
    return 1e6 * float(np.median(runs))


def ball_of(triangles):
    """Ball of 30 mm radius with about so many triangles."""
    segments = int((triangles / 2) ** 0.5)
    angle = np.linspace(0, np.pi, segments + 2)[1:-1]
    turn = np.linspace(0, 2 * np.pi, segments, endpoint=False)
    rings = np.stack(
        [
            np.outer(np.sin(angle), np.cos(turn)),
            np.outer(np.sin(angle), np.sin(turn)),
            np.outer(np.cos(angle), np.ones(segments)),
        ],
        axis=-1,
    )
    vertices = 0.03 * np.concatenate([[[0, 0, 1]], rings.reshape(-1, 3), [[0, 0, -1]]])
    last, faces = len(vertices) - 1, []

    def at(ring, k):
        return 1 + ring * segments + k % segments

    for k in range(segments):
        faces += [[0, at(0, k), at(0, k + 1)], [last, at(segments - 1, k + 1), at(segments - 1, k)]]
        for ring in range(segments - 1):
            a, b, c, d = at(ring, k), at(ring, k + 1), at(ring + 1, k), at(ring + 1, k + 1)
            faces += [[a, c, d], [a, d, b]]
    return spts.Body.from_vertices(vertices, np.array(faces, np.int64))


def touches():
    ball = ball_of(2000)
    flat = spts.Skin(10, 10, 0.015)
    pose, twist = ((0.0, 0.0, 0.028), UPRIGHT), (0.0,) * 6
    yield (
        f"touch, flat, 10 x 10 taxels of 6 x 6 points, {ball.triangles} triangles",
        cost_us(lambda: flat.touch({ball: pose}, {ball: twist}, 1e-3)),
    )

    n = 60
    x, y = np.meshgrid((np.arange(n) - n / 2 + 0.5) * 0.0025, (np.arange(n) - n / 2 + 0.5) * 0.0025)
    taxels = (np.arange(n)[:, None] // 6 * 10 + np.arange(n)[None, :] // 6).ravel()

    def bowl(radius):
        """3,600 points on a hollow ball of this radius, which the ball of 30 mm fills or nearly fills."""
        z = radius - np.sqrt(np.maximum(radius**2 - (x * 0.25) ** 2 - (y * 0.25) ** 2, 0))
        at = np.stack([x * 0.25, y * 0.25, z], axis=-1).reshape(-1, 3)
        normals = np.array([0, 0, radius]) - at
        return spts.Skin.from_points(at, normals, np.full(n * n, 4e-7), taxels=taxels, rows=10, cols=10)

    every = bowl(0.0302)
    full = every.touch({ball: ((0, 0, 0.0285), UPRIGHT)})
    yield (
        f"touch, curved, 3,600 points, {full.area / (n * n * 4e-7):.0%} touched",
        cost_us(lambda: every.touch({ball: ((0, 0, 0.0285), UPRIGHT)})),
    )
    wide = spts.Skin.cylinder(0.05, 30, 30, span=(-0.04, 0.04), arc=(-0.8, 0.8), points=2, thickness=0.04)
    place = ((0.05 + 0.03 - 0.0145, 0, 0), UPRIGHT)
    part = wide.touch({ball: place})
    yield (
        f"touch, curved, 3,600 points, {part.area / wide.areas.sum():.0%} touched",
        cost_us(lambda: wide.touch({ball: place})),
    )
    many = spts.Skin.cylinder(0.05, 32, 32, span=(-0.1, 0.1), points=2)
    yield "touch, curved, 1,024 taxels of 4 points", cost_us(lambda: many.touch({ball: ((0.078, 0, 0), UPRIGHT)}))

    touch = flat.touch({ball: pose}, {ball: twist}, 1e-3)
    wire = spts.Wire(flat)
    yield "wire.record of 20, with its rows", cost_us(lambda: wire.record(touch, 20))
    y, phi = wire.record(touch, 20)
    yield "decode of 20, mixture", cost_us(lambda: spts.decode(phi, y, flat))


SCENE = """
<mujoco><option timestep="0.0005"/>
  {asset}
  <worldbody>
    <body name="table"><geom name="top" type="box" size=".1 .1 .05" pos="0 0 -.05"/><site name="skin"/>{pad}</body>
    <body name="can" pos="0 0 .0199"><joint type="slide" axis="0 0 1"/><geom type="cylinder" size=".03 .02" mass="{mass}"/></body>
  </worldbody>{sensor}</mujoco>"""
# MuJoCo's own: depth at 10 x 10 points of a plate
SENSOR = {
    "asset": '<asset><mesh name="pad" builtin="plate" params="10 10" scale=".075 .075 .001"/></asset>',
    "pad": '<geom name="pad" type="mesh" mesh="pad" pos="0 0 .001" contype="0" conaffinity="0"/>',
    "sensor": '<sensor><tactile name="t" geom="pad" mesh="pad"/></sensor>',
}
BARE = dict.fromkeys(SENSOR, "")
GRAVITY = 9.81


def table(parts, mass=0.5):
    model = mujoco.MjModel.from_xml_string(SCENE.format(mass=mass, **parts))
    return model, mujoco.MjData(model)


def steps():
    """A can that stands on a table: bare, with MuJoCo's sensor of 10 x 10 points, and with a skin."""
    model, data = table(BARE)
    mujoco.mj_step(model, data, nstep=4000)
    yield "mj_step, MuJoCo's own contact", cost_us(lambda: mujoco.mj_step(model, data))
    model, data = table(SENSOR)
    mujoco.mj_step(model, data, nstep=4000)
    yield (
        f"mj_step with MuJoCo's tactile sensor, {model.nsensordata // 3} points",
        cost_us(lambda: mujoco.mj_step(model, data)),
    )
    model, data = table(BARE)
    with spts.mujoco.attach(model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["can"], mode="foam") as touch:
        touch.step(4000)
        yield (
            f"attached step, 10 x 10 taxels of 6 x 6 points, {next(iter(touch.bodies.values())).triangles} triangles",
            cost_us(touch.step),
        )


def humanoids():
    """A humanoid of gymnasium's that lies on the floor: its taxels, and a step in µs, bare and in either mode."""
    path = os.path.join(os.path.dirname(gymnasium.__file__), "envs/mujoco/assets/humanoid.xml")
    for pitch in (0.134, 0.0405, 0.01279):
        model = mujoco.MjModel.from_xml_path(path)
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
        costs, datas = [], []
        for mode in (None, "sense", "foam"):
            data = mujoco.MjData(model)
            robot = None if mode is None else spts.mujoco.dress(model, data, pitch=pitch, wires=None, mode=mode)
            step = robot.step if robot else functools.partial(mujoco.mj_step, model, data)
            for _ in range(1500):
                step()
            datas.append(step)
        # by turns, so that a noisy moment is one of all
        for _ in range(3):
            costs.append([cost_us(step) for step in datas])
        yield robot.taxels, np.median(costs, axis=0)


def sums():
    """What the taxels add up to under two weights, N; MuJoCo's sensor measures depth, m."""
    for mass in (0.25, 0.5, 1.0):
        model, data = table(SENSOR, mass)
        mujoco.mj_step(model, data, nstep=8000)
        theirs = float(np.abs(data.sensordata[: model.nsensordata // 3]).sum())
        model, data = table(BARE, mass)
        with spts.mujoco.attach(
            model, data, spts.Skin(10, 10, 0.015), site="skin", bodies=["can"], mode="foam"
        ) as touch:
            ours = float((touch.step(8000).pressure * 0.015**2).sum())
        yield mass * GRAVITY, ours, theirs


def threads():
    """How many times faster two threads do the same touches than one."""
    n = 120
    x, y = np.meshgrid(np.arange(n), np.arange(n))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(n * n)], axis=1) * 0.001
    arrays = (points, np.tile((0.0, 0.0, 1.0), (n * n, 1)), np.full(n * n, 1e-6))

    def work():
        skin, ball = spts.Skin.from_points(*arrays), spts.Body.sphere(0.1)
        for _ in range(60):
            skin.touch({ball: ((0.06, 0.06, 0.09), UPRIGHT)})

    def timed(count):
        every = [threading.Thread(target=work) for _ in range(count)]
        begin = time.perf_counter()
        for thread in every:
            thread.start()
        for thread in every:
            thread.join()
        return time.perf_counter() - begin

    return float(np.median([2 * timed(1) / timed(2) for _ in range(REPEATS)]))


def leak():
    """Growth of the memory over a million touches, MB."""
    skin, ball = spts.Skin(10, 10, 0.015), spts.Body.sphere(0.03)

    def work(count):
        for _ in range(count):
            skin.touch({ball: ((0.0, 0.0, 0.028), UPRIGHT)}, {ball: (0.0,) * 6}, 1e-3)

    def resident():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6

    work(10_000)
    before = resident()
    work(1_000_000)
    return resident() - before


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--json", action="store_true", help="print the numbers as JSON")
    options.add_argument("--leak", action="store_true", help="growth of the memory over a million touches")
    chosen = options.parse_args()
    side_by_side = threads()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    if chosen.leak:
        print(f"memory over a million touches: {leak():+.2f} MB")
        return
    found, balance, dressed = {**dict(touches()), **dict(steps())}, list(sums()), list(humanoids())
    if chosen.json:
        print(
            json.dumps(
                {
                    "cost_us": found,
                    "two_threads": side_by_side,
                    "humanoid_us": [
                        {"taxels": taxels, **dict(zip(("bare", "sense", "foam"), map(float, costs)))}
                        for taxels, costs in dressed
                    ],
                    "weight_n": [{"weight": w, "ours": a, "mujoco": b} for w, a, b in balance],
                },
                indent=2,
            )
        )
        return
    for what, cost in found.items():
        print(f"{what:<75} {cost:9.1f} µs")
    print(f"{'two threads, as many times faster than one':<75} {side_by_side:9.2f}")
    print("\ntaxels of a humanoid; a step, µs: bare, in mode sense, in mode foam")
    for taxels, costs in dressed:
        print(f"{taxels:8} {costs[0]:8.1f} {costs[1]:8.1f} {costs[2]:8.1f}")
    print("\nweight of the can, N; sum of pressure times area, N; sum of MuJoCo's tactile sensor, mm")
    for weight, ours, theirs in balance:
        print(f"{weight:8.4f} {ours:8.4f} {1e3 * theirs:9.4f}")


if __name__ == "__main__":
    main()
