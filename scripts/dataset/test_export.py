"""Exports of data sets: LeRobot against its published layout, with pyarrow alone, and tar files, read by `webdataset`.

`check(folder)` takes any folder for LeRobot, of ours or of another program: `python scripts/dataset/test_export.py FOLDER`.
"""

import importlib.util
import json
import math
import os
import pathlib
import shutil
import signal
import subprocess
import sys
import time

import numpy as np
import pyarrow
import pyarrow.compute
import pyarrow.parquet
import pytest

VERSION = "v3.0"
DATA_PATH = "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
EPISODES_PATH = "meta/episodes/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
# columns of every data file beside the features that the author chose
FRAME_COLUMNS = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}
# columns of an episode, without its statistics and where it is itself
EPISODE_COLUMNS = ["episode_index", "tasks", "length", "data/chunk_index", "data/file_index", "dataset_from_index", "dataset_to_index"]
# LeRobot itself writes Snappy and reads whatever pyarrow does; these two are in every pyarrow
CODECS = {"SNAPPY", "ZSTD"}
# LeRobot refuses times that are farther than this from frame / fps, s
TIME_TOLERANCE_S = 1e-4
# Of the largest value: extremes may have been rounded to float32; means and deviations may have been summed in it, over
# up to 10^4 frames.
TOLERANCE = {"min": 2.0**-24, "max": 2.0**-24, "mean": 1e4 * 2.0**-24, "std": 1e4 * 2.0**-24, "count": 0.0}
STATISTICS = list(TOLERANCE)
# the quantiles that are there are those of all frames, on a straight line between two of them
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}

EXPORT = pathlib.Path(__file__).parents[2] / "python/spts/export.py"

COURSES = """\
name = "courses"
rows = 240
seed = 2

[object]
from = "objects"

[pose]
about = "placement"

[record]
what = "course"
windows = 30
interval_s = 0.02

[split]
by = "press"
validation = 0.3
test = 0.3
"""
# Presses of three windows, the last one of two, on a sheet that is not square, in five files; all splits have some.
PRESSES = """\
name = "presses"
rows = 89
rows_per_shard = 21
seed = 5
[split]
by = "press"
validation = 0.25
test = 0.25
[object]
rows_per_shape = 9
count = { choice = [1, 2] }
[pose]
x_share = { uniform = [-0.2, 0.2] }
rotation_deg = { uniform = [0.0, 90.0] }
[press]
force_n = { log_uniform = [5.0, 40.0] }
[skin]
rows = 8
cols = 12
rows_per_skin = 21
[record]
windows = 3
interval_s = 0.02
measurements = 7
"""
CODES = PRESSES.replace('"presses"', '"presses-codes"').replace("rows = 89", "rows = 42") + "raster = false\nphi = true\ncodes = true\n"


def plain(field, name):
    """The dtype, shape and names of a feature."""
    assert set(field) >= {"dtype", "shape", "names"}, f"{name}: needs dtype, shape and names"
    shape = field["shape"]
    assert shape and all(isinstance(n, int) and n > 0 for n in shape), f"{name}: shape {shape}"
    names = field["names"]
    if names is not None:
        assert len(names) == (shape[0] if len(shape) == 1 else len(shape)), f"{name}: {len(names)} names for shape {shape}"
        assert len(set(names)) == len(names), f"{name}: a name comes twice"
    return field["dtype"], shape


def arrow_type_is(found, dtype, shape, name):
    """One value, a fixed-size list, or lists of lists, by the number of dimensions."""
    value = pyarrow.string() if dtype == "string" else pyarrow.from_numpy_dtype(np.dtype(dtype))
    if shape == [1]:
        assert found == value, f"{name}: {found}, not {value}"
        return
    if len(shape) == 1:
        assert pyarrow.types.is_fixed_size_list(found) and found.list_size == shape[0], f"{name}: {found}, not lists of {shape[0]}"
        found = found.value_type
    else:
        for _ in shape:
            assert pyarrow.types.is_list(found), f"{name}: {found}, not lists of lists"
            found = found.value_type
    assert found == value, f"{name}: values are {found}, not {value}"


