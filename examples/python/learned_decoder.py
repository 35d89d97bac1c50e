"""Decodes with the model of `learn_from_data.py`:

    spts score recordings/ --external 'learned=python3 examples/python/learned_decoder.py MODEL.npz'

For every Gaussian of the mixture and every length ℓ the measurements are Gaussian too, y ~ N(ℓΦμ, ℓ²ΦΣΦᵀ + s²I): that gives
the most probable image, μ + ΣΦᵀ(…)⁻¹(y − …), and how well it explains y. The answer is their mean, weighed by that, without
its negative values. Needs numpy.
"""

import json
import sys

import numpy as np


def decode(model, phi, y):
    """Image from the measurements `y` (M) with the sensing matrix `phi` (M × taxels)."""
    lengths = model["lengths"]
    variance = model["noise"][0] + model["noise"][1] * (lengths * model["sum"]) ** 2
    # of all Gaussians at once: Gaussians × M × taxels, Gaussians × M × M
    seen = phi @ model["covariances"]
    values, axes = np.linalg.eigh(seen @ phi.T)
    expected = np.einsum("kmi,mn,kn->ki", axes, phi, model["means"], optimize=True)
    found = np.einsum("kmi,m->ki", axes, y)
    # Gaussians × lengths × M
    spread = lengths[:, None] ** 2 * np.maximum(values, 0.0)[:, None] + variance[:, None]
    apart = found[:, None] - lengths[:, None] * expected[:, None]
    evidence = np.log(model["weights"])[:, None] - 0.5 * np.sum(np.log(spread) + apart**2 / spread, axis=2)
    share = np.exp(evidence - evidence.max())
    share /= share.sum()
    # Σ share · length · (μ + ΣΦᵀ …), of every Gaussian over its lengths first
    direct = (share * lengths).sum(axis=1) @ model["means"]
    weighed = np.einsum("kl,klm->km", share * lengths**2, apart / spread)
    back = np.einsum("km,kim->ki", weighed, axes)
    return np.maximum(direct + np.einsum("ki,kin->n", back, seen), 0.0)


def main():
    model = dict(np.load(sys.argv[1]))
    model["sum"] = model["means"][0].sum()
    sys.stdin.readline()  # a header with what other decoders learn from
    for line in sys.stdin:
        window = json.loads(line)
        phi = np.array([[1.0 if sign == "+" else -1.0 for sign in row] for row in window["phi"]])
        print(json.dumps({"image": decode(model, phi, np.array(window["y"])).tolist()}), flush=True)


if __name__ == "__main__":
    main()
