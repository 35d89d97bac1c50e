"""A small unrolled network, LISTA: eight steps of ISTA whose steps, thresholds and smoothing are learned."""

import jax
import jax.numpy as jnp
import numpy as np
import optax


class Unrolled:
    def fit(self, train):
        self.shape = (train.rows, train.cols)
        images = jnp.array(train.images / train.images.max(axis=1, keepdims=True))
        start = {"step": jnp.full(8, 0.5), "cut": jnp.full(8, 0.05), "blur": jnp.zeros((8, 3, 3)).at[:, 1, 1].set(1.0)}
        self.weights, n = start, train.rows * train.cols
        move = optax.adam(0.01)
        state = move.init(start)
        grad = jax.jit(jax.grad(lambda w, phi, x, y: jnp.mean((self.image(w, phi, y) - x) ** 2)))
        rng = np.random.default_rng(0)
        for _ in range(1500 if n < 500 else 0):
            m, x = int(rng.choice([10, 20, 40])), images[rng.integers(len(images))]
            phi = jnp.array(rng.choice([-1.0, 1.0], (m, n)))
            y = phi @ x * (1 + 0.05 * rng.standard_normal(m))
            updates, state = move.update(grad(self.weights, phi, x, y), state)
            self.weights = optax.apply_updates(self.weights, updates)

    def image(self, w, phi, y):
        scale = jnp.linalg.norm(phi, 2) ** 2
        x = jnp.zeros(phi.shape[1])
        for step, cut, blur in zip(w["step"], w["cut"], w["blur"], strict=True):
            x = x + step * phi.T @ (y - phi @ x) / scale
            x = jax.scipy.signal.convolve2d(x.reshape(self.shape), blur, mode="same").ravel()
            x = jnp.maximum(x - cut * jnp.abs(x).max(), 0)
        return x

    def predict(self, phi, y):
        return self.image(self.weights, jnp.array(phi), jnp.array(y) / np.abs(y).max())
