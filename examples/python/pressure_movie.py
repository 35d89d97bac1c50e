"""A pressure movie of a simulator of its own: soft balls on a foam of 32 x 32 taxels. Frames for `spts import`.

python3 examples/python/pressure_movie.py FILE.npz

Hertz: a ball of radius R that is pressed in by d touches on a disc of radius a = sqrt(R d), under the pressure
p = p0 sqrt(1 - r^2/a^2) with p0 = 2 E d / (pi a) (K. L. Johnson, Contact Mechanics, 1985, section 4.2).
"""

import sys

import numpy as np

ROWS, COLS, PITCH, RATE = 32, 32, 0.005, 50.0
MODULUS = 1.5e5  # of the foam, Pa


def ball(x, y, radius, depth):
    """Pressure (ROWS, COLS), Pa, of a ball at x, y from the middle, m."""
    if depth <= 0.0:
        return np.zeros((ROWS, COLS))
    across = (np.arange(COLS) - (COLS - 1) / 2) * PITCH - x
    along = ((ROWS - 1) / 2 - np.arange(ROWS)) * PITCH - y
    disc = radius * depth
    inside = np.clip(1.0 - (across[None] ** 2 + along[:, None] ** 2) / disc, 0.0, None)
    return 2.0 * MODULUS * depth / (np.pi * np.sqrt(disc)) * np.sqrt(inside)


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    rng, frames = np.random.default_rng(1), []
    for _ in range(6):
        balls = [(*rng.uniform(-0.055, 0.055, 2), rng.uniform(0.01, 0.04)) for _ in range(rng.integers(1, 4))]
        course = np.concatenate(
            [np.zeros(8), np.linspace(0.0, 1.0, 5), np.ones(15), np.linspace(1.0, 0.0, 4), np.zeros(3)]
        )
        frames += [sum(ball(x, y, radius, 0.006 * share) for x, y, radius in balls) for share in course]
    np.savez_compressed(sys.argv[1], frames=np.array(frames), rate_hz=RATE)


if __name__ == "__main__":
    main()
