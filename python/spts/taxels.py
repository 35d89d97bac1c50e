"""Taxels from files, and their neighbours: what `spts.mujoco.dress` places them by."""

from __future__ import annotations

import json
import math
import os
import re
from pathlib import Path

import numpy as np

# Lengths of the units of files, m.
UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3}

_PLACE, _NORMAL = ("x", "y", "z"), ("nx", "ny", "nz")
_NUMBERS = (*_PLACE, *_NORMAL, "area")
#: Columns that name the frame of a place, and all that a file may have; the last of them are not read.
FRAMES = ("link", "body", "site", "geom")
_COLUMNS = (*_NUMBERS, "wire", *FRAMES)
_PASSED = ("", "id", "index", "name")

# What may be wrong with lengths.
_UNIT = '; is the unit right? unit="mm" and unit="cm" are the others'

# Farthest place from the origin of its frame, m, largest area of a taxel, m², and side of what is one place, m.
_FAR, _LARGE, _APART = 10.0, 1.0, 5e-5


class Table:
    """Taxels of one source, as they are written there: places in the frames that `frames` names, as pairs of the column
    and its entries, or in that of `link`.

    Rows of zeros are places without a taxel, as in the iCub's files. `rows` has the numbers of the others.
    """

    def __init__(self, source, columns, *, unit="m", word="row", numbers=None, link=None, shared=False):
        #: Whether several taxels may be at one place.
        self.source, self.link, self.shared = source, link, shared
        count = len(next(iter(columns.values())))
        self._word, self._numbers = word, np.arange(count) if numbers is None else np.asarray(numbers)
        for name in _PLACE:
            if name not in columns:
                raise ValueError(f"{source}: no column `{name}`; it has: {', '.join(columns)}")
        given = [name for name in _NORMAL if name in columns]
        if given and len(given) < 3:
            raise ValueError(f"{source}: a normal needs `nx`, `ny` and `nz`; it has: {', '.join(given)}")
        values = np.full((count, len(_NUMBERS)), np.nan)
        for k, name in enumerate(_NUMBERS):
            if name in columns:
                try:
                    values[:, k] = columns[name]
                except (TypeError, ValueError):
                    raise ValueError(f"{source}: `{name}` has entries that are no numbers") from None
        known = [k for k, name in enumerate(_NUMBERS) if name in columns]
        # without normals those are NaN
        taken = (values[:, :3] != 0.0).any(axis=1) | (np.nan_to_num(values[:, 3:6]) != 0.0).any(axis=1)
        self.rows = np.flatnonzero(taken)
        if len(self.rows) == 0:
            raise ValueError(f"{source}: no taxel in it" + (f", {count} rows of zeros" if count else ""))
        values = values[taken]
        self.frames = [(kind, np.asarray(columns[kind])[taken]) for kind in FRAMES if kind in columns]
        self.wires = np.asarray(columns["wire"])[taken] if "wire" in columns else None
        if len(self.frames) > 1:
            raise ValueError(f"{source}: one column may name the frame; it has: {', '.join(k for k, _ in self.frames)}")
        self._need(np.isfinite(values[:, known]).all(axis=1), values, "a finite number in every column is needed")
        values[:, :3] *= UNITS[unit]
        values[:, 6] *= UNITS[unit] ** 2
        #: Places (n, 3), m, normals (n, 3) and areas (n,), m²; NaN where there are none.
        self.places, self.normals, self.areas = values[:, :3], values[:, 3:6], values[:, 6]
        near = np.linalg.norm(self.places, axis=1) <= _FAR
        self._need(near, self.places, f"m, farther than {_FAR:g} m from the origin{_UNIT}")
        if given:
            length = np.linalg.norm(self.normals, axis=1)
            self._need(
                length > 1e-12, self.normals, "a normal of zero length; without its columns the surface gives it"
            )
            self.normals /= length[:, None]
        if "area" in columns:
            valid = (self.areas > 0.0) & (self.areas <= _LARGE)
            self._need(valid, self.areas, f"m², `area` is outside (0, {_LARGE:g}] m²")

    def _need(self, good, values, text):
        if not good.all():
            k = int(np.argmin(good))
            raise ValueError(f"{self.where(k)}: {np.array2string(values[k], separator=', ')} {text}")

    def where(self, k):
        """Where the taxel k is written."""
        return f"{self.source}: {self._word} {self._numbers[self.rows[k]]}"


