"""The public split of the suite touch-1, as `spts bench data` writes it."""

import subprocess
import tempfile
from pathlib import Path

import numpy as np
from benchopt import BaseDataset


class Dataset(BaseDataset):
    name = "touch-1"
    parameters = {"task": ["small", "thin", "broad"], "measurements": [7, 20, 50]}

    def get_data(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run(["spts", "bench", "data", self.task, "--out", folder], check=True, stdout=subprocess.DEVNULL)
            phi, y, images = (np.load(Path(folder) / f"{name}.npy") for name in ("phi", "y", "images"))
        # five skins to learn from, and one that is decoded
        first = 5 * len(y) // 6
        m = self.measurements
        return {"phi": phi[:m], "y": y[first:, :m], "images": images[first:], "train": images[:first]}
