"""Supports that the published decoder chooses on 1,000 windows of the real skin, and their SHA-256.

The published pursuit, written here from its description: weights 0 and 1 from each cell's generator, no offset taken off, atoms not
normalised, a pseudo-inverse for the coefficients, S atoms at most, and an end as soon as another atom no longer lowers the residual. Windows
are the first M measurements of every eighth frame from frame 500 to 692 of presses 6 to 13 of brain, center, eraser, rec and trig, with the
published dictionary. The text that is hashed has a line a window: the indices of the atoms in the order they were chosen, separated by
spaces. `tests/published.rs` holds the digests; the recordings carry no licence, so nothing of them is kept.

    python scripts/oracles/published_supports.py RECORDINGS [--out FOLDER]
"""

import argparse
import hashlib
import pathlib

import numpy as np
from scipy.io import loadmat

OBJECTS = ["brain", "center", "eraser", "rec", "trig"]
PRESSES = range(5, 13)
FRAMES = range(500, 700, 8)
PER_FRAME = 100
# measurements and most atoms: the script's own setting and its classifier's
SETTINGS = [(20, 20), (25, 20), (50, 20), (25, 10), (50, 10)]
FIRST_SEED = 8


def binary_rows(first, count):
    """Rows first … first + count − 1 of Φ, row 0 being the one after a single step from the seeds."""
    states = np.arange(FIRST_SEED, FIRST_SEED + PER_FRAME, dtype=np.uint64)
    mask = np.uint64(0xFFFFFFFF)
    # s ↦ a·s + c, many times at once: square and multiply the map
    a, c, steps = 1664525, 1013904223, int(first)
    while steps:
        if steps & 1:
            states = (states * np.uint64(a) + np.uint64(c)) & mask
        a, c = a * a & 0xFFFFFFFF, (a + 1) * c & 0xFFFFFFFF
        steps >>= 1
    rows = np.empty((count, PER_FRAME))
    for row in rows:
        states = (states * np.uint64(1664525) + np.uint64(1013904223)) & mask
        row[:] = (states >> np.uint64(24)) >= 128
    return rows


def pursuit(a, y, most):
    """Atoms in the order they are chosen, and how clearly: the least relative lead of a choice over the second best."""
    chosen, residual, lead = [], y, np.inf
    while len(chosen) < min(most, *a.shape):
        score = np.abs(a.T @ residual)
        best = int(np.argmax(score))
        if best in chosen:
            break
        trial = [*chosen, best]
        candidate = y - a[:, trial] @ (np.linalg.pinv(a[:, trial]) @ y)
        if not np.linalg.norm(candidate) < np.linalg.norm(residual):
            break
        second = np.max(np.delete(score, best))
        chosen, residual, lead = trial, candidate, min(lead, 1 - second / score[best])
    return chosen, lead


def windows(root):
    """(rows of Φ, measurements) of a whole frame, in order."""
    for name in OBJECTS:
        folder = root / "presses" / name
        if not folder.is_dir():
            folder = root / "Measurements_Collected" / name
        volts = loadmat(folder / f"{name}_random2.mat")["C"]
        ends = loadmat(folder / f"{name}_random2_time.mat")["framePosition"].ravel()
        for press in PRESSES:
            for frame in FRAMES:
                first = (int(ends[press]) - volts.shape[1] + frame) * PER_FRAME
                yield binary_rows(first, PER_FRAME), volts[:, frame, press]


def dictionary(root):
    paths = [root / "dictionary.mat", *sorted((root / "Dictionary_Learning").glob("*.mat"))]
    for path in filter(pathlib.Path.is_file, paths):
        variables = loadmat(path)
        if "Dksvd" in variables:
            return variables["Dksvd"]
    raise SystemExit(f"no file with the variable Dksvd in {root}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("recordings", type=pathlib.Path)
    parser.add_argument("--out", type=pathlib.Path, help="folder for the supports themselves")
    options = parser.parse_args()
    atoms = dictionary(options.recordings)
    frames = list(windows(options.recordings))
    for m, most in SETTINGS:
        lines, least = [], np.inf
        for phi, y in frames:
            chosen, lead = pursuit(phi[:m] @ atoms, y[:m], most)
            lines.append(" ".join(map(str, chosen)))
            least = min(least, lead)
        text = "".join(line + "\n" for line in lines)
        digest = hashlib.sha256(text.encode()).hexdigest()
        print(f"M = {m:2}, S = {most:2}: {len(lines)} windows, least lead {least:.1e}, {digest}")
        if options.out:
            (options.out / f"supports_{m}_{most}.txt").write_text(text)


if __name__ == "__main__":
    main()
