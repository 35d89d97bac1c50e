"""How good images are, as `spts score` and the published evaluation count it.

The support of an image is its taxels above 0.23 of its own largest value.
"""

from __future__ import annotations

import warnings

import numpy as np

from ._spts import support_scores

# Sides of an array up to which it is taken for what may be one image.
_SIDE = 64


def support_accuracy(images, truths):
    """Share of taxels on the right side of the support, one value an image.

    Parameters
    ----------
    images, truths : ndarray (n, taxels), (n, rows, cols) or (taxels,)
        Of the same shape. One image of rows and columns is `image[None]`: an array with two axes holds one image a
        row.

    Returns
    -------
    ndarray (n,)

    Warns
    -----
    UserWarning
        For an array with two axes that looks like one image: both sides have 2 to 64 entries. `images[:, None]` are n
        images, without a warning.
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
    if images.ndim == 2 and min(images.shape) > 1 and max(images.shape) <= _SIDE:
        warnings.warn(
            f"`images` has shape {images.shape}: it is scored as {count} images of {images.shape[1]} taxels. One image "
            f"of {count} x {images.shape[1]} taxels is `image[None]`; `images[:, None]` ends this warning",
            stacklevel=3,
        )
    return images.reshape(count, -1), truths.reshape(count, -1)