def values_of(column, shape, name):
    """A column's values with the shape (frames, *shape), or (frames,) for the shape (1,)."""
    assert column.null_count == 0, f"{name}: a value is null"
    flat, lengths = column.combine_chunks(), []
    while pyarrow.types.is_nested(flat.type):
        lengths.append(set(pyarrow.compute.list_value_length(flat).to_pylist()))
        flat = flat.flatten()
    expected = [] if shape == [1] else [{n} for n in shape]
    assert lengths == expected, f"{name}: lists of {lengths}, not {expected}"
    assert flat.null_count == 0, f"{name}: a value is null"
    return flat.to_numpy(zero_copy_only=False).reshape(len(column), *([] if shape == [1] else shape))


def statistics_are(said, values, name):
    """`said` has the statistics of `values`, taken over frames."""
    values = values.astype(np.float64)
    of = {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0), "count": np.array([len(values)])}
    for key in STATISTICS:
        assert key in said, f"{name}: no {key}"
        found, expected = np.array(said[key], np.float64), np.atleast_1d(of[key])
        assert found.shape == expected.shape, f"{name}/{key}: shape {found.shape}, not {expected.shape}"
        size = max(float(np.abs(values).max(initial=0.0)), math.ulp(1.0))
        error = float(np.abs(found - expected).max())
        assert error <= TOLERANCE[key] * size, f"{name}/{key}: off by {error}"
    for key, q in QUANTILES.items():
        if key in said:
            error = np.abs(np.array(said[key], np.float64) - np.quantile(values, q, axis=0)).max()
            assert error <= TOLERANCE["min"] * size, f"{name}/{key}: off by {error}"


def info_of(folder):
    info = json.loads((folder / "meta/info.json").read_text())
    assert info["codebase_version"] == VERSION
    assert type(info["fps"]) is int and info["fps"] > 0, f"fps {info['fps']}"
    assert info["data_path"] == DATA_PATH
    assert info["video_path"] is None and not any(f["dtype"] in ("video", "image") for f in info["features"].values())
    assert type(info["chunks_size"]) is int and info["chunks_size"] > 0
    for name, dtype in FRAME_COLUMNS.items():
        assert plain(info["features"][name], name) == (dtype, [1]), name
    for name in info["features"]:
        assert "/" not in name, f"{name}: has a slash, which is how the statistics' names are divided"
    return info


def tasks_of(folder):
    """Tasks by number; the task is the index of the pandas frame."""
    table = pyarrow.parquet.read_table(folder / "meta/tasks.parquet")
    frame = json.loads(table.schema.metadata[b"pandas"])
    (index,) = frame["index_columns"]
    assert table.schema.field("task_index").type == pyarrow.int64()
    assert table.schema.field(index).type == pyarrow.string()
    numbers, tasks = table["task_index"].to_pylist(), table[index].to_pylist()
    assert numbers == list(range(len(numbers))) and len(set(tasks)) == len(tasks)
    return tasks


def episodes_of(folder):
    """Rows of all episode files."""
    paths = sorted(folder.glob("meta/episodes/chunk-*/file-*.parquet"))
    assert paths, "no file of episodes"
    rows = []
    for path in paths:
        table = pyarrow.parquet.read_table(path)
        for name in EPISODE_COLUMNS:
            kind = table.schema.field(name).type
            assert kind == (pyarrow.list_(pyarrow.string()) if name == "tasks" else pyarrow.int64()), f"{name}: {kind}"
        for row in table.to_pylist():
            here = {"chunk_index": row["meta/episodes/chunk_index"], "file_index": row["meta/episodes/file_index"]}
            assert path == folder / EPISODES_PATH.format(**here), f"{path}: says that it is {here}"
            rows.append(row)
    assert [row["episode_index"] for row in rows] == list(range(len(rows)))
    return rows


def data_of(folder, info, episodes):
    """The frames of all data files, {feature: values}."""
    parts, of_file = {name: [] for name in info["features"]}, {}
    for row in episodes:
        of_file.setdefault((row["data/chunk_index"], row["data/file_index"]), []).append(row)
    paths = {(chunk, file): folder / DATA_PATH.format(chunk_index=chunk, file_index=file) for chunk, file in of_file}
    assert set(folder.glob("data/**/*.parquet")) == set(paths.values())
    assert list(of_file) == sorted(of_file), "episodes are not in the order of the files"
    for key, rows in of_file.items():
        file = pyarrow.parquet.ParquetFile(paths[key])
        # a reader fetches one episode without the others
        lengths = [file.metadata.row_group(k).num_rows for k in range(file.metadata.num_row_groups)]
        assert lengths == [row["length"] for row in rows], f"{paths[key]}: row groups are not episodes"
        groups = (file.metadata.row_group(k).column(c) for k in range(len(lengths)) for c in range(file.metadata.num_columns))
        assert {group.compression for group in groups} <= CODECS
        assert set(file.schema_arrow.names) == set(info["features"]), paths[key]
        table = file.read()
        for name, field in info["features"].items():
            dtype, shape = plain(field, name)
            arrow_type_is(table.schema.field(name).type, dtype, shape, name)
            parts[name].append(values_of(table[name], shape, name))
    return {name: np.concatenate(values) for name, values in parts.items()}


