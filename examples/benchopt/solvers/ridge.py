"""The linear estimate under the second moments of the images to learn from."""

import numpy as np
from benchopt import BaseSolver


class Solver(BaseSolver):
    name = "ridge"
    parameters = {"noise": [0.02]}
    sampling_strategy = "run_once"

    def set_objective(self, phi, y, train):
        self.phi, self.y, self.moments = phi, y, train.T @ train / len(train)

    def run(self, _):
        sums = self.phi @ self.moments @ self.phi.T
        sums += self.noise * np.trace(sums) / len(sums) * np.eye(len(sums))
        self.images = np.maximum((self.moments @ self.phi.T @ np.linalg.solve(sums, self.y.T)).T, 0)

    def get_result(self):
        return {"images": self.images}
