"""Rows of signs learned by straight-through gradients, after GLODISMO (Sauder, Genzel, Jung, arXiv 2202.03391),
here of the error of a linear estimate; decoded by a non-negative lasso over the images."""

import warnings

import jax
import jax.numpy as jnp
import numpy as np
import optax
from sklearn.linear_model import Lasso

warnings.filterwarnings("ignore")


class LearnedRows:
    def fit(self, train):
        self.x = jnp.array(train.images / np.linalg.norm(train.images, axis=1, keepdims=True)).T
        self.c = self.x @ self.x.T / self.x.shape[1]
        self.signs = {m: self.learned(m) for m in train.measurements}

    def rows(self, m):
        return self.signs[m]

    def learned(self, m):
        soft = jnp.array(np.random.default_rng(m).standard_normal((m, self.x.shape[0])))

        def left(soft):
            phi = soft + jax.lax.stop_gradient(jnp.sign(soft) - soft)
            s = phi @ self.c @ phi.T
            s = s + 0.02 * jnp.trace(s) / m * jnp.eye(m)
            return jnp.trace(self.c) - jnp.trace(self.c @ phi.T @ jnp.linalg.solve(s, phi @ self.c))

        move, grad = optax.adam(0.05), jax.jit(jax.grad(left))
        state = move.init(soft)
        for _ in range(300 if self.x.shape[0] < 500 else 0):
            updates, state = move.update(grad(soft), state)
            soft = optax.apply_updates(soft, updates)
        return np.sign(np.asarray(soft))

    def predict(self, phi, y):
        columns = phi @ np.asarray(self.x)
        penalty = 0.02 * np.abs(columns.T @ y).max() / len(y)
        model = Lasso(alpha=penalty, positive=True, fit_intercept=False, max_iter=300)
        return np.asarray(self.x) @ model.fit(columns, y).coef_
