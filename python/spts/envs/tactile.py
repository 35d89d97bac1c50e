"""What a skin says, as an observation."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from .._spts import Wire
from ..decode import decode

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


def fresh_seed(rng):
    """A seed for everything random of one episode."""
    return rng.integers(0, 2**63)
