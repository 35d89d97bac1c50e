"""Lasso of SPAMS over a dictionary that SPAMS has learned from the images."""

import numpy as np
import spams


class Dictionary:
    def fit(self, train):
        images = np.asfortranarray(train.images.T / np.linalg.norm(train.images, axis=1))
        atoms = min(2 * images.shape[0], images.shape[1])
        options = {"lambda1": 0.05, "iter": 100, "posAlpha": True, "posD": True, "numThreads": 1, "verbose": False}
        self.atoms = spams.trainDL(images, K=atoms, batchsize=64, **options)

    def predict(self, phi, y):
        columns = phi @ self.atoms
        lengths = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
        columns = np.asfortranarray(columns / lengths)
        penalty = 0.02 * np.abs(columns.T @ y).max()
        weights = spams.lasso(np.asfortranarray(y[:, None]), D=columns, lambda1=penalty, pos=True, numThreads=1)
        return self.atoms @ (weights.toarray()[:, 0] / lengths)
