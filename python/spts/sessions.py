"""Sessions: recordings of one object or event, of the real skin or of the twin."""

from __future__ import annotations

import os

from . import _spts


def load(path):
    """The session in a folder, as `spts simulate`, `spts record` and `spts.simulate` leave one.

    Parameters
    ----------
    path : str or os.PathLike

    Returns
    -------
    Session

    Raises
    ------
    ValueError
        When there is none, when a file of it is damaged, and when there are several: `load_all` opens those.
    """
    found = load_all(path)
    if len(found) > 1:
        names = ", ".join(session.name for session in found)
        raise ValueError(
            f"`path` = {os.fspath(path)} holds {len(found)} sessions ({names}); `spts.load_all` opens them"
        )
    return found[0]


def load_all(path):
    """All sessions in a folder: a session, a folder of sessions, or the published recordings.

    Parameters
    ----------
    path : str or os.PathLike

    Returns
    -------
    list of Session
    """
    return _spts.load(os.fspath(path))
