"""Data sets in the layouts of other programs: `python -m spts.export DATASET LAYOUT --out DIR`.

`lerobot` is LeRobot v3.0: a press is an episode, a row is a frame. `webdataset` are tar files with JSON and NumPy arrays
for every row. This file needs NumPy and PyArrow alone, and nothing else of the package.
"""

from __future__ import annotations

import argparse
import contextlib
import fcntl
import hashlib
import io
import itertools
import json
import os
import pathlib
import shutil
import signal
import sys
import tarfile
import time

import numpy as np

__all__ = ["LAYOUTS", "Refused", "export"]

SPLITS = ("train", "validation", "test")
STATISTICS = ("min", "max", "mean", "std", "q01", "q10", "q50", "q90", "q99")
QUANTILES = (0.01, 0.1, 0.5, 0.9, 0.99)
# Most rows, and bytes of rows, that are read together; bytes of the values whose statistics are found together.
BATCH_ROWS, BATCH_BYTES = 1024, 16 << 20
STATISTICS_BYTES = 256 << 20
# LeRobot's defaults, which `info.json` repeats; and most row groups of a file, which every reader keeps in memory.
CHUNK_FILES, FILE_MB, FILE_GROUPS = 1000, 100, 10_000
# Largest frame rate, and how far from a whole number it may be: seconds with seven digits mean a whole rate.
MOST_FPS, FPS_TOLERANCE = 1e6, 1e-6
# Time from window to window, s, of a spec that does not say it.
INTERVAL_S = {"course": 0.02, "drop": 0.001}
ROWS_PER_TAR, MOST_ROWS_PER_TAR = 10_000, 1_000_000
POSE = ("x_m", "y_m", "height_m", "rotation_deg", "tilt_x_deg", "tilt_y_deg")
# Names and shapes of the tar files' arrays; a list column that is not here has its own name and one dimension.
ARRAYS = {
    "pressure_pa": "pressure",
    "conductance_s": "conductance",
    "support": "support",
    "image_v": "image",
    "y_v": "y",
    "y_code": "y",
    "phi": "phi",
}


class Refused(ValueError):
    """Why there is no export, as one sentence."""


def export(dataset, layout, out, *, rows_per_tar=None, progress=False):
    """Writes a data set in the layout of another program.

    Parameters
    ----------
    dataset : str or os.PathLike
        Folder of the data set, of which all files must be there.
    layout : str
        "lerobot" or "webdataset".
    out : str or os.PathLike
        A folder that is missing or empty. In the end it holds the whole export, or nothing.
    rows_per_tar : int, optional
        Most rows of a tar file, for "webdataset" only; [1, 10^6], default 10,000.
    progress : bool
        Whether a bar is drawn on standard error after two seconds.

    Returns
    -------
    dict
        `format`, `rows`, `episodes` (of LeRobot), `splits`, `files`, `bytes`, `digest`, and for LeRobot `flat`: the
        features with entries whose quantiles q01 and q99 are equal.
    """
    if layout not in LAYOUTS:
        raise Refused(f"`layout` = {layout!r}; valid: {', '.join(LAYOUTS)}")
    if rows_per_tar is not None:
        if layout != "webdataset":
            raise Refused(f"`rows_per_tar` = {rows_per_tar}: valid for the layout webdataset only")
        if not 1 <= rows_per_tar <= MOST_ROWS_PER_TAR:
            raise Refused(f"`rows_per_tar` = {rows_per_tar} is outside [1, 10^6]")
    source = Source(dataset)
    write = LAYOUTS[layout](source, rows_per_tar or ROWS_PER_TAR)
    with filled(out) as folder:
        source.check()
        bar = Bar(source.rows, progress)
        found = write(folder, bar)
        bar.end()
        (folder / "spec.toml").write_text(source.text)
        files = manifest(folder)
    digest = hashlib.sha256("".join(f"{file['sha256']}  {name}\n" for name, file in files.items()).encode())
    sizes = [file["bytes"] for file in files.values()]
    whole = {"rows": sum(found["splits"].values()), "files": len(files), "bytes": sum(sizes)}
    return {"format": layout, **whole, **found, "digest": digest.hexdigest()}


# ---------------------------------------------------------------------------------------------------------------------
# what is read


