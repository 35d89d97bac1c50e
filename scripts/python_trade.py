"""What a step costs against what it errs by: shapes, points a taxel, and modes.

python scripts/python_trade.py [--steps 500] [--json]

A ball of 60 mm and 1 kg, loaded with another 40 N, rests on a plate with 32 x 32 taxels of 5 mm, at ten places. The
reference is the exact ball on 8 x 8 points a taxel, in mode "sense". Errors are of each place, relative to the
reference's norm: of the pressures of the taxels, and of the image that `spts.decode` makes of 80 sums of them by an
ideal wire; with the median over the places and the worst one. The force is that of all taxels against ball and load.
Times are those of steps in which the ball rolls, p50 and p99, by turns in one process, on one core. The mesh of the
ball has corners on the ball itself: its faces lie inside by up to 0.02 mm (fine) or 0.3 mm (coarse).
"""

import argparse
import json
import os
import time

import mujoco
import numpy as np
import spts
import spts.mujoco

SIDE, PITCH, RADIUS, LOAD, SUMS = 32, 0.005, 0.06, 40.0, 80
REFERENCE = ("ball", 8, "sense", None)
KINDS = [
    ("ball", 1, "sense", None),
    ("ball", 2, "sense", None),
    ("ball", 4, "sense", None),
    REFERENCE,
    ("ball", 1, "foam", None),
    ("ball", 4, "foam", None),
    ("fine mesh", 1, "sense", None),
    ("fine mesh", 1, "sense", 1e-4),
    ("fine mesh", 1, "sense", 1e-3),
    ("coarse mesh", 1, "sense", None),
    ("fine mesh", 1, "foam", None),
    ("fine mesh", 1, "foam", 1e-3),
]


def corners(rings):
    """Vertices of a ball, as text."""
    polar, around = np.linspace(0, np.pi, rings + 1), np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    t, p = np.meshgrid(polar[1:-1], around, indexing="ij")
    points = RADIUS * np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)], axis=-1).reshape(-1, 3)
    points = np.vstack([points, [[0, 0, RADIUS], [0, 0, -RADIUS]]])
    return " ".join(f"{v:.7f}" for v in points.ravel())


