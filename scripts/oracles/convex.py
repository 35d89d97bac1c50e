"""Non-negative lasso (scikit-learn) and most probable non-negative images (scipy's nnls) of small problems.

The problems are made of a linear congruential generator, so that only the answers are recorded.

Writes tests/oracles/convex.json. Run: python scripts/oracles/convex.py
"""

import importlib.metadata
import json
import pathlib
import warnings

import numpy as np
from scipy.optimize import nnls
from sklearn.linear_model import Lasso

OUT = pathlib.Path(__file__).parents[2] / "tests/oracles/convex.json"
# measurements, unknowns, penalty as a share of the largest correlation over M
LASSOS = [
    (20, 60, 0.3),
    (20, 60, 0.01),
    (25, 100, 0.1),
    (25, 100, 0.001),
    (100, 30, 0.05),
    (7, 100, 0.05),
]
# measurements, unknowns, noise deviation
GAUSSIANS = [(4, 16, 0.3), (10, 16, 0.05), (16, 16, 0.01), (40, 16, 0.2)]


def uniform(state, count):
    """`count` numbers in [-1, 1) from the generator of Numerical Recipes, and its last state."""
    out = np.empty(count)
    for i in range(count):
        state = (1664525 * state + 1013904223) % 2**32
        out[i] = state / 2**31 - 1.0
    return out, state


def problem(seed, measurements, unknowns):
    """A and y = A x + noise of a tenth of its amplitude, x with every seventh entry 1."""
    values, state = uniform(seed, measurements * unknowns)
    noise, _ = uniform(state, measurements)
    matrix = values.reshape(measurements, unknowns)
    planted = (np.arange(unknowns) % 7 == 3).astype(float)
    return matrix, matrix @ planted + 0.1 * noise


def lasso(seed, case):
    measurements, unknowns, share = case
    matrix, y = problem(seed, measurements, unknowns)
    alpha = float(share * (matrix.T @ y).max() / measurements)
    model = Lasso(alpha=alpha, positive=True, fit_intercept=False, tol=1e-14, max_iter=10_000_000)
    with warnings.catch_warnings():
        # a gap of 1e-14 is below what rounding lets it see; it then ends at max_iter or at a fixed point
        warnings.simplefilter("ignore")
        model.fit(matrix, y)
    return {"seed": seed, "m": measurements, "k": unknowns, "alpha": alpha, "w": model.coef_.tolist()}


def gaussian(seed, case):
    measurements, unknowns, deviation = case
    matrix, y = problem(seed, measurements, unknowns)
    values, _ = uniform(seed + 1000, unknowns * (unknowns + 1))
    root = values[: unknowns * unknowns].reshape(unknowns, unknowns)
    covariance = root @ root.T / unknowns + 0.1 * np.eye(unknowns)
    mean = values[unknowns * unknowns :]
    whitener = np.linalg.cholesky(np.linalg.inv(covariance)).T
    x, _ = nnls(
        np.vstack([matrix / deviation, whitener]), np.concatenate([y / deviation, whitener @ mean]), maxiter=10_000
    )
    return {"seed": seed, "m": measurements, "k": unknowns, "noise": deviation, "x": x.tolist()}


def main():
    record = {
        "made_by": "scripts/oracles/convex.py",
        "versions": {name: importlib.metadata.version(name) for name in ("numpy", "scipy", "scikit-learn")},
        "lasso": [lasso(seed, case) for seed, case in enumerate(LASSOS, 1)],
        "gaussian": [gaussian(seed, case) for seed, case in enumerate(GAUSSIANS, 1)],
    }
    OUT.write_text(json.dumps(record, indent=1) + "\n")


if __name__ == "__main__":
    main()
