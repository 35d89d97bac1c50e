"""FISTA of PyProximal with the operators of PyLops: non-negative images with few taxels."""

import numpy as np
import pylops
import pyproximal


class NonNegative(pyproximal.ProxOperator):
    """The penalty s * sum(x) for x >= 0."""

    def __init__(self, penalty):
        super().__init__(None, False)
        self.penalty = penalty

    def __call__(self, x):
        return self.penalty * x.sum()

    def prox(self, x, tau):
        return np.maximum(x - tau * self.penalty, 0)


class Fista:
    def predict(self, phi, y):
        misfit = pyproximal.L2(Op=pylops.MatrixMult(phi), b=y)
        penalty = 0.05 * np.abs(phi.T @ y).max()
        step = 1 / np.linalg.norm(phi, 2) ** 2
        start = np.zeros(phi.shape[1])
        return pyproximal.optimization.primal.AcceleratedProximalGradient(
            misfit, NonNegative(penalty), start, tau=step, niter=100
        )
