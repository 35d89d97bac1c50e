"""Gymnasium environments."""

import functools
import multiprocessing
import warnings

import gymnasium as gym
import mujoco
import numpy as np
import pytest
import spts
import spts.envs
import spts.mujoco
from gymnasium.utils.env_checker import check_env

SEEN = ["samples", "pressure", "image"]


@pytest.mark.parametrize("observe", SEEN)
def test_press_is_an_environment(observe):
    check_env(gym.make("spts/Press-v0", observe=observe, render_mode="rgb_array").unwrapped)


@pytest.mark.parametrize("observe", SEEN)
def test_bounce_is_an_environment(observe):
    env = gym.make("spts/Bounce-v0", observe=observe, render_mode="rgb_array").unwrapped
    check_env(env)
    env.close()


def test_a_press_can_be_solved():
    """Going to the place and pressing until the force is there ends well: reward rises to nearly 0."""
    env = spts.envs.PressEnv(observe="pressure")
    for seed in range(3):
        seen, info = env.reset(seed=seed)
        for _ in range(1000):
            away = seen["goal"][:2] - seen["position"][:2]
            off = (seen["goal"][2] - info["force"]) / seen["goal"][2]
            down = -0.05 * off if np.linalg.norm(away) < 1e-3 else 0.2 * (seen["position"][2] < 0.003)
            seen, reward, done, cut, info = env.step(np.array([*np.clip(40 * away, -1, 1), np.clip(5 * down, -1, 1)]))
            if done:
                break
        assert done and reward > -0.6
        assert 1e3 * seen["tactile"].sum() * 0.015**2 == pytest.approx(info["force"], rel=1e-6)


def test_a_ball_bounces():
    """A paddle that strikes when the ball comes keeps it in the air for a while; one at rest does not."""
    totals = []
    for strikes in (False, True):
        env = spts.envs.BounceEnv(observe="pressure")
        _, info = env.reset(seed=1)
        most = total = 0.0
        for _ in range(300):
            near = info["height"] < 0.075
            seen, reward, done, _, info = env.step(np.array([0.2 if strikes and near else -0.4, 0.0, 0.0]))
            most, total = max(most, seen["tactile"].max()), total + reward
            if done:
                break
        totals.append(total)
        env.close()
        assert most > 10.0
    assert totals[1] > totals[0] >= 1


def test_the_same_seed_is_the_same_episode():
    for make in (spts.envs.PressEnv, spts.envs.BounceEnv):
        found = []
        for _ in range(2):
            env = make()
            env.reset(seed=5)
            env.action_space.seed(5)
            found.append([env.step(env.action_space.sample())[0]["tactile"] for _ in range(10)])
            env.close()
        assert np.array_equal(*found)


HAND = """
<mujoco><option timestep="0.001" integrator="{integrator}"/><worldbody>
  <body name="palm"><joint name="lift" type="slide" axis="0 0 1" damping="50"/>
    <geom name="plate" type="box" size=".08 .08 .01" pos="0 0 -.01" mass="1"/><site name="skin"/></body>
  <body name="cup" pos="0 0 .0405"><freejoint/><geom type="cylinder" size=".03 .04" mass=".2"/></body>
</worldbody><actuator><position joint="lift" kp="1000" ctrlrange="-.1 .1"/></actuator></mujoco>"""


