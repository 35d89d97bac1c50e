"""A reflex by touch: an arm swings at a person and must stop below a force. How fast must it feel, and through what?

python scripts/python_reflex.py [--seeds 100] [--quick] [--json] [--figure PATH] [--animation PATH] [--taxels 8000]

The forearm of an arm with two driven joints meets the chest of a person who stands freely. MuJoCo moves both. The limb
wears 8,000 taxels on one wire. At every period of its control the reflex reads the skin, and drives both joints back
with full torque once the readings are larger than an untouched skin's. A trial succeeds if the force stays below 280 N
and the reflex did not act before the contact. Trials differ in place, angle, posture, speed (±5 %), girth of the chest,
phase of the control, specimen of the skin and noise. All conditions have the same trials, and the same seeds give the
same numbers. Figure and animation need matplotlib, the animation OpenGL too (MUJOCO_GL=egl).

Sources
- Person: ISO/TS 15066:2016, chest: 25 N/mm and 40 kg (table A.3); 140 N, and twice that for a contact below half a
  second with a person who can recoil (table A.2). The numbers are quoted from secondary sources. The person keeps the
  balance like an oscillator of 1 Hz, critically damped: an assumption that matters little within 0.1 s.
- Arm: UR5e. Lengths and masses from Universal Robots' article 45257. Torque (150 N m), gains (2,000 N m/rad, 400
  N m s/rad) and inertia of the motors (0.1 kg m²) from google-deepmind/mujoco_menagerie; its authors did not tune the
  last ones carefully. The torque follows its command with a lag of 2 ms, an assumption.
- Contact: a spring that stiffens as the skin's foam does, without friction. Behind it is the chest's spring, with a
  wall of 10 g between them, where the specification has none.
"""

from __future__ import annotations

import argparse
import copy
import json
import math
import sys
import time

import mujoco
import numpy as np
import spts
import spts.mujoco

