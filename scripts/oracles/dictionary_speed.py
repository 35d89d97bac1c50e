"""Seconds to learn a dictionary to the same error, one thread, side by side in one run: SPAMS `trainDL`, ours.

Both learn 100 atoms from the same 1,000 images (synthetic contacts, or a file), with at most S atoms a code. The error of a dictionary is
‖X − D A‖_F / ‖X‖_F with the codes A of a pursuit of S atoms, for every program alike: orthogonal least squares, which is what SPAMS' own
`omp` is, or scikit-learn's orthogonal matching pursuit. SPAMS runs with the ℓ0 code (`mode` 3, the better one here: with the lasso its error
at S atoms stays above) and two batch sizes, 256 being its default, for 10 to 1,000 iterations; ours are the published K-SVD and its fast
settings with 1 to 80 sweeps. Every program starts from its own random images; errors and times are means over the seeds, times are the thread's CPU time (ours: a process less one that learns nothing), and the ratio is SPAMS' time to the error over our time to
the error, ours interpolated on its curve (log time against error). SPAMS' entry is always the fastest of its settings at that error.

    cargo build --release -p spts-recon --example dictionary_time
    python scripts/oracles/dictionary_speed.py [--json] [--seeds 3] [--sparsity 20] [--judge omp|ols] [--images FILE.npy]
"""

import peers

peers.one_thread()

import argparse
import json
import pathlib
import resource
import subprocess
import tempfile
import time
import warnings

import numpy as np
import spams
from contact_images import contact_images
from sklearn.linear_model import orthogonal_mp_gram

ATOMS = 100
IMAGES = 1000
ROOT = pathlib.Path(__file__).parents[2]
OURS = ROOT / "target/release/examples/dictionary_time"
SETTINGS = ["ksvd", "ksvd_fast"]
SWEEPS = [1, 2, 3, 5, 10, 20, 40, 80]
ITERATIONS = [10, 30, 100, 300, 1000]
BATCHES = [64, 256]


def error_of(dictionary, images, sparsity, judge):
    """Relative error of coding `images` (rows) with `sparsity` atoms (columns of `dictionary`)."""
    d, x = np.asfortranarray(dictionary / np.linalg.norm(dictionary, axis=0)), np.asfortranarray(images.T)
    if judge == "ols":
        codes = spams.omp(x, d, L=sparsity, eps=0.0, numThreads=1).toarray()
    else:
        with warnings.catch_warnings():
            # a pursuit that ends early because nothing is left
            warnings.simplefilter("ignore")
            codes = orthogonal_mp_gram(d.T @ d, d.T @ x, n_nonzero_coefs=sparsity)
    return float(np.linalg.norm(x - d @ codes) / np.linalg.norm(x))


def spams_point(images, sparsity, judge, batch, iterations, seed):
    """(s, error) of SPAMS."""
    x = np.asfortranarray(images.T)
    chosen = np.random.default_rng(seed).choice(len(images), ATOMS, replace=False)
    start = np.asfortranarray(x[:, chosen] / np.linalg.norm(x[:, chosen], axis=0))
    settings = {"mode": 3, "lambda1": sparsity, "batchsize": batch}
    begin = time.process_time()
    found = spams.trainDL(x, D=start, K=ATOMS, iter=iterations, numThreads=1, verbose=False, **settings)
    return time.process_time() - begin, error_of(found, images, sparsity, judge)


def ours_seconds(folder, settings, sparsity, sweeps, seed):
    """CPU seconds of a process of ours; the dictionary is left in `folder`."""
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    numbers = [str(v) for v in (ATOMS, sparsity, sweeps, seed)]
    subprocess.run([OURS, folder / "images", settings, *numbers, folder / "dictionary"], check=True)
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime


def ours_point(folder, images, sparsity, judge, settings, sweeps, seed):
    """(s, error) of ours."""
    nothing = ours_seconds(folder, settings, sparsity, 0, seed)
    seconds = ours_seconds(folder, settings, sparsity, sweeps, seed) - nothing
    found = np.fromfile(folder / "dictionary").reshape(images.shape[1], -1)
    return seconds, error_of(found, images, sparsity, judge)


def curves(images, sparsity, judge, seeds):
    """{name: [(steps, s, error), …]}, means over the seeds, programs taking turns."""
    found = {}
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        with open(folder / "images", "wb") as file:
            np.array(images.T.shape, "<u8").tofile(file)
            np.ascontiguousarray(images, "<f8").tofile(file)
        for seed in range(1, seeds + 1):
            for batch in BATCHES:
                for n in ITERATIONS:
                    point = spams_point(images, sparsity, judge, batch, n, seed)
                    found.setdefault(f"SPAMS, batches of {batch}", {}).setdefault(n, []).append(point)
            for settings in SETTINGS:
                for n in SWEEPS:
                    point = ours_point(folder, images, sparsity, judge, settings, n, seed)
                    found.setdefault(settings, {}).setdefault(n, []).append(point)
    mean = {name: [(n, *np.mean(points, axis=0)) for n, points in curve.items()] for name, curve in found.items()}
    return {name: [(n, float(s), float(e)) for n, s, e in curve] for name, curve in mean.items()}


def seconds_to(curve, error):
    """Seconds at which `curve` reaches `error`; infinite when it does not."""
    before = None
    for _, s, e in curve:
        if e <= error:
            if before is None:
                return s
            share = (before[1] - error) / (before[1] - e)
            return float(np.exp(np.log(before[0]) + share * np.log(s / before[0])))
        before = (s, e)
    return float("inf")


def ratios(all_curves):
    """SPAMS' fastest time to each error that it stops at, and how many times ours that is."""
    theirs = {name: curve for name, curve in all_curves.items() if name.startswith("SPAMS")}
    rows = []
    for error in sorted({e for curve in theirs.values() for _, _, e in curve}, reverse=True):
        spams_s = min(seconds_to(curve, error) for curve in theirs.values())
        row = {"error": error, "spams_s": spams_s}
        for settings in SETTINGS:
            row[settings] = spams_s / seconds_to(all_curves[settings], error)
        rows.append(row)
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--sparsity", type=int, default=20)
    parser.add_argument("--judge", choices=["omp", "ols"], default="omp")
    parser.add_argument("--images", type=pathlib.Path, help=".npy, one image a row")
    options = parser.parse_args()
    images = np.load(options.images) if options.images else contact_images(IMAGES, 1)
    all_curves = curves(images, options.sparsity, options.judge, options.seeds)
    rows = ratios(all_curves)
    if options.json:
        print(json.dumps({"curves": all_curves, "ratios": rows}))
        return
    for name, curve in all_curves.items():
        print(f"{name:22}", "  ".join(f"{n}: {s:.3f} s {e:.4f}" for n, s, e in curve))
    print(f"\n{'error':>7} {'SPAMS s':>8}  times ours: " + "  ".join(f"{name:>9}" for name in SETTINGS))
    for row in rows:
        print(f"{row['error']:7.4f} {row['spams_s']:8.3f}  {'':12}" + "  ".join(f"{row[n]:9.1f}" for n in SETTINGS))


if __name__ == "__main__":
    main()
