"""Copies and pickles: apart from the original, with its state, and the same wherever they go."""

import concurrent.futures
import copy
import json
import multiprocessing
import os
import pickle
import subprocess
import sys

import gymnasium as gym
import mujoco
import numpy as np
import pytest
import spts
import spts.decoders
import spts.envs
from conftest import UPRIGHT
from test_envs import Lift as Hand

HOWS = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
    "pickle 2": lambda thing: pickle.loads(pickle.dumps(thing, protocol=2)),
}
DEEP = [how for how in HOWS if how != "copy"]


def skins():
    rng = np.random.default_rng(0)
    places, normals = rng.normal(0, 0.03, (40, 3)), rng.normal(0, 1, (40, 3))
    return {
        "flat": spts.Skin(
            7, 9, 0.01, electrode=0.004, cells=3, stiffness=2e7, thickness=0.01, damping=0.001, friction=0.1
        ),
        "cylinder": spts.Skin.cylinder(0.05, 6, 8, span=(0, 0.06), arc=(0.0, 3.0), friction=0.3),
        "wrapped": spts.Skin.wrap(spts.Body.sphere(0.06), 5, 9, points=3),
        "points": spts.Skin.from_points(places, normals, np.full(40, 1e-4), rows=5, cols=8, damping=0.0),
    }


def poses(skin, ball, depth):
    """A ball that presses on the taxel in the middle."""
    k = len(skin.positions) // 2
    return {ball: (skin.positions[k] + (0.03 - depth) * skin.normals[k], UPRIGHT)}


def same(a, b):
    """Whether two touches are the same."""
    wrenches = zip(a.wrenches.values(), b.wrenches.values())
    assert np.array_equal(a.pressure, b.pressure) and (a.area, a.time, a.number) == (b.area, b.time, b.number)
    assert all(np.array_equal(v, w) for one, other in wrenches for v, w in zip(one, other))
    return a.bottomed == b.bottomed and len(a.wrenches) == len(b.wrenches)


@pytest.mark.parametrize("kind", skins())
@pytest.mark.parametrize("how", HOWS)
def test_skins(kind, how, ball):
    skin = skins()[kind]
    skin.touch(poses(skin, ball, 1e-3), dt=0.25)
    other = HOWS[how](skin)
    for name in ("shape", "time", "thickness"):
        assert getattr(other, name) == getattr(skin, name)
    for name in ("positions", "normals", "areas"):
        assert np.array_equal(getattr(other, name), getattr(skin, name))
    # apart: what one feels the other does not, and each goes on as it would
    first = other.touch(poses(skin, ball, 2e-3), dt=0.5)
    assert (skin.time, other.time) == (0.25, 0.75) and first.area > 0.0
    moves = {ball: (0.01, 0.0, -0.02, 0.1, 0.0, 0.3)}
    assert same(skin.touch(poses(skin, ball, 2e-3), dt=0.5), first)
    assert same(skin.touch(poses(skin, ball, 2e-3), moves, 0.5), other.touch(poses(skin, ball, 2e-3), moves, 0.5))


READOUTS = {
    "as built": {},
    "as published": {"readout": "as_published", "seeds": "mixed"},
    "as designed": {"readout": "as_designed", "levels": "analog"},
    "half": {"taxels": range(99, 20, -2), "seed": 2**64 - 1, "session": 2**63},
    "linear": {"transducer": "linear", "parameters": {"slope_s_per_pa": 2e-8}, "seeds": list(range(100))},
    "faulty": {"faults": [{"name": "skipping_clocks", "taxel": 3, "probability": 0.01}, {"name": "dead", "taxel": 55}]},
    "patterns": {"rows": np.sign(np.random.default_rng(1).normal(size=(7, 100)))},
}


@pytest.mark.parametrize("options", READOUTS)
@pytest.mark.parametrize("how", HOWS)
def test_wires(options, how, skin, ball):
    wire = spts.Wire(skin, **READOUTS[options])
    pressed = skin.touch(poses(skin, ball, 2e-3), dt=0.1)
    wire.record(pressed, 333)
    wire.record(pressed, 50, raster=True)
    wire.feel(skin.touch({}, dt=0.2))
    other = HOWS[how](wire)
    assert (other.shape, other.sample_rate, other.idle) == (wire.shape, wire.sample_rate, wire.idle)
    assert np.array_equal(other.conductance, wire.conductance)
    touch = skin.touch(poses(skin, ball, 3e-3), dt=0.3)
    for _ in range(2):
        for raster in (False, True):
            own, again = (w.record(touch, 200, raster=raster, raw=True) for w in (wire, other))
            assert np.array_equal(own[0], again[0]) and np.array_equal(own[1], again[1])
    # the copy's clock does not run with the original's
    later = HOWS[how](wire)
    ahead = wire.record(touch, 100)[0]
    assert not np.array_equal(ahead, wire.record(touch, 100)[0])
    assert np.array_equal(ahead, later.record(touch, 100)[0])


