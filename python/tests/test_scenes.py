"""Scenes with the physics engine. Run where MuJoCo 3.17.0 is installed; elsewhere it is said that it is needed."""

import importlib.metadata
import importlib.util
import subprocess
import sys

import numpy as np
import pytest
import spts

VERSION = importlib.metadata.version("mujoco") if importlib.util.find_spec("mujoco") else None
with_engine = pytest.mark.skipif(VERSION != "3.17.0", reason="MuJoCo 3.17.0 is not installed")


@pytest.mark.skipif(VERSION == "3.17.0", reason="MuJoCo 3.17.0 is installed")
def test_what_is_missing_is_said():
    with pytest.raises(ImportError, match="3.17.0"):
        spts.simulate("press/T")


@with_engine
def test_a_press(tmp_path):
    session = spts.simulate("press/T", out=tmp_path / "T", set={"press.force_n": 12, "seed": 3})
    assert (session.object, session.event, session.simulated, session.shape) == ("T", "press", True, (10, 10))
    assert session.compressive.force[0] == pytest.approx(12.0, rel=0.05)
    assert session.compressive.pressure[0].sum() * 0.015**2 == pytest.approx(session.compressive.force[0], rel=1e-3)
    again = spts.simulate("press/T", set={"press.force_n": 12, "seed": 3})
    assert np.array_equal(session.compressive.volts, again.compressive.volts)
    assert spts.load(tmp_path / "T").name == session.name


@with_engine
def test_a_bounce():
    session = spts.simulate("bounce")
    assert session.event == "drop" and session.compressive.force[0] > 20.0


@with_engine
def test_rows_that_move(tmp_path):
    data = spts.dataset.make("drops", tmp_path / "drops", rows=64)
    assert len(data) == 64 and (data["contact_force_n"] >= 0).all()


@with_engine
def test_errors():
    for text, arguments in [
        ("spoon", ("press/spoon",)),
        ("force_n", ("press/T", None, {"press.force_n": 1e9})),
        ("forec", ("press/T", None, {"press.forec": 1.0})),
        ("none.toml", ("none.toml",)),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.simulate(*arguments)


@with_engine
@pytest.mark.parametrize("first", ["mujoco, spts._scenes", "spts._scenes, mujoco"])
def test_one_library_whoever_comes_first(first):
    """MuJoCo's library is loaded once: the extension's is that of PyPI's package."""
    call = f"import {first}; spts.simulate('press/T'); print(sum('libmujoco' in line and 'r-xp' in line for line in open('/proc/self/maps')))"
    call = call.replace("spts.simulate", "__import__('spts').simulate")
    done = subprocess.run([sys.executable, "-c", call], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "1"
