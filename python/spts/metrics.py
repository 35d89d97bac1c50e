"""How good images are, as `spts score` and the published evaluation count it.

The support of an image is its taxels above 0.23 of its own largest value.
"""

from __future__ import annotations

import numpy as np

from ._spts import support_scores


def support_accuracy(images, truths):
    """Share of taxels on the right side of the support, one value an image.

    Parameters
    ----------
    images, truths : ndarray (n, taxels), (n, rows, cols) or (taxels,)
        Of the same shape. One image of rows and columns is `image[None]`.

    Returns
    -------
    ndarray (n,)
    """
    return support_scores(*_pairs(images, truths))[0]


def iou(images, truths):
    """Intersection over union of the supports, one value an image; shapes as of `support_accuracy`."""
    return support_scores(*_pairs(images, truths))[1]


def _pairs(images, truths):
    images, truths = np.asarray(images, np.float64), np.asarray(truths, np.float64)
    if images.shape != truths.shape or images.ndim == 0:
        raise ValueError(f"`images` has shape {images.shape} and `truths` {truths.shape}; both have to be the same")
    count = 1 if images.ndim == 1 else len(images)
    return images.reshape(count, -1), truths.reshape(count, -1)
