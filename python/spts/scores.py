"""Scores of decoders and of anybody's estimators, by the rules of `spts score`."""

from __future__ import annotations

import json
import os
import threading

import numpy as np

from ._spts import score_sessions, support_scores
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
        A decoder's name, or whatever has `predict(X)` with X as `spts.windows` makes it: images (n, taxels), or classes. An
        estimator that is fitted already is scored as it is. Another one is cloned and learns, for every M, from windows
        that are computed of raster images: `fit(X, images)`, or `fit(X, names)` of a classifier.
    data : str, os.PathLike or Dataset
        Sessions, as `spts.load_all` takes them, or a data set.
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
    board, text = score_sessions(
        os.fspath(data), decoders, given, measurements, objects, left_out, learn_from, sensing, times, seed
    )
    board = json.loads(board)
    return Scores(board["rows"], board["objects"], text)


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
    return named


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
            found = np.asarray(ready(phi).predict(windows(phi, y)))
            if found.ndim == 1:
                known = [numbers.get(str(v), -1) if isinstance(v, str) else int(v) for v in found.tolist()]
                return None, np.asarray(known, np.int64)
            return np.ascontiguousarray(found.reshape(len(found), -1), np.float64), None

        return answers


def _is_ready(estimator):
    """Whether it has learned, or does not learn at all."""
    from sklearn.exceptions import NotFittedError
    from sklearn.utils.validation import check_is_fitted

    if not hasattr(estimator, "fit"):
        return True
    try:
        check_is_fitted(estimator)
    except NotFittedError:
        return False
    except TypeError:
        # not of scikit-learn: nobody knows
        return True
    return True


def _fitted(estimator, images, labels, names, shape, phi):
    """A clone that has learned from windows that are computed of images, with rows of Φ as in `phi` (n, M, taxels)."""
    from sklearn.base import clone, is_classifier

    one = clone(estimator)
    if "shape" in one.get_params():
        one.set_params(shape=tuple(shape))
    again = -(-_LEARNED // len(images))
    images, labels = np.tile(images, (again, 1)), np.tile(labels, again)
    rows = phi[np.arange(len(images)) % len(phi)]
    X = windows(rows, np.einsum("nmk,nk->nm", rows, images))
    if not is_classifier(one):
        if _takes(one, "labels"):
            return one.fit(X, images, labels=labels)
        return one.fit(X, images)
    targets = np.asarray([names[label] for label in labels])
    return one.fit(X, targets, images=images) if _takes(one, "images") else one.fit(X, targets)


def _takes(estimator, argument):
    """Whether `fit` has this argument."""
    import inspect

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
            X = windows(phi[:, :m], y[:, :m])
            found = np.asarray(_ready_for(one, learn, shape, m).predict(X))
            line = {"decoder": name, "m": m, "left_out": False}
            line |= {"learned_from": "given" if _learned(one) else "train", "sensing": "random"}
            if found.ndim == 1:
                values = {"class_single": (found.astype(str) == names.astype(str)).astype(float)}
            else:
                accuracy, iou = support_scores(np.ascontiguousarray(found.reshape(len(found), -1), np.float64), truths)
                values = {"support": accuracy, "iou": iou}
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
    if isinstance(one, str):
        from .decoders import ImageDecoder

        one = ImageDecoder(one)
    from sklearn.base import clone, is_classifier

    one = clone(one)
    if "shape" in one.get_params():
        one.set_params(shape=shape)
    X = windows(phi[:, :m], y[:, :m])
    if is_classifier(one):
        return one.fit(X, names, images=images) if _takes(one, "images") else one.fit(X, names)
    if _takes(one, "labels"):
        return one.fit(X, images, labels=np.unique(names, return_inverse=True)[1])
    return one.fit(X, images)


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