@pytest.mark.parametrize("how", DEEP)
def test_a_skin_and_its_wire_go_on_together(how, skin, ball):
    wire = spts.Wire(skin, seed=3)
    touch = skin.touch(poses(skin, ball, 1e-3), dt=0.1)
    wire.record(touch, 20)
    nested = {"rig": [(skin, wire), touch], "ball": ball}
    other = HOWS[how](nested)
    (skin2, wire2), touch2 = other["rig"]
    # the touch that the wire knows, and the next one of either skin
    assert same(touch2, touch) and list(touch2.wrenches) == [other["ball"]]
    assert np.array_equal(wire2.record(touch2, 9)[0], wire.record(touch, 9)[0])
    own, again = skin.touch(poses(skin, ball, 2e-3), dt=0.1), skin2.touch(poses(skin, other["ball"], 2e-3), dt=0.1)
    assert np.array_equal(wire.record(own, 50)[0], wire2.record(again, 50)[0])
    # two pasts do not mix
    own, again = skin.touch({}, dt=0.1), skin2.touch(poses(skin, other["ball"], 3e-3), dt=0.1)
    wire.feel(own)
    with pytest.raises(ValueError, match="of a copy of the skin"):
        wire.record(again, 5)
    with pytest.raises(ValueError, match="another skin"):
        wire2.feel(spts.Skin().touch({}, dt=1.0))


@pytest.mark.parametrize("how", DEEP)
def test_wires_over_several_skins(how, ball):
    left, right = skins()["flat"], skins()["cylinder"]
    wires = [spts.Wire([left, right], seed=3), spts.Wire((right, left), taxels=range(100, 7, -3), seed=4)]
    wires[0].record([left.touch(poses(left, ball, 2e-3), dt=0.1), None], 100)
    wires[1].feel([right.touch(poses(right, ball, 2e-3), dt=0.3), None])
    others = HOWS[how](wires)
    touches = left.touch({}, dt=0.2), right.touch(poses(right, ball, 1e-3), dt=0.2)
    for wire, other, order in zip(wires, others, (touches, touches[::-1])):
        for given in (order, order, [None, None]):
            assert all(np.array_equal(a, b) for a, b in zip(wire.record(given, 50), other.record(given, 50)))
        with pytest.raises(ValueError, match="another skin"):
            other.feel(order[::-1])


def test_skins_of_other_processes_are_others(skin, tmp_path):
    """Numbers of skins do not repeat from process to process."""
    script = "import spts, sys, pickle; sys.stdout.buffer.write(pickle.dumps([spts.Skin() for _ in range(20)]))"
    others = [
        s for _ in range(2) for s in pickle.loads(subprocess.check_output([sys.executable, "-c", script], cwd=tmp_path))
    ]
    wires = [spts.Wire(s) for s in others]
    for k, wire in enumerate(wires):
        for j, other in enumerate([*others, skin]):
            if j != k:
                with pytest.raises(ValueError, match="another skin"):
                    wire.feel(other.touch({}, dt=0.1))


def test_a_profile_goes_along(skin, tmp_path):
    """A wire by a file needs it no more."""
    ideal = spts.Wire(skin, readout="ideal")
    file = tmp_path / "mine.toml"
    file.write_text(
        'weights = "binary"\nsample_rate_hz = 5e4\ndrive_v = 4.0\nfeedback_ohm = 500\n[compressive.idle_noise]\nsd_v = 0.1\n'
    )
    saved = pickle.dumps(spts.Wire(skin, readout=str(file)))
    file.unlink()
    wire = pickle.loads(saved)
    assert wire.sample_rate == 5e4 != ideal.sample_rate
    assert wire.record(skin.touch({}, dt=0.1), 100)[0].std() == pytest.approx(0.1, rel=0.4)


def test_a_damaged_pickle_is_refused(skin):
    restored, (made, state) = spts.Wire(skin).__reduce__()
    for wrong in (state[:-8], state + bytes(8), b""):
        with pytest.raises(ValueError, match="of another object|numbers"):
            restored(made, wrong)


