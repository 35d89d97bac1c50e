"""Trains the decoder `amortised`: a small network that turns samples and rows into an image, for objects never seen.

::

    python -m spts.amortised --out amortised.safetensors                # the skin of 10 x 10 taxels
    python -m spts.amortised my_shapes.toml --out mine.safetensors      # a skin of your own: `[skin]` in the spec
    spts decode SESSION --decoder amortised --weights mine.safetensors

Needs `pip install 'spts-twin[train]'`. All numbers are functions of the spec and of the options: a machine of the same type with the
same versions of jax writes the same file. The 9,000 steps of the shipped network take about half an hour on two cores.

What is learned from is a data set of procedural shapes (`spts dataset specs --show unseen-shapes`) and nothing that was recorded.
Every example is one press of it, in one of the symmetries of the grid, whose taxels get gains of their own; what they sum up to under
the rows of a window, with noise, is what the network sees.

The model, for M rows Φ and samples y on N taxels (sizes: H hidden, P memory, T steps):

    S = Φ K Φᵀ + ν I = L Lᵀ        K: second moments of the images, each scaled to length 1; ν: `noise_variance`
    V = L⁻¹ Φ K,  w = L⁻¹ y,  s = |w| / √M,  v = √max(diag K − Σ V², 0)
    x = max(0, Vᵀ w / s),  h = 0
    T times:  e = L⁻¹ (y / s − Φ x),  u = [x, Vᵀ e, Vᵀ w / s, v, h, ln(M / 20), |e| / √M]
              z = W₂ max(0, W₁ u + b₁) + b₂,  x = max(0, x + z[:N]),  h = tanh z[N:]
    p = 1 / (1 + exp(−(Wₒ [h, x] + bₒ)))    the probability that a taxel is touched; the image is s x

After Gregor and LeCun, "Learning fast approximations of sparse coding", ICML 2010: unrolled steps, here with the exact residual and the
gain of the linear estimate.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
import tempfile

import numpy as np

__all__ = ["train"]

# A taxel counts as touched above this share of the image's maximum, as everywhere in the project.
THRESHOLD = 0.23
# Numbers of measurements of the windows, and how often each is drawn.
MEASUREMENTS = {5: 1.0, 7: 1.5, 10: 1.5, 13: 1.5, 20: 2.0, 25: 1.5, 35: 1.0, 50: 0.7}
# nu: variance of the noise of a sample in the linear estimate, images being scaled to length 1.
NOISE_VARIANCE = 0.012
# Root mean square of the noise of a sample, as a share of the image's length, log-uniform: contact noise and what a
# window differs by.
NOISE = (0.04, 0.16)
# The same, as a share of the sample.
NOISE_OF_SAMPLE = 0.04
# Log-sd of the gains of the taxels, uniform; of a smooth factor over the sheet; and between a session and the scan that
# is its truth.
GAINS, SMOOTH, SESSION = (0.2, 0.6), (0.0, 0.3), 0.12
# Length over which the smooth factor changes, taxels.
SMOOTH_LENGTH = 2.0
# Shares of windows of random rows, of rows chosen for the prior, and of rows of few cosines.
ROWS = (0.6, 0.2, 0.2)
# Sets of chosen rows, the longest window, and the candidates that each is chosen from.
CHOSEN_SETS, LONGEST, CANDIDATES = 96, 50, 1000


def images(data):
    """Conductances of the touches of `data` that are not for tests, each scaled to a maximum of 1: (touches, rows * cols)."""
    values = data["conductance_s"].astype(np.float32)
    values = values[np.asarray(data["split"]) != "test"]
    peaks = values.max(axis=1, keepdims=True)
    touched = ((values > THRESHOLD * peaks).sum(axis=1) >= 2) & (peaks[:, 0] > 0)
    return values[touched] / peaks[touched]


def symmetries(rows, cols):
    """Orders of the taxels that map the grid onto itself: (4 or 8, rows * cols)."""
    grid = np.arange(rows * cols).reshape(rows, cols)
    grids = [grid, grid[::-1], grid[:, ::-1], grid[::-1, ::-1]]
    if rows == cols:
        grids += [g.T for g in grids]
    return np.array([g.ravel() for g in grids])


def second_moments(values, orders):
    """K: mean of x xᵀ over images of length 1 in all symmetries, with gains that scatter."""
    unit = values / np.linalg.norm(values, axis=1, keepdims=True)
    moments = unit.T.astype(np.float64) @ unit / len(unit)
    moments = sum(moments[np.ix_(q, q)] for q in orders) / len(orders)
    spread = np.expm1(np.mean(np.square(GAINS)))
    return moments + np.diag(spread * np.diag(moments)) + 1e-5 * np.eye(len(moments))


def chosen_rows(prior, rng):
    """Rows that lower the trace of the posterior covariance most, among random ones: (sets, LONGEST, N) of ±1."""
    n = len(prior)
    sets = np.empty((CHOSEN_SETS, LONGEST, n), np.float32)
    for chosen in sets:
        rows = rng.integers(0, 2, (CANDIDATES, n)) * 2.0 - 1.0
        products = rows @ prior
        along = np.einsum("cn,cn->c", products, rows)
        for row in chosen:
            best = np.argmax(np.square(products).sum(axis=1) / (along + NOISE_VARIANCE))
            row[:] = rows[best]
            u, d = products[best].copy(), along[best] + NOISE_VARIANCE
            products -= np.outer(rows @ u / d, u)
            along = np.einsum("cn,cn->c", products, rows)
    return sets


def cosine_rows(rows, cols, rng):
    """Signs of sums of few products of slow cosines along both axes: (sets, LONGEST, N) of ±1."""
    y, x = (np.arange(size)[:, None] + 0.5 for size in (rows, cols))
    sets = np.empty((CHOSEN_SETS, LONGEST, rows * cols), np.float32)
    order = sorted(((i, j) for i in range(min(rows, 8)) for j in range(min(cols, 8))), key=lambda k: k[0] + k[1])
    for at, chosen in enumerate(sets):
        for k, row in enumerate(chosen):
            pairs = [order[k % len(order)]]
            if at % 2:
                pairs = [order[i] for i in rng.integers(0, min(24, len(order)), 2)]
            waves = [np.cos(np.pi * i * y / rows) @ np.cos(np.pi * j * x / cols).T for i, j in pairs]
            wave = sum(rng.normal() * w if at % 2 else w for w in waves)
            row[:] = np.where(wave.ravel() >= 0, 1.0, -1.0)
    return sets


def sizes(n, hidden, memory, steps):
    """Shapes of all parameters of the network by name."""
    shapes = {}
    for t in range(steps):
        shapes[f"steps.{t}.w1"] = (4 * n + memory + 2, hidden)
        shapes[f"steps.{t}.b1"] = (hidden,)
        shapes[f"steps.{t}.w2"] = (hidden, n + memory)
        shapes[f"steps.{t}.b2"] = (n + memory,)
    shapes["out.w"] = (memory + n, n)
    shapes["out.b"] = (n,)
    return shapes


def train(data, *, steps=9_000, batch=512, hidden=160, memory=48, unrolled=3, rate=1e-3, seed=0, report=None):
    """Parameters of the network by name and what describes them, learned from the :class:`spts.dataset.Dataset` `data`.

    `report(step, steps, losses)` is called every hundredth of the steps with the mean cross-entropy of a taxel and the mean squared
    error of an image of length 1.
    """
    import jax
    import jax.numpy as jnp
    import optax

    rows, cols = data.shape
    n = rows * cols
    values = images(data)
    orders = symmetries(rows, cols)
    prior = second_moments(values, orders)
    rng = np.random.default_rng(seed)
    row_sets = jnp.asarray(np.concatenate([chosen_rows(prior, rng), cosine_rows(rows, cols, rng)]))
    places = np.stack(np.meshgrid(np.arange(rows), np.arange(cols), indexing="ij"), -1).reshape(n, 2)
    near = np.exp(-np.square(places[:, None] - places[None]).sum(-1) / (2 * SMOOTH_LENGTH**2)) + 1e-6 * np.eye(n)
    smooth = jnp.asarray(np.linalg.cholesky(near).T.astype(np.float32))
    touches, orders = jnp.asarray(values), jnp.asarray(orders)
    prior_f32 = jnp.asarray(prior.astype(np.float32))

    def start(key):
        shapes = sizes(n, hidden, memory, unrolled)
        weights = {}
        for name, k in zip(shapes, jax.random.split(key, len(shapes))):
            shape = shapes[name]
            scale = {"w1": np.sqrt(2 / shape[0]), "w2": 0.3 / np.sqrt(shape[0]), "w": 0.05}.get(
                name.split(".")[-1], 0.0
            )
            weights[name] = scale * jax.random.normal(k, shape)
        weights["out.b"] -= 2.0
        return weights

    def network(weights, phi, y):
        count = phi.shape[1]
        seen = jnp.einsum("kn,bmn->bmk", prior_f32, phi)
        lower = jnp.linalg.cholesky(jnp.einsum("bmn,bkn->bmk", phi, seen) + NOISE_VARIANCE * jnp.eye(count))

        def solve(b):
            return jax.scipy.linalg.solve_triangular(lower, b, lower=True)

        v = solve(seen)
        w = solve(y[..., None])[..., 0]
        s = jnp.sqrt(jnp.mean(w * w, axis=1, keepdims=True)) + 1e-12
        y, w = y / s, w / s
        left = jnp.sqrt(jnp.maximum(jnp.diag(prior_f32)[None] - jnp.sum(v * v, axis=1), 0.0))
        linear = jnp.einsum("bmn,bm->bn", v, w)
        x, h = jax.nn.relu(linear), jnp.zeros((len(y), memory))
        size = jnp.full((len(y), 1), np.log(count / 20))
        found = []
        for t in range(unrolled):
            e = solve((y - jnp.einsum("bmn,bn->bm", phi, x))[..., None])[..., 0]
            u = [
                x,
                jnp.einsum("bmn,bm->bn", v, e),
                linear,
                left,
                h,
                size,
                jnp.sqrt(jnp.mean(e * e, axis=1, keepdims=True) + 1e-12),
            ]
            z = jax.nn.relu(jnp.concatenate(u, 1) @ weights[f"steps.{t}.w1"] + weights[f"steps.{t}.b1"])
            z = z @ weights[f"steps.{t}.w2"] + weights[f"steps.{t}.b2"]
            x, h = jax.nn.relu(x + z[:, :n]), jnp.tanh(z[:, n:])
            found.append(x)
        return found, jnp.concatenate([h, x], 1) @ weights["out.w"] + weights["out.b"], s

    def examples(key, count):
        k = jax.random.split(key, 12)
        x = touches[jax.random.randint(k[0], (batch,), 0, len(values))]
        x = jnp.take_along_axis(x, orders[jax.random.randint(k[1], (batch,), 0, len(orders))], 1)
        gains = jax.random.uniform(k[2], (batch, 1), minval=GAINS[0], maxval=GAINS[1]) * jax.random.normal(
            k[3], (batch, n)
        )
        wave = jax.random.uniform(k[4], (batch, 1), minval=SMOOTH[0], maxval=SMOOTH[1]) * (
            jax.random.normal(k[5], (batch, n)) @ smooth
        )
        x = x * jnp.exp(gains + wave)
        touched = x > THRESHOLD * x.max(axis=1, keepdims=True)
        x = x / jnp.linalg.norm(x, axis=1, keepdims=True)
        felt = x * jnp.exp(SESSION * jax.random.normal(k[6], (batch, n)))
        phi = jnp.where(jax.random.bernoulli(k[7], 0.5, (batch, count, n)), 1.0, -1.0)
        kind = jax.random.uniform(k[8], (batch,))
        half = len(row_sets) // 2
        at = jax.random.randint(k[9], (batch,), 0, half) + jnp.where(kind < ROWS[1], 0, half)
        phi = jnp.where((kind < ROWS[1] + ROWS[2])[:, None, None], row_sets[at][:, :count], phi)
        y = jnp.einsum("bmn,bn->bm", phi, felt)
        share = jnp.exp(jax.random.uniform(k[10], (batch, 1), minval=np.log(NOISE[0]), maxval=np.log(NOISE[1])))
        y += jax.random.normal(k[11], y.shape) * jnp.sqrt(share**2 + (NOISE_OF_SAMPLE * y) ** 2)
        return phi, y, x, touched

    def loss(weights, key, count):
        phi, y, x, touched = examples(key, count)
        found, logits, s = network(weights, phi, y)
        entropy = optax.sigmoid_binary_cross_entropy(logits, touched.astype(jnp.float32)).mean()
        errors = [jnp.square(s * f - x).sum(1).mean() for f in found]
        squares = sum((t + 1) * e for t, e in enumerate(errors)) * 2 / len(found) ** 2
        return entropy * n / 10 + squares, (entropy, errors[-1])

    optimiser = optax.chain(optax.clip_by_global_norm(1.0), optax.adam(optax.cosine_decay_schedule(rate, steps)))

    def update(weights, state, key, count):
        grads, losses = jax.grad(loss, has_aux=True)(weights, key, count)
        change, state = optimiser.update(grads, state, weights)
        return optax.apply_updates(weights, change), state, losses

    update = jax.jit(update, static_argnums=3)
    key = jax.random.PRNGKey(seed)
    weights = start(key)
    state = optimiser.init(weights)
    counts = np.array(list(MEASUREMENTS))
    chances = np.array(list(MEASUREMENTS.values()))
    for step in range(steps):
        key, k = jax.random.split(key)
        count = int(rng.choice(counts, p=chances / chances.sum()))
        weights, state, losses = update(weights, state, k, count)
        if report and (step + 1) % max(steps // 100, 1) == 0:
            report(step + 1, steps, [float(v) for v in losses])
    found = {name: np.asarray(w).astype(np.float16) for name, w in weights.items()}
    found["prior"] = prior.astype(np.float32)
    described = {
        "kind": "spts amortised 1",
        "rows": rows,
        "cols": cols,
        "hidden": hidden,
        "memory": memory,
        "unrolled": unrolled,
        "noise_variance": NOISE_VARIANCE,
        "training": {"steps": steps, "batch": batch, "rate": rate, "seed": seed},
        "spec": data.spec,
        "data": data.info["digest"],
    }
    return found, described


def main(arguments=None):
    parser = argparse.ArgumentParser(
        prog="python -m spts.amortised",
        description="Trains the decoder `amortised` on a data set of shapes: a small network from samples and rows to an image.",
        epilog="examples: python -m spts.amortised --out amortised.safetensors; "
        "spts dataset specs --show unseen-shapes > mine.toml, then [skin] rows, cols, pitch_m in it, then "
        "python -m spts.amortised mine.toml --out mine.safetensors",
    )
    parser.add_argument(
        "spec", nargs="?", default="unseen-shapes", help="name of a spec, or a file (default: unseen-shapes)"
    )
    parser.add_argument("--out", required=True, help="file to write the trained network to")
    parser.add_argument(
        "--data", help="folder of the data set, made there if it is not there yet (default: a temporary one)"
    )
    parser.add_argument("--steps", type=int, default=9_000, help="steps of training (default: 9000)")
    parser.add_argument("--batch", type=int, default=512, help="windows of a step (default: 512)")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args(arguments)
    try:
        import jax  # noqa: F401
        import optax  # noqa: F401
        from safetensors.numpy import save
    except ImportError as error:
        sys.exit(f"error: {error.name} is missing: pip install 'spts-twin[train]'")
    import spts

    with tempfile.TemporaryDirectory() as temporary:
        data = spts.dataset.make(asked.spec, asked.data or os.path.join(temporary, "shapes"))

        def report(step, steps, losses):
            print(
                f"\rstep {step} of {steps}: cross-entropy {losses[0]:.4f}, squared error {losses[1]:.4f}",
                end="",
                file=sys.stderr,
            )

        weights, described = train(data, steps=asked.steps, batch=asked.batch, seed=asked.seed, report=report)
        print(file=sys.stderr)
        # one entry: several would be written in any order
        content = save(weights, metadata={"spts": json.dumps(described, sort_keys=True)})
        with open(asked.out, "wb") as out:
            out.write(content)
        print(f"{asked.out}: sha256 {hashlib.sha256(content).hexdigest()}")


if __name__ == "__main__":
    main()
