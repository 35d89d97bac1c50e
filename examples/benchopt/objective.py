"""Images of touches from few sums on one wire: how many taxels are shown wrongly."""

import numpy as np
from benchopt import BaseObjective


def support(images):
    """Taxels above 23 % of each image's maximum."""
    most = images.max(axis=1, keepdims=True)
    return (images > 0.23 * most) & (most > 0)


class Objective(BaseObjective):
    name = "Few-wire touch"
    url = "docs/benchmark.md"
    min_benchopt_version = "1.6"

    def set_data(self, phi, y, images, train):
        self.phi, self.y, self.images, self.train = phi, y, images, train

    def get_objective(self):
        return {"phi": self.phi, "y": self.y, "train": self.train}

    def get_one_result(self):
        return {"images": np.zeros_like(self.images)}

    def evaluate_result(self, images):
        shown, true = support(images), support(self.images)
        iou = (shown & true).sum(axis=1) / (shown | true).sum(axis=1)
        cosine = (images * self.images).sum(axis=1) / np.maximum(
            np.linalg.norm(images, axis=1) * np.linalg.norm(self.images, axis=1), 1e-300
        )
        worst = np.quantile(iou, 0.1)
        return {"value": 1 - iou.mean(), "iou": iou.mean(), "worst_tenth": worst, "cosine": cosine.mean()}
