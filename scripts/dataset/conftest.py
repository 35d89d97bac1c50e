"""Options and data sets of the tests: `python -m pytest scripts/dataset`, see README.md beside this file."""

import json
import os
import pathlib
import shutil
import subprocess
import tempfile

import pytest

ROOT = pathlib.Path(__file__).parents[2]

# `datasets` must neither ask a server nor leave files in the user's own cache; it reads this when it is imported
CACHE = tempfile.mkdtemp(prefix="spts-readers-")
os.environ.update(HF_HOME=CACHE, HF_HUB_OFFLINE="1", HF_DATASETS_OFFLINE="1", HF_DATASETS_DISABLE_PROGRESS_BARS="1")

# One to three objects, so that columns of the second and third are null in places; two windows a press; all splits.
SEVERAL = """\
name = "several"
rows = 600
seed = 1

[object]
from = "shapes"
rows_per_shape = 20
count = { choice = [1, 2, 3] }

[pose]
x_share = { uniform = [-0.4, 0.4] }
y_share = { uniform = [-0.4, 0.4] }
rotation_deg = { uniform = [-180.0, 180.0] }

[press]
force_n = { log_uniform = [5.0, 40.0] }

[record]
windows = 2
phi = true
"""


def pytest_addoption(parser):
    parser.addoption("--spts", type=pathlib.Path, default=ROOT / "target/release/spts", help="the program")
    parser.addoption("--kills", type=int, default=10, help="how often the run of test_workers.py is ended with SIGKILL")


def pytest_unconfigure():
    shutil.rmtree(CACHE, ignore_errors=True)


class Program:
    """The `spts` program, and the data sets that it makes."""

    def __init__(self, path, folder):
        self.path = path.resolve()
        self.folder = folder

    def call(self, *arguments, environment=None):
        """Runs the program to its end; its standard output."""
        done = subprocess.run(
            [self.path, *map(str, arguments)], capture_output=True, text=True, env=os.environ | (environment or {})
        )
        assert done.returncode == 0, f"spts {' '.join(map(str, arguments))}: {done.stderr}"
        return done.stdout

    def json(self, *arguments, environment=None):
        """Runs the program with `--json`; what it prints, parsed."""
        return json.loads(self.call(*arguments, "--json", environment=environment))

    def spec(self, name, text):
        """A file with the spec `text`."""
        path = self.folder / f"{name}.toml"
        path.write_text(text)
        return path

    def make(self, name, spec, *options):
        """Makes the data set of `spec` in a folder of this `name`."""
        out = self.folder / name
        self.call("dataset", "make", spec, "--out", out, *options)
        return Made(self, out)


class Made:
    """A data set that has been made."""

    def __init__(self, program, folder):
        self.folder = folder
        self.name = folder.name
        # the data set's own copy of the spec, so that what `make` was told on its command line counts
        self.schema = program.json("dataset", "schema", folder / "spec.toml")
        self.info = program.json("dataset", "info", folder)


@pytest.fixture(scope="session")
def program(request, tmp_path_factory):
    path = request.config.getoption("--spts")
    assert path.is_file(), f"{path}: not there; build it with `cargo build --release --workspace` or say --spts PATH"
    return Program(path, tmp_path_factory.mktemp("data"))


@pytest.fixture(scope="session")
def shapes(program):
    """The spec `random-shapes`, 400 rows."""
    return program.make("random-shapes", "random-shapes", "--rows", 400)


@pytest.fixture(scope="session")
def several(program):
    """One to three objects, with Φ."""
    return program.make("several", program.spec("several", SEVERAL))


@pytest.fixture(scope="session")
def codes(program):
    """The rows of `several` with codes of the converter in place of volts."""
    return program.make("codes", program.spec("codes", SEVERAL + "codes = true\n"))


@pytest.fixture(scope="session")
def ideal(program):
    """The rows of `several` through a readout without effects."""
    return program.make("ideal", program.spec("ideal", 'readout = "ideal"\n' + SEVERAL))


@pytest.fixture(scope="session")
def made(request):
    """The data set whose name a test was given."""
    return request.getfixturevalue(request.param)