def tables(taxels, unit):
    """The `Table` of every source, with the link that the caller has named for it, or None.

    `taxels` is a path, several, an array, or a dict of those by links."""
    if unit not in UNITS:
        raise ValueError(f"`unit` = {unit!r}; valid: {', '.join(UNITS)}")
    given = taxels.items() if isinstance(taxels, dict) else [(None, taxels)]
    found = []
    for link, value in given:
        if isinstance(value, (str, os.PathLike)):
            value = [value]
        if np.iterable(value) and all(isinstance(path, (str, os.PathLike)) for path in value):
            found += [(link, table) for path in value for table in read(path, unit)]
        else:
            source = "`taxels`" if link is None else f'`taxels["{link}"]`'
            found.append((link, Table(source, _plain(source, value), unit=unit)))
    if not found:
        raise ValueError("`taxels` is empty: a path, several, or a dict of links to paths is needed")
    return found


def read(path, unit="m"):
    """The tables of a file: CSV, JSON, or the iCub's format."""
    data = Path(path).read_bytes()
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise ValueError(f"{path}: the file is UTF-16; save it as UTF-8")
    if b"\0" in data:
        raise ValueError(f"{path}: the file is not text: CSV, JSON or the iCub's format is needed")
    text = data.decode("utf-8-sig", errors="replace")
    if not text.strip():
        raise ValueError(f"{path}: the file is empty")
    if re.search(r"^\s*\[calibration\]", text, re.MULTILINE):
        found = [_icub(path, text, unit)]
    elif text.lstrip()[0] in "[{":
        found = _json(path, text, unit)
    else:
        found = [_csv(path, text.splitlines(), unit)]
    places = np.concatenate([table.places for table in found])
    if unit == "m" and places.any() and (places % 1.0 == 0.0).all():
        raise ValueError(f"{path}: all places are whole metres, such as {places[-1]}{_UNIT}")
    return found


def _icub(path, text, unit):
    """A file of the iCub's `skinGui/conf/positions`: fields, then a row of six numbers a taxel under `[calibration]`.

    The row's number is the taxel's in the skin part's port. Files have several taxels at one place, where only the place
    of a triangle of ten is known.
    """
    lines = text.splitlines()
    first = next(k for k, line in enumerate(lines) if line.strip().startswith("[calibration]")) + 1
    after = (k for k, line in enumerate(lines[first:], first) if line.lstrip().startswith("["))
    link = next((line.split()[1] for line in lines[:first] if re.match(r"\s*name\s+\S", line)), None)
    return _csv(path, lines[first : next(after, len(lines))], unit, first=first, link=link, shared=True)


def _csv(path, lines, unit, first=0, **of):
    lines = [line.partition("#")[0].strip() for line in lines]
    numbers = np.array([k for k, line in enumerate(lines, first + 1) if line])
    lines = [line for line in lines if line]
    if not lines:
        raise ValueError(f"{path}: no taxel in it")
    separator = next((mark for mark in ";," if mark in lines[0]), None)
    names = [field.strip(" \t\"'") for field in lines[0].split(separator)]
    if any(_number(name) is None for name in names):
        for name in names:
            _comma(path, numbers[0], name)
        names = [name.lower() for name in names]
        lines, numbers = lines[1:], numbers[1:]
        _known(path, names)
        if not lines:
            raise ValueError(f"{path}: no taxel under the header")
    elif len(names) in (3, 6):
        names = [*_PLACE, *_NORMAL][: len(names)]
    else:
        raise ValueError(
            f"{path}: line {numbers[0]} has {len(names)} numbers; without a header x y z or x y z nx ny nz are read"
        )
    counts = (
        [len(line.split()) for line in lines] if separator is None else [line.count(separator) + 1 for line in lines]
    )
    for number, count, line in zip(numbers, counts, lines):
        if count != len(names):
            for field in line.split(separator):
                _comma(path, number, field)
            raise ValueError(f"{path}: line {number} has {count} fields; the first line has {len(names)}")
    wanted = [k for k, name in enumerate(names) if name in _NUMBERS]
    try:
        values = np.loadtxt(lines, delimiter=separator, usecols=wanted, comments=None, ndmin=2)
    except ValueError:
        for number, line in zip(numbers, lines):
            fields = line.split(separator)
            for k in wanted:
                if _number(fields[k]) is None:
                    _comma(path, number, fields[k])
                    raise ValueError(
                        f"{path}: line {number}: `{names[k]}` = {fields[k].strip()!r} is no number"
                    ) from None
        raise
    columns = dict(zip((names[k] for k in wanted), values.T))
    for k, name in enumerate(names):
        if name in FRAMES or name == "wire":
            columns[name] = [line.split(separator)[k].strip(" \t\"'") for line in lines]
    return Table(path, columns, unit=unit, word="line", numbers=numbers, **of)


