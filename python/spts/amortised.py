"""Trains the decoder `amortised`: a small network that turns samples and rows into an image, for objects never seen,
anywhere on sheets of any rows and columns.

::

    python -m spts.amortised --out amortised.safetensors
    spts decode SESSION --decoder amortised --weights amortised.safetensors

Needs `pip install 'spts-twin[train]'`. All numbers are functions of the options: a machine of the same type with the
same versions of jax writes the same file.

What is learned from are touches of the twin by procedural shapes (`spts dataset specs --show unseen-shapes`) and drawn
images, and nothing that was recorded. Every example is a sheet of its own size with one to five contacts anywhere; its
taxels get gains of their own, and what they sum up to under the rows of a window, with noise, is what the network sees.
`spts_recon::recover::Unrolled` documents the formulas, which `network` computes for many windows at once.

After Gregor and LeCun, "Learning fast approximations of sparse coding", ICML 2010, for unrolled steps, here with an
exact Gaussian solve in each.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import queue
import sys
import tempfile
import threading

import numpy as np

__all__ = ["train"]

# A taxel counts as touched above this share of the image's maximum, as everywhere in the project.
THRESHOLD = 0.23
# Log-sd of the gains of the taxels, uniform; of a smooth factor over the sheet; of a plane over the sheet; and between
# a session and the scan that is its truth.
GAINS, SMOOTH, PLANE, SESSION = (0.2, 0.6), (0.0, 0.3), (0.0, 0.3), 0.12
# Length over which the smooth factor changes, taxels.
SMOOTH_LENGTH = 2.5
# Root mean square of the noise of a sample, as a share of the image's length, log-uniform; the same as a share of the
# sample.
NOISE, NOISE_OF_SAMPLE = (0.03, 0.16), 0.04
# Widths of the Gaussians of the prior, taxels, and of each of its kinds the weights of both, of a constant and of
# independent taxels: N times the covariance of images of length 1 is 1 on the diagonal.
WIDTHS = (1.2, 4.5)
PRIORS = np.array(
    [
        [0.05, 0.05, 0.02, 0.88],  # taxels apart from each other
        [0.42, 0.09, 0.01, 0.48],  # thin contacts
        [0.47, 0.19, 0.02, 0.32],  # contacts some taxels wide
        [0.22, 0.45, 0.13, 0.20],  # loads of large parts of the sheet
    ],
    np.float32,
)
# nu: variance of the noise of a sample in the linear estimate, images being scaled to length 1.
NOISE_VARIANCE = 0.012
# Largest sheets, most samples and fewest rows and columns of sheets of a batch, and how often each is drawn.
CANVASES = {(10, 10, 56, 6): 4.5, (16, 16, 72, 6): 4, (32, 32, 104, 12): 1.5}
# Steps of the shipped network, taxels of a batch and largest rate of learning.
STEPS, PIXELS, RATE = 7_500, 12_000, 2e-3
# Sides of the rectangles that are tried as contacts, taxels; they lie a quarter of a side apart.
SIDES = (1, 2, 3, 4, 5, 6, 8, 12, 16, 24, 32, 48, 64)
# Shares of the energy of a contact in its mean and in what taxels differ by.
EVEN, UNEVEN = 0.75, 0.25
# Weight of the sum of the standard deviations over taxels that take part: they are to be zero where nothing is.
SPREAD = 3e-3
# Blocks of the network, channels and memory of a taxel.
BLOCKS, CHANNELS, MEMORY = 4, 24, 13
# Share of images with one contact; others have two to five.
ONE_BODY = 0.72
# Share of contacts that are touches of the twin; others are drawn, of kinds that are chosen this often.
TOUCHES = 0.6
DRAWN = {
    "plus": 1.5,
    "cross": 1.5,
    "lattice": 1.0,
    "dotted": 1.5,
    "line": 2.0,
    "lines": 1.5,
    "circle": 1.0,
    "foot": 1.5,
    "hand": 1.5,
    "whole": 2.5,
    "sprinkle": 1.5,
    "checker": 1.0,
    "dots": 1.0,
    "point": 0.5,
}
# Data sets of touches: what of the spec `unseen-shapes` differs, and rows. The first two have touches about the middle
# of the published skin, the second of them by what covers the sheet; of the others, contacts are cut out and placed
# anywhere.
_ANYWHERE = {"pose.x_share": {"uniform": [-0.3, 0.3]}, "pose.y_share": {"uniform": [-0.3, 0.3]}}
_BROAD = {
    "object.names": ["plate", "blob", "dome", "gear", "perforated"],
    "object.relief_m": [0.0005, 0.005],
    "object.size_m": [0.2, 0.3],
    "press.stiffness_pa_per_m": 1e6,
}


def _sheet(side, pitch):
    return {"skin.rows": side, "skin.cols": side, "skin.pitch_m": pitch}


MIDDLE = {
    "middle": (60_000, {}),
    "broad": (8_000, {**_BROAD, "press.force_n": {"log_uniform": [20.0, 200.0]}}),
}
CUT = {
    "coarse": (50_000, {**_sheet(32, 0.015), **_ANYWHERE, "object.size_m": [0.02, 0.14]}),
    "large": (20_000, {**_sheet(32, 0.015), **_ANYWHERE, "object.size_m": [0.05, 0.3]}),
    "fine": (20_000, {**_sheet(24, 0.006), **_ANYWHERE, "object.size_m": [0.01, 0.1]}),
    "sheet": (8_000, {**_sheet(20, 0.015), **_BROAD, "press.force_n": {"log_uniform": [20.0, 400.0]}}),
}


def crops(values, shape):
    """Images of `values` cut to what is above 1 % of the maximum, maximum 1: list of 2-D arrays."""
    found = []
    for image in np.asarray(values, np.float32).reshape(-1, *shape):
        peak = image.max()
        if peak <= 0 or (image > THRESHOLD * peak).sum() < 2:
            continue
        image = image / peak
        r, c = np.nonzero((image > 0.01).any(1))[0], np.nonzero((image > 0.01).any(0))[0]
        found.append(image[r[0] : r[-1] + 1, c[0] : c[-1] + 1].copy())
    return found


def turned(image, rng):
    """One of the eight symmetries."""
    k = rng.integers(8)
    if k & 4:
        image = image.T
    return image[:: 1 if k & 1 else -1, :: 1 if k & 2 else -1]


def paste(canvas, image, row, col, strength):
    """Adds `image` with its middle at (row, col); what lies beside the sheet is cut off."""
    r, c = round(row - (image.shape[0] - 1) / 2), round(col - (image.shape[1] - 1) / 2)
    r0, c0 = max(r, 0), max(c, 0)
    r1, c1 = min(r + image.shape[0], canvas.shape[0]), min(c + image.shape[1], canvas.shape[1])
    if r1 > r0 and c1 > c0:
        canvas[r0:r1, c0:c1] += strength * image[r0 - r : r1 - r, c0 - c : c1 - c]


def _segments(rows, cols, parts, width):
    """Taxels within `width` of segments ((r0, c0), (r1, c1), weight), smooth at the edge."""
    r, c = np.mgrid[:rows, :cols].astype(np.float32)
    out = np.zeros((rows, cols), np.float32)
    for (r0, c0), (r1, c1), weight, w in parts:
        dr, dc = r1 - r0, c1 - c0
        t = np.clip(((r - r0) * dr + (c - c0) * dc) / max(dr * dr + dc * dc, 1e-9), 0, 1)
        d = np.hypot(r - r0 - t * dr, c - c0 - t * dc)
        out = np.maximum(out, weight * np.clip((w + 0.5 * width - d) / width, 0, 1))
    return out


def drawn(kind, rows, cols, rng):
    """An image of a drawn kind on a sheet of rows x cols."""
    small = min(rows, cols)
    x = np.zeros((rows, cols), np.float32)

    def put(points):
        for r, c in points:
            if 0 <= r < rows and 0 <= c < cols:
                x[int(r), int(c)] = np.exp(rng.normal(0, 0.15))

    r0, c0 = int(rng.integers(1, rows - 1)), int(rng.integers(1, cols - 1))
    if kind in ("plus", "cross"):
        step, arm = rng.integers(1, 4), rng.integers(1, max(2, min(5, small // 2)) + 1)
        steps = [(1, 0), (-1, 0), (0, 1), (0, -1)] if kind == "plus" else [(1, 1), (-1, -1), (1, -1), (-1, 1)]
        middle = rng.random() < 0.6
        put(
            ([(r0, c0)] if middle else [])
            + [(r0 + step * k * a, c0 + step * k * b) for k in range(1, arm + 1) for a, b in steps]
        )
    elif kind in ("lattice", "checker"):
        p, q = (rng.integers(2, 5), rng.integers(2, 5)) if kind == "lattice" else (1, 1)
        h, w = rng.integers(2, 6, 2)
        put((r0 + p * i, c0 + q * j) for i in range(h) for j in range(w) if kind == "lattice" or (i + j) % 2 == 0)
    elif kind == "dotted":
        angle, step = rng.uniform(0, np.pi), rng.uniform(1.5, 3.5)
        put(
            (round(r0 + step * k * np.sin(angle)), round(c0 + step * k * np.cos(angle)))
            for k in range(rng.integers(2, 8))
        )
    elif kind in ("sprinkle", "dots", "point"):
        count = {"sprinkle": rng.integers(3, 13), "dots": rng.integers(2, 5), "point": 1}[kind]
        reach = rng.uniform(2, max(rows, cols))
        put(
            (
                np.clip(round(r0 + reach * rng.uniform(-1, 1)), 0, rows - 1),
                np.clip(round(c0 + reach * rng.uniform(-1, 1)), 0, cols - 1),
            )
            for _ in range(count)
        )
    elif kind in ("line", "lines"):
        parts = []
        for _ in range(1 if kind == "line" else rng.integers(2, 4)):
            angle, length = rng.uniform(0, np.pi), rng.uniform(3, max(4, min(1.2 * small, 16)))
            r, c = (
                (r0 + rng.uniform(-2, 2), c0 + rng.uniform(-2, 2))
                if kind == "line"
                else (r0 + rng.normal(0, 2), c0 + rng.normal(0, 2))
            )
            a, b = np.sin(angle) * length / 2, np.cos(angle) * length / 2
            parts.append(((r - a, c - b), (r + a, c + b), 1.0, rng.uniform(0.3, 0.7)))
        x = _segments(rows, cols, parts, 0.5)
    elif kind == "circle":
        r, c = np.mgrid[:rows, :cols]
        rows_, cols_ = (
            rng.uniform(1.5, max(2, min(small / 2, 6)), 2)
            if rng.random() < 0.4
            else (rng.uniform(1.5, max(2, min(small / 2, 6))),) * 2
        )
        d = (np.hypot((r - r0) / rows_, (c - c0) / cols_) - 1) * np.sqrt(rows_ * cols_)
        x = np.clip(rng.uniform(0.7, 1.3) - np.abs(d), 0, 0.8).astype(np.float32) + 0
    elif kind in ("foot", "hand"):
        length = rng.uniform(5, max(6, min(1.1 * max(rows, cols), 24)))
        angle = rng.uniform(-np.pi, np.pi)
        u, v = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)]) * rng.choice([-1, 1])
        at = np.array([r0, c0], float)

        def p(a, b):
            return tuple(at + length * (a * u + b * v))

        if kind == "foot":
            parts = [(p(-0.42, 0), p(-0.3, 0), rng.uniform(0.6, 1), 0.12 * length)]
            parts += [(p(0.2, -0.12), p(0.26, 0.12), rng.uniform(0.5, 1), 0.09 * length)]
            if rng.random() < 0.6:
                parts += [(p(-0.2, 0.1), p(0.15, 0.12), rng.uniform(0.1, 0.6), 0.06 * length)]
            for k in range(5):
                parts.append(
                    (p(0.42 - 0.03 * k, -0.15 + 0.08 * k),) * 2 + (rng.uniform(0.2, 0.9), (0.05 - 0.005 * k) * length)
                )
        else:
            parts = [(p(-0.3, -0.1), p(-0.2, 0.15), rng.uniform(0.1, 1), 0.12 * length)] if rng.random() < 0.8 else []
            for k in range(5):
                b = -0.25 + 0.125 * k
                far = 0.45 - 0.1 * abs(k - 2) - (0.2 if k == 0 else 0)
                near = rng.uniform(0, 0.3) if rng.random() < 0.7 else far
                if rng.random() < 0.85:
                    parts.append((p(near if k else -0.1, b), p(far, 1.2 * b), rng.uniform(0.4, 1), 0.045 * length))
            parts = parts or [(p(0, 0), p(0.3, 0), 1.0, 0.05 * length)]
        x = _segments(rows, cols, [(a, b, w, max(s, 0.35)) for a, b, w, s in parts], max(0.6, 0.05 * length))
    elif kind == "whole":
        r, c = np.mgrid[:rows, :cols] / np.array([rows, cols]).reshape(2, 1, 1)
        x += rng.uniform(0, 0.5) if rng.random() < 0.5 else 0.0
        for _ in range(rng.integers(1, 6)):
            a, b, s, t = rng.uniform(0, 1), rng.uniform(0, 1), *rng.uniform(0.12, 0.5, 2)
            x += (rng.uniform(0.3, 1) * np.exp(-(((r - a) / s) ** 2) - ((c - b) / t) ** 2)).astype(np.float32)
    return x


class Source:
    """Images of touches on sheets of any size."""

    def __init__(self, cut, middle):
        # contacts, and whole images of ten by ten taxels
        self.cut, self.middle = cut, middle
        self._kinds = list(DRAWN)
        self._odds = np.array(list(DRAWN.values())) / sum(DRAWN.values())

    @classmethod
    def made(cls, folder):
        """From the data sets of touches, which are made in `folder` if they are not there yet."""
        import spts

        def touches(name, rows, changes):
            data = spts.dataset.make("unseen-shapes", os.path.join(folder, name), rows=rows, set=changes)
            return data["conductance_s"][np.asarray(data["split"]) != "test"], data.shape

        cut = []
        for name, wanted in CUT.items():
            cut += crops(*touches(name, *wanted))
        middle = np.concatenate([touches(name, *wanted)[0] for name, wanted in MIDDLE.items()]).astype(np.float32)
        peaks = middle.max(1, keepdims=True)
        touched = ((middle > THRESHOLD * peaks).sum(1) >= 2) & (peaks[:, 0] > 0)
        return cls(cut, middle[touched] / peaks[touched])

    def one(self, rows, cols, rng):
        """An image on a sheet of rows x cols: (rows, cols), at least one taxel touched."""
        if (rows, cols) == (10, 10) and rng.random() < 0.35:
            return turned(self.middle[rng.integers(len(self.middle))].reshape(10, 10).astype(np.float32), rng)
        for _ in range(50):
            x = np.zeros((rows, cols), np.float32)
            count = 1 if rng.random() < ONE_BODY else int(rng.integers(2, 6))
            for _ in range(count):
                kind = None if rng.random() < TOUCHES else str(rng.choice(self._kinds, p=self._odds))
                strength = np.exp(rng.normal(0, 0.35)) if count > 1 else 1.0
                if kind == "whole" and count > 1:
                    continue
                if kind:
                    x += strength * drawn(kind, rows, cols, rng)
                else:
                    paste(x, *self._placed(rows, cols, rng), strength)
            peak = x.max()
            if peak > 0.1 and (x > THRESHOLD * peak).sum() >= (1 if rng.random() < 0.1 else 2):
                return x / peak
        return np.ones((rows, cols), np.float32)

    def _placed(self, rows, cols, rng):
        """A contact, and the row and column of its middle."""
        image = turned(self.cut[rng.integers(len(self.cut))], rng)
        if rng.random() >= 0.85:
            return image, rows * (0.5 + 0.1 * rng.normal()) - 0.5, cols * (0.5 + 0.1 * rng.normal()) - 0.5
        row, col = rng.uniform(-0.5, rows - 0.5), rng.uniform(-0.5, cols - 0.5)
        if rng.random() < 0.6:
            # as far inside as it fits
            half = [(size - 1) / 2 for size in image.shape]
            row = np.clip(row, min(half[0], rows / 2), max(rows - half[0] - 1, rows / 2))
            col = np.clip(col, min(half[1], cols / 2), max(cols - half[1] - 1, cols / 2))
        return image, row, col


def _smooth(rows, cols, length):
    d = [
        np.exp(-np.square(np.subtract.outer(np.arange(n), np.arange(n))) / (2 * length**2)) + 1e-5 * np.eye(n)
        for n in (rows, cols)
    ]
    return [np.linalg.cholesky(k).astype(np.float32) for k in d]


def with_gains(images, rng):
    """The images under gains of the taxels that differ; with small values on taxels beside the contact now and then."""
    b, rows, cols = images.shape
    # conduction along the wires, and small offsets
    own = rng.random((b, 1, 1)) < 0.25
    share = rng.uniform(0, 0.06, (b, 1, 1)).astype(np.float32) * own
    along = [images.max(axis, keepdims=True) * rng.random((b, 1, 1), np.float32) for axis in (1, 2)]
    x = images + share * np.maximum(*along)
    own = rng.random((b, 1, 1)) < 0.25
    x = x + own * rng.uniform(0, 0.05, (b, 1, 1)) * rng.random((b, rows, cols), np.float32) ** 3
    r, c = _smooth(rows, cols, SMOOTH_LENGTH)
    wave = np.einsum("ij,bjk,lk->bil", r, rng.standard_normal((b, rows, cols), np.float32), c, optimize=True)
    log = (
        rng.uniform(*GAINS, (b, 1, 1)) * rng.standard_normal((b, rows, cols), np.float32)
        + rng.uniform(*SMOOTH, (b, 1, 1)) * wave
    )
    plane = [np.linspace(-1.7, 1.7, rows)[None, :, None], np.linspace(-1.7, 1.7, cols)[None, None, :]]
    for axis in plane:
        log = log + rng.uniform(*PLANE, (b, 1, 1)) * 0.7 * rng.standard_normal((b, 1, 1)) * axis
    x = x * np.exp(log)
    return (x / x.max((1, 2), keepdims=True)).astype(np.float32)


def samples(x, phi, rng):
    """y of images of length 1, (b, N), under rows (b, M, N), with noise."""
    felt = x * np.exp(SESSION * rng.standard_normal(x.shape, np.float32))
    y = np.einsum("bmn,bn->bm", phi, felt, optimize=True)
    share = np.exp(rng.uniform(*np.log(NOISE), (len(x), 1)))
    return (y + rng.standard_normal(y.shape) * np.sqrt(share**2 + (NOISE_OF_SAMPLE * y) ** 2)).astype(np.float32)


def random_rows(b, m, n, rng):
    bits = np.unpackbits(np.frombuffer(rng.bytes((b * m * n + 7) // 8), np.uint8), count=b * m * n)
    return (bits.astype(np.float32) * 2 - 1).reshape(b, m, n)


def chosen_rows(prior, count, noise, rng, candidates=500):
    """Rows of ±1 that lower the trace of the posterior covariance most, among random ones: (count, N)."""
    n = len(prior)
    rows = (rng.integers(0, 2, (candidates, n)) * 2 - 1).astype(np.float32)
    products = rows @ prior.astype(np.float32)
    along = np.einsum("cn,cn->c", products, rows)
    out = np.empty((count, n), np.float32)
    for k in range(count):
        best = np.argmax(np.square(products).sum(1) / (along + noise))
        out[k] = rows[best]
        u = products[best].copy()
        f = rows @ u / (along[best] + noise)
        products -= f[:, None] * u
        along = along - f * f * (along[best] + noise)
    return out


def cosine_rows(rows, cols, count, rng):
    """Signs of sums of few products of slow cosines along both axes: (count, N) of ±1."""
    y, x = (np.arange(size)[:, None] + 0.5 for size in (rows, cols))
    order = sorted(((i, j) for i in range(min(rows, 12)) for j in range(min(cols, 12))), key=lambda k: k[0] + k[1])
    mixed = rng.random() < 0.7
    out = np.empty((count, rows * cols), np.float32)
    for k in range(count):
        pairs = [order[k % len(order)]]
        if mixed or k >= len(order):
            pairs = [order[i] for i in rng.integers(0, min(24 + count, len(order)), 2)]
        wave = sum(
            (rng.normal() if mixed else 1.0) * np.cos(np.pi * i * y / rows) @ np.cos(np.pi * j * x / cols).T
            for i, j in pairs
        )
        out[k] = np.where(wave.ravel() >= 0, 1.0, -1.0)
    return out


def gaussians(rows, cols):
    """Factors along both axes of each Gaussian of the prior."""

    def near(n, w):
        apart = np.subtract.outer(np.arange(n), np.arange(n))
        return np.exp(-np.square(apart) / (2 * w * w)).astype(np.float32)

    return [(near(rows, w), near(cols, w)) for w in WIDTHS]


def prior_matrix(rows, cols):
    """The mean covariance of images of length 1 over all kinds, (N, N)."""
    w = PRIORS.mean(0)
    n = rows * cols
    k = sum(a * np.kron(r, c) for a, (r, c) in zip(w, gaussians(rows, cols)))
    return (k + w[2] + w[3] * np.eye(n)) / n


def intervals(size):
    """Which of `size` taxels in a line every interval of SIDES covers: (intervals, size), and their ends."""
    spans = [(start, start + side) for side in SIDES for start in range(0, size - side + 1, max(1, side // 4))]
    at = np.arange(size)
    covered = np.array([(at >= start) & (at < end) for start, end in spans], np.float32)
    return covered, np.array([end for _, end in spans], np.float32)


def regions(grid, y, count, size):
    """Where a contact that is a rectangle lies: the probability that a taxel is in it, its expected height (both (b,
    rows, cols)), the mean share of y that it explains and the mean logarithm of its area (b,)."""
    import jax
    import jax.numpy as jnp

    rows, cols = grid.shape[2:]
    (down, down_ends), (along, along_ends) = intervals(rows), intervals(cols)
    area = down.sum(1)[:, None] * along.sum(1)
    sums = jnp.einsum("bmrc,ir,jc->bmij", grid, down, along, optimize="optimal")
    c = UNEVEN + NOISE_VARIANCE
    share = EVEN / area
    spread = c + share * jnp.square(sums).sum(1)
    along_y = jax.nn.relu(jnp.einsum("bmij,bm->bij", sums, y))
    explained = share * along_y * along_y / spread / jnp.square(y).sum(1)[:, None, None]
    m = count.astype(jnp.float32)[:, None, None]
    evidence = -0.5 * m * jnp.log1p(-explained) - 0.5 * jnp.log(spread)
    fits = (down_ends[:, None] <= size[:, 0, None, None]) & (along_ends[None] <= size[:, 1, None, None])
    evidence = jnp.where(fits, evidence, -1e30)
    p = jnp.exp(evidence - evidence.max((1, 2), keepdims=True))
    p /= p.sum((1, 2), keepdims=True)
    spread_over = lambda v: jnp.einsum("bij,ir,jc->brc", v, down, along, optimize="optimal")  # noqa: E731
    whole = (p * explained).sum((1, 2)), (p * jnp.log(area)).sum((1, 2))
    return spread_over(p), spread_over(p * share * along_y / spread), *whole


def features():
    """Number of features of a taxel, and of the whole image."""
    # x, d, g, linear, mean, q1, q2, the rectangle's probability and height, and where the taxel lies
    return 12 + MEMORY, 6 + len(PRIORS) + 4 + MEMORY


def start(key):
    """Weights before training."""
    import jax

    taxel, whole = features()
    c, h = CHANNELS, MEMORY
    weights = {}
    for t in range(BLOCKS):
        key, k1, k2, k3 = jax.random.split(key, 4)
        weights[f"blocks.{t}.w1"] = jax.random.normal(k1, (taxel, c)) * np.sqrt(2 / taxel)
        weights[f"blocks.{t}.g1"] = jax.random.normal(k1, (whole, c)) * 0.1
        weights[f"blocks.{t}.b1"] = jax.numpy.zeros(c)
        weights[f"blocks.{t}.dw"] = (jax.random.normal(k2, (9, c)) * 0.25).at[4].add(0.7)
        weights[f"blocks.{t}.b2"] = jax.numpy.zeros(c)
        bias = jax.numpy.zeros(3 + h).at[1].set(0.2).at[2].set(0.2).at[3].set(-2.0)
        weights[f"blocks.{t}.w3"] = jax.random.normal(k3, (c, 3 + h)) * 0.3 / np.sqrt(c)
        weights[f"blocks.{t}.b3"] = bias
        # ln nu of the next solve: of image length, from the whole's features
        weights[f"blocks.{t}.nu"] = jax.numpy.zeros(whole + 1)
    return weights


def _solve(s, r):
    """S^-1 r for matrices (..., M, M) and vectors (..., M); its gradient takes one more solve and no matrix solve."""
    import jax
    import jax.numpy as jnp

    def both(lower, r):
        e = jax.scipy.linalg.solve_triangular(lower, r[..., None], lower=True)
        return jax.scipy.linalg.solve_triangular(lower, e, lower=True, trans=1)[..., 0]

    @jax.custom_vjp
    def solve(s, r):
        return both(jnp.linalg.cholesky(s), r)

    def forward(s, r):
        lower = jnp.linalg.cholesky(s)
        u = both(lower, r)
        return u, (lower, u)

    def backward(kept, change):
        lower, u = kept
        back = both(lower, change)
        return -back[..., :, None] * u[..., None, :], back

    solve.defvjp(forward, backward)
    return solve(s, r)


def network(weights, phi, y, count, size, rows, cols):
    """Images and logits after every block, the last of which is the answer, and the mean sum of the standard deviations
    over the taxels that take part.

    `phi` (b, M, N) and `y` (b, M) are zero from `count` (b,) on. Sheets have `size` (b, 2) rows and columns in the
    first corner of the canvas of `rows` x `cols`, beside which `phi` is zero.
    """
    import jax
    import jax.numpy as jnp

    b, most, pixels = phi.shape
    m = count.astype(jnp.float32)[:, None]
    size = size.astype(jnp.float32)
    n = size[:, :1] * size[:, 1:]
    r, c = jnp.arange(rows)[:, None] + jnp.zeros((b, 1, 1)), jnp.arange(cols)[None] + jnp.zeros((b, 1, 1))
    r_size, c_size = size[:, :1, None], size[:, 1:, None]
    inside = ((r < r_size) & (c < c_size)).astype(jnp.float32).reshape(b, pixels)

    grid = phi.reshape(b, most, rows, cols)
    eye = jnp.eye(most)
    factors = gaussians(rows, cols)
    smooth = lambda v, f: jnp.einsum("ij,...jk,kl->...il", f[0], v, f[1], optimize="optimal")  # noqa: E731
    parts = [jnp.einsum("bmn,bkn->bmk", smooth(grid, f).reshape(b, most, pixels), phi) for f in factors]
    sums = phi.sum(2)
    parts += [sums[:, :, None] * sums[:, None, :], jnp.einsum("bmn,bkn->bmk", phi, phi)]
    parts = jnp.stack(parts, 1) / n[:, :, None, None]

    # the linear estimate under each prior, and the evidence of each
    s_all = jnp.einsum("kp,bpmn->bkmn", PRIORS, parts) + NOISE_VARIANCE * eye
    lower_all = jnp.linalg.cholesky(s_all)
    e = jax.scipy.linalg.solve_triangular(
        lower_all, jnp.broadcast_to(y[:, None, :, None], (b, len(PRIORS), most, 1)), lower=True
    )
    length = jnp.sqrt((e[..., 0] ** 2).sum(2) / m + 1e-20)
    logdet = jnp.log(jnp.diagonal(lower_all, axis1=2, axis2=3)).sum(2) - 0.5 * (most - m) * np.log(NOISE_VARIANCE)
    evidence = -m * jnp.log(length) - logdet
    share = jax.nn.softmax(evidence, axis=1)
    s = jnp.exp((share * jnp.log(length)).sum(1, keepdims=True))

    def linear(u):
        """sum over kinds: share K Phi^T u, and share u."""
        u = u * share[:, :, None]
        back = (
            jnp.einsum("bpm,bmn->bpn", jnp.einsum("kp,bkm->bpm", PRIORS, u), phi).reshape(b, 4, rows, cols)
            / n[:, :, None, None]
        )
        out = (
            smooth(back[:, 0], factors[0])
            + smooth(back[:, 1], factors[1])
            + back[:, 2].sum((1, 2), keepdims=True)
            + back[:, 3]
        )
        return out.reshape(b, pixels) * inside, u.sum(1)

    lin, u = linear(jax.scipy.linalg.solve_triangular(lower_all, e, lower=True, trans=1)[..., 0])
    positive = jax.nn.relu(lin) + 1e-4 * s
    # taxels that take part, (sum x^2)^2 / sum x^4; a: height of an image of length s that has as many
    part = jnp.square(positive / s) * inside
    wide = jnp.square(part.sum(1, keepdims=True)) / jnp.square(part).sum(1, keepdims=True)
    a = s / jnp.sqrt(wide)
    y, lin, u = y / a, lin / a, u / jnp.sqrt((u * u).sum(1, keepdims=True) + 1e-20)

    ones = jnp.ones((b, pixels))
    likely, height, explained, extent = (jax.lax.stop_gradient(v) for v in regions(grid, y, count, size))
    likely, height = likely.reshape(b, pixels), height.reshape(b, pixels)
    x, d, mean = lin, lin, jax.nn.relu(lin)
    g = jnp.einsum("bmn,bm->bn", phi, u)
    q1, q2 = ones * jnp.sqrt(wide / n), 0 * ones
    h = jnp.zeros((b, pixels, MEMORY))
    left = ones[:, :1]
    fixed = [
        jnp.clip(jnp.log(m / n), -3.7, 0.0),
        jnp.clip(jnp.log(m / 20), -1.5, 1.7),
        jnp.log(wide / 10),
        jnp.log(wide / n),
        explained[:, None],
        extent[:, None] - 2,
        share,
    ]

    def blur(v):
        """(1 2 1)/4 along both axes, nothing beyond the edges; (..., rows, cols)."""
        pad = [(0, 0)] * (v.ndim - 2)
        w = jnp.pad(v, pad + [(1, 1), (0, 0)])
        v = 0.25 * w[..., :-2, :] + 0.5 * v + 0.25 * w[..., 2:, :]
        w = jnp.pad(v, pad + [(0, 0), (1, 1)])
        return 0.25 * w[..., :-2] + 0.5 * v + 0.25 * w[..., 2:]

    u_, v_ = jnp.abs(2 * r + 1 - r_size) / r_size, jnp.abs(2 * c + 1 - c_size) / c_size
    edge = jnp.minimum(jnp.minimum(r, r_size - 1 - r), jnp.minimum(c, c_size - 1 - c))
    where = [v.reshape(b, pixels) for v in (jnp.maximum(u_, v_), u_ * u_ + v_ * v_, jnp.exp(-edge / 1.5))]
    wider = blur(grid).reshape(b, most, pixels) * inside[:, None]
    names = ("w1", "g1", "b1", "dw", "b2", "w3", "b3", "nu")

    def block(w, state):
        """The network's part of a block: mean, h, z, and the features of the whole image."""
        x, d, g, mean, q1, q2, h, left = state
        now = jax.nn.relu(x)
        square, total = (now * now).sum(1, keepdims=True), now.sum(1, keepdims=True)
        whole = fixed + [
            left - 1,
            jnp.log(now.max(1, keepdims=True) + 0.1),
            jnp.log(square / wide + 0.01),
            jnp.log((jnp.square(total) + 0.1) / (square + 0.1) / wide),
            h.sum(1) / n,
        ]
        whole = jnp.concatenate(whole, 1)
        taxel = jnp.stack([x, d, 0.3 * g, lin, mean, q1, q2, likely, height] + where, 2)
        z = jnp.concatenate([taxel, h], 2) @ w["w1"] + (whole @ w["g1"] + w["b1"])[:, None]
        z = jnp.pad((jax.nn.relu(z) * inside[:, :, None]).reshape(b, rows, cols, -1), [(0, 0), (1, 1), (1, 1), (0, 0)])
        z = sum(z[:, i : i + rows, j : j + cols] * w["dw"][3 * i + j] for i in range(3) for j in range(3))
        z = (jax.nn.relu(z + w["b2"]).reshape(b, pixels, -1) @ w["w3"] + w["b3"]) * inside[:, :, None]
        return jax.nn.relu(now + z[:, :, 0]), h + z[:, :, 3:], z, whole

    def solved(state, w):
        """A block, and the image that the samples make of its mean and variances."""
        mean, h, z, whole = block(w, state)
        rest = y - jnp.einsum("bmn,bn->bm", phi, mean)
        # variance of the taxels about the mean: of each alone, and of blurred sources
        q1, q2 = 0.01 + jax.nn.relu(z[:, :, 1]), jax.nn.relu(z[:, :, 2])
        nu = wide * NOISE_VARIANCE * jnp.exp(jnp.clip(whole @ w["nu"][:-1, None] + w["nu"][-1], -3, 3))
        cov = jnp.einsum("bmn,bkn->bmk", phi * jnp.square(q1)[:, None], phi)
        cov += jnp.einsum("bmn,bkn->bmk", wider * jnp.square(q2)[:, None], wider)
        u = _solve(cov + nu[:, :, None] * eye, rest)
        back = jnp.einsum("bmn,bm->bn", phi, u)
        d = jnp.square(q1) * back
        d += (
            blur((jnp.square(q2) * jnp.einsum("bmn,bm->bn", wider, u)).reshape(b, rows, cols)).reshape(b, pixels)
            * inside
        )
        left = jnp.sqrt(jax.nn.relu((rest * u).sum(1, keepdims=True)) / m + 1e-6)
        g = back / jnp.sqrt((u * u).sum(1, keepdims=True) + 1e-20)
        spread = ((jax.nn.relu(z[:, :, 1]) + q2).sum(1) / wide[:, 0]).mean()
        return (mean + d, d, g, mean, q1, q2, h, left), (mean * a, h[:, :, 0], spread)

    many = {name: jnp.stack([weights[f"blocks.{t}.{name}"] for t in range(BLOCKS - 1)]) for name in names}
    state, (found, logits, spread) = jax.lax.scan(solved, (x, d, g, mean, q1, q2, h, left), many)
    mean, h, _, whole = block({name: weights[f"blocks.{BLOCKS - 1}.{name}"] for name in names}, state)
    return [*found, mean * a], [*logits, h[:, :, 0]], spread.mean()


