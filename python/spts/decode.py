"""From measurements to tactile images."""

from __future__ import annotations

import functools

import numpy as np

from ._spts import Decoder


@functools.lru_cache(maxsize=32)
def _of_layout(decoder: str, shape: tuple[int, int]) -> Decoder:
    return Decoder(decoder, shape)


def decode(phi, y, shape, decoder="nn_lmmse", prior=None):
    """Tactile image of one window of measurements.

    Parameters
    ----------
    phi : ndarray (M, taxels)
        Rows of the sensing matrix, as `Wire.record` gives them.
    y : ndarray (M,)
        Measurements without the output of the untouched skin, V.
    shape : (int, int)
        Rows and columns of taxels.
    decoder : str
        One of `spts.decoders.names()`.
    prior : ndarray (n, taxels) or (n, rows, cols), optional
        Raster images like those to come, in any unit. Default: random shapes on the layout. What is learned without a
        prior is kept for the next call; with one, `spts.decoders` learns once.

    Returns
    -------
    ndarray (rows, cols)
        Image, one value a taxel, in the unit of y.
    """
    shape = (int(shape[0]), int(shape[1]))
    if prior is None:
        learned = _of_layout(decoder, shape)
    else:
        learned = Decoder(decoder, shape, as_images(prior, shape, "prior"))
    return learned.decode(np.asarray(phi, np.float64), np.asarray(y, np.float64))


def windows(phi, y):
    """Windows as one array, a row a window: the M measurements, then the M rows of Φ, one after the other.

    Parameters
    ----------
    phi : ndarray (n, M, taxels) or (M, taxels)
    y : ndarray (n, M) or (M,)

    Returns
    -------
    ndarray (n, M * (1 + taxels))
        What the estimators of `spts.decoders` take as X.
    """
    phi, y = np.asarray(phi, np.float64), np.asarray(y, np.float64)
    if phi.ndim == 2 and y.ndim == 1:
        phi, y = phi[None], y[None]
    if phi.ndim != 3 or y.ndim != 2 or phi.shape[:2] != y.shape:
        raise ValueError(f"`phi` has shape {phi.shape} and `y` {y.shape}; (n, M, taxels) and (n, M) are needed")
    return np.concatenate([y, phi.reshape(len(phi), -1)], axis=1)


def split(X, taxels):
    """The rows of Φ (n, M, taxels) and the measurements (n, M) of `windows`."""
    X = np.asarray(X, np.float64)
    m, rest = divmod(X.shape[1], 1 + taxels) if X.ndim == 2 else (0, 1)
    if rest or m == 0:
        raise ValueError(f"`X` has shape {X.shape}; (n, M * (1 + {taxels})) is needed: `spts.windows` makes it")
    return X[:, m:].reshape(len(X), m, taxels), X[:, :m]


def as_images(images, shape, name):
    """Images (n, taxels) from those or from (n, rows, cols)."""
    images = np.asarray(images, np.float64)
    taxels = shape[0] * shape[1]
    if images.ndim == 3 and images.shape[1:] == tuple(shape):
        images = images.reshape(len(images), taxels)
    if images.ndim != 2 or images.shape[1] != taxels:
        raise ValueError(f"`{name}` has shape {images.shape}; (n, {taxels}) or (n, {shape[0]}, {shape[1]}) is needed")
    return np.ascontiguousarray(images)