def _number(field):
    """A number as a file has it; None for what is none. 04 is what a decimal comma leaves."""
    try:
        return None if re.match(r"\s*[-+]?0\d", field) else float(field)
    except ValueError:
        return None


def _comma(path, line, field):
    if re.match(r"\s*[-+]?(\d+,\d+|0\d+)\s*$", field):
        raise ValueError(f"{path}: line {line}: {field.strip()!r} comes of a decimal comma; write numbers with a point")


def _known(source, names):
    for name in names:
        if name not in (*_COLUMNS, *_PASSED):
            raise ValueError(f"{source}: unknown column {name!r}; valid: {', '.join(_COLUMNS)}")
        if names.count(name) > 1 and name in _COLUMNS:
            raise ValueError(f"{source}: {names.count(name)} columns are called {name!r}")


def _json(path, text, unit):
    try:
        content = json.loads(text)
    except ValueError as error:
        raise ValueError(f"{path}: no JSON: {error}") from None
    if isinstance(content, dict) and isinstance(content.get("links"), dict):
        found = []
        for link, entry in content["links"].items():
            source = f'{path}: link "{link}"'
            if not isinstance(entry, dict) or not {"points"} <= set(entry) <= {"points", "normals", "areas", "wires"}:
                raise ValueError(f"{source}: `points` are needed, and `normals`, `areas` and `wires` are known")
            columns = _plain(f"{source}: `points`", entry["points"], 3)
            if "normals" in entry:
                columns.update(zip(_NORMAL, _plain(f"{source}: `normals`", entry["normals"], 3).values()))
            columns.update({name: entry[f"{name}s"] for name in ("area", "wire") if f"{name}s" in entry})
            for name, column in columns.items():
                if len(column) != len(columns["x"]):
                    raise ValueError(f"{source}: {len(columns['x'])} points, but {len(column)} of `{name}`")
            found.append(Table(source, columns, unit=unit, word="point", link=link))
        return found
    rows = content.get("taxels") if isinstance(content, dict) else content
    if not isinstance(rows, list) or not rows or not all(isinstance(row, dict) for row in rows):
        raise ValueError(f'{path}: a list of objects is needed, one a taxel, or "taxels" with it, or "links"')
    _known(path, list(rows[0]))
    columns = {name: [] for name in rows[0] if name in _COLUMNS}
    for k, row in enumerate(rows):
        if row.keys() != rows[0].keys():
            odd = ", ".join(sorted(row.keys() ^ rows[0].keys()))
            raise ValueError(f"{path}: taxel {k} differs from the first in its fields: {odd}")
        for name, column in columns.items():
            value = row[name]
            if name in _NUMBERS and (isinstance(value, bool) or not isinstance(value, (int, float))):
                raise ValueError(f"{path}: taxel {k}: `{name}` = {value!r} is no number")
            column.append(value if name in _NUMBERS else str(value))
    return [Table(path, columns, unit=unit, word="taxel")]


def _plain(source, values, *counts):
    """Columns of rows of 3 or 6 numbers."""
    counts = counts or (3, 6)
    try:
        values = np.asarray(values, np.float64)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.ndim != 2 or values.shape[1] not in counts:
        raise ValueError(f"{source}: rows of {' or '.join(map(str, counts))} numbers are needed")
    return dict(zip((*_PLACE, *_NORMAL), values.T))


def places_of(places):
    """Number of the place of every taxel, and how many taxels each place has."""
    x, y, z = np.round(places / _APART).astype(np.int64).T + (1 << 19)
    _, place, counts = np.unique((x << 40) + (y << 20) + z, return_inverse=True, return_counts=True)
    return place, counts


# Pairs that `nearest` looks at once.
_PAIRS = 500_000