DT = 2.5e-4  # time step of the physics, s
LIMIT = 280.0  # force that must not be passed, N
CHEST, MASS, WALL = 25e3, 40.0, 0.01  # stiffness of the chest, N/m, its mass and that of its wall, kg
TORQUE, STIFF, DAMP, LAG = 150.0, 2000.0, 400.0, 0.002
RADII = (0.11, 0.13, 0.15)  # of the chest, m
SOFT = 0.2  # root of the foam's stiffness at the first touch, of that when pressed flat
UPPER, FORE, ARM = 0.425, 0.392, 0.045  # lengths of the links and radius of the forearm, m
TOOL, AREA = FORE + 0.05, 0.345  # place of the tool on the forearm, m, and taxels of the skin x pitch², m²
LEAD, WINDOW, APPROACH = 8, 480, 800  # steps before the contact, after it, and of the untouched swing before
PER_STEP = 16  # readings in a step: 64.3 kHz x DT
COMPUTE = 2  # steps from the last reading to the new command
IDLE = 16384  # readings of the untouched skin that the threshold is from
ALARMS = 0.01  # false alarms a second that the threshold allows
WATCH = 2.0  # time of the untouched skin in which false alarms are counted, s, per trial and readout
# SPEED is the fastest of SPEEDS at which the arm stops in 95 % of the trials, told of the touch within 1 ms.
RATES, SPEED, M = (50, 100, 250, 1000), 1.4, 16
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
        <asset><texture type="skybox" builtin="flat" rgb1="1 1 1" rgb2="1 1 1" width="8" height="8"/></asset>
        <default><geom condim="1"/><joint axis="0 0 1" armature="{armature}"/></default>
        <worldbody>
          <body name="upper"><joint name="shoulder"/>
            <geom type="capsule" fromto="0 0 0 {UPPER} 0 0" size=".054" mass="8.058" rgba=".2 .28 .42 1"/>
            <body name="fore" pos="{UPPER} 0 0"><joint name="elbow"/>
              <geom type="capsule" fromto="0 0 0 {FORE} 0 0" size="{ARM}" mass="2.846" rgba=".2 .28 .42 1"/>
              <geom type="sphere" pos="{TOOL} 0 0" size=".05" mass="3.035" rgba=".2 .28 .42 1"/></body></body>
          <body name="chest" pos="9 9 0"><joint name="chest" type="slide" axis="0 1 0" armature="0" stiffness="{MASS * wave**2}"
            damping="{2.0 * MASS * wave}"/><inertial pos="0 0 0" mass="{MASS}" diaginertia="1 1 1"/>
            <body name="wall"><joint name="wall" type="slide" axis="0 1 0" armature="0" stiffness="{CHEST}"/>
              <geom type="capsule" size="{radius} .2" mass="{WALL}" rgba=".87 .67 .55 .35"/></body></body>
        </worldbody>
        <actuator><general joint="shoulder" dyntype="filterexact" dynprm="{LAG}"/>
          <general joint="elbow" dyntype="filterexact" dynprm="{LAG}"/></actuator></mujoco>"""
        self.radius, self.model = radius, mujoco.MjModel.from_xml_string(text)
        self.data = mujoco.MjData(self.model)
        self.robot = spts.mujoco.dress(self.model, self.data, ["upper", "fore"], pitch, wires=None)
        skin = self.robot.skins[1]
        body, depth = spts.Body.capsule(radius, 0.4), 0.999 * skin.thickness
        pose = (0.2, radius + ARM + skin.thickness - depth, 0.0), (1.0, 0.0, 0.0, 0.0)
        felt = skin.touch({body: pose}, dt=1e3)
        stiffness = float(felt.pressure.ravel() @ skin.areas) / depth
        # MuJoCo's force of one frictionless contact of depth r is about (K d r + B v) d / weight, where d rises from
        # SOFT d_full to d_full as (r / width)², and K, B are those of solref over d_full², d_full. So the stiffness is
        # `stiffness` (d / d_full)²: what the skin's foam has under this chest, within a quarter from 0.5 mm on. The
        # damping is the foam's at the first touch. The contact's own inertia, d_full / weight, is a gram.
        d, weights = 0.02, self.model.body_invweight0[[self.model.body(n).id for n in ("fore", "wall")], 0]
        self.model.geom_solimp[:] = SOFT * d, d, depth, 0.9999, 2.0
        self.model.geom_solref[:] = -stiffness * weights.sum() * np.array([1.0, SOFT * skin.damping])


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
        self.place, self.turn, self._felt, self._peaks = (*place, 0.0), bend, None, {}

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

    def felt(self):
        """Forces and touches without a reflex."""
        if self._felt is None:
            self._felt = self.run(feel=True)
        return self._felt

    def peak(self, react):
        """Largest force of the trial, N, if the reflex acts from step `react` on."""
        if react not in self._peaks:
            self._peaks[react] = float(self.run(react)[0].max())
        return self._peaks[react]

    @property
    def contact(self):
        """The first step with a force."""
        return int(np.argmax(self.felt()[0] > 0.0))


class Reader:
    """A wire and what its untouched skin reads: the sum of squares tells touch from noise."""

    def __init__(self, kind, trial):
        skins, taxels = trial.scene.robot.skins, trial.scene.robot.taxels
        rng = np.random.default_rng([trial.seed, 64300])
        more = {"designed": {"rows": np.ones((1, taxels))}, "scattered": {"taxels": rng.permutation(taxels)}}.get(
            kind, {}
        )
        self.wire = spts.Wire(skins, seeds=None if "rows" in more else "mixed", seed=trial.seed, **more)
        self.raster = kind in ("scan", "scattered")
        self.read(trial.felt()[1][0], int(rng.integers(taxels)))  # a scan is anywhere
        idle = self.read(None, IDLE)
        self.mean = idle.mean()
        self.squares, self.counts = np.unique((idle - self.mean) ** 2, return_counts=True)

    def copy(self):
        """A reader whose wire goes on from here, apart from this one's."""
        other = copy.copy(self)
        other.wire = copy.deepcopy(self.wire)
        return other

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
    forces, touches = trial.felt()
    if reader is None:
        ticks = range(int(trial.phase * period), LEAD + WINDOW, period)
        return next((k + 1 + COMPUTE for k in ticks if forces[k] > 0.0), None), False
    reader, count = reader.copy(), period * PER_STEP if reader.raster else count
    chunks = [min(PER_STEP, count - first) for first in range(0, count, PER_STEP)]
    period *= math.ceil(len(chunks) / period)  # readings that take longer than a period
    limit = reader.threshold(count, 1.0 / (period * DT))
    before = reader.read(None, count * (APPROACH // period)).reshape(-1, count)
    if (reader.energy(before) >= limit).any():
        return None, True
    felt = 0
    for tick in range(int(trial.phase * period) - period, LEAD + WINDOW - len(chunks), period):
        for k in range(max(felt, 0), tick):
            reader.wire.feel(touches[k])
        felt = tick + len(chunks)
        times = range(tick, felt)
        total = sum(reader.energy(reader.read(touches[k] if k >= 0 else None, c)) for k, c in zip(times, chunks))
        if total >= limit:
            return felt + 1 + COMPUTE, felt <= trial.contact
    return None, False


def false_alarms(reader, rate=1000):
    """False alarms of an untouched skin in WATCH s."""
    reader, count = reader.copy(), round(PER_STEP / (rate * DT)) if reader.raster else M
    blocks = reader.read(None, count * int(WATCH * rate)).reshape(-1, count)
    return int((reader.energy(blocks) >= reader.threshold(count, rate)).sum())


def wilson(good, n, z=1.96):
    """95 % interval of a share (Wilson, 1927)."""
    p, over = good / n, 1.0 + z * z / n
    middle, half = (p + z * z / (2 * n)) / over, z / over * math.sqrt(p * (1 - p) / n + z * z / (4 * n * n))
    return max(middle - half, 0.0), min(middle + half, 1.0)


def finite(value):
    return None if math.isinf(value) else float(value)


def conditions():
    """Readout, M, rate and speed of all that is compared."""
    rows = [("none", 0, 1000, v) for v in SPEEDS]
    rows += [(kind, M, rate, SPEED) for kind in list(LABELS)[:-1] for rate in RATES]
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
                watched.setdefault(kind, []).append(false_alarms(readers[kind]))
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
        peaks, late = (values[early == 0] if (early == 0).any() else values for values in (peaks, late))
        rows.append(
            {
                "readout": kind, "m": m, "rate_hz": rate, "speed_m_s": speed, "success": good / len(trials),
                "low": low, "high": high, "peak_median_n": float(np.median(peaks)), "peak_max_n": float(peaks.max()),
                "late_median_ms": finite(np.median(late)), "late_max_ms": finite(late.max()), "early": int(early.sum()),
            }
        )  # fmt: skip
    seconds = WATCH * options.seeds
    alarms = {kind: {"alarms": sum(counts), "seconds": seconds} for kind, counts in watched.items()}
    return {"taxels": scenes[0].robot.taxels, "false_alarms": alarms, "rows": rows}, found, scenes


def table(result):
    print(f"{result['taxels']} taxels on one wire; {SPEED} m/s")
    print("| readout | M | rate, Hz | below 280 N | peak force, N, median (worst) | reaction, ms, median (worst) |")
    print("|---|---|---|---|---|---|")
    for r in result["rows"]:
        late = "{} ({})".format(*("–" if r[k] is None else f"{r[k]:.1f}" for k in ("late_median_ms", "late_max_ms")))
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

    colours = dict(zip(LABELS, ("#263238", "#00796b", "#5e92f3", "#ef6c00", "#c62828", "#9e9e9e")))
    figure, axes = plt.subplots(1, 3, figsize=(13.6, 4.6), layout="constrained", sharey=True)

    def line(panel, x, style, colour, label, move=1.0, **wanted):
        rows = [r for r in result["rows"] if all(r[k] == v for k, v in wanted.items())]
        rows.sort(key=lambda r: r[x])
        places = [r[x] * move for r in rows]
        mean, low, high = (np.array([r[k] for r in rows]) for k in ("success", "low", "high"))
        whiskers = np.maximum([mean - low, high - mean], 0.0)
        panel.errorbar(places, mean, whiskers, fmt=style, color=colour, label=label, capsize=3, markersize=5)

    for k, kind in enumerate(list(LABELS)[:-1]):
        summed = kind in ("random", "designed")
        style, label = "osD^v"[k] + "-", LABELS[kind] + f", M = {M}" * summed
        line(axes[0], "rate_hz", style, colours[kind], label, 1.05 ** (k - 2), readout=kind, m=M, speed_m_s=SPEED)
        if summed:
            fixed = {"readout": kind, "rate_hz": RATES[-1], "speed_m_s": SPEED}
            line(axes[1], "m", style, colours[kind], LABELS[kind], 1.05 ** (2 * k - 3), **fixed)
    line(axes[2], "speed_m_s", "o-", colours["pressure"], "pressure, 1,000 Hz", readout="pressure", rate_hz=1000)
    for rate, colour in zip(reversed(RATES), (colours["random"], "#9ccc65", "#ef6c00", "#ad1457")):
        line(axes[2], "speed_m_s", "s-", colour, f"random sums, {rate:,} Hz", readout="random", m=M, rate_hz=rate)
    line(axes[2], "speed_m_s", "x--", colours["none"], LABELS["none"], readout="none")
    axes[0].set(xscale="log", xlabel="rate of the reflex, Hz", ylabel=f"share of trials that stay below {LIMIT:.0f} N")
    axes[0].set_xticks(RATES, [f"{rate:,}" for rate in RATES])
    axes[0].set_title(f"Readout and rate, {SPEED} m/s", fontsize=11)
    axes[1].set(xscale="log", xlabel="readings of a decision, M")
    axes[1].set_xticks(MANY, [str(m) for m in MANY])
    axes[1].set_title(f"Readings, at 1,000 Hz or as fast as M allows, {SPEED} m/s", fontsize=11)
    axes[2].set(xlabel="speed of the tool, m/s")
    axes[2].set_title("Rate and speed", fontsize=11)
    for panel, place in zip(axes, ("lower right", "lower left", "center left")):
        panel.minorticks_off()
        panel.set_ylim(-0.03, 1.03)
        panel.grid(axis="y", alpha=0.3)
        panel.spines[["top", "right"]].set_visible(False)
        panel.legend(loc=place, fontsize=8.5, framealpha=0.9, edgecolor="none")
    figure.savefig(path, dpi=100, metadata={"Software": None})
    plt.close(figure)


def glow(scene, touch, most=1e5):
    """Draws the pressed taxels of a link."""
    frame = touch.data.xmat[touch._link].reshape(3, 3)
    places, pressure = touch.skin.positions @ frame.T + touch.data.xpos[touch._link], touch.pressure.ravel()
    for k in np.flatnonzero(pressure > 0.0)[: scene.maxgeom - scene.ngeom]:
        share = min(pressure[k] / most, 1.0)
        colour = np.array([1.0, 0.75 - 0.6 * share, 0.1, 1.0], np.float32)
        shape = mujoco.mjtGeom.mjGEOM_SPHERE, np.full(3, 0.003 + 0.002 * share), places[k], np.eye(3).ravel()
        mujoco.mjv_initGeom(scene.geoms[scene.ngeom], *shape, colour)
        scene.ngeom += 1


def animate(found, scenes, path):
    """The first trial that is too slow at 50 Hz and in time at 1,000 Hz, by random sums: both side by side."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    from PIL import Image

    slow, fast = (found["random", M, rate, SPEED] for rate in (RATES[0], RATES[-1]))
    seed = next((k for k, (a, b) in enumerate(zip(slow, fast)) if a[0] > LIMIT >= b[0]), 0)
    trial = Trial(scenes, seed, SPEED)
    model, data, robot = trial.scene.model, trial.scene.data, trial.scene.robot
    camera = mujoco.MjvCamera()
    camera.lookat[:] = np.array([0.85, 0.85, 1.0]) * trial.place + (0.0, 0.0, 0.02)
    camera.distance, camera.azimuth, camera.elevation = 0.95, 290, -30
    every, last = round(1e-3 / DT), LEAD + round(0.06 / DT)
    shown = []
    with mujoco.Renderer(model, 300, 400, max_geom=2000) as renderer:
        for rate, trials in ((RATES[0], slow), (RATES[-1], fast)):
            late, pictures = trials[seed][1], []
            react = None if math.isinf(late) else trial.contact + round(late * 1e-3 / DT)

            def each(step, pictures=pictures):
                if step % every == 0 and step < last:
                    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
                    renderer.update_scene(data, camera)
                    glow(renderer.scene, robot.attachments[1])
                    pictures.append(renderer.render())

            shown.append((rate, late, trial.run(react, feel=True, each=each)[0], pictures))
    pause = 80  # ms
    time_ms = 1e3 * DT * (np.arange(LEAD + WINDOW) - trial.contact)
    frames, top = [], 1.1 * max(force[:last].max() for _, _, force, _ in shown)
    figure, axes = plt.subplots(2, 2, figsize=(6.4, 4.2), dpi=100, height_ratios=(5, 3), layout="constrained")
    figure.suptitle(f"{SPEED} m/s, {pause / (1e3 * DT * every):.0f} times slower than it is", fontsize=9)
    for k in range(len(shown[0][3])):
        step = k * every
        for column, (rate, late, force, pictures) in enumerate(shown):
            view, curve = axes[:, column]
            view.clear(), curve.clear()
            view.imshow(pictures[k])
            view.axis("off")
            view.set_title(f"touch at {rate:,} Hz", fontsize=11)
            over = force[: step + 1].max() > LIMIT
            curve.axhline(LIMIT, color="#c62828", ls="--", lw=1)
            if time_ms[step] >= late:
                curve.axvline(late, color="#00796b", lw=1)
                curve.text(late + 1.0, 0.04 * top, "reacts", color="#00796b", fontsize=8)
            curve.plot(time_ms[: step + 1], force[: step + 1], color="#c62828" if over else "#263238", lw=1.8)
            curve.set(xlim=(time_ms[0], time_ms[last - 1]), ylim=(0.0, top), xlabel="time since contact, ms")
            curve.spines[["top", "right"]].set_visible(False)
            curve.tick_params(labelsize=8)
        axes[1, 0].set_ylabel("force, N")
        axes[1, 0].text(time_ms[last - 1], LIMIT, f"{LIMIT:.0f} N", color="#c62828", fontsize=8, ha="right", va="top")
        figure.canvas.draw()
        frames.append(Image.fromarray(np.asarray(figure.canvas.buffer_rgba())[..., :3].copy()))
    plt.close(figure)
    palette = frames[-1].quantize(128)
    frames = [frame.quantize(palette=palette, dither=Image.Dither.NONE) for frame in frames]
    pauses = [pause] * (len(frames) - 1) + [2000]
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=pauses, loop=0, optimize=True)


def main(arguments=None):
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--seeds", type=int, default=100, help="trials of every condition (default: 100)")
    options.add_argument("--quick", action="store_true", help="10 trials")
    options.add_argument("--taxels", type=int, default=8000, help="taxels of the limb, about (default: 8000)")
    options.add_argument("--armature", type=float, default=0.1, help="inertia of a motor, kg m² (default: 0.1)")
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
