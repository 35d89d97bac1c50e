"""Pressing an object on a skin by touch."""

from __future__ import annotations

import copy

import gymnasium as gym
import numpy as np

from .._spts import Body, Skin
from ..decode import DEFAULT
from .tactile import Tactile, fresh_seed


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
        Flat; default 10 x 10 taxels of 15 mm. A copy of it is used.
    force : (float, float)
        Range of the wanted force, N.
    speed : float
        Largest speed along each axis, m/s.
    dt : float
        Time of a step, s.
    observe, measurements, decoder, wire
        As of `spts.envs.Tactile`.
    render_mode : str, optional
        "rgb_array": the pressure.
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
        decoder=DEFAULT,
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
        # of its own: the environments of a vector are given one
        self.skin = Skin(10, 10, 0.015) if skin is None else copy.deepcopy(skin)
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
        self._tactile.reset(fresh_seed(self.np_random))
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
            from ..viz import rgb

            return rgb(self.last.pressure)
        return None
