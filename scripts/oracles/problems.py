"""Random problems that any language draws alike: SplitMix64, numbers in [-1, 1).

Source of the generator: G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014.
"""

import numpy as np

# measurements, atoms, sparsity
SHAPES = [(10, 40, 3), (25, 100, 6), (50, 100, 20), (7, 100, 2), (20, 100, 5), (13, 60, 4), (40, 24, 8)]
NOISE = 0.1


def uniform(seed, count):
    """`count` numbers of stream `seed`: the top 53 bits, from [0, 2) less 1."""
    with np.errstate(over="ignore"):
        z = np.uint64(seed) + np.arange(1, count + 1, dtype=np.uint64) * np.uint64(0x9E3779B97F4A7C15)
        z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        z ^= z >> np.uint64(31)
    return (z >> np.uint64(11)).astype(float) * 2.0**-52 - 1.0


def problem(index):
    """(A, y, S) number `index`. Even ones have a random y, odd ones that of S planted atoms and noise."""
    m, k, s = SHAPES[index % len(SHAPES)]
    values = uniform(1_000_003 * index, m * k + m + k)
    a, noise, x = values[: m * k].reshape(m, k), values[m * k : m * k + m], values[m * k + m :].copy()
    if index % 2 == 0:
        return a, noise, s
    # the s atoms with the largest draws
    x[np.argsort(-np.abs(x), kind="stable")[s:]] = 0.0
    return a, a @ x + NOISE * noise, s
