"""A reflex by touch: an arm swings at a person and must stop below a force. How fast must it feel, and through what?

python scripts/python_reflex.py [--seeds 100] [--quick] [--json] [--figure docs/reflex.png] [--animation docs/reflex.gif]

The forearm of an arm with two driven joints meets a chest that hangs freely. MuJoCo moves both. The limb wears
8,000 taxels on one wire. At every period of its control the reflex reads the skin, and drives both joints back with
full torque when the readings are too large for an untouched skin. A trial succeeds if the force never is above 280 N,
and the reflex has not acted before the contact. Trials differ in place, angle, posture, speed (±5 %), girth of the chest,
phase of the control, specimen of the skin and noise; all conditions have the same trials. The same seeds give the same
numbers. Figure and animation need matplotlib, the animation OpenGL too (MUJOCO_GL=egl).

Sources
- Person: ISO/TS 15066:2016, chest: 25 N/mm and 40 kg (table A.3), 140 N, twice that while the person is free to recoil
  and the contact is below half a second (table A.2). He keeps his balance like an oscillator of 1 Hz, critically damped;
  this is an assumption, and does little within 0.1 s.
- Arm: UR5e. Lengths and masses from Universal Robots' article 45257; 150 N m and the joints' gains (2,000 N m/rad,
  400 N m s/rad) and reflected inertia (0.1 kg m²) from google-deepmind/mujoco_menagerie, which calls them not carefully
  tuned. Torque follows its command with a lag of 2 ms, an assumption. 1 m/s is the data sheet's typical tool speed.
- Contact: the skin's foam at its secant stiffness at 280 N, and its damping; no friction. Behind it the chest's spring,
  with a wall of 50 g between them, where the specification has none.
"""

from __future__ import annotations

import argparse
import copy
import functools
import json
import math
import os
import sys
import time

import mujoco
import numpy as np
import spts
import spts.mujoco

DT = 2.5e-4  # time step of the physics, s
LIMIT = 280.0  # force that must not be passed, N
CHEST, MASS, WALL = 25e3, 40.0, 0.05  # stiffness of the chest, N/m, its mass and that of its wall, kg
TORQUE, STIFF, DAMP, LAG = 150.0, 2000.0, 400.0, 0.002
RADII = (0.11, 0.13, 0.15)  # of the chest, m
UPPER, FORE, ARM = 0.425, 0.392, 0.045  # lengths of the links and radius of the forearm, m
TOOL, AREA = FORE + 0.05, 0.243  # place of the tool on the forearm, m, and area of the skin, m²
LEAD, WINDOW, APPROACH = 8, 480, 800  # steps before the contact, after it, and of the untouched swing before
PER_STEP = 16  # readings in a step: 64.3 kHz x DT
COMPUTE = 2  # steps from the last reading to the new command
IDLE = 16384  # readings of the untouched skin that the threshold is from
ALARMS = 0.01  # false alarms a second that the threshold allows
WATCH = 2.0  # time of the untouched skin in which false alarms are counted, s, per trial and readout
RATES, SPEED, M = (50, 100, 250, 1000), 1.0, 16
MANY = (1, 2, 4, 8, 16, 32, 64, 256, 1024)
SPEEDS = (0.4, 0.6, 0.8, 1.0, 1.1, 1.2, 1.3, 1.4, 1.5, 1.6)
LABELS = {
    "pressure": "pressure of every taxel",
    "random": "random sums",
    "designed": "sums with all weights +1",
    "scattered": "scan, taxels in random order",
    "scan": "scan, row by row",
    "none": "no reflex",
}


