"""Scenes of the twin: the UR5 that presses an object, and the bouncing ball. Needs `pip install spts-twin[scenes]`."""

from __future__ import annotations

import importlib.util
import os
import tempfile
import warnings

from . import _spts
from .sessions import load

__all__ = ["simulate"]

# the library of PyPI's mujoco, which need not be imported for it
try:
    _mujoco = importlib.util.find_spec("mujoco")
except ValueError:  # a module that stands in for it
    _mujoco = None
for _folder in (_mujoco and _mujoco.submodule_search_locations) or []:
    _spts.look_in(_folder)


def simulate(scene, out=None, set=None):
    """Simulates a scene and records it in both modes. Ctrl-C stops it after the press under way.

    Parameters
    ----------
    scene : str or os.PathLike
        "press/NAME" with one of the 17 objects, "press" with a mesh (`set={"press.mesh": "cup.stl"}`), "bounce", "arm"
        (a finger on a bent skin under preload), or a file that ends in .toml.
    out : str or os.PathLike, optional
        Folder of the session; default none is kept.
    set : dict, optional
        Fields of the scene by their dotted names: `{"press.force_n": 12, "readout": "ideal"}`.

    Returns
    -------
    Session

    Raises
    ------
    ValueError
        For what is no scene, with field, value and what is valid.
    ImportError
        Without MuJoCo 3.17.0, which may lie beside another version that Python imports: `SPTS_MUJOCO` names its file.
    """
    _spts.open_mujoco()
    with tempfile.TemporaryDirectory() as folder:
        kept = os.path.join(folder, "session") if out is None else os.fspath(out)
        for note in _spts.simulate(os.fspath(scene), dict(set or {}), kept):
            warnings.warn(note, stacklevel=2)
        return load(kept)
