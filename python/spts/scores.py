"""Scores of decoders and of anybody's estimators, by the rules of `spts score`."""

from __future__ import annotations

import copy
import inspect
import json
import os
import tempfile
import threading
from types import SimpleNamespace

import numpy as np

from ._spts import Session, score_sessions, support_scores
from .dataset import Dataset
from .decode import windows

# Windows that an estimator which has not learned yet learns from, at least.
_LEARNED = 1000
# Numbers of resamplings of a band.
_RESAMPLINGS = 1000


class Scores:
    """A board: one line a decoder and number of measurements.

    Attributes
    ----------
    rows : list of dict
        `decoder`, `m`, `left_out`, `learned_from`, `sensing`, means of `support` (share of taxels on the right side of
        the support), `iou`, `f1`, `class_single` and so on, and their 95 % bands over objects, `iou_ci` and so on. On
        sessions also `ceiling` (how good the truth is, as an IoU), `worst_object` and `worst_iou`, `cosine` and
        `jaccard` (no threshold), and `iou_raster` (against one frame of a raster scan).
    objects : list of dict
        The same of every object.
    """

    def __init__(self, rows, objects, text):
        self.rows, self.objects, self._text = rows, objects, text

    def of(self, decoder, m, left_out=False, sensing="random"):
        """The line of a decoder at M measurements."""
        for row in self.rows:
            if (row["decoder"], row["m"], row["left_out"], row["sensing"]) == (decoder, m, left_out, sensing):
                return row
        raise ValueError(f'`decoder` = "{decoder}", `m` = {m}: there is no such line')

    def __repr__(self):
        return self._text


def score(
    estimator,
    data,
    *,
    measurements=(7, 20, 50),
    objects=(),
    left_out=False,
    learn_from="published",
    sensing="random",
    split="test",
    rows=None,
    times=False,
    seed=1,
):
    """Scores decoders and estimators on sessions or on a data set.

    Parameters
    ----------
    estimator : str, estimator, or a list or dict of them
        A decoder's name, or whatever has `predict(X)` with X as `spts.windows` makes it: images (n, taxels), or
        classes. An estimator that is fitted already is scored as it is. An unfitted one of scikit-learn is cloned and
        learns, for every M, from windows that are computed of raster images: `fit(X, images)`, or `fit(X, names)` of a
        classifier. An entrant of `spts bench` will do, too: `predict(phi, y)` with phi (M, taxels) and y (M,), which
        answers an image or (image, name). It is copied and learns with `fit(train)`, if it has `fit`; its `rows` and
        `read` are not called.
    data : str, os.PathLike, Session, sequence of Session, or Dataset
        Sessions, or the folder of them as `spts.load_all` takes it, or a data set.
    measurements : sequence of int
        M, [1, 10000].
    objects : sequence of str
        Sessions: objects that are scored; default all.
    left_out : bool
        Sessions: whether all are also scored on objects that they have not learned from.
    learn_from : str
        Sessions: "published", "raster" or "shapes", as of `spts score`.
    sensing : str, or sequence of str
        Sessions: "random", measurements that follow each other, or "chosen", rows that are chosen from those of a press
        without a look at its samples; as of `spts score`.
    split : str
        Data set: rows that are scored; what has not learned yet learns from the split "train".
    rows : (int, int), optional
        Data set: first row, and one beyond the last, that are looked at; default all.
    times : bool
        Sessions: whether decodes are timed.
    seed : int
        Of dictionary learning.

    Returns
    -------
    Scores
    """
    named = _named(estimator)
    measurements = sorted({int(m) for m in np.atleast_1d(measurements)})
    if not measurements:
        raise ValueError("`measurements` is empty")
    sensing = sorted({sensing} if isinstance(sensing, str) else set(sensing), reverse=True)
    if isinstance(data, Dataset):
        if sensing != ["random"]:
            raise ValueError(f"`sensing` = {sensing}: the rows of a data set are as they were made; valid: random")
        return _on_rows(named, data, measurements, split, rows)
    decoders = [given for _, given in named if isinstance(given, str)]
    given = [(name, Contender(given)) for name, given in named if not isinstance(given, str)]
    objects = [objects] if isinstance(objects, str) else list(objects)
    with tempfile.TemporaryDirectory() as folder:
        board, text = score_sessions(
            _folder(data, folder), decoders, given, measurements, objects, left_out, learn_from, sensing, times, seed
        )
    board = json.loads(board)
    return Scores(board["rows"], board["objects"], text)


