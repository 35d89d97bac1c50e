"""Data sets: labelled touches as rows of Parquet files, made and read.

::

    data = spts.dataset.make("random-shapes", "out/shapes", rows=10_000)
    phi, y, images, names, presses = data.labelled("train")
    force = data["contact_force_n"]
    mine = spts.dataset.make(frames="out/frames")                   # from frames of any skin

`pandas`, `polars`, DuckDB, Hugging Face `datasets` and whatever else reads Parquet read the files in `data/` too.
"""

from __future__ import annotations

import concurrent.futures
import json
import os
import sys
import time

import numpy as np

from ._spts import DataFolder, shipped_specs

__all__ = ["Dataset", "make", "specs"]

# Rows from which the output of the untouched skin is found.
_IDLE_ROWS = 500


def specs():
    """Names of the specs that ship."""
    return shipped_specs()


class Dataset:
    """A data set in a folder. A copy (`copy.deepcopy`, `pickle`) reads the same folder.

    Parameters
    ----------
    folder : str or os.PathLike
    files : str or os.PathLike
        Folder of the files that the spec names.
    """

    def __init__(self, folder, files="."):
        self.path = os.fspath(folder)
        # a worker may stand in another folder
        self._places = os.path.abspath(folder), os.path.abspath(files)
        self._folder = DataFolder.open(*self._places)
        self._idle = None

    def __getstate__(self):
        return {name: value for name, value in vars(self).items() if name != "_folder"}

    def __setstate__(self, state):
        self.__dict__.update(state)
        self._folder = DataFolder.open(*self._places)

    @property
    def info(self):
        """What it is and how far: `name`, `rows`, `shards`, `made`, `bytes`, `digest` and so on."""
        return json.loads(self._folder.info())

    @property
    def columns(self):
        """Its columns: `name`, `kind`, `length`, `unit`, `description` of each."""
        return json.loads(self._folder.columns())

    @property
    def spec(self):
        """The spec, as TOML."""
        return self._folder.spec

    @property
    def shape(self):
        """Rows and columns of taxels."""
        return self._folder.shape

    def __len__(self):
        return self.info["rows"]

    def __getitem__(self, name):
        """A whole column, (n,) or (n, length)."""
        return self.read([name])[name]

    def read(self, columns, rows=None):
        """Columns as arrays.

        Parameters
        ----------
        columns : sequence of str
        rows : (int, int), optional
            First row, and one beyond the last; default all.

        Returns
        -------
        dict of str to ndarray
            (n,) or (n, length); what is missing is NaN, -1, or an empty text.
        """
        start, stop = (0, len(self)) if rows is None else (int(rows[0]), int(rows[1]))
        if not 0 <= start <= stop <= len(self):
            raise ValueError(f"`rows` = {rows} is outside [0, {len(self)}]")
        found = self._folder.read(list(dict.fromkeys(columns)), start, stop)
        return {name: np.asarray(values) for name, values in found.items()}

    def labelled(self, split="train", rows=None):
        """What decoders learn from and are scored on.

        All rows of one shape belong to one split, so that a data set of few shapes may have none in another:
        `spts.dataset.make(…, set={"object.rows_per_shape": 20})` makes more shapes.

        Parameters
        ----------
        split : str
            "train", "validation" or "test".
        rows : (int, int), optional
            Rows that are looked at; default all.

        Returns
        -------
        phi : ndarray (n, M, taxels)
            Rows of the sensing matrix.
        y : ndarray (n, M)
            Measurements without the output of the untouched skin, V.
        images : ndarray (n, taxels)
            The raster scan, V, where there is one, else conductance, S, else pressure, Pa.
        names : ndarray (n,) of str
            The object, or the family of the shape.
        presses : ndarray (n,) of int
            Number of the press.
        """
        there = {column["name"] for column in self.columns}
        truth = self._truth(there)
        needed = ["split", "first_row", "press", "object", truth, self._wire(there)]
        found = self.read(needed, rows)
        own = found["split"] == split
        if not own.any():
            raise ValueError(f'`split` = "{split}": none of {len(own)} rows; there are {sorted(set(found["split"]))}')
        y = self._volts(found[self._wire(there)][own]) - self._idle_v(there)
        phi = self._phi(found["first_row"][own], y.shape[1])
        return phi, y, found[truth][own].astype(np.float64), found["object"][own], found["press"][own]

    def _phi(self, first_rows, m):
        return self._folder.phi(first_rows.tolist(), m).reshape(len(first_rows), m, -1)

    def _wire(self, there):
        return "y_v" if "y_v" in there else "y_code"

    def _truth(self, there):
        for name in ("image_v", "conductance_s", "pressure_pa"):
            if name in there:
                return name
        raise ValueError(
            "the data set has no images: `record.labels` of its spec names none, and there is no raster scan"
        )

    def _volts(self, values):
        if values.dtype.kind == "i":
            return self._folder.volts(np.ascontiguousarray(values, np.int64))
        return values.astype(np.float64)

    def _idle_v(self, there):
        """Output of the untouched skin: what is left of y where Φ times the image is 0, by least squares."""
        if self._idle is None:
            truth, rows = self._truth(there), (0, min(_IDLE_ROWS, len(self)))
            found = self.read([self._wire(there), truth, "first_row"], rows)
            y = self._volts(found[self._wire(there)])
            sums = np.einsum("nmk,nk->nm", self._phi(found["first_row"], y.shape[1]), found[truth].astype(np.float64))
            scale = np.abs(sums).max() or 1.0
            design = np.stack([sums.ravel() / scale, np.ones(sums.size)], axis=1)
            self._idle = float(np.linalg.lstsq(design, y.ravel(), rcond=None)[0][1])
        return self._idle

    def __repr__(self):
        info = self.info
        return f"<spts.Dataset {info['name']}: {info['rows']} rows, {info['made']} of {info['shards']} files>"


