"""Scenes of the twin: the UR5 that presses an object, and the bouncing ball. Needs `pip install spts-twin[scenes]`."""

from __future__ import annotations

import importlib.util
import os
import tempfile
import warnings

from .sessions import load

__all__ = ["simulate"]


def engine():
    """The part of the package that shares MuJoCo's library.

    Raises
    ------
    ImportError
        When MuJoCo's package is missing, or is of another version than this one was built for.
    """
    if importlib.util.find_spec("mujoco") is None:
        raise ImportError("scenes need MuJoCo 3.17.0: pip install 'spts-twin[scenes]'")
    try:
        from . import _scenes
    except ImportError as error:
        raise ImportError(
            f"scenes need the MuJoCo that they were built with, 3.17.0: pip install 'spts-twin[scenes]' ({error})"
        ) from None
    return _scenes


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
        Without MuJoCo 3.17.0.
    """
    run = engine().simulate
    with tempfile.TemporaryDirectory() as folder:
        kept = os.path.join(folder, "session") if out is None else os.fspath(out)
        for note in run(os.fspath(scene), dict(set or {}), kept):
            warnings.warn(note, stacklevel=2)
        return load(kept)
