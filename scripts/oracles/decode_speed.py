"""Microseconds a decode, one thread, side by side in one run: scikit-learn, SPAMS, ours.

Every window has its own Φ of ±1 (M × N) and y = Φ·D·α + noise with S planted atoms of a random dictionary D (N × K). Orthogonal matching
pursuit of S atoms on the columns of Φ·D scaled to length 1 (SPAMS: orthogonal least squares, which is what its `omp` is):

    formed  Φ·D given for every window
    all     Φ·D formed from Φ, and its columns scaled where the program does not do it

The peers' Φ·D is one matrix product for all windows, the fastest way there is in numpy. Times are the thread's CPU time, medians over
alternating rounds; their ratios are the result (float32 against our `f32` tables). Ours is the example `decode_time`, timed as a process of many repeats less a process of
one. Supports are compared with scikit-learn's. 
    cargo build --release -p spts-recon --example decode_time
    python scripts/oracles/decode_speed.py [--json] [--rounds 5] [--windows 1000]
"""

import peers

peers.one_thread()

import argparse
import json
import pathlib
import resource
import statistics
import subprocess
import tempfile
import time

import numpy as np
import spams
from sklearn.linear_model import orthogonal_mp

N, K, M, S = 100, 100, 25, 6
NOISE = 0.01
ROOT = pathlib.Path(__file__).parents[2]
OURS = ROOT / "target/release/examples/decode_time"
# a round of ours lasts at least this long, s
ROUND_S = 0.2
# scikit-learn is timed on the first of this many windows
FEW = 200
OUR_MODES = ["form", "form32", "decode", "all", "all32"]


class Windows:
    """The problem all programs get."""

    def __init__(self, count):
        rng = np.random.default_rng(1)
        self.count = count
        self.dictionary = rng.standard_normal((N, K))
        bits = rng.integers(0, 2, (count, M, N), dtype=np.uint8)
        self.phi = 2.0 * bits - 1.0
        alpha = np.zeros((count, K))
        for row in alpha:
            row[rng.choice(K, S, replace=False)] = rng.uniform(0.5, 1.5, S)
        image = alpha @ self.dictionary.T
        clean = np.einsum("wmn,wn->wm", self.phi, image)
        self.y = clean + NOISE * np.std(clean) * rng.standard_normal((count, M))
        words = -(-N // 64)
        padded = np.zeros((count, M, 64 * words), np.uint8)
        padded[:, :, :N] = bits
        self.signs = np.packbits(padded, axis=2, bitorder="little").view("<u8")

    def write(self, path):
        with open(path, "wb") as file:
            np.array([N, K, M, S, self.count], "<u8").tofile(file)
            for part in (self.dictionary, self.signs, self.y):
                part.tofile(file)


def form(phi, dictionary, out):
    """Φ·D of all windows with columns of length 1, W·M × K, into memory that is there."""
    np.matmul(phi, dictionary, out=out)
    for a in out.reshape(-1, M, K):
        a /= np.sqrt(np.einsum("mk,mk->k", a, a))


def sklearn_own(a, y):
    return [orthogonal_mp(a, y, n_nonzero_coefs=S) for a, y in zip(a, y)]


def spams_own(a, y):
    # SPAMS wants columns one after the other
    return [spams.omp(y[:, None], np.asfortranarray(a), L=S, eps=0.0, numThreads=1) for a, y in zip(a, y)]


def timed(action, *arguments):
    begin = time.process_time()
    result = action(*arguments)
    return time.process_time() - begin, result


def ours_seconds(file, mode, repeats):
    begin = resource.getrusage(resource.RUSAGE_CHILDREN)
    text = subprocess.run([OURS, file, mode, str(repeats)], check=True, capture_output=True, text=True).stdout
    end = resource.getrusage(resource.RUSAGE_CHILDREN)
    return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime, json.loads(text)["supports"]


def peers_round(windows):
    """{(program, task): µs a decode} of one round, and scikit-learn's supports."""
    times = {}
    for dtype in (np.float64, np.float32):
        name = np.dtype(dtype).name
        phi, dictionary = windows.phi.astype(dtype).reshape(-1, N), windows.dictionary.astype(dtype)
        out = np.ones((windows.count * M, K), dtype)
        seconds, _ = timed(form, phi, dictionary, out)
        forming, a = seconds / windows.count, out.reshape(-1, M, K)
        # as SPAMS wants them, not counted: a program built around it would form them so
        fortran = [np.asfortranarray(one) for one in a]
        y = windows.y.astype(dtype)
        seconds, _ = timed(spams_own, fortran, y)
        times[f"SPAMS {name}", "formed"] = seconds / windows.count
        times[f"SPAMS {name}", "all"] = seconds / windows.count + forming
        times[f"numpy {name}", "form"] = forming
        if dtype is np.float64:
            seconds, codes = timed(sklearn_own, a[:FEW], y[:FEW])
            times["scikit-learn", "formed"] = seconds / len(codes)
            times["scikit-learn", "all"] = seconds / len(codes) + forming
    supports = [set(np.flatnonzero(code)) for code in codes]
    return {key: 1e6 * seconds for key, seconds in times.items()}, supports


def agreement(ours, theirs):
    """Share of equal supports."""
    return float(np.mean([set(a) == b for a, b in zip(ours, theirs)]))


def race(windows, rounds):
    """Median µs of every (program, task), and how often our supports are scikit-learn's."""
    times, agreements = {}, {}
    with tempfile.TemporaryDirectory() as folder:
        file = f"{folder}/windows"
        windows.write(file)
        repeats = {}
        for mode in OUR_MODES:
            spent = ours_seconds(file, mode, 21)[0] - ours_seconds(file, mode, 1)[0]
            repeats[mode] = max(20, int(20 * ROUND_S / max(spent, 1e-3)))
        for _ in range(rounds):
            theirs, own_supports = peers_round(windows)
            for mode in OUR_MODES:
                many, supports = ours_seconds(file, mode, 1 + repeats[mode])
                theirs["ours", mode] = 1e6 * (many - ours_seconds(file, mode, 1)[0]) / (repeats[mode] * windows.count)
                if mode in ("decode", "all", "all32"):
                    agreements[mode] = agreement(supports, own_supports)
            for key, value in theirs.items():
                times.setdefault(key, []).append(value)
    return {key: statistics.median(values) for key, values in times.items()}, agreements


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--windows", type=int, default=1000)
    options = parser.parse_args()
    times, agreements = race(Windows(options.windows), options.rounds)
    rows = []
    for (program, task), us in times.items():
        ours = {"formed": "decode"}.get(task, task)
        if program.endswith("float32") and task in ("form", "all"):
            ours += "32"
        ratio = us / times["ours", ours] if program != "ours" else None
        rows.append({"program": program, "task": task, "us": us, "times_ours": ratio})
    if options.json:
        print(json.dumps({"rows": rows, "agreement": agreements}))
        return
    print(f"{'program':14} {'task':7} {'µs':>8} {'× ours':>7}")
    for row in rows:
        ratio = f"{row['times_ours']:7.1f}" if row["times_ours"] else ""
        print(f"{row['program']:14} {row['task']:7} {row['us']:8.2f} {ratio}")
    for mode, share in agreements.items():
        print(f"supports of {mode} equal scikit-learn's: {100 * share:.1f} %")


if __name__ == "__main__":
    main()
