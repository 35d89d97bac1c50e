"""Sessions, scores and data sets."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import spts
import spts.decoders
from sklearn.linear_model import Ridge

SPTS = [sys.executable, "-m", "spts"]
SMALL = {"rows_per_shard": 100}


@pytest.fixture(scope="module")
def data(tmp_path_factory):
    return spts.dataset.make("random-shapes", tmp_path_factory.mktemp("data") / "shapes", rows=1500, set=SMALL)


def test_the_bytes_of_a_data_set_are_those_of_the_command(data, tmp_path):
    """Made by threads, and by the command line in one go."""
    words = [
        "dataset",
        "make",
        "random-shapes",
        "--rows",
        "1500",
        "--set",
        "rows_per_shard=100",
        "--out",
        str(tmp_path / "b"),
        "--json",
    ]
    made = json.loads(subprocess.run([*SPTS, *words], check=True, capture_output=True, text=True).stdout)
    assert data.info["digest"] == made["finished"]["digest"]
    assert (data.info["rows"], data.info["made"], len(data)) == (1500, 15, 1500)


def test_columns(data):
    names = {column["name"] for column in data.columns}
    assert {"pressure_pa", "y_v", "object", "split"} <= names
    found = data.read(["pressure_pa", "contact_force_n", "object", "index"], rows=(150, 350))
    assert found["pressure_pa"].shape == (200, 100) and found["object"].dtype.kind == "U"
    assert np.array_equal(found["index"], np.arange(150, 350))
    # what the pressure adds up to
    assert np.allclose(found["pressure_pa"].sum(axis=1) * 0.015**2, found["contact_force_n"], rtol=1e-4)
    with pytest.raises(ValueError, match="colour"):
        data.read(["colour"])
    for rows in ((0, 2000), (-1, 5), (5, 4)):
        with pytest.raises(ValueError, match="rows"):
            data.read(["index"], rows=rows)


def test_labelled_rows_fit_together(data):
    """Without the output of the untouched skin, y is Φ times the conductance, to the noise."""
    phi, y, images, names, presses = data.labelled("train")
    assert (
        phi.shape == (len(y), y.shape[1], 100)
        and images.shape == (len(y), 100)
        and len(names) == len(presses) == len(y)
    )
    sums = np.einsum("nmk,nk->nm", phi, images)
    assert np.corrcoef(sums.ravel(), y.ravel())[0, 1] > 0.95
    assert abs(np.median(y[np.abs(sums) < 0.01 * np.abs(sums).max()])) < 0.1 * np.abs(y).max()


def test_scores_on_a_data_set(data):
    board = spts.score(["nn_lmmse", Ridge(1.0), spts.decoders.Omp()], data, measurements=[7, 20])
    line = board.of("nn_lmmse", 20)
    assert line["iou"] > board.of("nn_lmmse", 7)["iou"] and line["iou_ci"][0] < line["iou"] < line["iou_ci"][1]
    assert line["iou"] > board.of("Ridge", 20)["iou"]
    assert "nn_lmmse" in repr(board) and board.objects
    with pytest.raises(ValueError, match="measurements"):
        spts.score("omp", data, measurements=[500])
    with pytest.raises(ValueError, match="split"):
        spts.score("omp", data, split="all")


@pytest.fixture(scope="module")
def sessions(tmp_path_factory):
    """Two objects of a virtual device, both modes."""
    folder = tmp_path_factory.mktemp("sessions")
    for name in ("T", "rec"):
        for mode, blocks in (("raster", "16"), ("binary", "16")):
            device = subprocess.Popen(
                [*SPTS, "device", "--pty", "--fast", "--mode", mode, "--object", name, "--blocks", blocks],
                stdout=subprocess.PIPE,
                text=True,
            )
            port = device.stdout.readline().strip()
            words = [
                "--object",
                name,
                "--mode",
                mode,
                "--blocks",
                blocks,
                "--conditioning",
                "2",
                "--out",
                str(folder / name),
            ]
            subprocess.run([*SPTS, "record", "--port", port, *words], check=True, capture_output=True)
            device.kill(), device.wait()
    return folder


def test_loaded_sessions(sessions):
    found = {session.name: session for session in spts.load_all(sessions)}
    assert spts.load(sessions / "T").name == "T"
    assert set(found) == {"T", "rec"}
    recording = found["T"].compressive
    assert len(recording) == 16 and recording.conditioning == 2 and recording.sample_rate == 64_300
    assert recording.volts.shape == (16, 100_000)
    phi, y = recording.windows(3, 20, count=4)
    first = round(found["T"].hold[0] * recording.sample_rate)
    assert np.array_equal(phi.reshape(80, 100), recording.phi(3, first, 80))
    assert np.allclose(y.ravel(), recording.volts[3, first : first + 80] - recording.idle[3])
    assert recording.pressure is None and np.isnan(recording.force).all()
    for text, call in [
        ("block", lambda: recording.windows(99, 20)),
        ("start", lambda: recording.windows(0, 20, start=-1.0)),
        ("start", lambda: recording.windows(0, 20, start=1e6)),
        ("measurements", lambda: recording.windows(0, 0)),
        ("nothing", lambda: spts.load(sessions / "nothing")),
        ("load_all", lambda: spts.load(sessions)),
    ]:
        with pytest.raises(ValueError, match=text):
            call()


class Threshold:
    """Somebody's decoder, of no library: the back-projection."""

    def predict(self, X):
        phi, y = X[:, 20:].reshape(len(X), 20, 100), X[:, :20]
        return np.maximum(np.einsum("nmk,nm->nk", phi, y), 0)