def make(
    spec=None,
    folder=None,
    *,
    frames=None,
    rows=None,
    seed=None,
    set=None,
    engine="threads",
    workers=None,
    progress=None,
):
    """Makes a data set, or goes on with one; files that are there are kept. Ctrl-C stops it after the files under way.

    Whoever makes it, and in whatever order, the bytes are the same.

    Parameters
    ----------
    spec : str or os.PathLike, optional
        A TOML file, or one of `specs()`. Without one there have to be `frames`.
    folder : str or os.PathLike, optional
        Default out/dataset/NAME; of frames alone out/dataset/frames.
    frames : str, os.PathLike, Session or sequence of Session, optional
        Frames of any skin, in place of simulated objects: a folder of sessions as `spts import` and `Session.write`
        write them, or sessions themselves, which are then written to FOLDER_frames and have to stay there. One row for
        every press, unless `rows` says otherwise.
    rows, seed : int, optional
        In place of the spec's.
    set : dict, optional
        Other values: nested dictionaries, or dotted keys as in `{"record.measurements": 50}`.
    engine : str
        "threads" of this process, or "ray": core tasks of Ray, on all machines of its cluster that share `folder`. A
        worker that dies is replaced.
    workers : int, optional
        Threads; default one a core. Of Ray the number of tasks at once; default as many as it has cores.
    progress : bool, optional
        Whether a bar is drawn on standard error; default when that is a terminal.

    Returns
    -------
    Dataset
    """
    if spec is None and frames is None:
        raise TypeError("`spec` or `frames` is needed")
    spec = "" if spec is None else os.fspath(spec)
    if folder is None:
        name = os.path.splitext(os.path.basename(spec))[0] or "frames"
        folder = os.path.join("out", "dataset", name)
    folder = os.path.abspath(os.fspath(folder))
    overrides = {}
    if frames is not None:
        _put(overrides, "object", {"from": "frames", "folder": _written(frames, folder + "_frames")})
        if not spec:
            _put(overrides, "name", "frames")
    for key, value in {**(set or {}), "rows": rows, "seed": seed}.items():
        if value is not None:
            _put(overrides, key, value)
    begun = _begin(spec, folder, overrides)
    shards = json.loads(begun.info())["shards"]
    bar = _Bar(shards, sys.stderr.isatty() if progress is None else progress)
    engines = {"threads": _on_threads, "ray": _on_ray}
    if engine not in engines:
        raise ValueError(f'`engine` = "{engine}"; valid: "threads", "ray"')
    if workers is not None and not 1 <= workers <= 100_000:
        raise ValueError(f"`workers` = {workers} is outside [1, 100000]")
    engines[engine](begun, (spec, folder, overrides), shards, workers, bar)
    begun.finish()
    return Dataset(folder, os.path.dirname(os.path.abspath(spec)) if os.path.exists(spec) else ".")


