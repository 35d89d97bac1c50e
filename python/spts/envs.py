"""Gymnasium environments with a tactile skin, and a wrapper that gives one to any environment. Needs `gymnasium`.

`gymnasium.make("spts/Press-v0")` and `"spts/Bounce-v0"` make them too, once `spts.envs` is imported.

Pressures alone are felt: no shear, no slip, no vibration.
"""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from ._spts import Body, Skin, Wire
from .decode import decode

# Measurements of an observation, by default: 20 of 100 taxels, and the same share of other skins.
_SHARE = 0.2
# Pressure that an observation may show at most, Pa; more than any foam bears.
_MOST_PA = 1e7
# Volts that an observation may show at most: amplifiers have supplies.
_MOST_V = 100.0


class Tactile:
    """What a skin says, as an observation.

    Parameters
    ----------
    skin : Skin
    observe : str
        "samples": the M measurements of the one wire, V; "pressure": pressure of the taxels, Pa, (rows, cols); "image":
        the image that is decoded from M measurements, in V, (rows, cols).
    measurements : int, optional
        M; default a fifth of the taxels.
    decoder : str
        Decoder of images.
    wire : dict, optional
        What `spts.Wire` takes beside the skin and the seed: `readout`, `seeds`, `transducer`, `faults` and so on.
    """

    def __init__(self, skin, observe="samples", measurements=None, decoder="nn_lmmse", wire=None):
        shape, taxels = skin.shape, skin.shape[0] * skin.shape[1]
        if observe not in ("samples", "pressure", "image"):
            raise ValueError(f'`observe` = "{observe}"; valid: "samples", "pressure", "image"')
        self.skin, self.observe, self.decoder = skin, observe, decoder
        self.measurements = max(1, round(_SHARE * taxels)) if measurements is None else int(measurements)
        if self.measurements < 1:
            raise ValueError(f"`measurements` = {measurements} is outside [1, 2^27]")
        self._options = dict(wire or {})
        if observe == "samples":
            self.space = gym.spaces.Box(-_MOST_V, _MOST_V, (self.measurements,), np.float64)
        elif observe == "pressure":
            self.space = gym.spaces.Box(0.0, _MOST_PA, shape, np.float64)
        else:
            self.space = gym.spaces.Box(-_MOST_V, _MOST_V, shape, np.float64)
        self.reset(0)

    def reset(self, seed):
        """Another specimen of the skin, which nothing has touched yet."""
        self.skin.reset()
        self._wire = None if self.observe == "pressure" else Wire(self.skin, seed=int(seed), **self._options)

    def feel(self, touch):
        """Lets the taxels feel a touch that is not observed."""
        if self._wire is not None:
            self._wire.feel(touch)

    def of(self, touch):
        """The observation of a touch."""
        if self.observe == "pressure":
            found = touch.pressure
        else:
            found, phi = self._wire.record(touch, self.measurements)
            if self.observe == "image":
                found = decode(phi, found, self.skin.shape, self.decoder)
        return np.clip(found, self.space.low, self.space.high)


def _fresh(rng):
    """A seed for everything random of one episode."""
    return rng.integers(0, 2**63)


