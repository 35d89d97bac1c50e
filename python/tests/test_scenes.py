"""Scenes with the physics engine: the MuJoCo 3.17.0 of the checkout, whatever version Python has installed."""

import importlib.metadata
import importlib.util
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest
import spts

LIBRARY = pathlib.Path(__file__).parents[2] / "third_party/mujoco/lib/libmujoco.so.3.17.0"
VERSION = importlib.metadata.version("mujoco") if importlib.util.find_spec("mujoco") else None
pytestmark = pytest.mark.skipif(not LIBRARY.is_file(), reason=f"{LIBRARY} is not there: scripts/setup.sh")
another_version = pytest.mark.skipif(VERSION in (None, "3.17.0"), reason="Python has no other version of MuJoCo")

# prints what the wire of a press says
SCENE = "print(spts.simulate('press/T', set={'seed': 3}).compressive.volts.tobytes().hex()[:4000])\n"
# prints the version of Python's MuJoCo, and where a ball has fallen
BALL = """
model = mujoco.MjModel.from_xml_string(
    '<mujoco><worldbody><geom type="plane" size="1 1 1"/>'
    '<body pos="0 0 .2"><freejoint/><geom size=".1"/></body></worldbody></mujoco>')
data = mujoco.MjData(model)
mujoco.mj_step(model, data, 200)
print(mujoco.mj_versionString(), data.qpos[2])
"""
# what a process loads after it may be called by everybody
GLOBAL = "import os, sys; sys.setdlopenflags(os.RTLD_NOW | os.RTLD_GLOBAL)\n"


@pytest.fixture
def engine(monkeypatch):
    monkeypatch.setenv("SPTS_MUJOCO", str(LIBRARY))


def run(*words, library=None, path=None):
    """Python with these arguments in a process of its own, with `SPTS_MUJOCO` = `library`, or without it."""
    env = {name: value for name, value in os.environ.items() if name != "SPTS_MUJOCO"}
    env |= {} if library is None else {"SPTS_MUJOCO": str(library)}
    env |= {} if path is None else {"PYTHONPATH": str(path)}
    return subprocess.run([sys.executable, *map(str, words)], capture_output=True, text=True, env=env, timeout=300)


@pytest.fixture(scope="module")
def alone():
    """What SCENE prints in a process without Python's MuJoCo, and BALL in one without `spts`."""
    scene, ball = run("-c", "import spts\n" + SCENE, library=LIBRARY), run("-c", "import mujoco" + BALL)
    assert scene.returncode == 0 and len(scene.stdout) > 4000, scene.stderr
    return scene.stdout, ball.stdout


def test_a_press(engine, tmp_path):
    session = spts.simulate("press/T", out=tmp_path / "T", set={"press.force_n": 12, "seed": 3})
    assert (session.object, session.event, session.simulated, session.shape) == ("T", "press", True, (10, 10))
    assert session.compressive.force[0] == pytest.approx(12.0, rel=0.05)
    assert session.compressive.pressure[0].sum() * 0.015**2 == pytest.approx(session.compressive.force[0], rel=1e-3)
    again = spts.simulate("press/T", set={"press.force_n": 12, "seed": 3})
    assert np.array_equal(session.compressive.volts, again.compressive.volts)
    assert spts.load(tmp_path / "T").name == session.name


def test_a_bounce(engine):
    session = spts.simulate("bounce")
    assert session.event == "drop" and session.compressive.force[0] > 20.0


def test_rows_that_move(engine, tmp_path):
    data = spts.dataset.make("drops", tmp_path / "drops", rows=64)
    assert len(data) == 64 and (data["contact_force_n"] >= 0).all()


def test_sessions_are_scored(engine):
    """One, or a list, as from the folder that they are written to."""
    sessions = [spts.simulate("press/T"), spts.simulate("press/tape")]
    board = spts.score("nn_lmmse", sessions, measurements=[20])
    assert {line["object"] for line in board.objects} == {"T", "tape"} and board.of("nn_lmmse", 20)["iou"] > 0.1
    one = spts.score("nn_lmmse", sessions[0], measurements=[20])
    assert {line["object"] for line in one.objects} == {"T"}