def _written(frames, folder):
    """The folder of the sessions `frames`, which are written to `folder` if they are in none."""
    if isinstance(frames, (str, os.PathLike)):
        return os.path.abspath(os.fspath(frames))
    sessions = [frames] if hasattr(frames, "write") else list(frames)
    names = [session.name for session in sessions]
    if len(set(names)) < len(names):
        raise ValueError(f"`frames`: sessions with one name replace each other: {sorted(names)}")
    if foreign := sorted(set(os.listdir(folder) if os.path.isdir(folder) else []) - set(names)):
        raise ValueError(f"`frames`: {folder} holds other sessions: {foreign}; remove them")
    for session in sessions:
        session.write(os.path.join(folder, session.name))
    return folder


def _put(table, key, value):
    """Puts a value at a dotted key."""
    if isinstance(value, dict) and isinstance(table.get(key), dict):
        for inner, own in value.items():
            _put(table[key], inner, own)
        return
    *path, last = key.split(".")
    for part in path:
        table = table.setdefault(part, {})
        if not isinstance(table, dict):
            raise ValueError(f'`set`: "{key}" lies in "{part}", which has a value')
    table[last] = value


def _on_threads(begun, _, shards, workers, bar):
    pool = concurrent.futures.ThreadPoolExecutor(workers or os.cpu_count() or 1)
    try:
        for done in concurrent.futures.as_completed([pool.submit(begun.make, shard) for shard in range(shards)]):
            done.result()
            bar.step()
    finally:
        # waits for the files under way
        pool.shutdown(wait=True, cancel_futures=True)
        bar.end()


def _begin(spec, folder, overrides):
    """The data set in its folder."""
    return DataFolder.begin(spec, folder, overrides)


def _shard(spec, folder, overrides, shard):
    """One file, by a worker of Ray."""
    return _begin(spec, folder, overrides).make(shard)


def _on_ray(_, arguments, shards, workers, bar):
    import ray

    own = not ray.is_initialized()
    if own:
        ray.init(log_to_driver=False, include_dashboard=False)
    try:
        task = ray.remote(num_cpus=1, max_retries=3)(_shard)
        most = workers or max(1, int(ray.cluster_resources().get("CPU", 1)))
        waiting, running = iter(range(shards)), []
        while True:
            while len(running) < most and (shard := next(waiting, None)) is not None:
                running.append(task.remote(*arguments, shard))
            if not running:
                break
            done, running = ray.wait(running)
            for one in done:
                ray.get(one)
                bar.step()
    finally:
        bar.end()
        if own:
            ray.shutdown()


class _Bar:
    """Files done of all, on standard error."""

    def __init__(self, steps, shown):
        self._steps, self._shown, self._done, self._begin = steps, shown, 0, time.monotonic()

    def step(self):
        self._done += 1
        if self._shown:
            left = (time.monotonic() - self._begin) * (self._steps - self._done) / self._done
            width = 40 * self._done // self._steps
            sys.stderr.write(
                f"\rfiles {'█' * width}{'·' * (40 - width)} {self._done}/{self._steps} (left {left:.0f} s) "
            )
            sys.stderr.flush()

    def end(self):
        if self._shown and self._done:
            sys.stderr.write("\n")