class Scene:
    """Arm, chest and skin."""

    def __init__(self, radius, pitch, armature=0.1):
        wave = 2.0 * math.pi
        text = f"""<mujoco><option timestep="{DT}" gravity="0 0 0" integrator="implicitfast"/>
        <visual><global offwidth="640" offheight="480"/><headlight ambient=".5 .5 .5" diffuse=".5 .5 .5"/></visual>
        <default><geom condim="1"/><joint axis="0 0 1" armature="{armature}"/></default>
        <worldbody>
          <body name="upper"><joint name="shoulder"/>
            <geom type="capsule" fromto="0 0 0 {UPPER} 0 0" size=".054" mass="8.058" rgba=".75 .78 .8 1"/>
            <body name="fore" pos="{UPPER} 0 0"><joint name="elbow"/>
              <geom type="capsule" fromto="0 0 0 {FORE} 0 0" size="{ARM}" mass="2.846" rgba=".75 .78 .8 1"/>
              <geom type="sphere" pos="{TOOL} 0 0" size=".05" mass="3.035" rgba=".35 .4 .45 1"/></body></body>
          <body name="chest"><joint name="chest" type="slide" axis="0 1 0" armature="0" stiffness="{MASS * wave**2}"
            damping="{2.0 * MASS * wave}"/><inertial pos="0 0 0" mass="{MASS}" diaginertia="1 1 1"/>
            <body name="wall"><joint name="wall" type="slide" axis="0 1 0" armature="0" stiffness="{CHEST}"/>
              <geom type="capsule" size="{radius} .2" mass="{WALL}" rgba=".87 .67 .55 1"/></body></body>
        </worldbody>
        <actuator><general joint="shoulder" dyntype="filterexact" dynprm="{LAG}"/>
          <general joint="elbow" dyntype="filterexact" dynprm="{LAG}"/></actuator></mujoco>"""
        self.radius, self.model = radius, mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.robot = spts.mujoco.dress(self.model, self.data, ["upper", "fore"], pitch, wires=None)
        skin, foam, low, high = self.robot.skins[1], 0.0, 0.0, 0.999 * self.robot.skins[1].thickness
        body = spts.Body.capsule(radius, 0.4)
        for _ in range(40):  # depth of the foam under the limit
            foam = 0.5 * (low + high)
            skin.reset()
            felt = skin.touch({body: ((0.2, radius + ARM + skin.thickness - foam, 0.0), (1.0, 0.0, 0.0, 0.0))}, dt=1e3)
            low, high = (foam, high) if felt.pressure.ravel() @ skin.areas < LIMIT else (low, foam)
        self.stiffness = LIMIT / foam
        # MuJoCo's force of one frictionless contact is (aref - a) / R, with R = (1 - d) / d x the bodies' inverse
        # weight. With these numbers it is a spring and a damper, beside an inertia of d / weight, below a gram.
        d, weights = 0.01, self.model.body_invweight0[[self.model.body(n).id for n in ("fore", "wall")], 0]
        scale = (1.0 - d) * weights.sum()
        self.model.geom_solimp[:, :2] = d
        self.model.geom_solref[:] = -self.stiffness * scale, -self.stiffness * skin.damping * scale

    @property
    def taxels(self):
        return self.robot.taxels


