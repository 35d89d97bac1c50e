"""Folders that `spts dataset export lerobot` writes, against the published layout of LeRobot 3.0, with pyarrow alone.

`check(folder)` takes any such folder, of ours or of another program: `python scripts/dataset/test_lerobot.py FOLDER`.
"""

import json
import math
import pathlib
import subprocess
import sys

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

PRESSES = """\
name = "presses"
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
            said = {key: row[f"stats/{name}/{key}"] for key in STATISTICS if f"stats/{name}/{key}" in row}
            statistics_are(said, part[name], f"episode {number}: {name}")
        begin = end
    assert begin == frames
    for name in (name for name in data if data[name].dtype != object):
        statistics_are(statistics[name], data[name], name)
    return data


def test_an_exported_data_set_is_as_published(program):
    if subprocess.run([program.path, "dataset", "export", "--help"], capture_output=True).returncode != 0:
        pytest.skip("the program has no `dataset export`")
    made = program.make("presses", program.spec("presses", PRESSES))
    out = program.folder / "lerobot"
    program.call("dataset", "export", "lerobot", made.folder, "--out", out)
    data = check(out)
    rows = pyarrow.parquet.read_table(made.folder / "data").sort_by("index")
    assert len(data["index"]) == len(rows)
    assert json.loads((out / "meta/info.json").read_text())["fps"] == 50  # a window every 0.02 s
    # episodes are presses, those of a split together
    assert sorted(data["source_index"]) == list(range(len(rows)))
    rows = rows.take(data["source_index"])
    press, episode = rows["press"].to_numpy(), data["episode_index"]
    assert len(set(zip(press, episode))) == len(set(press)) == len(set(episode)) == 8
    assert np.array_equal(data["frame_index"], rows["window"].to_numpy())
    for split, part in json.loads((out / "meta/info.json").read_text())["splits"].items():
        first, end = map(int, part.split(":"))
        assert set(rows["split"].to_numpy(zero_copy_only=False)[(episode >= first) & (episode < end)]) == {split}
    assert np.array_equal(data["observation.force"], rows["contact_force_n"].to_numpy())


if __name__ == "__main__":
    check(sys.argv[1])
    print(f"{sys.argv[1]}: as published")