class Fitted(Threshold):
    """Has `fit`, and is none of scikit-learn's: it is taken as it is."""

    def fit(self, X, images):
        raise RuntimeError("fitted again")


def test_scores_on_sessions(sessions):
    """Own decoders, a fitted and an unfitted estimator, a classifier, and an object with nothing but `predict`."""
    fitted = spts.decoders.NnLmmse().fit()
    named = {"fitted": fitted, "ridge": Ridge(1.0), "evidence": spts.decoders.Evidence()}
    named |= {"mine": Threshold(), "own": Fitted()}
    board = spts.score(named, sessions, measurements=[20])
    assert {row["decoder"] for row in board.rows} == set(named)
    assert board.of("fitted", 20)["iou"] > board.of("mine", 20)["iou"] == board.of("own", 20)["iou"] > 0
    # two objects: which of them is a coin's toss for who knows nothing
    assert board.of("evidence", 20)["class_single"] > 0.9
    own = spts.score("nn_lmmse", sessions, measurements=[20])
    by_command = subprocess.run(
        [
            *SPTS,
            "score",
            str(sessions),
            "--decoder",
            "nn_lmmse",
            "--measurements",
            "20",
            "--no-times",
            "--json",
            "--out",
            str(sessions.parent / "board"),
        ],
        check=True,
        capture_output=True,
        text=True,
    )
    assert own.rows == json.loads(by_command.stdout)["rows"]


class Entrant:
    """A class as `spts bench` runs it: the ridge of docs/my_decoder.md."""

    def fit(self, train):
        assert train.images.shape == (len(train.labels), train.rows * train.cols) and train.measurements == [20]
        self.c = train.images.T @ train.images / len(train.images)

    def predict(self, phi, y):
        s = phi @ self.c @ phi.T
        s += 0.02 * np.trace(s) / len(y) * np.eye(len(y))
        return np.maximum(self.c @ phi.T @ np.linalg.solve(s, y), 0).reshape(10, 10)


class Named(Entrant):
    def predict(self, phi, y):
        return super().predict(phi, y), "T"


class Projected:
    """Learns nothing."""

    def predict(self, rows, samples):
        return np.maximum(rows.T @ samples, 0)


def test_entrants_of_the_benchmark(sessions, data):
    named = {"entrant": Entrant(), "named": Named(), "projected": Projected()}
    board = spts.score({**named, "mine": Threshold()}, sessions, measurements=[20])
    assert board.of("entrant", 20)["iou"] == board.of("named", 20)["iou"] > board.of("projected", 20)["iou"]
    assert board.of("projected", 20)["iou"] == pytest.approx(board.of("mine", 20)["iou"])
    # without a name, the class is that of the image that is most like it
    assert board.of("entrant", 20)["class_single"] > board.of("named", 20)["class_single"] == 0.5
    board = spts.score(named, data, measurements=[20])
    assert board.of("entrant", 20)["iou"] > board.of("projected", 20)["iou"]
    assert board.of("named", 20)["class_single"] == 0.0 and board.of("projected", 20)["learned_from"] == "given"
    # they stay as they were
    assert not vars(named["entrant"])