class Trial:
    """One swing at the chest: everything random in it is drawn of its seed."""

    def __init__(self, scenes, seed, speed):
        rng = np.random.default_rng([seed, 15066])
        self.scene = scenes[rng.integers(len(scenes))]
        self.seed, self.speed = seed, speed * rng.uniform(0.95, 1.05)
        bend, self.tilt, self.phase = rng.uniform(0.2, 1.0), rng.uniform(-0.35, 0.35), rng.uniform()
        reach, ratio = rng.uniform(0.15, 0.34), rng.uniform(0.0, 1.0)
        self.posture, self.swing = np.array([0.0, bend]), np.array([1.0, ratio])
        # the tool's speed for this swing of both joints
        tool = UPPER * math.sin(bend), UPPER * math.cos(bend) + (1.0 + ratio) * TOOL
        self.swing *= self.speed / math.hypot(*tool)
        along, across = np.array([math.cos(bend), math.sin(bend)]), np.array([-math.sin(bend), math.cos(bend)])
        place = np.array([UPPER, 0.0]) + reach * along + (ARM + self.scene.radius) * across
        self.place, self.turn = (*place, 0.0), bend

    def run(self, react=None, feel=False, each=None):
        """Forces of the steps, N, and with `feel` what both links feel after each. From step `react` on the joints are
        driven back."""
        model, data, robot = self.scene.model, self.scene.data, self.scene.robot
        mujoco.mj_resetData(model, data)
        chest = model.body("chest").id
        first, second, quat = np.zeros(4), np.zeros(4), np.zeros(4)
        mujoco.mju_axisAngle2Quat(first, (0.0, 0.0, 1.0), self.turn)
        mujoco.mju_axisAngle2Quat(second, (0.0, 1.0, 0.0), self.tilt)
        mujoco.mju_mulQuat(quat, first, second)
        model.body_pos[chest], model.body_quat[chest] = self.place, quat
        data.qpos[:2], data.qvel[:2] = self.posture - LEAD * DT * self.swing, self.swing
        start, forces, touches = data.qpos[:2].copy(), [], []
        robot.reset()
        for step in range(LEAD + WINDOW):
            if react is None or step < react:
                wanted = start + step * DT * self.swing
                torque = STIFF * (wanted - data.qpos[:2]) + DAMP * (self.swing - data.qvel[:2])
            else:
                torque = DAMP * (-self.swing - data.qvel[:2])
            data.ctrl[:] = np.clip(torque, -TORQUE, TORQUE)
            if feel:
                touches.append(robot.step())
            else:
                mujoco.mj_step(model, data)
            forces.append(float(data.efc_force.sum()))
            if each is not None:
                each(step)
        return np.array(forces), touches

    @functools.cache  # noqa: B019
    def felt(self):
        return self.run(feel=True)

    @functools.cache  # noqa: B019
    def peak(self, react):
        return float(self.run(react)[0].max())

    @property
    def contact(self):
        """The first step with a force."""
        return int(np.argmax(self.felt()[0] > 0.0))


class Reader:
    """A wire and what its untouched skin reads: the sum of squares tells touch from noise."""

    def __init__(self, kind, trial):
        skins, taxels = trial.scene.robot.skins, trial.scene.taxels
        rng = np.random.default_rng([trial.seed, 64300])
        more = {
            "designed": {"rows": np.ones((1, taxels))},
            "scattered": {"taxels": rng.permutation(taxels)},
        }.get(kind, {})
        self.kind, self.order = kind, more.get("taxels")
        self.wire = spts.Wire(skins, seeds=None if "rows" in more else "mixed", seed=trial.seed, **more)
        self.raster = kind in ("scan", "scattered")
        self.read(trial.felt()[1][0], int(rng.integers(taxels)))  # a scan is anywhere
        idle = self.read(None, IDLE)
        self.mean = idle.mean()
        self.squares, self.counts = np.unique((idle - self.mean) ** 2, return_counts=True)

    def read(self, touch, count):
        self.untouched = touch if touch is not None else self.untouched
        return self.wire.record(self.untouched, count, raster=self.raster, weights=False)[0]

    def energy(self, readings):
        return ((readings - self.mean) ** 2).sum(axis=-1)

    def threshold(self, count, rate):
        """Sum of squares that `count` readings of the untouched skin pass ALARMS times a second at most.

        Chernoff's bound, P(sum >= t) <= min over s of exp(-s t) E[exp(s z²)]^count, for independent readings. One
        reading is added that is a code of the converter larger than any seen.
        """
        code = 3.3 / 1023.0 * (508.0 / 165.0 if self.raster else 11140.0 / 570.0)
        squares = np.append(self.squares, (math.sqrt(self.squares[-1]) + code) ** 2)
        shares = np.append(self.counts, 1.0) / (self.counts.sum() + 1.0)
        s = np.geomspace(1e-3, 1e3, 400)[:, None] / squares[-1]
        logs = s * squares
        most = logs.max(axis=1)
        growth = most + np.log((shares * np.exp(logs - most[:, None])).sum(axis=1))
        return float(((count * growth - math.log(ALARMS / rate)) / s[:, 0]).min())


