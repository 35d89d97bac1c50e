"""Tactile images a second, one thread, side by side in one run: MuJoCo's `tactile` sensor, rows of a data set.

MuJoCo: a body at rest is let go where it touches a plate with 10 × 10 taxels, at a random place, and is stepped until its
depth has settled to 1 % (how many steps that takes is found before anything is timed). One degree of freedom, no arm, no
readout, no file. Two bodies: a ball, MuJoCo's cheapest shape, and a T, a mesh whose distance field is built before. Three
ways:

    plain   MuJoCo's own time step and contact parameters, and the sensor in every step, as `mj_step` does
    once    the same with the sensor at the end only
    lean    the sensor at the end only, and of the time steps and contact parameters below those that cost least among
            those in which the T settles as deep as on the twin's foam, to a factor of two; stiffer contacts settle sooner
            and are no soft skin

All steps of a press are one call into MuJoCo (`mj_step` with `nstep`), so that Python costs a few µs an image.

Ours: `spts dataset make`, from the command line. Pose and force are drawn, forces and moments are balanced at any tilt; a
row holds pressure, conductance, a raster scan of 100 samples and a window of 20 through the readout with its noise.
Parquet files, statistics, SHA-256 and the start of the program count. `T` is the T alone at random places, held level,
with 20 N.

Balance: MuJoCo's sensor measures depth, not pressure. Σ k·depth·A over the taxels, with the foam's stiffness k, is set
against the body's weight; ours is Σ p·A against the force, in the worst row. Times are CPU time, medians over alternating
rounds.

    python scripts/oracles/tactile_speed.py [--json] [--rounds 5] [--presses 300] [--rows 10000] [--spts PATH]
"""

import argparse
import itertools
import json
import os
import pathlib
import resource
import statistics
import subprocess
import tempfile
import time

import mujoco
import numpy as np

ROOT = pathlib.Path(__file__).parents[2]
PITCH_M, TAXELS = 0.015, 10
# initial stiffness of the twin's foam, Pa/m
FOAM_PA_PER_M = 1.5e7
GRAVITY = 9.81
# weight of 20 N, the force on our T
MASS_KG = 20.0 / GRAVITY
BALANCE_KG = [0.5, 1.0, 2.0, 4.0]
BALL_RADIUS_M = 0.04
# width and length of the T, and width of its arms, m
T_SIZE_M, T_ARM_M, T_HEIGHT_M = 0.07, 0.016, 0.01
T_AREA_M2 = T_ARM_M * (2 * T_SIZE_M - T_ARM_M)
# places are drawn within so far from the middle, m
PLACE_M = 0.03
SETTLED = 0.01
LONGEST_STEPS = 1000
# of MuJoCo's documentation: time constants of contacts are at least two steps
LEAN_STEPS_S = [0.002, 0.005, 0.01, 0.02]
LEAN_STEPS_A_CONSTANT = [2.0, 3.0, 4.0, 8.0]
LEAN_IMPEDANCES = [0.3, 0.5, 0.7, 0.9]
SPECS = {
    "presses-17": "presses-17",
    "random-shapes": "random-shapes",
    "T": """\
name = "T"

[object]
from = "objects"
names = ["T"]

[pose]
x_m = { uniform = [-0.03, 0.03] }
y_m = { uniform = [-0.03, 0.03] }

[press]
force_n = 20.0
""",
}
# of our rows the first are looked at
BALANCE_ROWS = 1000


def t_mesh():
    """Vertices and faces of the T, lying on z = 0."""
    half, arm = T_SIZE_M / 2, T_ARM_M / 2
    inner = half - T_ARM_M
    outline = [(-half, half), (-half, inner), (-arm, inner), (-arm, -half), (arm, -half), (arm, inner), (half, inner), (half, half)]
    cover = [(0, 1, 2), (0, 2, 5), (0, 5, 7), (5, 6, 7), (2, 3, 4), (2, 4, 5)]
    n = len(outline)
    vertices = [(x, y, z) for z in (0.0, T_HEIGHT_M) for x, y in outline]
    faces = [(a, c, b) for a, b, c in cover] + [(a + n, b + n, c + n) for a, b, c in cover]
    for i in range(n):
        j = (i + 1) % n
        faces += [(i, j, j + n), (i, j + n, i + n)]
    return vertices, faces


def numbers(rows):
    return " ".join(str(value) for row in rows for value in row)