@pytest.mark.parametrize("how", HOWS)
def test_decoders(how, skin, pressed):
    y, phi = spts.Wire(skin).record(pressed, 40)
    X, rng = spts.windows(phi, y), np.random.default_rng(0)
    images, labels = rng.random((60, 100)), np.arange(60) % 3
    taught = images.copy()
    for made in [
        spts.decoders.NnLmmse().fit(),
        spts.decoders.Mixture().fit(None, taught),
        spts.decoders.ImageDecoder("evidence").fit(None, taught, labels),
        spts.decoders.Evidence().fit(np.repeat(X, 60, 0), labels, images=taught),
        spts.decoders.Amortised().fit(),
    ]:
        found = made.predict(X)
        # what is done to the images afterwards does not show
        taught[:] = 0.0
        assert np.array_equal(HOWS[how](made).predict(X), found), made
        taught[:] = images
    classifier = spts.decoders.SparseClassifier(3).fit(images, labels)
    assert np.array_equal(HOWS[how](classifier).predict(images), classifier.predict(images))
    surface = (skin.positions[::-1], skin.normals)
    for inner in spts._spts.Decoder("omp", (10, 10)), spts._spts.Decoder("tv", (1, 100), surface=surface):
        assert np.array_equal(HOWS[how](inner).decode(phi, y), inner.decode(phi, y))


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return spts.dataset.make("random-shapes", tmp_path_factory.mktemp("set") / "d", rows=200, progress=False)


@pytest.mark.parametrize("how", HOWS)
def test_data_sets(how, data, monkeypatch, tmp_path):
    opened = spts.Dataset(os.path.relpath(data.path))
    opened.labelled("train")
    monkeypatch.chdir(tmp_path)
    other = HOWS[how]([opened])[0]
    assert other.info == data.info and len(other) == 200
    assert all(np.array_equal(a, b) for a, b in zip(other.labelled("train"), data.labelled("train")))


@pytest.fixture(scope="module")
def session(tmp_path_factory):
    """A session of somebody's own, with a lost sample and what is known of its two presses."""
    folder, rng = tmp_path_factory.mktemp("session"), np.random.default_rng(0)
    volts = rng.normal(0, 1, (2, 3, 12))
    volts[1, 2, 5] = np.nan
    np.save(folder / "volts.npy", volts)
    np.save(folder / "force.npy", rng.random((2, 3, 4)))
    recording = {
        "info": {
            "layout": {"rows": 3, "cols": 4, "pitch_m": 0.01, "electrode_m": 0.008},
            "sample_rate_hz": 1e4,
            "measurements_per_frame": 12,
        },
        "frames": 3,
        "conditioning": 1,
        "blocks": [
            {"frame_position": 3 + 7 * k, "idle_frames": 1, "time_s": 1e-3, "force_n": 2.5 - k} for k in range(2)
        ],
        "samples": {"file": "volts.npy", "kind": "volts", "missing": 1},
        "pressure_pa": "force.npy",
    }
    weights = {
        "raster": {"mode": "raster", "taxels": 12},
        "compressive": {"mode": "binary", "generator": "lcg", "seeds": list(range(12))},
    }
    modes = {mode: {**recording, "info": {**recording["info"], "weights": w}} for mode, w in weights.items()}
    whole = {
        "format": "spts-session",
        "schema": 1,
        "name": "cup 1",
        "object": "cup",
        "event": "press",
        "hold_s": [0.0, 2e-3],
    }
    (folder / "session.json").write_text(json.dumps({**whole, **modes, "provenance": None}))
    return spts.load(folder)


@pytest.mark.parametrize("how", HOWS)
def test_sessions(how, session):
    copied = HOWS[how]({"all": [session], "raster": session.raster})
    other = copied["all"][0]
    for name in ("name", "object", "event", "hold", "shape", "simulated"):
        assert getattr(other, name) == getattr(session, name)
    for own, again in ((session.raster, copied["raster"]), (session.compressive, other.compressive)):
        assert (len(own), own.conditioning, own.sample_rate) == (len(again), again.conditioning, again.sample_rate)
        for name in ("volts", "idle", "pressure", "force", "time"):
            assert np.array_equal(getattr(again, name), getattr(own, name), equal_nan=True), name
        assert np.array_equal(again.phi(1, 5, 20), own.phi(1, 5, 20)) and again.conductance is None


def episode(env, actions):
    found = []
    for action in actions:
        seen, reward, done, cut, info = env.step(action)
        parts = seen.values() if isinstance(seen, dict) else [seen]
        found.append(np.concatenate([*(np.ravel(v) for v in parts), [reward, done]]))
    return np.array(found)