def alarm(trial, reader, count, rate):
    """The step from which the reflex acts, or None; and whether it acted before the contact."""
    period = round(1.0 / (rate * DT))
    phase, touches = int(trial.phase * period), trial.felt()[1]
    ticks = np.arange((phase - APPROACH) % period - period, LEAD + WINDOW, period)
    if reader is None:
        forces = trial.felt()[0]
        return next((int(k) + 1 + COMPUTE for k in ticks if k >= 0 and forces[k] > 0.0), None), False
    reader = copy.deepcopy(reader)
    if reader.raster:
        limit = reader.threshold(period * PER_STEP, rate)
        before = reader.read(None, PER_STEP * (APPROACH // period) * period).reshape(-1, period * PER_STEP)
        if (reader.energy(before) >= limit).any():
            return None, True
        total = 0.0
        for k in range(ticks[0], LEAD + WINDOW):
            if (k - ticks[0]) % period == 0:
                if total >= limit:
                    return k + 1 + COMPUTE, k <= trial.contact
                total = 0.0
            total += reader.energy(reader.read(touches[k] if k >= 0 else None, PER_STEP))
        return None, False
    chunks = [PER_STEP] * (count // PER_STEP) + ([count % PER_STEP] if count % PER_STEP else [])
    limit = reader.threshold(count, min(rate, 1.0 / (len(chunks) * DT)))
    before = reader.read(None, count * math.ceil(APPROACH / max(period, len(chunks)))).reshape(-1, count)
    if (reader.energy(before) >= limit).any():
        return None, True
    ready, k = -1, 0
    for tick in ticks[ticks >= 0]:
        if tick < ready or tick + len(chunks) > LEAD + WINDOW:
            continue
        for i in range(k, tick):
            reader.wire.feel(touches[i])
        total = sum(reader.energy(reader.read(touches[tick + i], c)) for i, c in enumerate(chunks))
        ready = k = tick + len(chunks)
        if total >= limit:
            return int(ready) + 1 + COMPUTE, ready <= trial.contact
    return None, False


def false_alarms(reader, count, rate=1000):
    """False alarms of an untouched skin in WATCH s."""
    reader = copy.deepcopy(reader)
    count = PER_STEP * round(1.0 / (rate * DT)) if reader.raster else count
    blocks = reader.read(None, count * int(WATCH * rate)).reshape(-1, count)
    return int((reader.energy(blocks) >= reader.threshold(count, rate)).sum())


def wilson(good, n, z=1.96):
    """95 % interval of a share (Wilson, 1927)."""
    p, over = good / n, 1.0 + z * z / n
    middle, half = (p + z * z / (2 * n)) / over, z / over * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return middle - half, middle + half


def conditions():
    """Readout, M, rate and speed of all that is compared."""
    rows = [("none", 0, 1000, v) for v in SPEEDS]
    rows += [(kind, M, rate, SPEED) for kind in LABELS if kind != "none" for rate in RATES]
    rows += [(kind, m, 1000, SPEED) for kind in ("random", "designed") for m in MANY]
    rows += [("random", M, rate, v) for rate in RATES for v in SPEEDS] + [("pressure", M, 1000, v) for v in SPEEDS]
    return list(dict.fromkeys(rows))


def study(options):
    pitch = math.sqrt(AREA / options.taxels)
    scenes = [Scene(radius, pitch, options.armature) for radius in RADII]
    found, watched = {row: [] for row in conditions()}, {}
    begin = shown = time.monotonic()
    for seed in range(options.seeds):
        trials, readers = {v: Trial(scenes, seed, v) for v in SPEEDS}, {"pressure": None}
        for trial in trials.values():
            trial.felt()  # a wire takes touches in the order of their making
        for kind in LABELS:
            if kind not in ("pressure", "none"):
                readers[kind] = Reader(kind, trials[SPEEDS[0]])
                watched.setdefault(kind, []).append(false_alarms(readers[kind], M))
        for row in found:
            kind, m, rate, speed = row
            trial = trials[speed]
            react, early = (None, False) if kind == "none" else alarm(trial, readers[kind], m, rate)
            late = math.inf if react is None else 1e3 * DT * (react - trial.contact)
            found[row].append((trial.peak(react), late, early))
        if time.monotonic() - shown > 2.0:
            shown = time.monotonic()
            left = (shown - begin) / (seed + 1) * (options.seeds - seed - 1)
            print(f"\r{seed + 1} of {options.seeds} trials, {left:.0f} s to go ", end="", file=sys.stderr, flush=True)
    if shown > begin:
        print(file=sys.stderr)
    rows = []
    for (kind, m, rate, speed), trials in found.items():
        peaks, late, early = np.array(trials, float).T
        good = int(((peaks <= LIMIT) & (early == 0)).sum())
        low, high = wilson(good, len(peaks))
        rows.append(
            {
                "readout": kind, "m": m, "rate_hz": rate, "speed_m_s": speed, "success": good / len(peaks),
                "low": low, "high": high, "peak_median_n": float(np.median(peaks)), "peak_max_n": float(peaks.max()),
                "late_median_ms": float(np.median(late)), "late_max_ms": float(late.max()), "early": int(early.sum()),
            }
        )  # fmt: skip
    seconds = WATCH * options.seeds
    alarms = {kind: {"alarms": sum(counts), "seconds": seconds} for kind, counts in watched.items()}
    stiffness = [scene.stiffness for scene in scenes]
    return {"taxels": scenes[0].taxels, "stiffness_n_m": stiffness, "false_alarms": alarms, "rows": rows}, found, scenes


def table(result):
    print(f"{result['taxels']} taxels on one wire; {SPEED} m/s")
    print("| readout | M | rate, Hz | below 280 N | peak force, N, median (worst) | reaction, ms, median (worst) |")
    print("|---|---|---|---|---|---|")
    for r in result["rows"]:
        late = "–" if math.isinf(r["late_median_ms"]) else f"{r['late_median_ms']:.1f} ({r['late_max_ms']:.1f})"
        speed = "" if r["speed_m_s"] == SPEED else f", {r['speed_m_s']} m/s"
        print(
            f"| {LABELS[r['readout']]}{speed} | {r['m'] if r['readout'] in ('random', 'designed') else '–'} "
            f"| {r['rate_hz'] if r['readout'] != 'none' else '–'} | {r['success']:.2f} ({r['low']:.2f} – {r['high']:.2f}) "
            f"| {r['peak_median_n']:.0f} ({r['peak_max_n']:.0f}) | {late} |"
        )
    for kind, count in result["false_alarms"].items():
        print(f"false alarms, {LABELS[kind]}: {count['alarms']} in {count['seconds']:.0f} s")
    print(f"false alarms before the contact, all conditions: {sum(r['early'] for r in result['rows'])}")


def draw(result, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    colours = {"pressure": "#263238", "random": "#00796b", "designed": "#5e92f3", "scattered": "#ef6c00", "scan": "#c62828"}
    figure, axes = plt.subplots(1, 3, figsize=(13.6, 4.6), layout="constrained", sharey=True)

    def line(panel, x, rows, **style):
        mean, low, high = (np.array([r[k] for r in rows]) for k in ("success", "low", "high"))
        whiskers = np.maximum([mean - low, high - mean], 0.0)
        panel.errorbar(x, mean, whiskers, capsize=3, markersize=5, **style)

    def pick(**wanted):
        return [r for r in result["rows"] if all(r[k] == v for k, v in wanted.items())]

    speed = {"speed_m_s": SPEED}
    for k, (kind, colour) in enumerate(colours.items()):
        rows = [r for r in pick(readout=kind, **speed) if r["m"] == M and r["rate_hz"] in RATES]
        rows.sort(key=lambda r: r["rate_hz"])
        text = LABELS[kind] + (f", M = {M}" if kind in ("random", "designed") else "")
        style = {"color": colour, "marker": "osD^v"[k], "label": text}
        line(axes[0], [r["rate_hz"] * 1.04 ** (k - 2) for r in rows], rows, **style)
    for k, kind in enumerate(("random", "designed")):
        rows = sorted(pick(readout=kind, rate_hz=1000, **speed), key=lambda r: r["m"])
        style = {"color": colours[kind], "marker": "sD"[k], "label": LABELS[kind]}
        line(axes[1], [r["m"] * 1.04 ** (2 * k - 1) for r in rows], rows, **style)
    kinds = [("pressure", 1000, "#263238", "o-"), ("none", 1000, "#9e9e9e", "x--")]
    kinds += [("random", rate, colour, "s-") for rate, colour in zip(RATES, ("#ad1457", "#ef6c00", "#9ccc65", "#00796b"))]
    for kind, rate, colour, style in kinds:
        rows = sorted([r for r in pick(readout=kind, rate_hz=rate) if kind != "random" or r["m"] == M], key=lambda r: r["speed_m_s"])
        text = LABELS[kind] if kind == "none" else f"{'random sums' if kind == 'random' else 'pressure'}, {rate:,} Hz"
        line(axes[2], [r["speed_m_s"] for r in rows], rows, color=colour, fmt=style, label=text)
    axes[0].set(xscale="log", xlabel="rate of the reflex, Hz", ylabel=f"share of trials that stay below {LIMIT:.0f} N")
    axes[0].set_xticks(RATES, [f"{rate:,}" for rate in RATES])
    axes[0].set_title(f"Readout and rate, {SPEED} m/s")
    axes[1].set(xscale="log", xlabel="readings a decision, M")
    axes[1].set_xticks(MANY, [str(m) for m in MANY])
    axes[1].set_title(f"Readings, at 1,000 Hz or as fast as M allows, {SPEED} m/s")
    axes[2].set(xlabel="speed of the tool, m/s")
    axes[2].set_title("Speed")
    for panel in axes:
        panel.minorticks_off()
        panel.set_ylim(-0.03, 1.03)
        panel.grid(axis="y", alpha=0.3)
        panel.spines[["top", "right"]].set_visible(False)
        panel.legend(frameon=False, fontsize=8.5)
    figure.savefig(path, dpi=110, metadata={"Software": None})
    plt.close(figure)


def main(arguments=None):
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seeds", type=int, default=100, help="trials of every condition (default: 100)")
    options.add_argument("--quick", action="store_true", help="10 trials")
    options.add_argument("--taxels", type=int, default=8000, help="taxels of the limb, about (default: 8000)")
    options.add_argument("--armature", type=float, default=0.1, help="reflected inertia of a motor, kg m² (default: 0.1)")
    options.add_argument("--json", action="store_true", help="print the numbers as JSON")
    options.add_argument("--figure", help="picture of the results to draw (default: none)")
    options.add_argument("--animation", help="GIF to draw of one trial at 50 Hz and 1,000 Hz (default: none)")
    chosen = options.parse_args(arguments)
    if chosen.quick:
        chosen.seeds = 10
    if chosen.seeds < 1 or not 100 <= chosen.taxels <= 200_000 or not 0.0 <= chosen.armature <= 10.0:
        options.error("--seeds is below 1, --taxels outside [100, 200000], or --armature outside [0, 10]")
    result, found, scenes = study(chosen)
    if chosen.json:
        print(json.dumps(result, indent=1))
    else:
        table(result)
    if chosen.figure:
        draw(result, chosen.figure)
    if chosen.animation:
        animate(found, scenes, chosen.animation)


if __name__ == "__main__":
    main()