def skin(points):
    """The plate's skin with points x points a taxel."""
    count, step = SIDE * points, PITCH / points
    line = (np.arange(count) - 0.5 * count + 0.5) * step
    x, y = np.meshgrid(line, -line)
    places = np.stack([x.ravel(), y.ravel(), np.zeros(count * count)], axis=1)
    taxels = (np.arange(count) // points)[:, None] * SIDE + np.arange(count) // points
    return spts.Skin.from_points(
        places,
        np.tile((0.0, 0.0, 1.0), (count * count, 1)),
        np.full(count * count, step**2),
        taxels=taxels.ravel(),
        rows=SIDE,
        cols=SIDE,
    )


class Setup:
    """A ball of one kind on a skin."""

    def __init__(self, shape, points, mode, tolerance):
        geom = 'type="sphere" size=".06"' if shape == "ball" else f'type="mesh" mesh="{shape.split()[0]}"'
        half = 0.5 * SIDE * PITCH
        meshes = "".join(
            f'<mesh name="{name}" vertex="{corners(rings)}"/>' for name, rings in (("fine", 64), ("coarse", 16))
        )
        self.model = mujoco.MjModel.from_xml_string(
            f'<mujoco><option timestep=".001" integrator="implicitfast"/><asset>{meshes}</asset><worldbody>'
            f'<body name="plate"><geom name="plate" type="box" size="{half} {half} .01" pos="0 0 -.01"/>'
            f'<site name="plate"/></body><body name="ball" pos="0 0 {RADIUS}"><joint name="x" type="slide" axis="1 0 0"/>'
            f'<joint name="y" type="slide" axis="0 1 0"/><joint name="z" type="slide" axis="0 0 1"/>'
            f'<geom {geom} mass="1" friction="0"/></body></worldbody>'
            f'<actuator><velocity joint="x" kv="1000"/></actuator></mujoco>'
        )
        self.data = mujoco.MjData(self.model)
        self.skin = skin(points)
        self.attachment = spts.mujoco.attach(
            self.model,
            self.data,
            self.skin,
            site="plate",
            bodies=["ball"],
            link_geoms=["plate"],
            mode=mode,
            tolerance=tolerance,
        )
        self.data.xfrc_applied[self.model.body("ball").id, 2] = -LOAD
        self.body = next(iter(self.attachment.bodies.values()))

    def rest(self, place):
        """The touch of the ball that has come to rest at a place."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.xfrc_applied[self.model.body("ball").id, 2] = -LOAD
        self.attachment.reset()
        self.data.qpos[:2] = place
        self.attachment.step(400)
        return self.attachment.last

    def timed(self, count):
        """Time of a step of the rolling ball, µs."""
        self.data.ctrl[0] = 0.02 * 2.0 * np.pi * np.cos(2.0 * np.pi * count * 1e-3)
        begin = time.perf_counter_ns()
        self.attachment.step()
        self.attachment.last  # noqa: B018
        return 1e-3 * (time.perf_counter_ns() - begin)


def image(touch, ideal):
    """What 80 sums say of a touch."""
    wire = spts.Wire(ideal, readout="ideal", seeds="mixed", seed=1)
    y, phi = wire.record(spts.Touch.from_array(ideal, touch.pressure), SUMS)
    return spts.decode(phi, y, ideal)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--steps", type=int, default=500)
    options.add_argument("--json", action="store_true", help="print the numbers as JSON")
    chosen = options.parse_args()
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    setups = {kind: Setup(*kind) for kind in KINDS}
    places = 0.03 * (np.random.default_rng(1).random((10, 2)) - 0.5)
    rested = {kind: [setup.rest(place) for place in places] for kind, setup in setups.items()}
    pictures = {kind: [image(touch, skin(1)) for touch in touches] for kind, touches in rested.items()}
    times = {kind: [] for kind in KINDS}
    for setup in setups.values():
        setup.rest(places[0])
    for count in range(-50, chosen.steps):
        for kind, setup in setups.items():
            passed = setup.timed(count)
            if count >= 0:
                times[kind].append(passed)
    force = LOAD + 9.81
    found = []
    for kind in KINDS:
        pairs = zip(rested[kind], rested[REFERENCE])
        pressure = [np.linalg.norm(a.pressure - b.pressure) / np.linalg.norm(b.pressure) for a, b in pairs]
        pairs = zip(pictures[kind], pictures[REFERENCE])
        decoded = [np.linalg.norm(a - b) / np.linalg.norm(b) for a, b in pairs]
        sums = [abs(t.pressure.ravel() @ setups[kind].skin.areas / force - 1.0) for t in rested[kind]]
        found.append(
            {
                "shape": kind[0],
                "points": kind[1] ** 2,
                "mode": kind[2],
                "tolerance": kind[3],
                "triangles": setups[kind].body.triangles if kind[0] != "ball" else 0,
                "touched": round(rested[kind][0].area * (kind[1] / PITCH) ** 2),
                "us": [float(np.percentile(times[kind], p)) for p in (50, 99)],
                "pressure": [float(np.median(pressure)), max(pressure)],
                "force": float(max(sums)),
                "image": [float(np.median(decoded)), max(decoded)],
            }
        )
    if chosen.json:
        print(json.dumps(found, indent=2))
        return
    print(
        "| shape | points a taxel | mode | `tolerance` | points touched | step, µs, p50 / p99 | pressure | force | image |"
    )
    print("|---|---|---|---|---|---|---|---|---|")
    for row in found:
        faces = f", {row['triangles']} triangles" if row["triangles"] else ""
        tolerance = f"{1e3 * row['tolerance']:g} mm" if row["tolerance"] else "-"
        errors = " | ".join(
            [
                "{:.3f} ({:.3f})".format(*row["pressure"]),
                f"{row['force']:.0e}",
                "{:.2f} ({:.2f})".format(*row["image"]),
            ]
        )
        print(
            f"| {row['shape']}{faces} | {row['points']} | {row['mode']} | {tolerance} | {row['touched']} "
            f"| {row['us'][0]:.0f} / {row['us'][1]:.0f} | {errors} |"
        )


if __name__ == "__main__":
    main()
