"""The single-pixel tactile skin, simulated: pressures, wrenches, and the samples of its one wire.

Poses and velocities of bodies go in; what the taxels feel, and what the one wire says of them, comes out::

    import spts

    skin = spts.Skin(rows=10, cols=10, pitch=0.015)
    ball = spts.Body.sphere(radius=0.03)
    wire = spts.Wire(skin, readout="as_built", seeds="mixed", seed=1)
    touch = skin.touch({ball: ((0, 0, 0.029), (1, 0, 0, 0))}, dt=0.1)
    y, phi = wire.record(touch, 20)
    image = spts.decode(phi, y, skin)

Lengths are in metres, pressures in pascals, forces in newtons, times in seconds.
"""

from . import dataset
from ._spts import Body, Recording, Session, Skin, Touch, Wire
from .dataset import Dataset
from .decode import auto, decode, prior, windows
from .metrics import iou, support_accuracy
from .scenes import simulate
from .scores import Scores, score
from .sessions import load, load_all

__all__ = [
    "Body",
    "Dataset",
    "Recording",
    "Scores",
    "Session",
    "Skin",
    "Touch",
    "Wire",
    "auto",
    "dataset",
    "decode",
    "iou",
    "load",
    "load_all",
    "prior",
    "score",
    "simulate",
    "support_accuracy",
    "windows",
]
__version__ = "0.2.0"
