"""Decodes with the model of `learn_from_data.py`:

    spts score recordings/ --external 'learned=python3 scripts/examples/learned_decoder.py MODEL.npz {windows} {answers}'

For every Gaussian of the mixture and every length ℓ the measurements are Gaussian too, y ~ N(ℓΦμ, ℓ²ΦΣΦᵀ + s²I): that gives
the most probable image, μ + ΣΦᵀ(…)⁻¹(y − …), and how well it explains y. The answer is their mean, weighed by that, without
its negative values. Needs numpy.
"""

import sys

import numpy as np


def decode(model, phi, y):
    """Image from the measurements `y` (M) with the sensing matrix `phi` (M × taxels)."""
    lengths = model["lengths"]
    images, evidence = [], []
    variance = model["noise"][0] + model["noise"][1] * (lengths * model["sum"]) ** 2
    for mean, covariance, weight in zip(model["means"], model["covariances"], model["weights"]):
        seen = phi @ covariance
        values, axes = np.linalg.eigh(seen @ phi.T)
        expected = axes.T @ (phi @ mean)
        found = axes.T @ y
        # lengths × M
        spread = lengths[:, None] ** 2 * np.maximum(values, 0.0) + variance[:, None]
        apart = found - lengths[:, None] * expected
        evidence.append(np.log(weight) - 0.5 * np.sum(np.log(spread) + apart**2 / spread, axis=1))
        back = (lengths[:, None] * apart / spread) @ (axes.T @ seen)
        images.append(lengths[:, None] * (mean + back))
    evidence = np.concatenate(evidence)
    share = np.exp(evidence - evidence.max())
    return np.maximum(share @ np.concatenate(images) / share.sum(), 0.0)


def main():
    path, windows, answers = sys.argv[1:4]
    model, asked = dict(np.load(path)), np.load(windows)
    model["sum"] = model["means"][0].sum()
    pairs = zip(asked["phi"].astype(float), asked["y"].astype(float))
    np.savez(answers, images=np.array([decode(model, phi, y) for phi, y in pairs]))


if __name__ == "__main__":
    main()