def check(folder):
    """Raises an AssertionError that says what is not as published."""
    folder = pathlib.Path(folder)
    info, tasks, episodes = info_of(folder), tasks_of(folder), episodes_of(folder)
    data = data_of(folder, info, episodes)
    frames = len(data["index"])
    for name, said in (("total_episodes", len(episodes)), ("total_frames", frames), ("total_tasks", len(tasks))):
        assert info.get(name, said) == said, f"{name}: {info[name]}, and there are {said}"
    covered = []
    for split, text in info.get("splits", {}).items():
        first, end = map(int, text.split(":"))
        assert 0 <= first < end <= len(episodes), f"split {split}: {text}"
        covered += range(first, end)
    assert sorted(covered) == list(range(len(episodes))), "splits do not divide the episodes"
    assert np.array_equal(data["index"], np.arange(frames))
    begin = 0
    statistics = json.loads((folder / "meta/stats.json").read_text())
    for number, row in enumerate(episodes):
        end = begin + row["length"]
        assert (row["dataset_from_index"], row["dataset_to_index"]) == (begin, end), f"episode {number}"
        part = {name: values[begin:end] for name, values in data.items()}
        steps = np.arange(row["length"])
        assert np.array_equal(part["frame_index"], steps), f"episode {number}"
        assert np.all(part["episode_index"] == number), f"episode {number}"
        assert np.abs(part["timestamp"] - steps / info["fps"]).max() < TIME_TOLERANCE_S, f"episode {number}: times are not frame / fps"
        assert {tasks[k] for k in part["task_index"]} == set(row["tasks"]), f"episode {number}: tasks"
        for name in (name for name in data if data[name].dtype != object):
            said = {key: row[f"stats/{name}/{key}"] for key in [*STATISTICS, *QUANTILES] if f"stats/{name}/{key}" in row}
            statistics_are(said, part[name], f"episode {number}: {name}")
        begin = end
    assert begin == frames
    for name in (name for name in data if data[name].dtype != object):
        statistics_are(statistics[name], data[name], name)
    return data


