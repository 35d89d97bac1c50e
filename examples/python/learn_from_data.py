"""Learns what images of touches look like, from a data set alone, with scikit-learn.

    python3 examples/python/learn_from_data.py DATA_SET MODEL.npz [--components 30] [--rows 40000]

DATA_SET is a folder that `spts dataset make random-shapes --set record.phi=true --out DATA_SET` has made. Only its rows for
training are read. Nothing recorded on a skin is used. Needs numpy, pyarrow and scikit-learn.

The model is a mixture of Gaussians over images: images of unit length are sorted into clusters by k-means, each cluster has
a mean and a covariance (shrunk to that of all images by Ledoit and Wolf's rule), and one wide Gaussian over all images
stands for shapes that are in no cluster. Lengths and the noise of a sample are numbers of their own.
`learned_decoder.py` decodes with it.
"""

import argparse
import pathlib

import numpy as np
import pyarrow.dataset
from sklearn.cluster import MiniBatchKMeans
from sklearn.covariance import LedoitWolf

# weight of the Gaussian over all images, before a measurement
WIDE = 0.3
# lengths of images that the decoder tries
LENGTHS = 9


def table(folder, rows):
    """Columns of the training rows, as arrays; at most `rows` rows, evenly out of all."""
    data = pyarrow.dataset.dataset(pathlib.Path(folder) / "data", format="parquet")
    training = pyarrow.dataset.field("split") == "train"
    found = data.to_table(columns=["conductance_s", "y_v", "phi"], filter=training)
    found = found.take(np.linspace(0, len(found) - 1, min(rows, len(found))).astype(int))
    column = lambda name: np.stack(found[name].combine_chunks().flatten().to_numpy().reshape(len(found), -1)).astype(float)
    y, conductance = column("y_v"), column("conductance_s")
    return conductance, y, column("phi").reshape(len(y), y.shape[1], -1)


def main():
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("data_set")
    options.add_argument("model")
    options.add_argument("--components", type=int, default=30)
    options.add_argument("--rows", type=int, default=40000)
    options = options.parse_args()

    conductance, y, phi = table(options.data_set, options.rows)
    # y = gain Φ x + offset: volts a siemens, and the output of an idle skin
    sums = np.einsum("wmn,wn->wm", phi, conductance)
    gain, offset = np.polyfit(sums.ravel(), y.ravel(), 1)
    images = gain * conductance
    residual = y - gain * sums - offset
    size = images.sum(axis=1)
    # variance of a sample: a part of its own, and one that grows with the square of all that is pressed
    noise = np.linalg.lstsq(np.stack([np.ones_like(size), size**2], axis=1), residual.var(axis=1), rcond=None)[0]
    noise = np.maximum(noise, [1e-6, 0.0])

    length = np.linalg.norm(images, axis=1)
    keep = length > 0
    images, length = images[keep] / length[keep, None], length[keep]
    whole = LedoitWolf().fit(images)
    labels = MiniBatchKMeans(options.components, random_state=0, n_init=3).fit_predict(images)
    means, covariances, weights = [whole.location_], [whole.covariance_], [WIDE]
    for cluster in range(options.components):
        members = images[labels == cluster]
        if len(members) < 2:
            continue
        own = LedoitWolf().fit(members)
        means.append(own.location_)
        covariances.append(own.covariance_)
        weights.append((1 - WIDE) * len(members) / len(images))
    np.savez(
        options.model,
        means=np.array(means),
        covariances=np.array(covariances),
        weights=np.array(weights),
        lengths=np.quantile(length, (np.arange(LENGTHS) + 0.5) / LENGTHS),
        noise=noise,
    )
    print(f"{len(images)} images, gain {gain:.0f} V/S, noise {noise[0] ** 0.5:.4f} V and {100 * noise[1] ** 0.5:.2f} % of all that is pressed")


if __name__ == "__main__":
    main()
