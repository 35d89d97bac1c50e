"""From measurements to tactile images."""

from __future__ import annotations

import functools

import numpy as np

from ._spts import Decoder, Skin, auto_decoder, decoder_table

#: What `decode`, `spts.envs` and `spts.decoders.ImageDecoder` take unless a decoder is named: the one of `auto(skin)`.
DEFAULT = "auto"

# Decoders that learn from images without labels.
_TAUGHT = {name for name, _, needs in decoder_table() if needs == "images"} | {"mixture"}
# Decoders that take neighbours from rows and columns; taxels in one row are arranged on a grid by their places.
_NEIGHBOURS = {"amortised", "tv", "patches"}
# Most taxels of a decoder, and most that are arranged.
MOST_TAXELS = 2048
_MOST_ARRANGED = 16_384
# Half sizes of the touches of a prior: the least as a share of the pitch, the most as a share of the skin's extent.
_LEAST, _MOST = 0.35, 0.25
# Scatter of the gains of a skin's taxels, as standard deviation of the logarithm.
_GAIN = 0.3
# Values of the images that are computed at once.
_SLICE = 200_000


def prior(skin, count=3000, seed=0):
    """Images of touches anywhere on a skin: what decoders learn from where nothing else is known of the objects.

    Half are ellipses, half are rectangles, turned anyhow; their half sizes are log-uniform from a third of the pitch to a
    quarter of the skin's extent. One half have even pressure, the other half are rounded. Taxels count by their places on
    the skin and not by their numbers, so that skins from points have as good a prior as grids. The gains of the taxels
    scatter as those of real skins.

    Parameters
    ----------
    skin : spts.Skin or (int, int)
        Or rows and columns of a flat grid.
    count : int
        Number of images, [1, 10^6].
    seed : int
        Of the random numbers.

    Returns
    -------
    ndarray (count, taxels)
        The largest taxel is near 1.
    """
    if not 1 <= count <= 1_000_000:
        raise ValueError(f"`count` = {count} is outside [1, 10^6]")
    return _touches(*_geometry(skin), count, seed)