def test_errors(engine):
    for text, arguments in [
        ("spoon", ("press/spoon",)),
        ("force_n", ("press/T", None, {"press.force_n": 1e9})),
        ("forec", ("press/T", None, {"press.forec": 1.0})),
        ("none.toml", ("none.toml",)),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.simulate(*arguments)


@another_version
@pytest.mark.parametrize("shared", ["nothing", "mujoco", "all"])
@pytest.mark.parametrize("first", ["spts", "mujoco"])
def test_each_calls_its_own_version(alone, first, shared):
    """Scenes and Python's MuJoCo in one process, in either order: both find what they find alone."""
    scene, ball = "import spts\n" + SCENE, f"import mujoco{BALL}"
    scene, ball = scene if shared != "all" else GLOBAL + scene, ball if shared == "nothing" else GLOBAL + ball
    code, found = (ball + scene + BALL, (1, 0, 1)) if first == "mujoco" else (scene + ball + SCENE, (0, 1, 0))
    done = run("-c", code, library=LIBRARY)
    assert done.returncode == 0, (done.stdout[-300:], done.stderr)
    assert done.stdout == "".join(alone[which] for which in found)


def test_a_package_with_the_library_is_found(alone, tmp_path):
    """As `pip install mujoco==3.17.0` leaves it; the package is not imported."""
    package = tmp_path / "mujoco"
    package.mkdir()
    (package / "__init__.py").write_text("raise RuntimeError('imported')")
    (package / LIBRARY.name).symlink_to(LIBRARY)
    done = run("-c", "import spts\n" + SCENE, path=tmp_path)
    assert done.stdout == alone[0], done.stderr
    done = run("-m", "spts", "simulate", "press/T", "--out", tmp_path / "T", path=tmp_path)
    assert done.returncode == 0 and spts.load(tmp_path / "T").object == "T", done.stderr


def test_the_command(tmp_path):
    done = run("-m", "spts", "simulate", "press/T", "--out", tmp_path / "T", library=LIBRARY)
    assert done.returncode == 0, done.stderr
    session = spts.load(tmp_path / "T")
    assert (session.object, session.simulated) == ("T", True)


@pytest.mark.skipif(VERSION == "3.17.0", reason="Python's MuJoCo is the one that is needed")
def test_what_is_missing_is_said(tmp_path):
    text = tmp_path / LIBRARY.name
    text.write_text("no library")
    installed = [] if VERSION is None else [f"libmujoco.so.{VERSION}"]
    for library, said in [
        (None, ["3.17.0", "SPTS_MUJOCO", *installed]),
        (tmp_path / "gone.so", ["SPTS_MUJOCO", "gone.so"]),
        (text, ["3.17.0", "SPTS_MUJOCO", str(text)]),
    ]:
        done = run("-c", "import spts\n" + SCENE, library=library)
        error = done.stderr.splitlines()[-1]
        assert error.startswith("ImportError") and all(word in error for word in said), done.stderr
        done = run("-m", "spts", "simulate", "press/T", "--out", tmp_path / "T", library=library)
        assert done.returncode != 0 and all(word in done.stderr for word in said), done.stderr
    done = run("-c", f"import spts; spts.dataset.make('drops', {str(tmp_path / 'd')!r}, rows=10)")
    assert "ValueError" in done.stderr and "MuJoCo 3.17.0" in done.stderr


@another_version
def test_another_version_by_name_is_refused():
    (folder,) = importlib.util.find_spec("mujoco").submodule_search_locations
    done = run("-c", "import spts\n" + SCENE, library=f"{folder}/libmujoco.so.{VERSION}")
    assert "ImportError" in done.stderr and VERSION in done.stderr.splitlines()[-1], done.stderr