MODEL = """<mujoco><option timestep="0.001"/><worldbody>
  <body name="palm"><joint name="lift" type="slide" axis="0 0 1" damping="50"/>
    <geom name="plate" type="box" size=".08 .08 .01" pos="0 0 -.01" mass="1"/><site name="skin"/></body>
  <body name="cup" pos="0 0 .0405"><freejoint/><geom type="cylinder" size=".03 .04" mass=".2"/></body>
</worldbody><actuator><position joint="lift" kp="1000" ctrlrange="-.1 .1"/></actuator></mujoco>"""


class Lift(Hand):
    """Somebody's environment, which copies as Python copies, and draws random numbers."""

    def __init__(self):
        super().__init__(text=MODEL)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.data.qpos[3] += self.np_random.uniform(-0.01, 0.01)
        mujoco.mj_forward(self.model, self.data)
        return self.data.qpos.copy(), {}

    def step(self, action):
        seen, _, *ends = super().step(action)
        return seen, float(self.np_random.random()), *ends


class BeginsAnew(Lift, gym.utils.EzPickle):
    """One that copies by its constructor, as those of gymnasium do."""

    def __init__(self):
        Lift.__init__(self)
        gym.utils.EzPickle.__init__(self)


ENVS = {
    "press": lambda: spts.envs.PressEnv(skin=spts.Skin(8, 8, 0.01)),
    "press, image": lambda: spts.envs.PressEnv(observe="image", body=spts.Body.box((0.03, 0.03, 0.03))),
    "bounce": lambda: spts.envs.BounceEnv(frame_skip=200),
    "wrapped": lambda: spts.envs.TactileWrapper(Lift(), spts.Skin(8, 8, 0.01), site="skin", bodies=["cup"]),
    "wrapped, foam": lambda: spts.envs.TactileWrapper(
        Lift(), spts.Skin(8, 8, 0.01), site="skin", bodies=["cup"], mode="foam", observe="pressure"
    ),
    "begins anew": lambda: spts.envs.TactileWrapper(BeginsAnew(), spts.Skin(8, 8, 0.01), site="skin", bodies=["cup"]),
}


@pytest.mark.parametrize("kind", ENVS)
@pytest.mark.parametrize("how", DEEP)
def test_environments(kind, how):
    env = ENVS[kind]()
    env.reset(seed=4)
    env.action_space.seed(4)
    actions = [env.action_space.sample() for _ in range(24)]
    episode(env, actions[:8])
    other = HOWS[how](env)
    exact = kind != "begins anew"
    found = episode(other, actions[8:])
    again = HOWS[how](env)
    expected = episode(env, actions[8:])
    assert np.array_equal(found, expected) if exact else np.allclose(found, expected, rtol=1e-6, atol=1e-9)
    # the second copy was made before the original went on, and the first one has gone on alone
    assert np.array_equal(episode(again, actions[8:]), found)
    seen = [e.reset(seed=9)[0] for e in (env, other)]
    assert all(np.array_equal(np.ravel(a), np.ravel(b)) for a, b in zip(*(s.values() for s in seen)))
    for e in (env, other, again):
        e.close()


def test_an_environment_is_made_again_from_its_spec(recwarn):
    skin = spts.Skin(8, 8, 0.01)
    env = gym.make("spts/Press-v0", skin=skin, body=spts.Body.sphere(0.02))
    env = gym.wrappers.RecordEpisodeStatistics(env)
    again = gym.make(env.spec)
    assert not [w for w in recwarn if "spec" in str(w.message) or "deepcopy" in str(w.message)]
    seen = [e.reset(seed=3)[0]["tactile"] for e in (env, again)]
    assert seen[0].shape == (13,) and np.array_equal(*seen)
    assert again.unwrapped.skin is not env.unwrapped.skin
    wrapped = spts.envs.TactileWrapper(gym.make("spts/Bounce-v0"), skin, key="more", site="skin", bodies=["ball"])
    assert wrapped.spec is not None and wrapped.spec.additional_wrappers[-1].name == "TactileWrapper"
    wrapped.close()


