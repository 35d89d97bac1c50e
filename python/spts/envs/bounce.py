"""Bouncing a ball on a skin by touch. Needs `mujoco`."""

from __future__ import annotations

import copy

import gymnasium as gym
import numpy as np

from .._spts import Body, Skin
from ..decode import DEFAULT
from .tactile import Tactile, fresh_seed

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


class BounceEnv(gym.Env):
    """Keep a tennis ball bouncing on a paddle that is a tactile skin, by touch alone. Needs `mujoco`.

    Action: wanted height of the paddle, [-1, 1] times 50 mm, and its wanted tilt about x and y, [-1, 1] times 10 degrees.
    Observation: `tactile`, the strongest touch since the last step; `paddle`: height, m, tilts, rad, and their
    velocities (6,).
    Reward: 1 for every bounce that has thrown the ball at least 30 mm high. It ends when the ball is lost.

    Parameters
    ----------
    skin : spts.Skin, optional
        Flat, centred on the paddle of 180 mm; default 10 x 10 taxels of 15 mm. A copy of it is used.
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
        decoder=DEFAULT,
        wire=None,
        render_mode=None,
    ):
        import mujoco

        if not 0.01 <= height <= 2.0:
            raise ValueError(f"`height` = {height} is outside [0.01, 2] m")
        if not 1 <= frame_skip <= 10_000:
            raise ValueError(f"`frame_skip` = {frame_skip} is outside [1, 10000]")
        if render_mode not in (None, "rgb_array"):
            raise ValueError(f'`render_mode` = {render_mode}; valid: None, "rgb_array"')
        # of its own: the environments of a vector are given one
        self.skin = Skin(10, 10, 0.015) if skin is None else copy.deepcopy(skin)
        self.render_mode = render_mode
        self._height, self._frame_skip = height, int(frame_skip)
        self.model = mujoco.MjModel.from_xml_string(_PADDLE)
        self.data = mujoco.MjData(self.model)
        self._attach()
        self._ball = self.model.body("ball").id
        self._tactile = Tactile(self.skin, observe, measurements, decoder, wire)
        most = np.full(6, 1e3)
        self.observation_space = gym.spaces.Dict(
            tactile=self._tactile.space, paddle=gym.spaces.Box(-most, most, dtype=np.float64)
        )
        self.action_space = gym.spaces.Box(-1.0, 1.0, (3,), np.float64)

    def _attach(self):
        from .. import mujoco as ours

        ball = Body.sphere(_BALL_M, stiffness=_BALL_PA_PER_M)
        self._touch = ours.attach(self.model, self.data, self.skin, site="skin", bodies={"ball": ball}, mode="foam")

    def __getstate__(self):
        # a copy attaches the copied skin to its own data
        return {name: value for name, value in vars(self).items() if name != "_touch"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._attach()

    def reset(self, *, seed=None, options=None):
        import mujoco

        super().reset(seed=seed)
        mujoco.mj_resetData(self.model, self.data)
        self._tactile.reset(fresh_seed(self.np_random))
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
            from ..viz import rgb

            return rgb(self._shown.pressure)
        return None

    def close(self):
        self._touch.detach()