class PressEnv(gym.Env):
    """Press an object on a flat skin at a wanted place with a wanted force, by touch.

    The hand holds the object and moves with the speed that it is told. Nothing is simulated but the contact.

    Action: velocity of the object along x, y and z, each [-1, 1] times `speed`.
    Observation: `tactile`, as `spts.envs.Tactile` makes it; `position` of the object, m, from the middle of the skin, its
    lowest point along z; `goal`: x and y of the place, m, and the force, N.
    Reward: minus the distance from the place in taxels, minus the relative error of the force. It ends well when the
    first is below 0.5 and the second below 0.1.

    Parameters
    ----------
    body : spts.Body, optional
        What is pressed; default a ball of 30 mm radius. Its z axis stays upright.
    skin : spts.Skin, optional
        Flat; default 10 x 10 taxels of 15 mm.
    force : (float, float)
        Range of the wanted force, N.
    speed : float
        Largest speed along each axis, m/s.
    dt : float
        Time of a step, s.
    observe, measurements, decoder, wire
        As of `spts.envs.Tactile`.
    render_mode : str, optional
        "rgb_array": the pressure beside what is decoded.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 100}

    def __init__(
        self,
        body=None,
        skin=None,
        force=(2.0, 10.0),
        speed=0.05,
        dt=0.01,
        observe="samples",
        measurements=None,
        decoder="nn_lmmse",
        wire=None,
        render_mode=None,
    ):
        if not 0.0 < force[0] <= force[1] <= 1e3:
            raise ValueError(f"`force` = {force}: 0 < least <= most <= 1000 N is needed")
        for name, value, most in (("speed", speed, 1.0), ("dt", dt, 1.0)):
            if not 0.0 < value <= most:
                raise ValueError(f"`{name}` = {value} is outside (0, {most}]")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'`render_mode` = {render_mode}; valid: None, "rgb_array"')
        self.skin = Skin(10, 10, 0.015) if skin is None else skin
        self.body = Body.sphere(0.03) if body is None else body
        self.render_mode = render_mode
        self._tactile = Tactile(self.skin, observe, measurements, decoder, wire)
        self._force, self._speed, self._dt = force, speed, dt
        # the half sides of the skin, and how far the object may be above and inside
        self._half = np.abs(self.skin.positions[:, :2]).max(axis=0)
        self._low = -float(self.body.mesh[0][:, 2].min())
        self._place = np.array([*(1.2 * self._half), 0.05])
        reach = np.float64(self._place)
        self.observation_space = gym.spaces.Dict(
            tactile=self._tactile.space,
            position=gym.spaces.Box(np.array([*-reach[:2], -0.01]), reach, dtype=np.float64),
            goal=gym.spaces.Box(np.array([*-self._half, 0.0]), np.array([*self._half, force[1]]), dtype=np.float64),
        )
        self.action_space = gym.spaces.Box(-1.0, 1.0, (3,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._tactile.reset(_fresh(self.np_random))
        self._goal = np.array(
            [*self.np_random.uniform(-0.7 * self._half, 0.7 * self._half), self.np_random.uniform(*self._force)]
        )
        self._position = np.array([*self.np_random.uniform(-0.7 * self._half, 0.7 * self._half), 0.005])
        self._touch(np.zeros(3))
        return self._observation(), self._info()

    def step(self, action):
        velocity = np.clip(np.asarray(action, np.float64), -1.0, 1.0) * self._speed
        before = self._position
        self._position = np.clip(before + velocity * self._dt, self.observation_space["position"].low, self._place)
        self._touch((self._position - before) / self._dt)
        away, off = self._errors()
        done = away < 0.5 and off < 0.1
        return self._observation(), -away - off, bool(done), False, self._info()

    def _touch(self, velocity):
        pose = (self._position + (0.0, 0.0, self._low), (1.0, 0.0, 0.0, 0.0))
        self.last = self.skin.touch({self.body: pose}, {self.body: (*velocity, 0.0, 0.0, 0.0)}, self._dt)
        self._normal = float(self.last.wrenches[self.body][0][2])

    def _errors(self):
        pitch = 2.0 * self._half.max() / max(max(self.skin.shape) - 1, 1)
        away = float(np.linalg.norm(self._position[:2] - self._goal[:2])) / pitch
        return away, abs(self._normal - self._goal[2]) / self._goal[2]

    def _observation(self):
        tactile = self._tactile.of(self.last)
        return {"tactile": tactile, "position": self._position.copy(), "goal": self._goal.copy()}

    def _info(self):
        away, off = self._errors()
        return {"force": self._normal, "taxels_away": away, "force_error": off}

    def render(self):
        if self.render_mode == "rgb_array":
            from .viz import rgb

            return rgb(self.last.pressure)
        return None


class BounceEnv(gym.Env):
    """Keep a tennis ball bouncing on a paddle that is a tactile skin, by touch alone. Needs `mujoco`.

    Action: wanted height of the paddle, [-1, 1] times 50 mm, and its wanted tilt about x and y, [-1, 1] times 10 degrees.
    Observation: `tactile`, the strongest touch since the last step; `paddle`: height, m, tilts, rad, and their
    velocities (6,).
    Reward: 1 for every bounce that has thrown the ball at least 30 mm high. It ends when the ball is lost.

    Parameters
    ----------
    skin : spts.Skin, optional
        Flat, centred on the paddle of 180 mm; default 10 x 10 taxels of 15 mm.
    height : float
        Height that the ball falls from at first, m.
    frame_skip : int
        Steps of 0.1 ms between two actions.
    observe, measurements, decoder, wire
        As of `spts.envs.Tactile`.
    render_mode : str, optional
        "rgb_array": the pressure.
    """

    metadata = {"render_modes": ["rgb_array"], "render_fps": 100}

    def __init__(
        self,
        skin=None,
        height=0.15,
        frame_skip=100,
        observe="samples",
        measurements=None,
        decoder="nn_lmmse",
        wire=None,
        render_mode=None,
    ):
        import mujoco

        from . import mujoco as ours

        if not 0.01 <= height <= 2.0:
            raise ValueError(f"`height` = {height} is outside [0.01, 2] m")
        if not 1 <= frame_skip <= 10_000:
            raise ValueError(f"`frame_skip` = {frame_skip} is outside [1, 10000]")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'`render_mode` = {render_mode}; valid: None, "rgb_array"')
        self.skin = Skin(10, 10, 0.015) if skin is None else skin
        self.render_mode = render_mode
        self._height, self._frame_skip = height, int(frame_skip)
        self._mujoco = mujoco
        self.model = mujoco.MjModel.from_xml_string(_PADDLE)
        self.data = mujoco.MjData(self.model)
        self._touch = ours.attach(
            self.model,
            self.data,
            self.skin,
            site="skin",
            bodies={"ball": Body.sphere(_BALL_M, stiffness=_BALL_PA_PER_M)},
        )
        self._ball = self.model.body("ball").id
        self._tactile = Tactile(self.skin, observe, measurements, decoder, wire)
        most = np.full(6, 1e3)
        self.observation_space = gym.spaces.Dict(
            tactile=self._tactile.space, paddle=gym.spaces.Box(-most, most, dtype=np.float64)
        )
        self.action_space = gym.spaces.Box(-1.0, 1.0, (3,), np.float64)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._mujoco.mj_resetData(self.model, self.data)
        self._tactile.reset(_fresh(self.np_random))
        self._touch.reset()
        away = self.np_random.uniform(-0.02, 0.02, 2)
        self.data.qpos[3:6] = (*away, _BALL_M + self._height)
        self._bounces, self._top, self._up = 0, 0.0, False
        self._shown = self._touch.step()
        self._observed = self._tactile.of(self._shown)
        return self._observation(), self._info()

    def step(self, action):
        action = np.clip(np.asarray(action, np.float64), -1.0, 1.0)
        self.data.ctrl[:] = action * (0.05, np.deg2rad(10), np.deg2rad(10))
        bounces, strongest = self._bounces, -1.0
        for _ in range(self._frame_skip):
            felt = self._touch.step()
            peak = felt.pressure.max()
            if peak > strongest:
                strongest, self._shown = peak, felt
                self._observed = self._tactile.of(felt)
            else:
                self._tactile.feel(felt)
            self._count(felt.area > 0.0)
        height = self.data.xpos[self._ball][2]
        lost = bool(height < -0.2 or np.abs(self.data.xpos[self._ball][:2]).max() > 0.5)
        return self._observation(), float(self._bounces - bounces), lost, False, self._info()

    def _count(self, touched):
        """Counts a bounce when the ball comes down again after it has been high enough."""
        height = self.data.xpos[self._ball][2] - self.data.site_xpos[0][2] - _BALL_M
        if touched:
            if self._up and self._top >= 0.03:
                self._bounces += 1
            self._up, self._top = True, 0.0
        else:
            self._top = max(self._top, height)

    def _observation(self):
        paddle = np.concatenate([self.data.qpos[:3], self.data.qvel[:3]])
        return {"tactile": self._observed, "paddle": np.clip(paddle, -1e3, 1e3)}

    def _info(self):
        return {"bounces": self._bounces, "height": float(self.data.xpos[self._ball][2])}

    def render(self):
        if self.render_mode == "rgb_array":
            from .viz import rgb

            return rgb(self._shown.pressure)
        return None

    def close(self):
        self._touch.detach()


class TactileWrapper(gym.ObservationWrapper):
    """Adds a skin to an environment with a MuJoCo model: what it feels becomes a part of the observation.

    The environment steps as it always does; the skin's forces act in every step of it. Needs `mujoco`.

    Parameters
    ----------
    env : gymnasium.Env
        With `model` and `data` of MuJoCo, as all of gymnasium's and gymnasium-robotics's have.
    skin : spts.Skin
    site, bodies, link_geoms
        As of `spts.mujoco.attach`.
    key : str
        Name of the new part of the observation. Observations that are no dictionaries become `observation`.
    observe, measurements, decoder, wire
        As of `spts.envs.Tactile`.
    """

    def __init__(
        self,
        env,
        skin,
        *,
        site,
        bodies,
        link_geoms=None,
        key="tactile",
        observe="samples",
        measurements=None,
        decoder="nn_lmmse",
        wire=None,
    ):
        from . import mujoco as ours

        super().__init__(env)
        inner = env.unwrapped
        if not (hasattr(inner, "model") and hasattr(inner, "data")):
            raise ValueError(f"`env` = {inner}: it has no `model` and `data` of MuJoCo")
        self.touch = ours.attach(inner.model, inner.data, skin, site=site, bodies=bodies, link_geoms=link_geoms)
        self.touch.hook(self._feel)
        self._tactile, self._key = Tactile(skin, observe, measurements, decoder, wire), key
        spaces = env.observation_space
        own = dict(spaces.spaces) if isinstance(spaces, gym.spaces.Dict) else {"observation": spaces}
        if key in own:
            raise ValueError(f'`key` = "{key}": the environment\'s observation has that already')
        self.observation_space = gym.spaces.Dict({**own, key: self._tactile.space})

    def reset(self, *, seed=None, options=None):
        # what the environment computes while it resets is no touch
        found, info = self.env.reset(seed=seed, options=options)
        self._tactile.reset(_fresh(self.unwrapped.np_random))
        self.touch.reset()
        return self.observation(found), info

    def _feel(self, touch):
        self._tactile.feel(touch)

    def observation(self, observation):
        touch = self.touch.last
        if touch is None:
            # nothing has been felt since the reset
            touch = self.touch.skin.touch({}, dt=0.0)
        parts = observation if isinstance(observation, dict) else {"observation": observation}
        return {**parts, self._key: self._tactile.of(touch)}

    def close(self):
        self.touch.detach()
        super().close()


# The tennis ball of the published experiments, and the stiffness of its surface, Pa/m.
_BALL_M, _BALL_PA_PER_M = 0.0334, 2e7
_PADDLE = f"""
<mujoco>
  <option timestep="0.0001" integrator="implicitfast"/>
  <worldbody>
    <body name="paddle" gravcomp="1">
      <joint name="lift" type="slide" axis="0 0 1" damping="100"/>
      <joint name="tilt_x" type="hinge" axis="1 0 0" damping="0.5"/>
      <joint name="tilt_y" type="hinge" axis="0 1 0" damping="0.5"/>
      <geom type="box" size=".09 .09 .01" pos="0 0 -.01" mass="1"/>
      <site name="skin"/>
    </body>
    <body name="ball" pos="0 0 0.2"><freejoint/><geom type="sphere" size="{_BALL_M}" mass="0.0577"/></body>
  </worldbody>
  <actuator>
    <position joint="lift" kp="2000" ctrlrange="-.05 .05" ctrllimited="true"/>
    <position joint="tilt_x" kp="50" ctrlrange="-.2 .2" ctrllimited="true"/>
    <position joint="tilt_y" kp="50" ctrlrange="-.2 .2" ctrllimited="true"/>
  </actuator>
</mujoco>"""

for _name, _class in (("Press", PressEnv), ("Bounce", BounceEnv)):
    gym.register(f"spts/{_name}-v0", entry_point=f"{__name__}:{_class.__name__}", max_episode_steps=1000)
