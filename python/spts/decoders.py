"""Decoders and classifiers as scikit-learn has them: clone, grid search and pipelines work. Needs scikit-learn.

A decoder takes windows of measurements, as `spts.windows` makes them, and answers images::

    X = spts.windows(phi, y)                    # (n, M * (1 + taxels))
    est = spts.decoders.Mixture(shape=(10, 10)) # knows touches anywhere on the skin
    est = est.fit(X, images)                    # or images like those to come
    images = est.predict(X)                     # (n, taxels)
    est.score(X, truths)                        # mean intersection over union

There is one class a decoder: `Omp`, `NnLasso`, `NnLmmse`, `Tv` and so on; `names()` lists them all.
"""

from __future__ import annotations

import numpy as np
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.utils.multiclass import check_classification_targets
from sklearn.utils.validation import check_is_fitted, validate_data

from ._spts import ImageClassifier, decoder_table
from .decode import DEFAULT, as_images, learned, split
from .metrics import iou

_TABLE = {name: (about, needs) for name, about, needs in decoder_table()}


def names():
    """Names of all decoders."""
    return list(_TABLE)


class ImageDecoder(BaseEstimator):
    """Decodes windows of measurements into tactile images.

    Parameters
    ----------
    decoder : str
        One of `names()`, or "auto", which takes `spts.auto(shape)`.
    shape : (int, int)
        Rows and columns of taxels.
    """

    def __init__(self, decoder=DEFAULT, shape=(10, 10)):
        self.decoder = decoder
        self.shape = shape

    def fit(self, X=None, y=None, labels=None):
        """Learns from images.

        Parameters
        ----------
        X : ndarray (n, M * (1 + taxels)), optional
            Windows; decoders learn nothing from them.
        y : ndarray (n, taxels), optional
            True images. Default: touches anywhere on a flat skin, `spts.prior(shape)`, for decoders that learn from images.
        labels : ndarray (n,) of int, optional
            Classes of the images, from 0, for decoders that learn classes.
        """
        shape = (int(self.shape[0]), int(self.shape[1]))
        if X is not None:
            split(X, shape[0] * shape[1])
            self.n_features_in_ = np.shape(X)[1]
        images = None if y is None else as_images(y, shape, "y")
        labels = None if labels is None else np.asarray(labels, np.int64)
        self._built = learned(self.decoder, shape, images, labels)
        return self

    def predict(self, X):
        """Images (n, taxels) of windows (n, M * (1 + taxels)), in the unit of the measurements."""
        return self._decode(X)[0]

    def score(self, X, y):
        """Mean intersection over union of the supports with those of the images `y` (n, taxels)."""
        return float(np.mean(iou(self.predict(X)[:, None], as_images(y, self._built.shape, "y")[:, None])))

    def _decode(self, X):
        check_is_fitted(self, "_built")
        rows, cols = self._built.shape
        phi, y = split(X, rows * cols)
        return self._built.decode_all(np.ascontiguousarray(phi), np.ascontiguousarray(y))


class Evidence(ClassifierMixin, BaseEstimator):
    """Classifies windows of measurements by the evidence that they give for each class, without an image.

    Parameters
    ----------
    shape : (int, int)
        Rows and columns of taxels.
    """

    def __init__(self, shape=(10, 10)):
        self.shape = shape

    def fit(self, X, y, images=None):
        """Learns classes.

        Parameters
        ----------
        X : ndarray (n, M * (1 + taxels))
            Windows; nothing is learned from them.
        y : ndarray (n,)
            Class of every window.
        images : ndarray (n, taxels)
            Raster image of every window's press.
        """
        if images is None:
            raise ValueError("`images` is missing: the classes are learned from a raster image of every press")
        self.classes_, labels = np.unique(np.asarray(y), return_inverse=True)
        self._decoder = ImageDecoder("evidence", self.shape).fit(X, images, labels)
        return self

    def predict(self, X):
        """Classes (n,) of windows (n, M * (1 + taxels))."""
        check_is_fitted(self, "classes_")
        # the first class where there is no evidence at all
        return self.classes_[np.maximum(self._decoder._decode(X)[1], 0)]


class SparseClassifier(ClassifierMixin, BaseEstimator):
    """Classifies images by their sparsest representation among labelled ones, as the published decoder does.

    Parameters
    ----------
    sparsity : int
        Images that may represent one, [1, 1024].
    """

    def __init__(self, sparsity=10):
        self.sparsity = sparsity

    def fit(self, X, y):
        """Learns from images X (n, pixels) with classes y (n,)."""
        X, y = validate_data(self, X, y, dtype=np.float64)
        check_classification_targets(y)
        self.classes_, labels = np.unique(y, return_inverse=True)
        self._built = ImageClassifier(np.ascontiguousarray(X), labels.astype(np.int64), self.sparsity)
        return self

    def predict(self, X):
        """Classes (n,) of images X (n, pixels); the first class for an image of zeros."""
        check_is_fitted(self, "classes_")
        X = validate_data(self, X, dtype=np.float64, reset=False)
        return self.classes_[np.maximum(self._built.classify(np.ascontiguousarray(X)), 0)]


def _named(name):
    """The class of the decoder `name`, which is one of `ImageDecoder` with that name set."""
    about, needs = _TABLE[name]

    def __init__(self, shape=(10, 10)):
        self.shape = shape

    title = "".join(part.capitalize() for part in name.split("_"))
    doc = f"{about[0].upper()}{about[1:]}. Learns from {needs}.\n\nParameters\n----------\nshape : (int, int)\n    Rows and columns of taxels."
    members = {"__init__": __init__, "__doc__": doc, "__module__": __name__, "decoder": name}
    return title, type(title, (ImageDecoder,), members)


for _name in _TABLE:
    if _name != "evidence":
        _title, _class = _named(_name)
        globals()[_title] = _class

__all__ = ["Evidence", "ImageDecoder", "SparseClassifier", "names"] + [
    "".join(part.capitalize() for part in name.split("_")) for name in _TABLE if name != "evidence"
]
