"""Gymnasium environments with a tactile skin, and a wrapper that gives one to any environment. Needs `gymnasium`.

`gymnasium.make("spts/Press-v0")` and `"spts/Bounce-v0"` make them too, once `spts.envs` is imported.

Pressures alone are felt: no shear, no slip, no vibration.
"""

from __future__ import annotations

import gymnasium as gym

from .bounce import BounceEnv
from .press import PressEnv
from .tactile import Tactile
from .wrapper import TactileWrapper

__all__ = ["BounceEnv", "PressEnv", "Tactile", "TactileWrapper"]

for _name, _class in (("Press", PressEnv), ("Bounce", BounceEnv)):
    gym.register(f"spts/{_name}-v0", entry_point=f"{__name__}:{_class.__name__}", max_episode_steps=1000)