class Press:
    """A MuJoCo model of one body over the plate, and how many steps it takes to settle."""

    def __init__(self, body, mass_kg=MASS_KG, timestep_s=None, constant_s=None, impedance=None):
        vertices, faces = t_mesh()
        option = f'<option timestep="{timestep_s}"/>' if timestep_s else ""
        contact = f'priority="1" solref="{constant_s} 1" solimp="{impedance} {impedance} .001"' if timestep_s else ""
        shape = f'type="sphere" size="{BALL_RADIUS_M}" pos="0 0 {BALL_RADIUS_M}"' if body == "ball" else 'type="mesh" mesh="T"'
        half = PITCH_M * TAXELS / 2
        spec = mujoco.MjSpec.from_string(f"""
        <mujoco>
          {option}
          <asset>
            <mesh name="taxels" builtin="plate" params="{TAXELS} {TAXELS}" scale="{half} {half} .001"/>
            <mesh name="T" vertex="{numbers(vertices)}" face="{numbers(faces)}"/>
          </asset>
          <worldbody>
            <body mocap="true">
              <geom type="box" size="{half} {half} .02" pos="0 0 -.02" condim="1"/>
              <geom name="taxels" type="mesh" mesh="taxels" pos="0 0 .001" contype="0" conaffinity="0"/>
            </body>
            <body name="pressed"><joint type="slide" axis="0 0 1"/><geom {shape} mass="{mass_kg}" condim="1" {contact}/></body>
          </worldbody>
          <sensor><tactile name="tactile" geom="taxels" mesh="taxels"/></sensor>
        </mujoco>""")
        # the sensor leaves out meshes without a distance field
        spec.mesh("T").needsdf = 1
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self.body = self.model.body("pressed").id
        self.steps, self.depth_m = self.settle()

    def place(self, x_m, y_m):
        mujoco.mj_resetData(self.model, self.data)
        self.model.body_pos[self.body, :2] = x_m, y_m

    def settle(self):
        """Steps until the depth stays within 1 % of its last value; the most of a few places."""
        most = 0
        for place in np.random.default_rng(2).uniform(-PLACE_M, PLACE_M, (8, 2)):
            self.place(*place)
            depths = []
            for _ in range(LONGEST_STEPS):
                mujoco.mj_step(self.model, self.data)
                depths.append(-self.data.qpos[0])
            away = np.flatnonzero(np.abs(np.array(depths) - depths[-1]) > SETTLED * depths[-1])
            most = max(most, int(away[-1]) + 2)
        return most, depths[-1]

    def sensor(self, on):
        flag = int(mujoco.mjtDisableBit.mjDSBL_SENSOR)
        self.model.opt.disableflags = self.model.opt.disableflags & ~flag if on else self.model.opt.disableflags | flag

    def image(self, place, once):
        """Depth at every taxel, m."""
        self.place(*place)
        self.sensor(not once)
        mujoco.mj_step(self.model, self.data, self.steps)
        if once:
            self.sensor(True)
            mujoco.mj_forward(self.model, self.data)
        return self.data.sensordata[: TAXELS * TAXELS]

    def seconds(self, presses, once):
        """CPU seconds an image."""
        places = np.random.default_rng(1).uniform(-PLACE_M, PLACE_M, (presses, 2))
        begin = time.process_time()
        for place in places:
            self.image(place, once)
        return (time.process_time() - begin) / presses

    def carried_n(self):
        """Σ k·depth·A, N, mean over places."""
        places = np.random.default_rng(3).uniform(-PLACE_M, PLACE_M, (200, 2))
        return float(np.mean([FOAM_PA_PER_M * PITCH_M**2 * self.image(place, True).sum() for place in places]))


def lean_parameters(body):
    """Time step, time constant and impedance that cost least where the T is as deep as on foam, to a factor of two."""
    foam_m = MASS_KG * GRAVITY / (FOAM_PA_PER_M * T_AREA_M2)
    found = []
    for step, ratio, impedance in itertools.product(LEAN_STEPS_S, LEAN_STEPS_A_CONSTANT, LEAN_IMPEDANCES):
        chosen = {"timestep_s": step, "constant_s": ratio * step, "impedance": impedance}
        depth_m = Press("T", **chosen).depth_m
        if foam_m / 2 <= depth_m <= 2 * foam_m:
            press = Press(body, **chosen)
            found.append((min(press.seconds(50, True) for _ in range(3)), press.steps, chosen))
    return min(found, key=lambda one: one[0])[2]


