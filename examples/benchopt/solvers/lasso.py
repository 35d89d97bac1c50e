"""Non-negative lasso of scikit-learn over single taxels."""

import warnings

import numpy as np
from benchopt import BaseSolver
from sklearn.linear_model import Lasso


class Solver(BaseSolver):
    name = "taxel-lasso"
    parameters = {"share": [0.05, 0.2]}
    requirements = ["scikit-learn"]
    sampling_strategy = "run_once"

    def set_objective(self, phi, y, train):
        self.phi, self.y = phi, y

    def run(self, _):
        warnings.filterwarnings("ignore")

        def image(y):
            penalty = self.share * np.abs(self.phi.T @ y).max() / len(y)
            return Lasso(alpha=penalty, positive=True, fit_intercept=False, max_iter=500).fit(self.phi, y).coef_

        self.images = np.array([image(y) for y in self.y])

    def get_result(self):
        return {"images": self.images}