def _folder(data, folder):
    """The folder of the sessions `data`, which are written into `folder` unless they are in one."""
    if isinstance(data, (str, os.PathLike)):
        return os.fspath(data)
    sessions = [data] if isinstance(data, Session) else data
    if not isinstance(sessions, (list, tuple)) or not all(isinstance(one, Session) for one in sessions):
        raise TypeError(
            f"`data` is of type {type(data).__name__}; valid: a folder, a Dataset, a Session, a list of Session"
        )
    if not sessions:
        raise ValueError("`data` holds no session")
    for number, session in enumerate(sessions):
        session.write(os.path.join(folder, f"{number:04}"))
    return folder


def _named(estimator):
    """Names and what they name."""
    if isinstance(estimator, dict):
        named = [(str(name), one) for name, one in estimator.items()]
    else:
        every = estimator if isinstance(estimator, (list, tuple)) else [estimator]
        named = [(one if isinstance(one, str) else type(one).__name__, one) for one in every]
    names = [name for name, _ in named]
    if not names or len(set(names)) < len(names):
        raise ValueError(
            f"`estimator` has the names {names}; each has to be there once: give a dict of name to estimator"
        )
    for name, one in named:
        if not isinstance(one, str) and not hasattr(one, "predict"):
            raise ValueError(f"`estimator` {name} is a {type(one).__name__}, which has no `predict`")
        if isinstance(one, type):
            raise ValueError(f"`estimator` is the class {one.__name__}: give an object of it, {one.__name__}()")
    return [(name, _Entrant(one) if not isinstance(one, str) and _is_entrant(one) else one) for name, one in named]


class Contender:
    """An estimator as the scorer asks it."""

    def __init__(self, estimator):
        self._estimator = estimator
        self._ready = _is_ready(estimator)

    def learn(self, images, labels, names, shape, left_out):
        """A function `(phi, y) -> (images or None, labels or None)`, once learned from these images."""
        numbers = {name: number for number, name in enumerate(names)}
        fitted, lock = {}, threading.Lock()

        def ready(phi):
            if self._ready:
                return self._estimator
            m = phi.shape[1]
            with lock:
                if m not in fitted:
                    fitted[m] = _fitted(self._estimator, images, labels, names, shape, phi)
            return fitted[m]

        def answers(phi, y):
            images, found = _asked(ready(phi), phi, y)
            if found is None:
                return images, None
            known = [numbers.get(str(v), -1) if isinstance(v, str) else int(v) for v in found.tolist()]
            return images, np.asarray(known, np.int64)

        return answers


class _Entrant:
    """An entrant of `spts bench` (docs/benchmark.md)."""

    def __init__(self, entrant):
        self.entrant = entrant

    def learned(self, images, names, shape, m):
        """A copy that has learned from images (n, taxels) with these names."""
        one, (rows, cols) = copy.deepcopy(self.entrant), shape
        if hasattr(one, "fit"):
            one.fit(SimpleNamespace(images=images, labels=list(names), rows=rows, cols=cols, measurements=[m]))
        return _Entrant(one)

    def answers(self, phi, y):
        """Images (n, taxels) of windows, and classes (n,) or None."""
        found = [self.entrant.predict(*window) for window in zip(phi, y)]
        found = [one if isinstance(one, tuple) else (one, None) for one in found]
        images = np.stack([np.asarray(image, np.float64).ravel() for image, _ in found])
        classes = None if all(name is None for _, name in found) else np.asarray([str(name) for _, name in found])
        return images, classes


def _is_entrant(estimator):
    """Whether its `predict` needs two arguments."""
    try:
        arguments = inspect.signature(estimator.predict).parameters.values()
    except (TypeError, ValueError):
        # not of Python
        return False
    return sum(a.default is a.empty and a.kind <= a.POSITIONAL_OR_KEYWORD for a in arguments) == 2


def _asked(estimator, phi, y):
    """Images (n, taxels) and classes (n,) of windows; None for what the estimator does not answer."""
    if isinstance(estimator, _Entrant):
        return estimator.answers(phi, y)
    found = np.asarray(estimator.predict(windows(phi, y)))
    if found.ndim == 1:
        return None, found
    return np.ascontiguousarray(found.reshape(len(found), -1), np.float64), None


def _is_ready(estimator):
    """Whether it has learned, or does not learn at all."""
    if isinstance(estimator, _Entrant):
        return not hasattr(estimator.entrant, "fit")
    if not hasattr(estimator, "fit"):
        return True
    from sklearn.exceptions import NotFittedError
    from sklearn.utils.validation import check_is_fitted

    try:
        check_is_fitted(estimator)
    except NotFittedError:
        return False
    except (AttributeError, TypeError):
        # not of scikit-learn: nobody knows
        return True
    return True