class Source:
    """A data set in its folder: what `dataset.json` and `spec.toml` say of it, and its files."""

    def __init__(self, folder):
        self.folder = pathlib.Path(folder)
        path = self.folder / "dataset.json"
        try:
            head = json.loads(path.read_text())
            self.name, self.rows, self.shards = head["name"], head["rows"], head["shards"]
            self.rows_per_shard = head["rows_per_shard"]
            self.shape = [head["recording"]["layout"][side] for side in ("rows", "cols")]
            self.facts = {"spec": head["spec_sha256"], "version": head["version"]}
        except OSError as error:
            raise Refused(f"{path}: {error.strerror}") from error
        except (ValueError, KeyError, TypeError) as error:
            raise Refused(f"{path}: is not the head of a data set ({error})") from error
        path = self.folder / "spec.toml"
        try:
            self.text = path.read_text()
            spec = read_toml(self.text)
        except OSError as error:
            raise Refused(f"{path}: {error.strerror}") from error
        except ValueError as error:
            raise Refused(f"{path}: {error}") from error
        self.description = spec.get("description", "")
        record = spec.get("record", {})
        self.what = record.get("what", "hold")
        self.interval_s = record.get("interval_s", INTERVAL_S.get(self.what))
        width = max(5, len(str(self.shards - 1)))
        self.files = [self.folder / f"data/part-{shard:0{width}}.parquet" for shard in range(self.shards)]

    @property
    def schema(self):
        """Columns of the first file, which all files have."""
        return self.opened(0).schema_arrow

    def lengths(self):
        """{column: length of its list, or None}."""
        import pyarrow

        is_list = pyarrow.types.is_fixed_size_list
        return {field.name: field.type.list_size if is_list(field.type) else None for field in self.schema}

    def opened(self, shard):
        """File number `shard`."""
        import pyarrow.parquet

        path = self.files[shard]
        if not path.exists():
            missing = [file for file in self.files if not file.exists()]
            problem = f"is missing, as {len(missing)} of {self.shards} files are"
            raise Refused(f"{missing[0]}: {problem}: run `spts dataset make` with this folder again")
        try:
            return pyarrow.parquet.ParquetFile(path)
        except (OSError, ValueError) as error:
            message = f"{path}: is not a whole Parquet file ({error}); remove it, and it is made anew"
            raise Refused(message) from error

    def check(self):
        """Refuses a data set of which a file is missing, damaged, or of another data set."""
        listed = {}
        with contextlib.suppress(OSError, ValueError):
            found = json.loads((self.folder / "manifest.json").read_text())
            listed = found["files"] if found.get("format") == "spts-results" else {}
        schema = self.schema
        for shard, path in enumerate(self.files):
            file = self.opened(shard)
            said = file.metadata.metadata or {}
            needed = {"spec": self.facts["spec"], "place in the data set": str(shard), "version": self.facts["version"]}
            for key, (what, value) in zip(("spts.spec_sha256", "spts.shard", "spts.version"), needed.items()):
                found = said.get(key.encode(), b"").decode(errors="replace")
                if found != value:
                    raise Refused(f"{path}: was made for another {what} ({found!r}, here {value!r})")
            rows = min(self.rows_per_shard, self.rows - shard * self.rows_per_shard)
            if file.metadata.num_rows != rows:
                raise Refused(f"{path}: has {file.metadata.num_rows} rows; {rows} are needed")
            if not file.schema_arrow.equals(schema):
                raise Refused(f"{path}: has other columns than the first file")
        for path in [self.folder / "spec.toml", *self.files] if listed else []:
            if digest_of(path) != listed.get(path.relative_to(self.folder).as_posix(), {}).get("sha256"):
                hint = "remove it and run `spts dataset make` with this folder again"
                raise Refused(f"{path}: is not the file that manifest.json lists; {hint}")

    def batches(self, split):
        """The rows of `split`, in their order: a file and some of its rows at a time."""
        import pyarrow
        import pyarrow.compute

        for shard, path in enumerate(self.files):
            file = self.opened(shard)
            groups = [file.metadata.row_group(k) for k in range(file.metadata.num_row_groups)]
            row_bytes = max((group.total_byte_size // max(1, group.num_rows) for group in groups), default=1)
            most = max(1, min(BATCH_ROWS, BATCH_BYTES // max(1, row_bytes)))
            try:
                for batch in file.iter_batches(most):
                    rows = batch.filter(pyarrow.compute.equal(batch["split"], split))
                    if rows.num_rows:
                        yield path, pyarrow.Table.from_batches([rows])
            except (OSError, pyarrow.ArrowException) as error:
                raise Refused(f"{path}: cannot be read: {error}") from error

    def presses(self, split):
        """The rows of `split` press by press: a file, rows, presses in them, and rows of each, which are as many."""
        import pyarrow

        waiting, path = None, None
        for path, rows in self.batches(split):
            rows = rows if waiting is None else pyarrow.concat_tables([waiting, rows])
            ends = np.flatnonzero(np.diff(rows["press"].to_numpy())) + 1
            # the last press may go on in the next rows
            last = int(ends[-1]) if len(ends) else 0
            yield from equal_presses(path, rows.slice(0, last))
            waiting = rows.slice(last)
        if waiting is not None:
            yield from equal_presses(path, waiting)


def equal_presses(path, rows):
    """Whole presses, those together that have as many rows."""
    press = rows["press"].to_numpy()
    lengths = np.diff([0, *np.flatnonzero(np.diff(press)) + 1, len(press)]) if len(press) else []
    first = 0
    for length, equal in itertools.groupby(map(int, lengths)):
        count = len(list(equal))
        part = rows.slice(first, count * length)
        window = part["window"].to_numpy().reshape(count, length)
        wrong = window[window != np.arange(length)]
        if len(wrong):
            raise Refused(f"{path}: `window` = {wrong[0]}: the rows of a press are not in order")
        yield path, part, count, length
        first += count * length


def values(path, rows, name):
    """A column as an array, (rows,) or (rows, length); every value there and finite."""
    column = rows[name].combine_chunks()
    if column.null_count:
        raise Refused(f"{path}: column `{name}` has no value")
    if hasattr(column.type, "list_size"):
        found = column.flatten().to_numpy(zero_copy_only=False).reshape(len(column), -1)
    else:
        found = column.to_numpy(zero_copy_only=False)
    if found.dtype.kind == "f" and not np.isfinite(found).all():
        raise Refused(f"{path}: column `{name}` holds a value that is not finite")
    return found


def read_toml(text):
    """A TOML document as a dictionary."""
    try:
        import tomllib
    except ImportError:  # before Python 3.11
        import tomli as tomllib
    return tomllib.loads(text)


# ---------------------------------------------------------------------------------------------------------------------
# where it is written


@contextlib.contextmanager
def filled(out):
    """A folder to fill, which gets the name `out` when it is full; what fails or is stopped leaves none."""
    out = pathlib.Path(os.path.abspath(out))
    if out.exists():
        held = sorted(out.iterdir()) if out.is_dir() else [out]
        if held:
            raise Refused(f"{held[0]}: is in the way; an export needs a folder that is empty or does not exist")
    stage = out.parent / f".{out.name}.spts-export"
    try:
        stage.mkdir(parents=True, exist_ok=True)
        lock = os.open(stage, os.O_RDONLY)
    except OSError as error:
        raise Refused(f"{out}: {error.strerror}") from error
    try:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise Refused(f"{out}: another export is being written there") from error
        try:
            # what a run that was killed has left
            for left in stage.iterdir():
                shutil.rmtree(left) if left.is_dir() else left.unlink()
            yield stage
            stage.replace(out)
        except OSError as error:
            raise Refused(f"{out}: {error.strerror or error}") from error
        finally:
            shutil.rmtree(stage, ignore_errors=True)
    finally:
        os.close(lock)


def manifest(folder):
    """Writes `manifest.json`; size and SHA-256 of every file, by name."""
    files = {}
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        with path.open("rb") as file:
            os.fsync(file.fileno())
        files[path.relative_to(folder).as_posix()] = {"bytes": path.stat().st_size, "sha256": digest_of(path)}
    files = dict(sorted(files.items()))
    write_json(folder / "manifest.json", {"format": "spts-results", "schema": 1, "files": files})
    return files


def digest_of(path):
    """SHA-256 of a file."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while piece := file.read(1 << 20):
            digest.update(piece)
    return digest.hexdigest()


def write_json(path, value):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(value, indent=2, ensure_ascii=False) + "\n")


class Bar:
    """Rows done of all, on standard error."""

    def __init__(self, steps, shown):
        self.steps, self.shown, self.done, self.begin = steps, shown, 0, time.monotonic()

    def step(self, rows):
        self.done += rows
        if self.shown and time.monotonic() - self.begin > 2.0:
            width = 40 * self.done // self.steps
            sys.stderr.write(f"\rrows {'█' * width}{'·' * (40 - width)} {self.done}/{self.steps} ")
            sys.stderr.flush()

    def end(self):
        if self.shown and time.monotonic() - self.begin > 2.0:
            sys.stderr.write("\n")


# ---------------------------------------------------------------------------------------------------------------------
# LeRobot v3.0


class Feature:
    """A feature of the frames: its values come from columns of the rows, or from the frame's place."""

    def __init__(self, key, dtype, shape, names, what, columns=None):
        self.key, self.dtype, self.shape, self.what, self.columns = key, dtype, shape, what, columns
        self.names = None if names is None else list(names)

    @property
    def entries(self):
        """Values of a frame."""
        return int(np.prod(self.shape))

    @property
    def arrow(self):
        """Type of the column: a scalar for one value, a list of fixed length for one side, nested lists for two."""
        import pyarrow

        scalar = pyarrow.from_numpy_dtype(self.dtype)
        if self.shape == [1]:
            return scalar
        if len(self.shape) == 1:
            return pyarrow.list_(scalar, self.shape[0])
        return pyarrow.list_(pyarrow.list_(scalar))

    def column(self, found):
        """The column of `found`, an array (frames, entries)."""
        import pyarrow

        flat = pyarrow.array(np.ascontiguousarray(found, self.dtype).ravel())
        if self.shape == [1]:
            return flat
        if len(self.shape) == 1:
            return pyarrow.FixedSizeListArray.from_arrays(flat, self.shape[0])
        return lists(flat, self.shape)


def lists(flat, shape):
    """Values as lists of the lengths `shape`, one in the other."""
    import pyarrow

    for length in reversed(shape):
        ends = np.arange(0, len(flat) + 1, length, np.int32)
        flat = pyarrow.ListArray.from_arrays(pyarrow.array(ends), flat)
    return flat


def features(source):
    """Features of the frames. No key has "image" in it: LeRobot takes such for pictures with colours."""
    has, map_names = source.lengths(), ("row", "col")
    samples = "y_v" if "y_v" in has else "y_code"
    dtype = "float32" if samples == "y_v" else "int64"
    unit = "V" if samples == "y_v" else "codes of the converter"
    m = has[samples]

    def one(key, what, columns=None, dtype="int64"):
        return Feature(key, dtype, [1], None, what, columns)

    def taxels(key, what, column):
        return [Feature(key, "float32", source.shape, map_names, what, [column])] if column in has else []

    phi_shape, phi_names = [m, int(np.prod(source.shape))], ("measurement", "taxel")
    phi = Feature(
        f"{TACTILE}.phi", "float32", phi_shape, phi_names, "rows of the sensing matrix of the samples", ["phi"]
    )
    return [
        Feature(STATE, "float32", [6], POSE, "pose of the first object on the skin; metres and degrees", list(POSE)),
        *taxels(f"{TACTILE}.pressure", "true mean pressure over every taxel's cell, Pa", "pressure_pa"),
        *taxels(f"{TACTILE}.conductance", "true conductance of every taxel, S", "conductance_s"),
        *taxels(f"{TACTILE}.raster", "image as the raster scan of the press has it, V", "image_v"),
        Feature(f"{TACTILE}.samples", dtype, [m], None, f"samples of the skin's one wire, {unit}", [samples]),
        # LeRobot's policies want a camera or this key
        Feature(ENVIRONMENT, "float32", [m], None, f"the samples once more, {unit}", [samples]),
        *([phi] if "phi" in has else []),
        one("observation.force", "normal force on the skin at this frame, N", ["contact_force_n"], "float32"),
        Feature(ACTION, "float32", [6], POSE, f"`{STATE}` of the next frame; of the last frame its own"),
        one("label", "class of the first object", ["label"]),
        one("source_index", "number of the row in the exported data set", ["index"]),
        one("first_row", "row of the sensing matrix of the first sample, from the loading of the seeds", ["first_row"]),
        one("timestamp", "time from the first frame of the episode, s", dtype="float32"),
        one("frame_index", "number of the frame in its episode"),
        one("episode_index", "number of the episode"),
        one("index", "number of the frame"),
        one("task_index", "number of the task in meta/tasks.parquet"),
    ]


STATE, ACTION, TACTILE = "observation.state", "action", "observation.tactile"
ENVIRONMENT = "observation.environment_state"


def frame_rate(source):
    """Frames a second, which LeRobot needs as a whole number."""
    interval_s = source.interval_s
    if interval_s is None:
        raise Refused(
            "`record.interval_s` is not set: LeRobot needs a whole number of frames a second; set it in the spec and "
            "make the data set anew, for example `interval_s = 0.02` for 50"
        )
    rate = 1.0 / interval_s
    if 1.0 <= round(rate) <= MOST_FPS and abs(rate - round(rate)) <= FPS_TOLERANCE:
        return round(rate)
    raise Refused(
        f"`record.interval_s` = {interval_s}: LeRobot needs a whole number of frames a second; valid: 1/n s for n = 1 "
        "to 10^6, for example 0.02"
    )


class Series:
    """A table over the files `chunk-000/file-000.parquet` and so on of a folder."""

    def __init__(self, folder, schema):
        self.folder, self.schema = folder, schema
        self.number, self.bytes, self.items, self.writer = 0, 0, 0, None

    def divide(self, count, each):
        """Files for `count` items of `each` bytes: first item, one beyond the last, chunk and file."""
        first = 0
        while first < count:
            room = min(((FILE_MB << 20) - self.bytes) // each, FILE_GROUPS - self.items)
            if room < 1 and self.items:
                self.close()
                self.number, self.bytes, self.items = self.number + 1, 0, 0
                continue
            end = min(count, first + max(1, room))
            self.bytes += (end - first) * each
            self.items += end - first
            yield first, end, *divmod(self.number, CHUNK_FILES)
            first = end

    def write(self, table, group):
        """Adds rows to the last file, `group` of them a row group."""
        if self.writer is None:
            chunk, file = divmod(self.number, CHUNK_FILES)
            self.writer = writer(self.folder / f"chunk-{chunk:03}/file-{file:03}.parquet", self.schema)
        self.writer.write_table(table, group)

    def close(self):
        if self.writer is not None:
            self.writer.close()
        self.writer = None


def writer(path, schema):
    """A Parquet file. Whoever writes one keeps what it knows of every row group until the file ends: no statistics."""
    import pyarrow.parquet

    path.parent.mkdir(parents=True, exist_ok=True)
    options = {"compression": "zstd", "compression_level": 1, "use_dictionary": False, "write_statistics": False}
    return pyarrow.parquet.ParquetWriter(path, schema, **options)


def statistics(found, axis):
    """Statistics along an axis, in the order of their names: quantiles are between frames on a straight line."""
    found = found.astype(np.float64)
    least, most = found.min(axis), found.max(axis)
    # between the least and the most, whatever the sum rounds to
    mean = np.clip(found.mean(axis), least, most)
    return np.stack([least, most, mean, found.std(axis), *np.quantile(found, QUANTILES, axis)])


def lerobot(source, _):
    """Checks that LeRobot can hold the data set; what writes it."""
    fps = frame_rate(source)
    return lambda folder, bar: Recorder(source, fps, folder).record(bar)


class Recorder:
    """An export to LeRobot that is being written."""

    def __init__(self, source, fps, folder):
        import pyarrow

        self.source, self.fps, self.folder = source, fps, folder
        self.features = features(source)
        self.data = Series(folder / "data", pyarrow.schema([(f.key, f.arrow) for f in self.features]))
        fields = [(name, pyarrow.int64()) for name in EPISODE] + [("tasks", pyarrow.list_(pyarrow.string()))]
        for feature in self.features:
            kind = pyarrow.float64()
            for _ in feature.shape:
                kind = pyarrow.list_(kind)
            fields += [(f"stats/{feature.key}/{name}", kind) for name in STATISTICS]
            fields.append((f"stats/{feature.key}/count", pyarrow.list_(pyarrow.int64())))
        self.table = Series(folder / "meta/episodes", pyarrow.schema(fields))
        self.tasks, self.episodes, self.frames = {}, 0, 0

    def record(self, bar):
        splits, rows = {}, {}
        for split in SPLITS:
            episodes, frames = self.episodes, self.frames
            for path, part, count, length in self.source.presses(split):
                self.add(path, part, count, length)
                bar.step(len(part))
            if self.episodes > episodes:
                splits[split], rows[split] = f"{episodes}:{self.episodes}", self.frames - frames
        self.data.close()
        self.table.close()
        found = {feature.key: self.statistics_of(feature) for feature in self.features}
        self.describe(splits, found)
        return {"episodes": self.episodes, "splits": rows, "flat": flat(self.features, found)}

    def add(self, path, rows, count, length):
        """Adds `count` presses of `length` rows each."""
        import pyarrow

        drops = "drop" if self.source.what == "drop" else "press"
        tasks = [f"{drops} {name}" for name in rows["object"].take(np.arange(count) * length).to_pylist()]
        numbers = [self.tasks.setdefault(task, len(self.tasks)) for task in tasks]
        found = {}
        for feature in (feature for feature in self.features if feature.columns):
            columns = [values(path, rows, name) for name in feature.columns]
            columns = columns[0] if len(columns) == 1 else np.stack(columns, 1)
            found[feature.key] = columns.astype(feature.dtype).reshape(count, length, -1)
        state, frame = found[STATE], np.tile(np.arange(length), (count, 1))
        found[ACTION] = np.concatenate([state[:, 1:], state[:, -1:]], 1)
        episode = self.episodes + np.arange(count)
        placed = {
            "timestamp": (frame / self.fps).astype(np.float32),
            "frame_index": frame,
            "episode_index": np.repeat(episode, length),
            "index": self.frames + np.arange(count * length),
            "task_index": np.repeat(numbers, length),
        }
        found.update({key: column.reshape(count, length, 1) for key, column in placed.items()})
        columns = [f.column(found[f.key].reshape(count * length, -1)) for f in self.features]
        table = pyarrow.Table.from_arrays(columns, schema=self.data.schema)
        frame_bytes = sum(f.entries * np.dtype(f.dtype).itemsize for f in self.features)
        chunks, files = np.zeros(count, int), np.zeros(count, int)
        for first, end, chunk, file in self.data.divide(count, length * frame_bytes):
            self.data.write(table.slice(first * length, (end - first) * length), length)
            chunks[first:end], files[first:end] = chunk, file
        begin = self.frames + length * np.arange(count)
        lines = [episode, np.full(count, length), chunks, files, begin, begin + length]
        stats = {f.key: statistics(found[f.key], 1) for f in self.features}
        entries = sum(f.entries for f in self.features) * len(STATISTICS) + len(self.features) + len(EPISODE)
        for first, end, chunk, file in self.table.divide(count, 8 * entries):
            places = [np.full(end - first, chunk), np.full(end - first, file)]
            columns = [pyarrow.array(line) for line in [*(line[first:end] for line in lines), *places]]
            columns.append(pyarrow.array([[task] for task in tasks[first:end]]))
            for f in self.features:
                each = (lists(pyarrow.array(stat[first:end].ravel()), f.shape) for stat in stats[f.key])
                columns += [*each, pyarrow.array([[length]] * (end - first))]
            self.table.write(pyarrow.Table.from_arrays(columns, schema=self.table.schema), end - first)
        self.episodes += count
        self.frames += count * length

    def statistics_of(self, feature):
        """Statistics of a feature over all frames, (statistics, entries), out of the files that have been written."""
        import pyarrow.parquet

        paths = sorted(self.folder.glob("data/chunk-*/file-*.parquet"))
        most = max(1, STATISTICS_BYTES // (8 * max(1, self.frames)))
        parts = []
        for first in range(0, feature.entries, most):
            read = []
            for path in paths:
                column = pyarrow.parquet.ParquetFile(path).read([feature.key])[feature.key].combine_chunks()
                while pyarrow.types.is_nested(column.type):
                    column = column.flatten()
                read.append(column.to_numpy().reshape(-1, feature.entries)[:, first : first + most])
            parts.append(statistics(np.concatenate(read), 0))
        return np.concatenate(parts, 1)

    def describe(self, splits, found):
        """Writes the files that describe the export."""
        info = {
            "codebase_version": "v3.0",
            "robot_type": "spts_skin",
            "total_episodes": self.episodes,
            "total_frames": self.frames,
            "total_tasks": len(self.tasks),
            "chunks_size": CHUNK_FILES,
            "data_files_size_in_mb": FILE_MB,
            # LeRobot's default; there are no videos
            "video_files_size_in_mb": 200,
            "fps": self.fps,
            "splits": splits,
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
            "video_path": None,
            "features": {f.key: {"dtype": f.dtype, "shape": f.shape, "names": f.names} for f in self.features},
        }
        write_json(self.folder / "meta/info.json", info)
        stats = {}
        for f in self.features:
            of = {name: shaped(stat, f) for name, stat in zip(STATISTICS, found[f.key])}
            stats[f.key] = {**of, "count": [self.frames]}
        write_json(self.folder / "meta/stats.json", stats)
        self.write_tasks()
        (self.folder / "README.md").write_text(self.card(splits, found))

    def write_tasks(self):
        """Writes `meta/tasks.parquet` as pandas writes a frame whose index is the task."""
        import pyarrow

        def column(name, pandas, numpy):
            kinds = {"pandas_type": pandas, "numpy_type": numpy, "metadata": None}
            return {"name": name, "field_name": name, **kinds}

        pandas = {
            "index_columns": ["task"],
            "column_indexes": [],
            "columns": [column("task_index", "int64", "int64"), column("task", "unicode", "object")],
            "creator": {"library": "pyarrow", "version": pyarrow.__version__},
            "pandas_version": "2.0.0",
        }
        columns = {"task_index": pyarrow.array(range(len(self.tasks)), pyarrow.int64()), "task": list(self.tasks)}
        table = pyarrow.table(columns).replace_schema_metadata({"pandas": json.dumps(pandas)})
        with writer(self.folder / "meta/tasks.parquet", table.schema) as file:
            file.write_table(table)

    def card(self, splits, found):
        """Card of the export, with the units of its features."""
        source, m = self.source, next(f.shape[0] for f in self.features if f.key == f"{TACTILE}.samples")
        lines = ["---", "tags:", "- LeRobot", "- tactile", "configs:", "- config_name: default"]
        lines += ["  data_files: data/*/*.parquet", "---", "", f"# {source.name}", ""]
        lines += [source.description, ""] if source.description else []
        lines += [
            f"Synthetic touches of a single-pixel tactile skin in LeRobot's layout v3.0: {self.episodes} episodes, "
            f"{self.frames} frames, {self.fps} frames a second. An episode is a press, a frame is a window of {m} "
            "samples of the skin's one wire. `spec.toml` is the spec that the data set was made from.",
            "",
            "| split | episodes |",
            "|---|---|",
        ]
        for split, text in splits.items():
            first, end = map(int, text.split(":"))
            lines.append(f"| {split} | {first} to {end - 1} |")
        lines += ["", "| feature | type | shape | what it is |", "|---|---|---|---|"]
        lines += [f"| `{f.key}` | {f.dtype} | {f.shape} | {f.what} |" for f in self.features]
        without = flat(self.features, found)
        if without:
            lines += [
                "",
                "Quantiles q01 and q99 are equal here, so that nothing can be divided by their difference:",
                "",
            ]
            lines += [f"- {told(key, of)}" for key, of in without.items()]
        return "\n".join(lines) + "\n"


# Columns of an episode that are whole numbers.
EPISODE = (
    "episode_index",
    "length",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
    "meta/episodes/chunk_index",
    "meta/episodes/file_index",
)


def shaped(stat, feature):
    """A statistic as lists with the feature's shape; whole numbers stay so, as far as they are."""
    nested = stat.reshape(feature.shape).tolist()
    if feature.dtype == "float32":
        return nested
    return [int(v) if v.is_integer() else v for v in nested]


def flat(features, found):
    """{feature: entries whose q01 is their q99, how many of these are constant, of how many, and names of them}."""
    out = {}
    for feature in features:
        of = dict(zip(STATISTICS, found[feature.key]))
        equal, constant = of["q01"] == of["q99"], of["min"] == of["max"]
        if equal.any():
            counts = {"entries": int(equal.sum()), "constant": int(constant.sum()), "of": feature.entries}
            named = feature.names if len(feature.shape) == 1 else None
            names = {"names": [named[k] for k in np.flatnonzero(equal)]} if named else {}
            out[feature.key] = counts | names
    return out


def told(key, of):
    """An entry of `flat` as text."""
    if "names" in of:
        which = f": {', '.join(of['names'])}"
    else:
        which = f": {of['entries']} of {of['of']} values" if of["of"] > 1 else ""
    return f"{key}{which} ({of['constant']} constant)" if of["of"] > 1 else f"{key}{which}"


# ---------------------------------------------------------------------------------------------------------------------
# WebDataset


def webdataset(source, rows_per_tar):
    """What writes tar files of at most `rows_per_tar` rows."""
    return lambda folder, bar: write_tars(source, rows_per_tar, folder, bar)


def write_tars(source, most, folder, bar):
    has = source.lengths()
    shapes = {name: [length] for name, length in has.items() if length}
    for name in ("pressure_pa", "conductance_s", "support", "image_v"):
        if name in shapes:
            shapes[name] = source.shape
    if "phi" in shapes:
        shapes["phi"] = [has.get("y_v", has.get("y_code")), int(np.prod(source.shape))]
    digits = max(9, len(str(source.rows - 1)))
    splits = {}
    for split in SPLITS:
        count, tar = 0, None
        for path, rows in source.batches(split):
            lines = json_lines(rows, [name for name in has if name not in shapes])
            arrays = {name: values(path, rows, name) for name in shapes}
            for k, index in enumerate(values(path, rows, "index")):
                if count % most == 0:
                    if tar:
                        tar.close()
                    name = folder / f"{split}-{count // most:06}.tar"
                    tar = tarfile.open(name, "w", format=tarfile.USTAR_FORMAT)
                put(tar, f"{index:0{digits}}.json", lines[k])
                for name, shape in shapes.items():
                    file = io.BytesIO()
                    np.lib.format.write_array(file, arrays[name][k].reshape(shape), allow_pickle=False)
                    put(tar, f"{index:0{digits}}.{ARRAYS.get(name, name)}.npy", file.getvalue())
                count += 1
            bar.step(len(rows))
        if tar:
            tar.close()
            splits[split] = count
    return {"splits": splits}


def put(tar, name, content):
    """Adds a file of mode 0644, of user and group 0, last changed at time 0."""
    info = tarfile.TarInfo(name)
    info.size = len(content)
    tar.addfile(info, io.BytesIO(content))


def json_lines(rows, names):
    """Single values of every row as JSON; single precision with the digits that tell a number from its neighbours."""
    columns = []
    for name in names:
        found = rows[name].to_pylist()
        if str(rows[name].type) == "float":
            found = [None if v is None else float(str(np.float32(v))) for v in found]
        columns.append(found)
    return [(json.dumps(dict(zip(names, row)), sort_keys=True) + "\n").encode() for row in zip(*columns)]


LAYOUTS = {"lerobot": lerobot, "webdataset": webdataset}


# ---------------------------------------------------------------------------------------------------------------------
# the command


def main(arguments=None):
    """Runs the command line; its exit status."""
    parser = argparse.ArgumentParser(
        "python -m spts.export",
        description="Writes a data set in the layout of another program. All files of the data set must be there and are "
        "checked first. OUT holds the whole export in the end, or nothing if the export fails or is stopped.",
        epilog="examples:\n"
        "  python -m spts.export out/shapes lerobot --out out/shapes_lerobot\n"
        "  python -m spts.export out/shapes webdataset --out out/shapes_tar --rows-per-tar 1000 --json\n\n"
        "lerobot: a press is an episode, a row is a frame. The spec needs `record.interval_s`, the time between the\n"
        "  windows of a press, with a whole number of windows a second.\n"
        '  In Python: LeRobotDataset("local/shapes", root="out/shapes_lerobot")\n'
        "webdataset: train-000000.tar and so on; every row is NUMBER.json with its single values, and\n"
        "  NUMBER.pressure.npy, .conductance.npy, .support.npy, .image.npy, .y.npy and .phi.npy as far as recorded.\n"
        '  In Python: webdataset.WebDataset("out/shapes_tar/train-{000000..000009}.tar").decode()',
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("dataset", metavar="DATASET", help="folder of the data set")
    parser.add_argument("layout", metavar="LAYOUT", help=" or ".join(LAYOUTS))
    parser.add_argument("--out", required=True, metavar="OUT", help="folder to write to; it must be missing or empty")
    tars = "most rows of a tar file, for webdataset only; [1, 10^6] (default: 10000)"
    parser.add_argument("--rows-per-tar", type=int, metavar="N", help=tars)
    parser.add_argument("--json", action="store_true", help="print the numbers as JSON on standard output")
    given = parser.parse_args(arguments)
    # what is asked to end removes what it has begun
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    try:
        options = {"rows_per_tar": given.rows_per_tar, "progress": sys.stderr.isatty()}
        done = export(given.dataset, given.layout, given.out, **options)
    except KeyboardInterrupt:
        return 128 + signal.SIGINT
    except ImportError as error:
        return refused(f"{error}: `pip install 'spts-twin[export]'` brings what exports need")
    except Refused as error:
        return refused(error)
    if given.json:
        print(json.dumps(done, indent=2))
        return 0
    splits = ", ".join(f"{split} {rows}" for split, rows in done["splits"].items())
    episodes = f" of {done['episodes']} episodes" if "episodes" in done else ""
    print(f"{done['rows']} rows{episodes} ({splits}) in {done['files']} files, {done['bytes'] / 1e6:.1f} MB")
    for key, of in done.get("flat", {}).items():
        print(f"q01 = q99: {told(key, of)}")
    print(f"digest: {done['digest']}\n{done['format']}: {given.out}")
    return 0


def refused(error):
    print(f"error: {error}", file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