def nearest(points, among=None, count=1, reach=np.inf, normals=None):
    """The `count` nearest of `among` to each of `points`, no farther than `reach`.

    Parameters
    ----------
    points : ndarray (n, 3)
    among : ndarray (m, 3), optional
        Default: the other points.
    normals : pair of ndarray (n, 3) and (m, 3), optional
        Those of both: only what looks the same way, within 60 degrees, is near.

    Returns
    -------
    numbers : ndarray (n, count) of int
    distances : ndarray (n, count)
        Infinite where there are fewer.
    """
    own = among is None
    among = points if own else among
    found, away = np.zeros((len(points), count), np.intp), np.full((len(points), count), np.inf)
    low = np.minimum(points.min(axis=0), among.min(axis=0))
    extent = float((np.maximum(points.max(axis=0), among.max(axis=0)) - low).max())
    reach = min(reach, 2.0 * extent + 1e-9)
    around = (np.array([-1, 0, 1])[:, None], np.array([-1, 0, 1]))

    def cells(places, side):
        across = math.floor(extent / side) + 3
        x, y, z = np.floor((places - low) / side).astype(np.int64).T + 1
        return (x * across + y) * across + z, across

    # cubes as small as leaves a few points in each, of those that have any
    side = reach
    while side > max(2.0**-19 * extent, 1e-9):
        filled = np.unique(cells(among, side)[0], return_counts=True)[1]
        if (filled**2).sum() <= max(2.0, 0.65 * count) * len(among):
            break
        side *= 0.8
    left = np.arange(len(points))
    while True:
        key, across = cells(among, side)
        order = np.argsort(key, kind="stable")
        key, sorted_ = key[order], among[order]
        mine, _ = cells(points[left], side)
        by = np.argsort(mine, kind="stable")
        left = left[by]
        # the cubes around a point: nine rows of three
        columns = mine[by][:, None] + (around[0] * across + around[1]).ravel() * across
        first = np.searchsorted(key, columns - 1)
        lengths = np.searchsorted(key, columns + 1, "right") - first
        whole = lengths.sum(axis=1)
        ends, short, start = np.cumsum(whole), [], 0
        while start < len(left):
            before = ends[start - 1] if start else 0
            stop = max(start + 1, int(np.searchsorted(ends, before + _PAIRS)))
            part, sizes = left[start:stop], lengths[start:stop].ravel()
            row = np.repeat(np.arange(stop - start), whole[start:stop])
            other = np.arange(len(row)) + np.repeat(first[start:stop].ravel() + sizes - np.cumsum(sizes), sizes)
            to = points[part][row] - sorted_[other]
            square = np.einsum("ij,ij->i", to, to)
            near = np.flatnonzero(square <= side**2)
            row, other, square = row[near], order[other[near]], square[near]
            near = part[row] != other if own else np.ones(len(row), bool)
            if normals is not None:
                near &= np.einsum("ij,ij->i", normals[0][part[row]], normals[1][other]) > 0.5
            row, other, square = row[near], other[near], square[near]
            by = np.lexsort((square, row))
            row, other, square = row[by], other[by], square[by]
            rank = np.arange(len(row)) - np.searchsorted(row, np.arange(stop - start))[row]
            taken = rank < count
            at = part[row[taken]], rank[taken]
            found[at], away[at] = other[taken], np.sqrt(square[taken])
            short.append(part[np.isinf(away[part, -1])])
            start = stop
        left = np.concatenate(short)
        if len(left) == 0 or side >= reach:
            return found, away
        side = min(1.4 * side, reach)


# Directions in which a cell is measured, and its reach towards the open, in distances of the two nearest.
_RAYS, _WIDE, _OPEN = 16, 1.2, 0.5


def areas_of(places, normals):
    """Areas of taxels (n,), m²: of their Voronoi cells in their tangent planes, among the eight nearest that look their
    way. A cell without a bound within 1.2 of the mean distance of the two nearest ends at half that distance. NaN for a
    taxel with fewer than two others within 0.1 m.
    """
    found, away = nearest(places, None, 8, 0.1, (normals, normals))
    spacing = away[:, :2].mean(axis=1)
    alone = np.isinf(spacing)
    spacing[alone] = 1.0
    u = np.cross(normals, np.eye(3)[np.abs(normals).argmin(axis=1)])
    u /= np.linalg.norm(u, axis=1, keepdims=True)
    v = np.cross(normals, u)
    # of the lines half-way to the neighbours, the inverse of the distance along a ray is a sum of these
    a, b = np.empty(found.T.shape), np.empty(found.T.shape)
    for k, other in enumerate(found.T):
        to = places[other] - places
        a[k], b[k] = np.einsum("ij,ij->i", to, u), np.einsum("ij,ij->i", to, v)
        half = np.where(np.isfinite(away[:, k]), np.maximum(0.5 * (a[k] ** 2 + b[k] ** 2), 1e-300), np.inf)
        a[k] /= half
        b[k] /= half
    nearer, whole = 1.0 / (_WIDE * spacing), np.zeros(len(places))
    for angle in (np.arange(_RAYS) + 0.5) * (2.0 * np.pi / _RAYS):
        inverse = (a * np.cos(angle) + b * np.sin(angle)).max(axis=0)
        whole += np.where(inverse < nearer, _OPEN * spacing, 1.0 / np.maximum(inverse, nearer)) ** 2
    whole[alone] = np.nan
    return whole * (np.pi / _RAYS)