def test_environments_do_not_share_a_skin():
    """Those of a vector are given one, and so are those made from one specification."""
    skin, alone = spts.Skin(8, 8, 0.01), gym.make("spts/Press-v0", skin=spts.Skin(8, 8, 0.01))
    envs = gym.make_vec("spts/Press-v0", num_envs=2, vectorization_mode="sync", skin=skin)
    spec = gym.make("spts/Press-v0", skin=skin).spec
    made = [gym.make(spec), gym.make(spec)]
    for env in made:
        env.reset(seed=1)
    expected = alone.reset(seed=1)[0]["tactile"]
    seen = [envs.reset(seed=[1, 2])[0]["tactile"][0]]
    actions = [alone.action_space.sample() for _ in range(5)]
    for k, action in enumerate(actions):
        expected = alone.step(action)[0]["tactile"]
        seen = [envs.step(np.stack([action, -action]))[0]["tactile"][0], made[0].step(action)[0]["tactile"]]
        assert all(np.array_equal(s, expected) for s in seen)
        if k == 2:
            made[1].reset(seed=5)
    assert skin.time == 0.0


def worker(rig, depth):
    """What one of many workers does with a rig that it was sent."""
    skin, wire, ball, decoder = rig
    y, phi = wire.record(skin.touch(poses(skin, ball, depth), dt=0.1), 30)
    return y, decoder.predict(spts.windows(phi, y)), os.getpid()


@pytest.mark.parametrize("start", ["spawn", "forkserver", "fork"])
def test_workers_are_sent_everything(start, skin, ball):
    rig = (
        skin,
        spts.Wire(skin, seed=1),
        ball,
        spts.decoders.Mixture().fit(None, np.random.default_rng(0).random((50, 100))),
    )
    depths = [1e-3, 2e-3, 2e-3]
    with concurrent.futures.ProcessPoolExecutor(2, multiprocessing.get_context(start)) as pool:
        found = list(pool.map(worker, [rig] * 3, depths))
    expected = [worker(copy.deepcopy(rig), depth) for depth in depths]
    for (y, image, pid), (y2, image2, own) in zip(found, expected):
        assert np.array_equal(y, y2) and np.array_equal(image, image2) and pid != own
    assert skin.time == 0.0


def work(kind, folder):
    """Work on threads, and what comes out."""
    if kind == "mixture":
        images = np.random.default_rng(0).random((300, 36))
        return spts.decoders.Mixture(shape=(6, 6)).fit(None, images).predict(np.ones((1, 37)))
    if kind == "layout":
        return spts._spts.Decoder("nn_lmmse", (6, 6)).decode(np.ones((1, 36)), np.ones(1))
    if kind == "verify":
        made = spts.dataset.make("random-shapes", folder, rows=200, progress=False)
        return np.array(spts._spts.command_line(["spts", "dataset", "verify", made.path]))
    data = spts.dataset.make("presses-17", folder, rows=340, progress=False)
    if kind == "rows":
        return data["y_code"] if "y_code" in {c["name"] for c in data.columns} else data["y_v"]
    return np.array(str(spts.score("nn_omp", data, measurements=[20])))


def into(pipe, kind, folder):
    pipe.send(work(kind, folder))


def in_child(of, *arguments, start="fork"):
    """What `of` sends from another process; within a minute or two, or not at all."""
    here, there = multiprocessing.Pipe(duplex=False)
    child = multiprocessing.get_context(start).Process(target=of, args=(there, *arguments))
    child.start()
    try:
        assert here.poll(120), f"{arguments} hangs in another process"
        return here.recv()
    finally:
        child.kill()
        child.join()


def twice(pipe, kind, folder):
    """As `into`, in a process that works and is forked itself."""
    own = work(kind, folder + "/own")
    pipe.send((own, in_child(into, kind, folder + "/child")))


@pytest.mark.parametrize("kind", ["mixture", "layout", "verify", "rows", "score"])
def test_threads_survive_a_fork(kind, tmp_path):
    own = work(kind, str(tmp_path / "own"))
    assert np.array_equal(in_child(into, kind, str(tmp_path / "child")), own)
    assert all(np.array_equal(found, own) for found in in_child(twice, kind, str(tmp_path / "twice")))
    # siblings, and the parent afterwards
    assert np.array_equal(in_child(into, kind, str(tmp_path / "sibling")), own)
    assert np.array_equal(work(kind, str(tmp_path / "again")), own)


def test_a_loader_of_forked_workers(data):
    """Workers of a loader read a data set that the parent has read."""
    expected = data.labelled("train")[1]
    for start in ("fork", "spawn"):
        found = [in_child(train_y, data, start=start) for _ in range(2)]
        assert all(np.array_equal(y, expected) for y in found)


def train_y(pipe, data):
    pipe.send(data.labelled("train")[1])
