"""Gymnasium environments."""

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


def test_many_at_once():
    for vector in (gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv):
        envs = vector([spts.envs.PressEnv] * 3)
        seen, _ = envs.reset(seed=0)
        seen, reward, *_ = envs.step(envs.action_space.sample())
        assert seen["tactile"].shape == (3, 20) and reward.shape == (3,)
        envs.close()


HAND = """
<mujoco><option timestep="0.001" integrator="{integrator}"/><worldbody>
  <body name="palm"><joint name="lift" type="slide" axis="0 0 1" damping="50"/>
    <geom name="plate" type="box" size=".08 .08 .01" pos="0 0 -.01" mass="1"/><site name="skin"/></body>
  <body name="cup" pos="0 0 .0405"><freejoint/><geom type="cylinder" size=".03 .04" mass=".2"/></body>
</worldbody><actuator><position joint="lift" kp="1000" ctrlrange="-.1 .1"/></actuator></mujoco>"""


class Lift(gym.Env):
    """Somebody's environment: it knows nothing of skins."""

    def __init__(self, integrator="implicitfast"):
        self.model = mujoco.MjModel.from_xml_string(HAND.format(integrator=integrator))
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
    assert mujoco.get_mjcb_passive() is None


@pytest.mark.parametrize("kind", [gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv])
def test_vectors_of_environments_with_a_skin(kind):
    def make():
        return spts.envs.TactileWrapper(Lift(), spts.Skin(8, 8, 0.01), site="skin")

    envs = kind([make, make])
    for seed in range(2):
        envs.reset(seed=seed)
        for _ in range(3):
            seen, *_ = envs.step(np.zeros((2, 1)))
    assert seen["tactile"].shape == (2, 13)
    envs.close()


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