def test_sessions_in_place_of_their_folder(sessions):
    found = spts.load_all(sessions)
    board = spts.score("nn_lmmse", found, measurements=[20])
    assert board.rows == spts.score("nn_lmmse", sessions, measurements=[20]).rows
    assert {line["object"] for line in spts.score("omp", found[0], measurements=[20]).objects} == {found[0].object}
    for kind, given in ((ValueError, []), (TypeError, [1]), (TypeError, 5)):
        with pytest.raises(kind, match="data"):
            spts.score("omp", given)


def test_an_object_with_predict_needs_no_scikit_learn(sessions):
    code = f"""
import sys
sys.modules["sklearn"] = None
import numpy as np, spts
class Given:
    def predict(self, X):
        return X[:, 20:120]
class Entrant:
    def fit(self, train):
        self.mean = train.images.mean(axis=0)
    def predict(self, phi, y):
        return self.mean
spts.score([Given(), Entrant()], {str(sessions)!r}, measurements=[20])
"""
    subprocess.run([sys.executable, "-c", code], check=True)


def test_an_estimator_that_fails_is_said(sessions):
    class Broken:
        def predict(self, X):
            return np.full((len(X), 100), np.nan)

    class Short:
        def predict(self, X):
            return np.zeros((len(X), 7))

    class Raises:
        def predict(self, X):
            raise RuntimeError("out of luck")

    for text, one in (("not finite", Broken()), ("shape", Short()), ("out of luck", Raises())):
        with pytest.raises(ValueError, match=text):
            spts.score(one, sessions, measurements=[20])
    for text, arguments in [
        ("estimator", {"estimator": "best"}),
        ("predict", {"estimator": object()}),
        ("class Short", {"estimator": Short}),
        ("names", {"estimator": ["omp", "omp"]}),
        ("learn_from", {"learn_from": "friends"}),
        ("measurements", {"measurements": [0]}),
        ("spoon", {"objects": ["spoon"]}),
    ]:
        with pytest.raises(ValueError, match=text):
            spts.score(arguments.pop("estimator", "omp"), sessions, **arguments)


def test_making_can_be_interrupted(tmp_path):
    """Ctrl-C ends it with KeyboardInterrupt, and the same call goes on: the digest is that of one go."""
    call = f"import spts; spts.dataset.make('random-shapes', {str(tmp_path / 'a')!r}, rows=12000, set={{'rows_per_shard': 100}}, workers=1)"
    run = subprocess.Popen([sys.executable, "-c", call], stderr=subprocess.PIPE, text=True)
    while not list(tmp_path.glob("a/data/*.parquet")):
        time.sleep(0.01)
    run.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in run.communicate(timeout=60)[1] and run.returncode != 0
    made = len(list(tmp_path.glob("a/data/*.parquet")))
    assert 0 < made < 120
    data = spts.dataset.make("random-shapes", tmp_path / "a", rows=12000, set={"rows_per_shard": 100})
    assert data.info["made"] == 120


def test_specs_and_refusals(tmp_path):
    assert "random-shapes" in spts.dataset.specs()
    for text, call in [
        ("spec", lambda: spts.dataset.make("no-such-spec", tmp_path / "x")),
        ("engine", lambda: spts.dataset.make("random-shapes", tmp_path / "x", rows=100, engine="magic")),
        ("workers", lambda: spts.dataset.make("random-shapes", tmp_path / "y", rows=100, workers=0)),
        ("colour", lambda: spts.dataset.make("random-shapes", tmp_path / "z", set={"colour": 1})),
        ("dataset.json", lambda: spts.Dataset(tmp_path / "nothing")),
    ]:
        with pytest.raises(ValueError, match=text):
            call()
    assert os.listdir(tmp_path)


def test_ray_makes_the_same_bytes(data, tmp_path):
    pytest.importorskip("ray")
    again = spts.dataset.make("random-shapes", tmp_path / "ray", rows=1500, set=SMALL, engine="ray", workers=2)
    assert again.info["digest"] == data.info["digest"]
