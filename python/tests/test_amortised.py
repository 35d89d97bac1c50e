"""The network of the decoder `amortised`: what ships against its formula in numpy, and training from a spec to a file."""

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import spts

safetensors = pytest.importorskip("safetensors.numpy")
SHIPPED = Path(__file__).parents[2] / "experiments" / "eval" / "assets" / "amortised.safetensors"
TINY = """name = "tiny"
rows = 200
[object]
from = "shapes"
names = ["plate", "dome"]
size_m = [0.02, 0.05]
rows_per_shape = 2
[skin]
rows = 4
cols = 5
pitch_m = 0.02
[record]
measurements = 1
raster = false
labels = ["conductance"]
"""


def probabilities(w, phi, y, noise, unrolled):
    """The formula that `spts.amortised` states, in double precision."""
    n, m = phi.shape[1], len(y)
    k = w["prior"].astype(float)
    lower = np.linalg.cholesky(phi @ k @ phi.T + noise * np.eye(m))
    v, white = np.linalg.solve(lower, phi @ k), np.linalg.solve(lower, y)
    s = np.linalg.norm(white) / np.sqrt(m)
    y, white = y / s, white / s
    linear, left = v.T @ white, np.sqrt(np.maximum(np.diag(k) - (v * v).sum(0), 0))
    x, h = np.maximum(linear, 0), np.zeros(w["steps.0.b2"].size - n)
    for t in range(unrolled):
        e = np.linalg.solve(lower, y - phi @ x)
        u = np.concatenate([x, v.T @ e, linear, left, h, [np.log(m / 20), np.linalg.norm(e) / np.sqrt(m)]])
        z = np.maximum(u @ w[f"steps.{t}.w1"] + w[f"steps.{t}.b1"], 0) @ w[f"steps.{t}.w2"] + w[f"steps.{t}.b2"]
        x, h = np.maximum(x + z[:n], 0), np.tanh(z[n:])
    return 1 / (1 + np.exp(-(np.concatenate([h, x]) @ w["out.w"] + w["out.b"])))


def test_the_network_that_ships_is_its_formula():
    weights = {name: value.astype(float) for name, value in safetensors.load_file(SHIPPED).items()}
    rng = np.random.default_rng(2)
    for m in (7, 20, 50):
        phi = rng.choice([-1.0, 1.0], (m, 100))
        truth = np.zeros((10, 10))
        truth[3:6, 2:7] = rng.uniform(0.5, 1.0, (3, 5))
        y = phi @ truth.ravel() + 0.1 * rng.normal(size=m)
        image = spts.decode(phi, y, shape=(10, 10), decoder="amortised").ravel()
        p = probabilities(weights, phi, y, 0.012, 3)
        order = np.sort(p)[::-1]
        inside = np.cumsum(order)
        count = 1 + np.argmax(inside / (np.arange(1, 101) + p.sum() - inside))
        support = image > 0.23 * image.max()
        assert support.sum() == count
        # the most probable ones, up to ties that rounding decides
        assert p[support].min() >= p[~support].max() - 1e-4


def test_training_makes_the_same_file_twice(tmp_path):
    pytest.importorskip("jax")
    pytest.importorskip("optax")
    spec = tmp_path / "tiny.toml"
    spec.write_text(TINY)
    digests = []
    for name in ("one", "two"):
        out = tmp_path / f"{name}.safetensors"
        command = [sys.executable, "-m", "spts.amortised", str(spec), "--out", str(out), "--steps", "2", "--batch", "8"]
        subprocess.run(command, check=True, cwd=tmp_path)
        digests.append(hashlib.sha256(out.read_bytes()).hexdigest())
    assert digests[0] == digests[1]
    assert safetensors.load_file(tmp_path / "one.safetensors")["prior"].shape == (20, 20)


def test_a_skin_of_another_shape_needs_weights_of_its_own():
    with pytest.raises(ValueError, match="trained for 10 × 10 taxels"):
        spts.decode(np.ones((3, 24)), np.ones(3), shape=(4, 6), decoder="amortised")
