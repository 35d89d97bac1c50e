"""The network of the decoder `amortised`: what ships against the network that is trained, and training to a file."""

import hashlib
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import spts

safetensors = pytest.importorskip("safetensors.numpy")
safe_open = pytest.importorskip("safetensors").safe_open
SHIPPED = Path(__file__).parents[2] / "experiments" / "eval" / "assets" / "amortised.safetensors"


@pytest.fixture(scope="module")
def jax(tmp_path_factory):
    """JAX that compiles without optimizations, and each function once."""
    jax = pytest.importorskip("jax")
    changed = {
        "jax_disable_most_optimizations": True,
        "jax_compilation_cache_dir": str(tmp_path_factory.mktemp("compiled")),
        "jax_persistent_cache_min_compile_time_secs": 0,
        "jax_persistent_cache_min_entry_size_bytes": 0,
    }
    before = {name: jax.config.values[name] for name in changed}
    for name, value in changed.items():
        jax.config.update(name, value)
    yield jax
    for name, value in before.items():
        jax.config.update(name, value)


def test_the_network_that_ships_is_the_one_that_is_trained(jax):
    """On a canvas that is larger than the sheet, as in training."""
    rows, cols, m = 9, 14, 30
    jnp = jax.numpy
    from spts.amortised import network

    weights = {name: jnp.asarray(value, jnp.float32) for name, value in safetensors.load_file(SHIPPED).items()}
    rng = np.random.default_rng(2)
    phi = rng.choice([-1.0, 1.0], (m, rows * cols))
    truth = np.zeros((rows, cols))
    truth[2:5, 1:5] = rng.uniform(0.5, 1.0, (3, 4))
    y = phi @ truth.ravel() + 0.1 * rng.normal(size=m)
    canvas = np.zeros((1, m + 3, rows + 2, cols + 1), np.float32)
    canvas[0, :m, :rows, :cols] = phi.reshape(m, rows, cols)
    samples = np.zeros((1, m + 3), np.float32)
    samples[0, :m] = y
    given = jnp.asarray(canvas.reshape(1, m + 3, -1)), jnp.asarray(samples), jnp.array([m]), jnp.array([[rows, cols]])
    _, logits, _ = network(weights, *given, rows + 2, cols + 1)
    logits = np.asarray(logits[-1], float).reshape(rows + 2, cols + 1)[:rows, :cols]
    p = 1 / (1 + np.exp(-logits))
    image = spts.decode(phi, y, shape=(rows, cols), decoder="amortised")
    order = np.sort(p.ravel())[::-1]
    expected = np.cumsum(order) / (np.arange(1, p.size + 1) + p.sum() - np.cumsum(order))
    support = image > 0.23 * image.max()
    # the support of the largest expected IoU, up to what the two precisions round to otherwise
    assert expected[support.sum() - 1] >= expected.max() - 1e-3
    assert p[support].min() >= p[~support].max() - 2e-3


def test_training_makes_the_same_file_twice(jax, tmp_path, monkeypatch):
    """The same compiled functions, and everything else anew."""
    pytest.importorskip("optax")
    from spts import amortised

    # few touches, and one size of sheets
    for sets in (amortised.MIDDLE, amortised.CUT):
        for name, (_, changes) in sets.items():
            monkeypatch.setitem(sets, name, (64, changes))
    monkeypatch.setattr(amortised, "CANVASES", {(10, 10, 12, 6): 1.0})
    digests = []
    for name in ("one", "two"):
        out = tmp_path / f"{name}.safetensors"
        amortised.main(["--out", str(out), "--data", str(tmp_path / "data"), "--steps", "2", "--pixels", "800"])
        digests.append(hashlib.sha256(out.read_bytes()).hexdigest())
    assert digests[0] == digests[1]
    with safe_open(tmp_path / "one.safetensors", "np") as file:
        assert json.loads(file.metadata()["spts"])["training"]["steps"] == 2
    decoded = subprocess.run(
        [sys.executable, "-m", "spts.amortised", "--out", "x", "--steps", "0"], capture_output=True, text=True
    )
    assert decoded.returncode == 2 and "--steps 0 is outside" in decoded.stderr


def test_one_network_serves_every_sheet():
    """Contacts of four taxels on sheets that nobody trained for."""
    rng = np.random.default_rng(5)
    for rows, cols in ((6, 6), (9, 23), (40, 40)):
        found = []
        for _ in range(10):
            truth = np.zeros((rows, cols))
            r, c = rng.integers(rows - 1), rng.integers(cols - 1)
            truth[r : r + 2, c : c + 2] = rng.uniform(0.5, 1.0, (2, 2))
            phi = rng.choice([-1.0, 1.0], (max(12, rows * cols // 16), rows * cols))
            image = spts.decode(phi, phi @ truth.ravel(), shape=(rows, cols), decoder="amortised")
            found.append(spts.iou(image[None], truth[None])[0])
        assert np.mean(found) > 0.9, (rows, cols)


@pytest.mark.parametrize("shape, m", [((32, 32), 600), ((1, 800), 450), ((10, 10), 400)])
def test_many_samples_without_noise(shape, m):
    """None of which the network was trained on."""
    rng = np.random.default_rng(3)
    for size in (1, 4):
        truth = np.zeros(shape)
        truth[min(3, shape[0] // 2) :, 4:][:size, :size] = 0.3
        phi = rng.choice([-1.0, 1.0], (m, truth.size))
        image = spts.decode(phi, phi @ truth.ravel(), shape, decoder="amortised")
        assert spts.iou(image[None], truth[None])[0] > 0.9, (shape, m, size)


def test_sheets_that_are_none_are_refused():
    with pytest.raises(ValueError, match="cols.*2048"):
        spts.decode(np.ones((3, 3000)), np.ones(3), shape=(1, 3000), decoder="amortised")
