"""Orthogonal matching pursuit of scikit-learn over the images to learn from."""

import numpy as np
from benchopt import BaseSolver
from sklearn.linear_model import orthogonal_mp


class Solver(BaseSolver):
    name = "omp"
    requirements = ["scikit-learn"]
    sampling_strategy = "run_once"

    def set_objective(self, phi, y, train):
        self.phi, self.y = phi, y
        self.atoms = train / np.linalg.norm(train, axis=1, keepdims=True)

    def run(self, _):
        columns = self.phi @ self.atoms.T
        lengths = np.linalg.norm(columns, axis=0)
        weights = orthogonal_mp(columns / lengths, self.y.T, n_nonzero_coefs=max(1, len(self.phi) // 3))
        self.images = np.maximum((weights / lengths[:, None]).T @ self.atoms, 0)

    def get_result(self):
        return {"images": self.images}
