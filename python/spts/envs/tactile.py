"""What a skin says, as an observation."""

from __future__ import annotations

import gymnasium as gym
import numpy as np

from .._spts import Body, Wire
from ..decode import DEFAULT, auto, decode, pitch_of

# Measurements of an observation, by default: 20 of 100 taxels, and the same share of other skins.
_SHARE = 0.2
# Pressure that an observation may show at most, kPa; more than any foam bears.
_MOST_KPA = 1e4
# Volts that an observation may show at most: amplifiers have supplies.
_MOST_V = 100.0


class Tactile:
    """What a skin says, as an observation.

    "pressure" and "image" have the same unit and scale, so that a policy for one can be tried with the other. The image is
    decoded in volts and brought to kilopascals by the mean taxel of simulated skins: conductance grows with about the root
    of the pressure and taxels have gains of their own, so that one taxel may be wrong by half, and a force that is summed
    over few taxels by a factor of two.

    Parameters
    ----------
    skin : Skin
    observe : str
        "samples": the M measurements of the one wire, V, (M,); "pressure": mean pressure of the taxels, kPa,
        (rows, cols); "image": what is decoded of M measurements, kPa, (rows, cols).
    measurements : int, optional
        M; default a fifth of the taxels.
    decoder : str
        Decoder of images, one of `spts.decoders.names()`; "auto" takes `spts.auto(skin)`.
    wire : dict, optional
        What `spts.Wire` takes beside the skin and the seed: `readout`, `seeds`, `transducer`, `faults` and so on; for
        "image" no `taxels`, as the image is of all.
    """

    def __init__(self, skin, observe="samples", measurements=None, decoder=DEFAULT, wire=None):
        shape, taxels = skin.shape, skin.shape[0] * skin.shape[1]
        if observe not in ("samples", "pressure", "image"):
            raise ValueError(f'`observe` = "{observe}"; valid: "samples", "pressure", "image"')
        self.skin, self.observe = skin, observe
        self.decoder = auto(skin) if decoder == DEFAULT else decoder
        self.measurements = max(1, round(_SHARE * taxels)) if measurements is None else int(measurements)
        if self.measurements < 1:
            raise ValueError(f"`measurements` = {measurements} is outside [1, 2^27]")
        self._options = dict(wire or {})
        if observe == "samples":
            self.space = gym.spaces.Box(-_MOST_V, _MOST_V, (self.measurements,), np.float64)
        else:
            self.space = gym.spaces.Box(0.0, _MOST_KPA, shape, np.float64)
        if observe == "image":
            if self._options.get("taxels") is not None:
                raise ValueError('`wire["taxels"]`: observe="image" needs all taxels on the wire')
            # what the decoder learns is kept
            decode(np.ones((1, taxels)), np.zeros(1), skin, self.decoder)
            self._gauge = _gauge(skin, self._options)
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
            found = touch.pressure / 1e3
        else:
            found, phi = self._wire.record(touch, self.measurements)
            if self.observe == "image":
                volts, exponent = self._gauge
                image = decode(phi, found, self.skin, self.decoder)
                found = (np.maximum(image, 0.0) / volts) ** exponent
        return np.clip(found, self.space.low, self.space.high)


def _gauge(skin, options):
    """Volts that a taxel under 1 kPa gives alone, and the power of the volts that the pressure grows with.

    Balls press on taxels of four specimens of the skin. A line through the logarithms of conductance and pressure has the
    power, and a line through the samples has the volts of a siemens.
    """
    rng = np.random.default_rng(0)
    places, normals = skin.positions, skin.normals
    radius = 3.0 * pitch_of(places)
    ball = Body.sphere(radius)
    pressures, conductances, samples, sums = [], [], [], []
    for seed in range(4):
        skin.reset()
        wire = Wire(skin, seed=seed, **options)
        idle = wire.conductance
        for depth in rng.uniform(0.1, 0.7, 8) * skin.thickness:
            taxel = rng.integers(len(places))
            place = places[taxel] + normals[taxel] * (radius - depth)
            touch = skin.touch({ball: (place, (1.0, 0.0, 0.0, 0.0))}, dt=0.1)
            y, phi = wire.record(touch, 50)
            more = wire.conductance - idle
            firm = touch.pressure > 0.1 * touch.pressure.max()
            pressures.append(touch.pressure[firm] / 1e3)
            conductances.append(more[firm])
            samples.append(y)
            sums.append(phi @ more.ravel())
    pressures, conductances, samples, sums = (np.concatenate(v) for v in (pressures, conductances, samples, sums))
    felt = conductances > 0.0
    power, log_siemens = np.polyfit(np.log(pressures[felt]), np.log(conductances[felt]), 1)
    return np.exp(log_siemens) * float(samples @ sums / (sums @ sums)), 1.0 / power


def fresh_seed(rng):
    """A seed for everything random of one episode."""
    return rng.integers(0, 2**63)