class Batches:
    """Examples of training, the same for the same seed."""

    def __init__(self, source, pixels, seed):
        self.source, self.pixels, self.seed = source, pixels, seed
        self.shapes, odds = list(CANVASES), np.array(list(CANVASES.values()), float)
        self.odds = odds / odds.sum()
        rng = np.random.default_rng([seed, 1])
        self.sets = {}
        for rows, cols, most, least in self.shapes:
            sizes = [(rows, cols)] + [tuple(rng.integers(least, rows + 1, 2)) for _ in range(7 if rows < 32 else 5)]
            self.sets[rows] = [(r, c, self._sets(r, c, min(most, r * c), rng)) for r, c in sizes]

    @staticmethod
    def _sets(rows, cols, most, rng):
        prior = prior_matrix(rows, cols)
        few = rows * cols > 400
        return [chosen_rows(prior, most, NOISE_VARIANCE, rng) for _ in range(2 if few else 6)] + [
            cosine_rows(rows, cols, most, rng) for _ in range(3 if few else 6)
        ]

    def make(self, step):
        """(canvas, phi, y, count, size, x, touched) of a step: half of the sheets of the whole canvas, others
        smaller."""
        rng = np.random.default_rng([self.seed, 2, step])
        canvas = self.shapes[rng.choice(len(self.shapes), p=self.odds)]
        rows, cols, most, _ = canvas
        b = int(np.clip(self.pixels // (rows * cols), 8, 256))
        phi, y, x = (np.zeros(s, np.float32) for s in ((b, most, rows, cols), (b, most), (b, rows, cols)))
        counts, sizes, at = [], [], 0
        sets = self.sets[rows]
        for part in (sets[0], sets[1 + rng.integers(len(sets) - 1)], sets[1 + rng.integers(len(sets) - 1)]):
            r, c, chosen = part
            k = b // 2 if part is sets[0] else b // 4 if at < b // 2 + 1 else b - at
            own, count, samples_, image = self._sheet(r, c, chosen, k, min(most, r * c), rng)
            phi[at : at + k, : own.shape[1], :r, :c] = own.reshape(k, -1, r, c)
            y[at : at + k, : own.shape[1]] = samples_
            x[at : at + k, :r, :c] = image.reshape(k, r, c)
            counts += list(count)
            sizes += [(r, c)] * k
            at += k
        x = x.reshape(b, -1)
        touched = (x > THRESHOLD * x.max(1, keepdims=True)).astype(np.float32)
        return canvas, phi.reshape(b, most, -1), y, np.array(counts, np.int32), np.array(sizes, np.int32), x, touched

    def _sheet(self, rows, cols, chosen, b, most, rng):
        """Rows, numbers of them, samples and images of b windows of a sheet."""
        n = rows * cols
        x = with_gains(np.stack([self.source.one(rows, cols, rng) for _ in range(b)]), rng).reshape(b, n)
        x /= np.linalg.norm(x, axis=1, keepdims=True)
        phi = random_rows(b, most, n, rng)
        for i, kind in enumerate(rng.random(b)):
            if kind < 0.4:
                half = len(chosen) // 2
                one = chosen[rng.integers(half) if kind < 0.2 else rng.integers(half, len(chosen))].reshape(
                    most, rows, cols
                )
                phi[i] = one[:, :: rng.choice([1, -1]), :: rng.choice([1, -1])].reshape(most, n)
        least = max(5, round(0.025 * n))
        count = np.exp(rng.uniform(np.log(least - 0.5), np.log(most + 0.5), b)).round().astype(np.int32)
        kept = np.arange(most) < count[:, None]
        phi *= kept[:, :, None]
        return phi, count, samples(x, phi, rng) * kept, x

    def stream(self, steps):
        """Batches made while others are learned from."""
        made = queue.Queue(3)

        def work():
            for step in range(steps):
                made.put(self.make(step))

        threading.Thread(target=work, daemon=True).start()
        for _ in range(steps):
            yield made.get()


def train(source, *, steps=STEPS, pixels=PIXELS, rate=RATE, seed=0, report=None):
    """Parameters of the network by name, learned from the images of the :class:`Source`.

    `report(step, steps, losses)` is called every hundredth of the steps with the mean cross-entropy of an image, over
    the square root of its taxels, and the mean squared error of an image of length 1.
    """
    import jax
    import jax.numpy as jnp
    import optax

    def loss(weights, phi, y, count, size, x, touched, rows, cols):
        found, logits, spread = network(weights, phi, y, count, size, rows, cols)
        n = (size[:, 0] * size[:, 1]).astype(jnp.float32)
        # taxels beside the sheet have the logit 0
        beside = (rows * cols - n) * np.log(2)
        entropies = jnp.stack(
            [((optax.sigmoid_binary_cross_entropy(z, touched).sum(1) - beside) / jnp.sqrt(n)).mean() for z in logits]
        )
        errors = jnp.stack([jnp.square(f - x).sum(1).mean() for f in found])
        pace = jnp.arange(1, len(found)) * 0.3 / len(found)
        total = (
            entropies[-1] + (pace * entropies[:-1]).sum() + errors[-1] + (pace * errors[:-1]).sum() + SPREAD * spread
        )
        return total, (entropies[-1], errors[-1], spread)

    optimiser = optax.chain(optax.clip_by_global_norm(1.0), optax.scale_by_adam(b2=0.99))
    pace_of = optax.cosine_onecycle_schedule(steps, rate, 0.05, 10, 100)

    def update(weights, state, now, *batch, rows, cols):
        grads, losses = jax.grad(loss, has_aux=True)(weights, *batch, rows, cols)
        ok = jnp.all(jnp.stack([jnp.isfinite(g).all() for g in jax.tree.leaves(grads)]))
        grads = jax.tree.map(lambda g: jnp.where(ok, g, 0), grads)
        change, state = optimiser.update(grads, state, weights)
        change = jax.tree.map(lambda c: -now * c, change)
        return optax.apply_updates(weights, change), state, losses, ok

    update = jax.jit(update, static_argnames=("rows", "cols"))
    weights = start(jax.random.PRNGKey(seed))
    state = optimiser.init(weights)
    for step, (shape, *batch) in enumerate(Batches(source, pixels, seed).stream(steps)):
        weights, state, losses, _ = update(
            weights, state, jnp.float32(pace_of(step)), *batch, rows=shape[0], cols=shape[1]
        )
        if report and (step + 1) % max(steps // 100, 1) == 0:
            report(step + 1, steps, [float(v) for v in losses])
    return {name: np.asarray(w).astype(np.float16) for name, w in weights.items()}


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m spts.amortised",
        description="Trains the decoder `amortised` on simulated and drawn shapes: a small network from samples and "
        "rows to an image, for sheets of any rows and columns.",
        epilog="examples: python -m spts.amortised --out amortised.safetensors; "
        "python -m spts.amortised --out small.safetensors --steps 1000 --data out/touches",
    )
    parser.add_argument("--out", required=True, help="file to write the trained network to")
    parser.add_argument(
        "--data", help="folder of the data sets, made there if they are not there yet (default: a temporary one)"
    )
    parser.add_argument("--steps", type=int, default=STEPS, help=f"steps of training (default: {STEPS})")
    parser.add_argument("--pixels", type=int, default=PIXELS, help=f"taxels of a batch (default: {PIXELS})")
    parser.add_argument("--seed", type=int, default=0, help="root of everything random (default: 0)")
    asked = parser.parse_args(arguments)
    for name, least in (("steps", 1), ("pixels", 1), ("seed", 0)):
        if getattr(asked, name) < least:
            parser.error(f"--{name} {getattr(asked, name)} is outside [{least}, 2^31)")
    try:
        import jax  # noqa: F401
        import optax  # noqa: F401
        from safetensors.numpy import save
    except ImportError as error:
        sys.exit(f"error: {error.name} is missing: pip install 'spts-twin[train]'")

    def report(step, steps, losses):
        text = f"\rstep {step} of {steps}: cross-entropy {losses[0]:.4f}, squared error {losses[1]:.4f}"
        print(text, end="", file=sys.stderr)

    with tempfile.TemporaryDirectory() as temporary:
        source = Source.made(asked.data or temporary)
    weights = train(source, steps=asked.steps, pixels=asked.pixels, seed=asked.seed, report=report)
    print(file=sys.stderr)
    described = {
        "kind": "spts amortised 2",
        "blocks": BLOCKS,
        "widths": WIDTHS,
        "priors": PRIORS.astype(float).round(4).tolist(),
        "noise_variance": NOISE_VARIANCE,
        "training": {"steps": asked.steps, "pixels": asked.pixels, "rate": RATE, "seed": asked.seed},
    }
    # one entry: several would be written in any order
    content = save(weights, metadata={"spts": json.dumps(described, sort_keys=True)})
    with open(asked.out, "wb") as out:
        out.write(content)
    print(f"{asked.out}: sha256 {hashlib.sha256(content).hexdigest()}")


if __name__ == "__main__":
    main()