@pytest.fixture(scope="session")
def layouts():
    """The exporter, which needs nothing of the package that it is in."""
    spec = importlib.util.spec_from_file_location("spts_export", EXPORT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def presses(program):
    return program.make("presses", program.spec("presses", PRESSES))


@pytest.fixture(scope="session")
def presses_with_codes(program):
    return program.make("presses-codes", program.spec("presses-codes", CODES))


def rows_of(made):
    """All rows of a data set, in their order."""
    return pyarrow.parquet.read_table(made.folder / "data").sort_by("index")


def maps(column, shape):
    return np.stack(column.to_numpy(zero_copy_only=False)).reshape(len(column), *shape)


def command(*arguments, **options):
    """What the command line of the exporter does, as a process of its own."""
    line = [sys.executable, EXPORT, *map(str, arguments)]
    return subprocess.run(line, capture_output=True, text=True, **options)


@pytest.mark.parametrize("name, spec", [("courses", COURSES), ("presses", PRESSES), ("presses-codes", CODES)])
def test_an_exported_data_set_is_as_published(name, spec, program, layouts):
    made = program.make(f"published-{name}", program.spec(f"published-{name}", spec))
    out = program.folder / f"lerobot-{name}"
    done = layouts.export(made.folder, "lerobot", out)
    data, info = check(out), json.loads((out / "meta/info.json").read_text())
    rows = rows_of(made)
    assert len(data["index"]) == len(rows) == done["rows"] == sum(done["splits"].values())
    assert info["fps"] == 50  # a window every 0.02 s
    # episodes are presses, those of a split together
    assert sorted(data["source_index"]) == list(range(len(rows)))
    rows = rows.take(data["source_index"])
    press, episode = rows["press"].to_numpy(), data["episode_index"]
    count = -(-len(rows) // (30 if name == "courses" else 3))
    assert len(set(zip(press, episode))) == len(set(press)) == len(set(episode)) == count == done["episodes"]
    assert np.array_equal(data["frame_index"], rows["window"].to_numpy())
    # in this order, those that have episodes
    having = set(rows["split"].to_pylist())
    assert list(info["splits"]) == [split for split in ("train", "validation", "test") if split in having]
    for split, part in info["splits"].items():
        first, end = map(int, part.split(":"))
        assert set(rows["split"].to_numpy(zero_copy_only=False)[(episode >= first) & (episode < end)]) == {split}
    # every value is that of the row
    pose = ["x_m", "y_m", "height_m", "rotation_deg", "tilt_x_deg", "tilt_y_deg"]
    state = data["observation.state"]
    assert np.array_equal(state, np.stack([rows[column].to_numpy() for column in pose], axis=1))
    last = np.append(episode[1:] != episode[:-1], True)
    assert np.array_equal(data["action"], np.where(last[:, None], state, np.roll(state, -1, axis=0)))
    for key, column in [("observation.force", "contact_force_n"), ("label", "label"), ("first_row", "first_row")]:
        assert np.array_equal(data[key], rows[column].to_numpy()), key
    shape = {"courses": (10, 10)}.get(name, (8, 12))
    samples = "y_code" if name == "presses-codes" else "y_v"
    for key, column, sides in [
        ("pressure", "pressure_pa", shape),
        ("conductance", "conductance_s", shape),
        ("raster", "image_v", shape),
        ("samples", samples, [-1]),
        ("phi", "phi", [7, 96]),
    ]:
        assert (f"observation.tactile.{key}" in data) == (column in rows.column_names), key
        if column in rows.column_names:
            assert np.array_equal(data[f"observation.tactile.{key}"], maps(rows[column], sides)), key
    tasks = tasks_of(out)
    assert [tasks[k] for k in data["task_index"][last]] == [f"press {o}" for o in rows["object"].filter(last).to_pylist()]
    card = (out / "README.md").read_text()
    assert all(f"`{key}`" in card for key in info["features"])
    # LeRobot takes every key with this word for a picture with three colours
    assert not any("image" in key for key in info["features"])
    assert (out / "spec.toml").read_bytes() == (made.folder / "spec.toml").read_bytes()


def test_what_no_quantiles_can_divide_is_named(program, presses, layouts):
    out = program.folder / "flat"
    said = layouts.export(presses.folder, "lerobot", out)["flat"]
    statistics = json.loads((out / "meta/stats.json").read_text())
    for key, of in statistics.items():
        equal = np.array(of["q01"]) == np.array(of["q99"])
        assert said.get(key, {"entries": 0})["entries"] == equal.sum(), key
    # the spec draws x and the rotation
    assert said["observation.state"]["names"] == ["y_m", "tilt_x_deg", "tilt_y_deg"]
    assert said["observation.state"] == said["action"]
    assert "observation.state: y_m, tilt_x_deg, tilt_y_deg (3 constant)" in (out / "README.md").read_text()


def test_files_have_limits(layouts, tmp_path):
    """A file is closed before it grows over its size or its number of groups; one group may be larger; chunks have 1000
    files."""
    schema = pyarrow.schema([("k", pyarrow.int64())])
    series, rows = layouts.Series(tmp_path, schema), pyarrow.table({"k": [0, 1]})

    def add(megabytes, count=1):
        places = []
        for first, end, *place in series.divide(count, megabytes << 20):
            series.write(rows, 2)
            places.append((end - first, *place))
        return places

    assert [add(size) for size in (60, 40, 1, 99, 500, 1)] == [[(1, 0, file)] for file in (0, 0, 1, 1, 2, 3)]
    assert add(30, 8) == [(3, 0, 3), (3, 0, 4), (2, 0, 5)]
    assert add(100, 996) == [(1, *divmod(file, 1000)) for file in range(6, 1002)]
    assert add(1) == [(1, 1, 2)]
    series.close()
    assert [len(list((tmp_path / chunk).iterdir())) for chunk in ("chunk-000", "chunk-001")] == [1000, 3]


@pytest.mark.parametrize("made", ["presses", "presses_with_codes"], indirect=True)
@pytest.mark.parametrize("most", [None, 7])
def test_tar_files_are_read_by_webdataset(made, most, program, layouts):
    import webdataset

    out = program.folder / f"tars-{made.name}-{most}"
    done = layouts.export(made.folder, "webdataset", out, rows_per_tar=most)
    rows, seen = rows_of(made).to_pylist(), []
    files = {"pressure_pa": "pressure", "conductance_s": "conductance", "support": "support", "image_v": "image"}
    files |= {"y_v": "y", "y_code": "y", "phi": "phi"}
    shapes = {"y": (7,), "phi": (7, 96)}
    for split, count in done["splits"].items():
        tars = sorted(out.glob(f"{split}-*.tar"))
        assert [tar.name for tar in tars] == [f"{split}-{k:06}.tar" for k in range(-(-count // (most or 10_000)))]
        of_split = list(webdataset.WebDataset([str(tar) for tar in tars], shardshuffle=False).decode())
        assert len(of_split) == count
        indices = [sample["json"]["index"] for sample in of_split]
        assert indices == sorted(indices)
        seen += indices
        for sample in of_split:
            row = rows[sample["json"]["index"]]
            assert sample["__key__"] == f"{row['index']:09}" and row["split"] == split
            for name, value in row.items():
                if not isinstance(value, list):
                    # the digits tell a single from its neighbours
                    found = sample["json"][name]
                    assert (np.float32(found) == np.float32(value)) if isinstance(value, float) else found == value, name
                else:
                    found = sample[f"{files[name]}.npy"]
                    assert found.shape == shapes.get(files[name], (8, 12)), name
                    assert np.array_equal(found.ravel(), np.array(value, found.dtype)), name
    assert sorted(seen) == list(range(len(rows)))
    first = next(out.glob("*.tar")).read_bytes()[:512]
    # mode, user, group and time say nothing of who wrote it
    assert [first[at : at + 8].rstrip(b"\0") for at in (100, 108, 116, 136)] == [b"0000644", b"0000000", b"0000000", b"00000000"]


@pytest.mark.parametrize("layout", ["lerobot", "webdataset"])
def test_the_same_rows_are_the_same_bytes(layout, program, presses, layouts):
    again = program.folder / f"again-{layout}"
    shutil.copytree(presses.folder, again / "set")
    (again / "set/manifest.json").unlink()
    done = [layouts.export(folder, layout, again / name) for folder, name in [(presses.folder, "a"), (again / "set", "b/c")]]
    assert done[0] == done[1] and done[0]["rows"] == 89
    files = sorted(path.relative_to(again / "a") for path in (again / "a").rglob("*") if path.is_file())
    assert all((again / "a" / name).read_bytes() == (again / "b/c" / name).read_bytes() for name in files)
    assert len(files) == done[0]["files"] + 1


def test_what_cannot_be_exported_is_refused(program, presses, layouts, tmp_path):
    """What is wrong ends in an error that names it; nothing is made and nothing is changed."""
    out = tmp_path / "out"

    def refused(*said, folder=presses.folder, layout="lerobot", **options):
        with pytest.raises(layouts.Refused) as error:
            layouts.export(folder, layout, out, **options)
        assert all(part in str(error.value) for part in said), error.value
        assert [path for path in tmp_path.iterdir() if path.name.startswith(".")] == []

    refused("`layout` = 'rlds'", "lerobot, webdataset", layout="rlds")
    refused("nowhere/dataset.json", folder="nowhere")
    refused("`rows_per_tar` = 10", "webdataset only", rows_per_tar=10)
    for rows in (0, 1_000_001):
        refused("`rows_per_tar`", "[1, 10^6]", layout="webdataset", rows_per_tar=rows)
    for interval, said in [
        ("", "`record.interval_s` is not set"),
        ("interval_s = 0.03\nwhole_rate = false", "`record.interval_s` = 0.03"),
        ("interval_s = 2.0\nwhole_rate = false", "valid: 1/n s"),
    ]:
        name = f"interval-{interval[:16].strip('interval_s = ') or 'none'}"
        made = program.make(name, program.spec(name, PRESSES.replace("interval_s = 0.02", interval)))
        refused(said, folder=made.folder)
    made = tmp_path / "set"
    shutil.copytree(presses.folder, made)
    file = made / "data/part-00002.parquet"
    whole = file.read_bytes()
    for layout in ("lerobot", "webdataset"):
        out.mkdir()
        (out / "thesis.tex").write_text("mine")
        refused("thesis.tex: is in the way", "empty", folder=made, layout=layout)
        assert (out / "thesis.tex").read_text() == "mine" and len(list(out.iterdir())) == 1
        (out / "thesis.tex").unlink()
        # an empty folder is filled; an export is not replaced
        layouts.export(made, layout, out)
        refused("is in the way", folder=made, layout=layout)
        shutil.rmtree(out)
        file.write_bytes(whole[: len(whole) // 2])
        refused("part-00002.parquet: is not a whole Parquet file", folder=made, layout=layout)
        file.unlink()
        refused("part-00002.parquet: is missing, as 1 of 5 files are", folder=made, layout=layout)
        shutil.copy(made / "data/part-00001.parquet", file)
        refused("was made for another place in the data set", folder=made, layout=layout)
        # a value that was changed shows against the manifest
        at = len(whole) // 10
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :])
        refused("part-00002.parquet: is not the file that manifest.json lists", folder=made, layout=layout)
        file.write_bytes(whole)
        assert not out.exists()


def test_what_the_command_prints(presses, tmp_path):
    done = command(presses.folder, "lerobot", "--out", tmp_path / "a")
    assert done.returncode == 0 and done.stderr == "", done.stderr
    assert "89 rows of 30 episodes (train " in done.stdout
    assert "q01 = q99: observation.state: y_m, tilt_x_deg, tilt_y_deg (3 constant)" in done.stdout
    told = json.loads(command(presses.folder, "lerobot", "--out", tmp_path / "b", "--json").stdout)
    assert f"digest: {told['digest']}" in done.stdout
    keys = ["format", "rows", "files", "bytes", "episodes", "splits", "flat", "digest"]
    assert list(told) == keys and told["format"] == "lerobot"
    again = command(presses.folder, "lerobot", "--out", tmp_path / "a")
    assert (again.returncode, again.stdout) == (2, "")
    assert again.stderr.startswith("error: ") and again.stderr.count("\n") == 1, again.stderr


def named(folder):
    """Names and sizes of all files below a folder."""
    return sorted((str(path.relative_to(folder)), path.stat().st_size) for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("layout", ["lerobot", "webdataset"])
def test_stopped_exports_leave_nothing(layout, program, tmp_path):
    """An export that a signal ends leaves no folder, and the next one is that of a run that nobody stopped."""
    # the last kills, which nothing can tidy up after
    stops = [signal.SIGINT, signal.SIGTERM, signal.SIGKILL]
    spec = PRESSES.replace("rows = 89\nrows_per_shard = 21", "rows = 1200\nrows_per_shard = 300")
    made = program.folder / "long"
    if not made.exists():
        program.make("long", program.spec("long", spec))
    line = [sys.executable, EXPORT, made, layout, "--json", "--out"]

    def begun(out, **streams):
        """An export that has come so far that it writes."""
        run = subprocess.Popen([*line, out], **streams)
        while run.poll() is None and not out.with_name(f".{out.name}.spts-export").exists():
            time.sleep(0.005)
        return run

    run, begin = begun(tmp_path / "whole", stdout=subprocess.PIPE), time.monotonic()
    told = run.communicate()[0]
    assert run.returncode == 0
    whole = json.loads(told)
    seconds, out, stopped = time.monotonic() - begin, tmp_path / "stopped", 0
    for stop, sent in enumerate(stops, 1):
        run = begun(out, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(seconds * stop / (len(stops) + 2))
        run.send_signal(sent)
        ended, killed = run.wait(), sent == signal.SIGKILL
        if ended == 0 or (killed and out.exists()):
            # all was there already
            assert named(out) == named(tmp_path / "whole")
            shutil.rmtree(out)
            continue
        stopped += 1
        assert not out.exists(), f"stop {stop} leaves a folder"
        left = [path.name for path in tmp_path.iterdir() if path.name != "whole"]
        assert left in ([], [".stopped.spts-export"]) and (killed or not left), f"stop {stop} leaves {left}"
    assert stopped > 0
    assert json.loads(subprocess.run([*line, out], capture_output=True, check=True).stdout) == whole
    assert sorted(os.listdir(tmp_path)) == ["stopped", "whole"]


if __name__ == "__main__":
    check(sys.argv[1])
    print(f"{sys.argv[1]}: as published")