def _touches(places, normals, count=3000, seed=0):
    rng, taxels = np.random.default_rng(seed), len(places)
    pitch, extent = pitch_of(places), float(np.linalg.norm(np.ptp(places, axis=0)))
    most = max(_MOST * extent, _LEAST * pitch)
    images = []
    for first in range(0, count, max(1, _SLICE // taxels)):
        n = min(max(1, _SLICE // taxels), count - first)
        at = rng.integers(taxels, size=n)
        normal = normals[at]
        # two directions of the surface, turned anyhow
        across = np.eye(3)[np.abs(normal).argmin(axis=1)]
        x = np.cross(normal, across)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        y = np.cross(normal, x)
        cos, sin = (f(rng.uniform(0.0, 2 * np.pi, (n, 1))) for f in (np.cos, np.sin))
        x, y = cos * x + sin * y, cos * y - sin * x
        half = _LEAST * pitch * (most / (_LEAST * pitch)) ** rng.uniform(0.0, 1.0, (n, 2))
        shift = pitch * rng.uniform(-0.5, 0.5, (n, 2))
        away = places[None] - places[at][:, None]
        # in half sizes; a taxel has a width, too
        u = np.abs(np.einsum("ntk,nk->nt", away, x) - shift[:, :1]) / (half[:, :1] + 0.25 * pitch)
        v = np.abs(np.einsum("ntk,nk->nt", away, y) - shift[:, 1:]) / (half[:, 1:] + 0.25 * pitch)
        radius = np.where(rng.random((n, 1)) < 0.5, np.maximum(u, v), np.hypot(u, v))
        image = np.clip(2.5 - 2.0 * radius, 0.0, 1.0) * (normal @ normals.T > 0.3)
        image *= np.where(rng.random((n, 1)) < 0.5, np.clip(1.0 - 0.9 * radius**2, 0.0, 1.0), 1.0)
        # a touch between the taxels of a sparse skin is felt by the nearest
        image[np.arange(n), at] = np.maximum(image[np.arange(n), at], 0.1)
        image /= image.max(axis=1, keepdims=True)
        images.append(image * np.exp(_GAIN * rng.standard_normal((n, taxels))))
    return np.concatenate(images)


def _geometry(skin):
    """Places and normals (taxels, 3) of the taxels of a skin, or of a grid with pitch 1."""
    if isinstance(skin, Skin):
        return skin.positions, skin.normals
    rows, cols = skin
    at = np.stack(np.meshgrid(np.arange(cols), -np.arange(rows), 0), axis=-1).reshape(-1, 3).astype(np.float64)
    return at, np.tile((0.0, 0.0, 1.0), (len(at), 1))


def pitch_of(places):
    """Distance of a taxel from its nearest neighbour: the median over the taxels; 1 for one taxel."""
    if len(places) < 2:
        return 1.0
    some = np.linspace(0, len(places) - 1, min(len(places), 256)).astype(int)
    away = np.stack([np.linalg.norm(places - places[k], axis=1) for k in some])
    away[np.arange(len(some)), some] = np.inf
    return max(float(np.median(away.min(axis=1))), 1e-9)


def auto(skin):
    """Name of the decoder that "auto" stands for on a skin: the best of those that need no recordings.

    It is "amortised" on up to 2,048 taxels, and "patches" on more (docs/python.md, "Which decoder").

    Parameters
    ----------
    skin : spts.Skin or (int, int)
        Or rows and columns of a flat grid.

    Returns
    -------
    str
    """
    return auto_decoder(*_shape(skin))


def _shape(skin):
    """Rows and columns of a skin."""
    return skin.shape if isinstance(skin, Skin) else (int(skin[0]), int(skin[1]))


def learned(decoder, skin, images=None, labels=None):
    """A decoder for a skin, or for rows and columns, that has learned from `images`; without them from `prior(skin)`,
    if it learns from images at all."""
    shape = _shape(skin)
    if decoder == DEFAULT:
        decoder = auto_decoder(*shape)
    if images is not None:
        return Decoder(decoder, shape, images, labels)
    taxels = shape[0] * shape[1]
    if decoder in _NEIGHBOURS and isinstance(skin, Skin) and 1 in shape and taxels <= _MOST_ARRANGED:
        return _arranged(decoder, shape, *_key(skin))
    # what cannot be is refused there
    if decoder not in _TAUGHT or not 1 <= taxels <= MOST_TAXELS:
        return _untaught(decoder, shape)
    return _taught(decoder, shape, *_key(skin if isinstance(skin, Skin) else shape))


def learned_of(decoder, parts, count=3000):
    """A decoder for taxels in a row that has learned from touches of one part at a time. A part has the numbers of its
    taxels, their places and their normals."""
    taxels = sum(len(numbers) for numbers, *_ in parts)
    if decoder == DEFAULT:
        decoder = auto_decoder(1, taxels)
    if decoder in _NEIGHBOURS:
        at, outwards = np.zeros((2, taxels, 3))
        end = 0.0
        for numbers, places, normals in parts:
            # beside each other, with a gap
            at[numbers] = places - places.min(axis=0) + (end, 0.0, 0.0)
            outwards[numbers] = normals
            end = at[numbers, 0].max() + 5.0 * pitch_of(places)
        return Decoder(decoder, (1, taxels), surface=(at, outwards))
    if decoder not in _TAUGHT:
        return _untaught(decoder, (1, taxels))
    images = []
    for k, (numbers, places, normals) in enumerate(parts):
        share = np.zeros((max(1, round(count * len(numbers) / taxels)), taxels))
        share[:, numbers] = _touches(places, normals, len(share), k)
        images.append(share)
    return Decoder(decoder, (1, taxels), np.concatenate(images))


@functools.lru_cache(maxsize=32)
def _key(skin):
    """By what skins are the same to a decoder."""
    return tuple(array.tobytes() for array in _geometry(skin))


@functools.lru_cache(maxsize=32)
def _untaught(decoder, shape):
    return Decoder(decoder, shape)


@functools.lru_cache(maxsize=32)
def _arranged(decoder, shape, places, normals):
    surface = tuple(np.frombuffer(array).reshape(-1, 3) for array in (places, normals))
    return Decoder(decoder, shape, surface=surface)


@functools.lru_cache(maxsize=32)
def _taught(decoder, shape, places, normals):
    places, normals = (np.frombuffer(array).reshape(-1, 3) for array in (places, normals))
    return Decoder(decoder, shape, _touches(places, normals))


def decode(phi, y, shape, decoder=DEFAULT, prior=None):
    """Tactile image of one window of measurements.

    Parameters
    ----------
    phi : ndarray (M, taxels)
        Rows of the sensing matrix, as `Wire.record` gives them.
    y : ndarray (M,)
        Measurements without the output of the untouched skin, V.
    shape : spts.Skin or (int, int)
        The skin; rows and columns of taxels will do for a flat one.
    decoder : str
        One of `spts.decoders.names()`, or "auto", which takes `spts.auto(shape)`.
    prior : ndarray (n, taxels) or (n, rows, cols), optional
        Raster images like those to come, in any unit. Default: touches anywhere on the skin, `spts.prior(shape)`, for
        decoders that learn from images. What is learned without a prior is kept for the next call; with one,
        `spts.decoders` learns once.

    Returns
    -------
    ndarray (rows, cols)
        Image, one value a taxel, in the unit of y: what the taxel alone would give with the weight 1.

    Raises
    ------
    ValueError
        For arrays of other shapes, and for `phi` and `y` in the other order.
    """
    phi, y = _real(phi, y)
    for name, array, needed, ndim in (("phi", phi, "(M, taxels)", 2), ("y", y, "(M,)", 1)):
        if array.ndim != ndim:
            one = f": take {name}[0]" if array.ndim == ndim + 1 else ""
            raise ValueError(f"`{name}` has shape {array.shape}; {needed} is needed{one}")
    if prior is not None:
        prior = as_images(prior, _shape(shape), "prior")
    found = learned(decoder, shape, prior)
    return found.decode(phi, y)


def _real(phi, y):
    """Both as arrays of real numbers, in this order."""
    if np.iscomplexobj(phi) or np.iscomplexobj(y):
        raise ValueError("`phi` and `y` are real; one of them is complex")
    phi, y = np.asarray(phi, np.float64), np.asarray(y, np.float64)
    if y.ndim > 1 and y.shape[:-1] == phi.shape:
        raise ValueError(
            f"`phi` and `y` are swapped: their shapes are {phi.shape} and {y.shape}. `Wire.record` returns (y, phi)"
        )
    return phi, y


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
    phi, y = _real(phi, y)
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