class Ours:
    """The `spts` program with one thread."""

    def __init__(self, path, folder, rows):
        self.path, self.folder, self.rows = path, pathlib.Path(folder), rows
        for name, text in SPECS.items():
            if "\n" in text:
                (self.folder / f"{name}.toml").write_text(text)

    def run(self, *arguments):
        environment = os.environ | {"RAYON_NUM_THREADS": "1"}
        return subprocess.run([self.path, "dataset", *map(str, arguments)], check=True, capture_output=True, text=True, env=environment).stdout

    def seconds(self, name, number):
        """CPU seconds a row, of the whole process: from its start to the manifest."""
        spec = self.folder / f"{name}.toml" if "\n" in SPECS[name] else name
        begin = resource.getrusage(resource.RUSAGE_CHILDREN)
        self.run("make", spec, "--rows", self.rows, "--seed", number, "--out", self.folder / f"{name}-{number}", "--json")
        end = resource.getrusage(resource.RUSAGE_CHILDREN)
        return (end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime) / self.rows

    def worst_balance(self, name):
        """Largest |Σ p·A − F| / F of the first rows."""
        lines = self.run("head", self.folder / f"{name}-0", "--rows", BALANCE_ROWS).splitlines()
        rows = [json.loads(line) for line in lines]
        return max(abs(sum(row["pressure_pa"]) * PITCH_M**2 / row["force_n"] - 1.0) for row in rows)


def race(ours, rounds, presses):
    """{(program, task): seconds an image}, and what MuJoCo's tasks are: press, body, parameters, way."""
    tasks = {}
    for body in ("ball", "T"):
        tasks[f"{body}, plain"] = body, {}, False
        tasks[f"{body}, once"] = body, {}, True
        tasks[f"{body}, lean"] = body, lean_parameters(body), True
    tasks = {task: (Press(body, **chosen), body, chosen, once) for task, (body, chosen, once) in tasks.items()}
    times = {}
    for number in range(rounds):
        for task, (press, _, _, once) in tasks.items():
            times.setdefault(("MuJoCo", task), []).append(press.seconds(presses, once))
        for name in SPECS:
            times.setdefault(("ours", name), []).append(ours.seconds(name, number))
    return {key: statistics.median(values) for key, values in times.items()}, tasks


def carried(tasks):
    """What the depths would carry on the foam, for bodies of several weights."""
    rows = []
    for task, (_, body, chosen, _) in tasks.items():
        if task.endswith("once"):
            continue  # the depths are those of "plain"
        for mass in BALANCE_KG:
            rows.append({"task": task, "weight_n": GRAVITY * mass, "carried_n": Press(body, mass_kg=mass, **chosen).carried_n()})
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--presses", type=int, default=300)
    parser.add_argument("--rows", type=int, default=10000)
    parser.add_argument("--spts", type=pathlib.Path, default=ROOT / "target/release/spts")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        ours = Ours(options.spts.resolve(), folder, options.rows)
        seconds, tasks = race(ours, options.rounds, options.presses)
        rows = [{"program": program, "task": task, "images_a_second": 1.0 / value} for (program, task), value in seconds.items()]
        for row in rows:
            if row["program"] == "MuJoCo":
                press = tasks[row["task"]][0]
                row |= {"steps": press.steps, "timestep_s": press.model.opt.timestep, "depth_mm": 1e3 * press.depth_m}
                row |= {f"ours_{name}": seconds["MuJoCo", row["task"]] / seconds["ours", name] for name in SPECS}
        balance = carried(tasks)
        worst = {name: ours.worst_balance(name) for name in SPECS}
    if options.json:
        print(json.dumps({"mujoco": mujoco.__version__, "rows": rows, "mujoco_balance": balance, "our_worst_balance": worst}))
        return
    print(f"MuJoCo {mujoco.__version__}, one thread, CPU time; ours is so many times as fast:\n")
    print(f"{'program':8} {'task':14} {'images/s':>9} {'steps':>6} {'of ms':>6} {'mm deep':>8}  " + "  ".join(f"ours, {name}" for name in SPECS))
    for row in rows:
        if row["program"] == "MuJoCo":
            detail = f"{row['steps']:6} {1e3 * row['timestep_s']:6.1f} {row['depth_mm']:8.2f}  "
            detail += "  ".join(f"{row[f'ours_{name}']:{6 + len(name)}.1f}" for name in SPECS)
        else:
            detail = ""
        print(f"{row['program']:8} {row['task']:14} {row['images_a_second']:9.0f} {detail}".rstrip())
    weights = ", ".join(f"{GRAVITY * mass:.1f}" for mass in BALANCE_KG)
    print(f"\nMuJoCo: what the sensor's depths would carry on the foam, N, under bodies of {weights} N")
    for task in dict.fromkeys(row["task"] for row in balance):
        print(f"{task:14} " + ", ".join(f"{row['carried_n']:.1f}" for row in balance if row["task"] == task))
    for name, value in worst.items():
        print(f"ours, {name}: Σ p·A is the force to {value:.1e} in the worst of {BALANCE_ROWS} rows")


if __name__ == "__main__":
    main()
