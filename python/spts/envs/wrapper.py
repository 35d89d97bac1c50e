"""A skin for any environment with a MuJoCo model. Needs `mujoco`."""

from __future__ import annotations

import copy

import gymnasium as gym
import numpy as np

from ..decode import DEFAULT
from .tactile import Tactile, fresh_seed


class TactileWrapper(gym.ObservationWrapper, gym.utils.RecordConstructorArgs):
    """Adds a skin to an environment with a MuJoCo model: what it feels becomes a part of the observation.

    The environment steps as it always does. In mode "sense" nothing of it changes, its random numbers included; in mode
    "foam" the skin's forces act in every step of it. An environment may have several skins: wrap it again, with another
    `key`. The seed of `reset` is that of the skin's random numbers, too. Needs `mujoco`.

    Parameters
    ----------
    env : gymnasium.Env
        With `model` and `data` of MuJoCo, as all of gymnasium's and gymnasium-robotics's have.
    skin : spts.Skin
        A copy of it is used: `touch.skin`.
    site, body, pos, quat, bodies, link_geoms, mode
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
        key="tactile",
        observe="samples",
        measurements=None,
        decoder=DEFAULT,
        wire=None,
        **place,
    ):
        tactile = {"observe": observe, "measurements": measurements, "decoder": decoder, "wire": wire}
        gym.utils.RecordConstructorArgs.__init__(self, skin=skin, key=key, **place, **tactile)
        gym.ObservationWrapper.__init__(self, env)
        inner = env.unwrapped
        if not (hasattr(inner, "model") and hasattr(inner, "data")):
            raise ValueError(f"`env` = {inner}: it has no `model` and `data` of MuJoCo")
        spaces = env.observation_space
        own = dict(spaces.spaces) if isinstance(spaces, gym.spaces.Dict) else {"observation": spaces}
        if key in own:
            raise ValueError(f'`key` = "{key}": the environment\'s observation has that already')
        self._tactile, self._key, self._resets = Tactile(copy.deepcopy(skin), **tactile), key, False
        self._rng = np.random.default_rng()
        self.observation_space = gym.spaces.Dict({**own, key: self._tactile.space})
        self._place = place
        self._attach()

    def _attach(self):
        """Puts the skin on the environment's model as it is now."""
        from .. import mujoco as ours

        inner = self.unwrapped
        self.touch = ours.attach(inner.model, inner.data, self._tactile.skin, **self._place)
        self.touch.hook(self._feel if self.touch.mode == "foam" else None)

    def __getstate__(self):
        import mujoco

        # a copy attaches the copied skin to the data of the copied environment, which may be one that begins anew
        inner, touch = self.env.unwrapped, vars(self.touch)
        physics = np.empty(mujoco.mj_stateSize(inner.model, mujoco.mjtState.mjSTATE_INTEGRATION))
        mujoco.mj_getState(inner.model, inner.data, physics, mujoco.mjtState.mjSTATE_INTEGRATION)
        felt = {name: touch[name] for name in ("_last", "_felt_at") if name in touch}
        return {**vars(self), "touch": felt, "_moment": (physics, inner.np_random)}

    def __setstate__(self, state):
        import mujoco

        state = dict(state)
        felt, (physics, rng) = state.pop("touch"), state.pop("_moment")
        self.__dict__.update(state)
        inner, everything = self.env.unwrapped, mujoco.mjtState.mjSTATE_INTEGRATION
        found = np.empty_like(physics)
        mujoco.mj_getState(inner.model, inner.data, found, everything)
        if not np.array_equal(found, physics):
            mujoco.mj_setState(inner.model, inner.data, physics, everything)
            mujoco.mj_forward(inner.model, inner.data)
            mujoco.mj_setState(inner.model, inner.data, physics, everything)
            inner.np_random = rng
        self._attach()
        vars(self.touch).update(felt)

    def reset(self, *, seed=None, options=None):
        # what the environment computes while it resets is no touch
        self._resets = True
        try:
            found, info = self.env.reset(seed=seed, options=options)
        finally:
            self._resets = False
        if seed is not None:
            # other numbers for every skin of the environment
            self._rng = np.random.default_rng([seed, *self._key.encode()])
        self._tactile.reset(fresh_seed(self._rng))
        inner = self.unwrapped
        if inner.model is not self.touch.model or inner.data is not self.touch.data:
            # the environment has made others
            self.touch.detach()
            self._attach()
        self.touch.reset()
        return self.observation(found), info

    def _feel(self, touch):
        if not self._resets:
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