def _fitted(estimator, images, labels, names, shape, phi):
    """A copy that has learned from windows that are computed of images, with rows of Φ as in `phi` (n, M, taxels)."""
    if isinstance(estimator, _Entrant):
        return estimator.learned(images, [names[label] for label in labels], shape, phi.shape[1])
    again = -(-_LEARNED // len(images))
    images, labels = np.tile(images, (again, 1)), np.tile(labels, again)
    rows = phi[np.arange(len(images)) % len(phi)]
    X = windows(rows, np.einsum("nmk,nk->nm", rows, images))
    return _fitted_clone(estimator, X, images, labels, np.asarray(names)[labels], shape)


def _fitted_clone(estimator, X, images, labels, names, shape):
    from sklearn.base import clone, is_classifier

    one = clone(estimator)
    if "shape" in one.get_params():
        one.set_params(shape=tuple(shape))
    if is_classifier(one):
        return one.fit(X, names, images=images) if _takes(one, "images") else one.fit(X, names)
    return one.fit(X, images, labels=labels) if _takes(one, "labels") else one.fit(X, images)


def _takes(estimator, argument):
    """Whether `fit` has this argument."""
    return argument in inspect.signature(estimator.fit).parameters


def _on_rows(named, data, measurements, split, span):
    """Scores on rows of a data set."""
    phi, y, truths, names, presses = data.labelled(split, span)
    shape = data.shape
    most = y.shape[1]
    beyond = [m for m in measurements if m > most]
    if beyond:
        raise ValueError(f"`measurements` = {beyond[0]} is outside [1, {most}]: the rows have no more")
    learn = data.labelled("train", span) if any(not _learned(one) for _, one in named) else None
    lines, objects = [], []
    for name, one in named:
        for m in measurements:
            images, classes = _asked(_ready_for(one, learn, shape, m), phi[:, :m], y[:, :m])
            line = {"decoder": name, "m": m, "left_out": False}
            line |= {"learned_from": "given" if _learned(one) else "train", "sensing": "random"}
            values = {}
            if images is not None:
                values["support"], values["iou"] = support_scores(images, truths)
            if classes is not None:
                values["class_single"] = (classes.astype(str) == names.astype(str)).astype(float)
            bands = {f"{key}_ci": _band(value, names, presses) for key, value in values.items()}
            lines.append({**line, **{key: float(value.mean()) for key, value in values.items()}, **bands})
            for object in np.unique(names):
                own = names == object
                objects.append(
                    {**line, "object": str(object), **{key: float(value[own].mean()) for key, value in values.items()}}
                )
    return Scores(lines, objects, _table(lines))


def _learned(one):
    return not isinstance(one, str) and _is_ready(one)


def _ready_for(one, learn, shape, m):
    if _learned(one):
        return one
    phi, y, images, names, _ = learn
    if isinstance(one, _Entrant):
        return one.learned(images, names.tolist(), shape, m)
    if isinstance(one, str):
        from .decoders import ImageDecoder

        one = ImageDecoder(one)
    labels = np.unique(names, return_inverse=True)[1]
    return _fitted_clone(one, windows(phi[:, :m], y[:, :m]), images, labels, names, shape)


def _band(values, objects, presses):
    """95 % band of the mean, whole objects drawn anew; whole presses of a single object."""
    objects = np.unique(objects, return_inverse=True)[1]
    number = objects if objects.any() else np.unique(presses, return_inverse=True)[1]
    sums, counts = np.bincount(number, values), np.bincount(number)
    rng = np.random.default_rng(0)
    drawn = rng.integers(0, len(sums), (_RESAMPLINGS, len(sums)))
    means = sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)
    return [float(v) for v in np.percentile(means, [2.5, 97.5])]


def _table(lines):
    text = [f"{'decoder':<20} {'M':>5}  {'support':>8} {'IoU':>6} {'95 % band':>15} {'class':>6}"]
    for line in lines:
        low, high = line.get("iou_ci") or line["class_single_ci"]
        cells = [f"{line[key]:.3f}" if key in line else "–" for key in ("support", "iou", "class_single")]
        band = f"[{low:.3f}, {high:.3f}]"
        text.append(f"{line['decoder']:<20} {line['m']:>5}  {cells[0]:>8} {cells[1]:>6} {band:>15} {cells[2]:>6}")
    return "\n".join(text)