class Lift(gym.Env):
    """Somebody's environment: it knows nothing of skins."""

    def __init__(self, integrator="implicitfast", text=HAND):
        self.model = mujoco.MjModel.from_xml_string(text.format(integrator=integrator))
        self.data = mujoco.MjData(self.model)
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (self.model.nq,), np.float64)
        self.action_space = gym.spaces.Box(-0.1, 0.1, (1,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        return self.data.qpos.copy(), {}

    def step(self, action):
        self.data.ctrl[:] = action
        mujoco.mj_step(self.model, self.data, nstep=20)
        return self.data.qpos.copy(), 0.0, False, False, {}


@pytest.mark.parametrize("mode", ["sense", "foam"])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_any_environment_gets_a_skin(integrator, mode):
    env = spts.envs.TactileWrapper(
        Lift(integrator), spts.Skin(10, 10, 0.015), site="skin", bodies=["cup"], observe="pressure", mode=mode
    )
    check_env(env)
    env.reset(seed=0)
    for _ in range(150):
        seen, *_ = env.step(np.zeros(1))
    assert 1e3 * seen["tactile"].sum() * 0.015**2 == pytest.approx(0.2 * 9.81, rel=1e-3)
    # a second episode, felt by a wire whose time begins anew
    env.reset(seed=1)
    env.step(np.zeros(1))
    env.close()
    assert mujoco.get_mjcb_control() is None


def with_skin(observe="samples", mode="sense", **lift):
    return spts.envs.TactileWrapper(Lift(**lift), spts.Skin(8, 8, 0.01), site="skin", observe=observe, mode=mode)


# each with an action that touches
MAKES = {
    "press": (functools.partial(spts.envs.PressEnv, observe="image"), [0.1, 0.0, -1.0]),
    "bounce": (functools.partial(spts.envs.BounceEnv, height=0.02, frame_skip=200), [0.1, 0.0, 0.0]),
    "sense": (with_skin, [0.01]),
    "foam": (functools.partial(with_skin, "image", "foam"), [0.01]),
}


def episodes(envs, action, steps=12):
    """What is felt in an episode that ends early, and in one with the random numbers that follow."""
    seen, _ = envs.reset(seed=7)
    felt = [seen["tactile"].copy()]
    for _ in range(2):
        for _ in range(steps):
            # asynchronous environments write into the same memory
            seen, *_ = envs.step(np.tile(np.float64(action), (envs.num_envs, 1)))
            felt.append(seen["tactile"].copy())
        seen, _ = envs.reset()
        felt.append(seen["tactile"].copy())
    return np.stack(felt, axis=1)


@pytest.mark.parametrize("name", MAKES)
def test_vectors_are_their_environments(name):
    """However many there are, and in whatever processes: environment k is the one with the seed 7 + k."""
    make, action = MAKES[name]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)
        envs = gym.vector.SyncVectorEnv([make] * 2)
        both = episodes(envs, action)
        envs.close()
        envs = gym.vector.SyncVectorEnv([make])
        one = episodes(envs, action)
        envs.close()
        assert np.array_equal(one[0], both[0])
        # felt, and of two specimens
        assert both.any(axis=tuple(range(2, both.ndim))).all(axis=0).any() and not np.array_equal(*both)
        # the slowest of three for one environment; for the others, what is new there is their own state
        for context in ("fork", "forkserver", "spawn") if name == "sense" else ("fork",):
            envs = gym.vector.AsyncVectorEnv([make] * 2, context=context)
            assert np.array_equal(episodes(envs, action), both), context
            envs.close()
            assert not any(process.is_alive() for process in envs.processes)


def learns_in_a_fork(answers):
    answers.put(spts.envs.PressEnv(skin=spts.Skin(5, 7, 0.015), observe="image").reset(seed=0)[0]["tactile"].shape)


def test_a_fork_learns():
    """Decoders learn on threads, which stay behind when a process forks."""
    spts.envs.PressEnv(skin=spts.Skin(5, 6, 0.015), observe="image")
    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    child = context.Process(target=learns_in_a_fork, args=(answers,))
    child.start()
    child.join(30)
    if child.exitcode is None:
        child.kill()
    assert child.exitcode == 0 and answers.get(timeout=5) == (5, 7)


class Wind(Lift):
    """Its steps and its resets are random."""

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.data.qpos[1:3] += self.np_random.uniform(-0.01, 0.01, 2)
        mujoco.mj_forward(self.model, self.data)
        return self.data.qpos.copy(), {}

    def step(self, action):
        self.data.xfrc_applied[2, :2] = self.np_random.uniform(-0.2, 0.2, 2)
        return super().step(action)


def test_a_skin_that_senses_changes_nothing():
    """Not even the random numbers of the second episode."""
    places = []
    for env in (Wind(), spts.envs.TactileWrapper(Wind(), spts.Skin(8, 8, 0.01), site="skin")):
        found = []
        for seed in (3, None):
            env.reset(seed=seed)
            for _ in range(5):
                env.step(np.full(1, 0.01))
                found.append(env.unwrapped.data.qpos.copy())
        places.append(found)
        env.close()
    assert np.array_equal(*places)


def test_two_skins_on_an_environment():
    """Both feel, each with noise of its own, in any mode; closing twice is closing."""
    for modes in (("sense", "sense"), ("foam", "sense"), ("foam", "foam")):
        env = Lift()
        env.model.opt.timestep = 0.0005
        for key, mode in zip(("fine", "coarse"), modes):
            n = {"fine": 10, "coarse": 5}[key]
            skin = spts.Skin(n, n, 0.15 / n)
            # the foam of one lies on that of the other: each bears half
            env = spts.envs.TactileWrapper(
                env, skin, site="skin", bodies=["cup"], key=key, observe="pressure", mode=mode
            )
        assert set(env.observation_space.spaces) == {"observation", "fine", "coarse"}
        for _ in range(2):
            env.reset(seed=0)
            for _ in range(60):
                seen, *_ = env.step(np.zeros(1))
        forces = [1e3 * seen[key].sum() * (0.15 / n) ** 2 for key, n in (("fine", 10), ("coarse", 5))]
        weight = 0.2 * 9.81
        if modes == ("sense", "sense"):
            assert forces == pytest.approx([weight, weight], rel=1e-2)
        elif modes == ("foam", "foam"):
            assert sum(forces) == pytest.approx(weight, rel=1e-2) and min(forces) > 0.3 * weight
        else:
            # foam takes MuJoCo's contact out, and nothing is left to be read
            assert forces[0] == pytest.approx(weight, rel=1e-2)
        env.close()
        env.close()
        assert mujoco.get_mjcb_control() is None
    env = spts.envs.TactileWrapper(Lift(), spts.Skin(8, 8, 0.01), site="skin")
    with pytest.raises(ValueError, match="key"):
        spts.envs.TactileWrapper(env, spts.Skin(8, 8, 0.01), site="skin")


class Rebuilt(Lift):
    """It makes a model and data anew for every episode, as those do that change shapes."""

    def reset(self, *, seed=None, options=None):
        self.model = mujoco.MjModel.from_xml_string(HAND.format(integrator="implicitfast"))
        self.data = mujoco.MjData(self.model)
        return super().reset(seed=seed)


@pytest.mark.parametrize("mode", ["sense", "foam"])
def test_an_environment_with_a_new_model(mode):
    env = spts.envs.TactileWrapper(
        Rebuilt(), spts.Skin(10, 10, 0.015), site="skin", bodies=["cup"], observe="pressure", mode=mode
    )
    for seed in range(2):
        env.reset(seed=seed)
        for _ in range(100):
            seen, *_ = env.step(np.zeros(1))
        assert 1e3 * seen["tactile"].sum() * 0.015**2 == pytest.approx(0.2 * 9.81, rel=1e-2)
    env.close()
    assert mujoco.get_mjcb_control() is None


def test_an_image_is_a_pressure():
    """Images and pressures have one unit and scale, whatever the electronics: forces are right to a factor of two."""
    ball, rng = spts.Body.sphere(0.03), np.random.default_rng(0)
    for readout in ("ideal", "as_built", "as_designed"):
        skin = spts.Skin(10, 10, 0.015)
        tactile = spts.envs.Tactile(skin, "image", 50, wire={"readout": readout})
        assert tactile.space == spts.envs.Tactile(skin, "pressure").space
        ratios, alike = [], []
        for seed in range(20):
            tactile.reset(seed)
            touch = skin.touch({ball: ((*rng.uniform(-0.05, 0.05, 2), 0.0275), (1.0, 0.0, 0.0, 0.0))}, dt=0.1)
            image = tactile.of(touch)
            ratios.append(1e3 * image.sum() / touch.pressure.sum())
            alike.append(np.corrcoef(image.ravel(), touch.pressure.ravel())[0, 1])
        assert 0.5 < np.median(ratios) < 2.0 and np.mean(alike) > 0.8
    with pytest.raises(ValueError, match="taxels"):
        spts.envs.Tactile(skin, "image", wire={"taxels": [0, 1]})


def test_a_hook_is_the_step():
    """`hook` and `mj_step` move everything as `step` does, to round-off."""
    places = []
    for hook in (False, True):
        env = Lift()
        skin = spts.Skin(10, 10, 0.015)
        with spts.mujoco.attach(env.model, env.data, skin, site="skin", bodies=["cup"], mode="foam") as touch:
            env.data.qvel[1] = 0.1
            if hook:
                touch.hook()
                mujoco.mj_step(env.model, env.data, nstep=300)
            else:
                touch.step(300)
        places.append(env.data.qpos.copy())
    assert np.allclose(*places, atol=1e-9)


def test_what_cannot_be():
    for text, make in [
        ("observe", lambda: spts.envs.PressEnv(observe="shear")),
        ("force", lambda: spts.envs.PressEnv(force=(5, 1))),
        ("speed", lambda: spts.envs.PressEnv(speed=float("nan"))),
        ("render_mode", lambda: spts.envs.PressEnv(render_mode="human")),
        ("measurements", lambda: spts.envs.PressEnv(measurements=0)),
        ("height", lambda: spts.envs.BounceEnv(height=-1)),
        ("frame_skip", lambda: spts.envs.BounceEnv(frame_skip=0)),
        ("model", lambda: spts.envs.TactileWrapper(spts.envs.PressEnv(), spts.Skin(), site="a", bodies=["b"])),
    ]:
        with pytest.raises(ValueError, match=text):
            make()
