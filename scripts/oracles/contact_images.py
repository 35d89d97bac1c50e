"""Images like those of pressed objects: any program that learns dictionaries can be given the same ones."""

import numpy as np

SIDE = 10


def contact_images(count, seed):
    """`count` × SIDE² images, V: one to three soft-edged discs, bars or rings, fixed taxel gains of log-deviation 0.3, noise of 0.02 V."""
    rng = np.random.default_rng(seed)
    rows, cols = np.mgrid[:SIDE, :SIDE].astype(float)
    gain = np.exp(rng.normal(0, 0.3, (SIDE, SIDE)))
    images = np.empty((count, SIDE * SIDE))
    for image in images:
        contact = np.zeros((SIDE, SIDE))
        for _ in range(rng.integers(1, 4)):
            col, row = rng.uniform(1, SIDE - 2, 2)
            a, b = rng.uniform(0.7, 4, 2)
            turn = rng.uniform(0, np.pi)
            u = np.cos(turn) * (cols - col) + np.sin(turn) * (rows - row)
            v = -np.sin(turn) * (cols - col) + np.cos(turn) * (rows - row)
            # distances from the edge, negative inside
            disc = (np.hypot(u / a, v / b) - 1) * min(a, b)
            bar = np.maximum(np.abs(u) - a, np.abs(v) - 0.5 * b)
            ring = np.abs(np.hypot(u, v) - a) - 0.6
            edge = (disc, bar, ring)[rng.integers(3)]
            contact = np.maximum(contact, rng.uniform(0.5, 1) / (1 + np.exp(edge / 0.3)))
        image[:] = rng.uniform(0.5, 3) * (contact * gain).ravel()
    return images + 0.02 * rng.standard_normal(images.shape)
