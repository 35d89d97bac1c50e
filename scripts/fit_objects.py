#!/usr/bin/env python3
"""Fits sizes and places of the seventeen objects to the published raster recordings, and scores the meshes.

The static model is the twin's in short form: the object's underside sinks into independent foam columns until they
carry the force; the pressure is averaged over every taxel's electrode; the conductance law V = A (P / (1 + P/P_s))^n
turns it into volts. The score is Pearson's r over the 100 taxels between that image and the recorded one: the median
over frames 500-650 and presses 2 onwards, minus the idle median of frames 0-150, taxel by taxel.

  fit_objects.py RECORDINGS fit OUT.json [--objects a,b] [--start EARLIER.json [--polish]]
      fits the parametrised shapes below and writes their parameters (millimetres and degrees). They are then rounded
      and written by hand into contact/src/objects, whose meshes are the shapes below as solids. With --start, half of the
      objective is r with the taxel gains that an earlier fit of the sixteen other objects implies, so that a shape
      need not imitate the sensitivity of single taxels; --polish also starts from that fit's parameters.
      The search has several near-equal optima (brain, center, comb, tape, perfume, trig): seeds differ by millimetres and
      degrees there, and the committed numbers are the most believable of those found, not always the highest r. The
      shape is fitted to the very image it is scored on, so r is a goodness of fit, not a prediction.
  fit_objects.py RECORDINGS laws
      tabulates how r answers to the exponent and the electrode side, the committed meshes held.
  fit_objects.py RECORDINGS volts
      fits A for several exponents and saturation pressures to the sums of the compressive recordings.
  fit_objects.py RECORDINGS score [--assets DIR] [--sheet SHEET.png]
      scores the committed meshes (OBJ and placements.csv), without taxel gains, with gains fitted to all objects, and
      with gains fitted to the sixteen others; draws model beside recording.

RECORDINGS holds presses/NAME/NAME_raster.mat (or Measurements_Collected/NAME/NAME_raster.mat). The recordings have no
licence: nothing of them is stored, only the geometric numbers that fit them best.
Needs numpy, scipy and, for --sheet, matplotlib. Run with OMP_NUM_THREADS=1: the arrays are small.
"""

import argparse
import csv
import json
import pathlib
import sys

import numpy as np
import scipy.io
import scipy.optimize

from object_shapes import POSE, SHAPES

NAMES = "brain center circle comb corner eraser fish gel line perfume rec smallT T tape tennis trig X".split()
PITCH_M = 15e-3
CELLS = 6  # fine cells along a taxel side: 2.5 mm
FORCE_N = 20.0

# Foam: p = K d / (1 - d/D) in series with a 50 times stiffer solid, as the twin's default contact layer.
STIFFNESS_PA_PER_M = 1.5e7
FOAM_DEPTH_M = 0.85 * 6e-3
SOLID_RATIO = 50.0
# Taxel: side of the electrode, m, and conductance law.
ELECTRODE_M = 10e-3
EXPONENT = 0.5
SATURATION_PA = 3e5


def recording(directory, name, kind):
    """Path of NAME_KIND.mat in either layout, or None."""
    paths = [pathlib.Path(directory) / f / name / f"{name}_{kind}.mat" for f in ("presses", "Measurements_Collected")]
    return next((path for path in paths if path.exists()), None)


def recorded(directory, name):
    """Median raster image, volts, shape (10, 10)."""
    path = recording(directory, name, "raster")
    if path is None:
        sys.exit(f"no {name}_raster.mat below {directory}/presses or {directory}/Measurements_Collected")
    volts = scipy.io.loadmat(path)["D"]
    idle = np.nanmedian(volts[:, :150, :], axis=1)
    held = np.nanmedian(volts[:, 500:650, :], axis=1)
    return np.median((held - idle)[:, 1:], axis=1).reshape(10, 10)


# --- contact and taxels ------------------------------------------------------------------------------------------

CENTRES_M = (np.arange(10 * CELLS) + 0.5) * PITCH_M / CELLS - 5 * PITCH_M
GRID_X_M, GRID_Y_M = np.meshgrid(CENTRES_M, -CENTRES_M)


def foam_pressure(depth_m):
    """Pressure of a foam column compressed by depth_m, Pa."""
    k, solid = STIFFNESS_PA_PER_M / (1 - 1 / SOLID_RATIO), SOLID_RATIO * STIFFNESS_PA_PER_M
    depth = np.maximum(depth_m, 0.0)
    b = 1 + k / solid - depth / FOAM_DEPTH_M
    root = np.sqrt(b * b + 4 * k * depth / (solid * FOAM_DEPTH_M))
    return np.where(b >= 0, 2 * k * depth / (np.abs(b) + root), (root - b) * solid * FOAM_DEPTH_M / 2)


def press(height_m, cover, force_n=FORCE_N):
    """Pressure field, Pa, of an underside of the given height over the skin (cover: share of each cell under it)."""
    inside = cover > 1e-6
    if not inside.any():
        return np.zeros_like(cover)
    z, share = height_m[inside], cover[inside]
    area = (PITCH_M / CELLS) ** 2
    low, high = z.min(), z.min() + 2 * FOAM_DEPTH_M
    for _ in range(26):
        middle = 0.5 * (low + high)
        if (foam_pressure(middle - z) * share).sum() * area < force_n:
            low = middle
        else:
            high = middle
    field = np.zeros_like(cover)
    field[inside] = foam_pressure(0.5 * (low + high) - z) * share
    return field


def electrode_means(field, electrode_m):
    """Mean over every taxel's electrode, shape (10, 10)."""
    edges = np.arange(CELLS + 1) * PITCH_M / CELLS
    low = 0.5 * (PITCH_M - electrode_m)
    share = np.maximum(0, np.minimum(edges[1:], low + electrode_m) - np.maximum(edges[:-1], low)) / electrode_m
    return np.einsum("ricj,i,j->rc", field.reshape(10, CELLS, 10, CELLS), share, share)


def law(pressure_pa, exponent=None):
    """Volts for A = 1."""
    return (pressure_pa / (1 + pressure_pa / SATURATION_PA)) ** (exponent or EXPONENT)


def image(height_m, cover, exponent=None, electrode_m=None):
    return law(electrode_means(press(height_m, cover), electrode_m or ELECTRODE_M), exponent)


def body_coordinates(pose):
    """Body x and y of every cell centre, mm; skin offsets from the body origin, m."""
    row, col, rotation_deg = pose[:3]
    dx = GRID_X_M - (col - 4.5) * PITCH_M
    dy = GRID_Y_M - (4.5 - row) * PITCH_M
    c, s = np.cos(np.radians(rotation_deg)), np.sin(np.radians(rotation_deg))
    return 1e3 * (c * dx + s * dy), 1e3 * (c * dy - s * dx), dx, dy


def surface(name, p):
    """Height (m) and cover of the parametrised shape with parameters p: the pose, then the sizes."""
    x, y, dx, dy = body_coordinates(p)
    distance, height, fill = SHAPES[name][0](x, y, *p[len(POSE) :])
    height = height + p[5] * (x / 40) ** 2 + p[6] * (y / 40) ** 2
    tilted = 1e-3 * height + np.radians(p[3]) * dy - np.radians(p[4]) * dx
    return tilted, fill * np.clip(0.5 - distance / (1e3 * PITCH_M / CELLS), 0, 1)


def correlation(a, b):
    a, b = a.ravel() - a.mean(), b.ravel() - b.mean()
    return float(a @ b / max(np.sqrt((a @ a) * (b @ b)), 1e-30))


def fit(name, target, gains, start=None, iterations=70, seed=1):
    _, pose, bow, sizes = SHAPES[name]
    turn = {"tennis": 1e-6, "circle": 1e-6, "brain": 40, "comb": 20}.get(name, 12)
    tilt = 1e-6 if name == "tennis" else 2.0
    low = [pose[0] - 1, pose[1] - 1, pose[2] - turn, -tilt, -tilt, -bow - 1e-6, -bow - 1e-6] + [s[1] for s in sizes.values()]
    high = [pose[0] + 1, pose[1] + 1, pose[2] + turn, tilt, tilt, bow + 1e-6, bow + 1e-6] + [s[2] for s in sizes.values()]
    low, high = np.array(low, float), np.array(high, float)
    first = np.array([*pose, 0, 0, 0, 0] + [s[0] for s in sizes.values()], float) if start is None else np.array(start)
    # what is not needed is not bought: tilt, bow and departure from the first guess cost a little
    scale = np.array([1e9, 1e9, 60, 2.5, 2.5, 1.2, 1.2] + [(s[2] - s[1]) * 1.5 for s in sizes.values()])
    centre = np.array([0, 0, pose[2], 0, 0, 0, 0] + [s[0] for s in sizes.values()], float)

    def cost(p):
        p = np.clip(p, low, high)
        model = image(*surface(name, p))
        r = 0.5 * correlation(model, target) + 0.5 * correlation(model * gains, target)
        return -r + 0.01 * (((p - centre) / scale) ** 2).sum()

    if start is None:
        found = scipy.optimize.differential_evolution(cost, list(zip(low, high)), x0=first, popsize=6, maxiter=iterations,
                                                      seed=seed, tol=1e-4, mutation=(0.4, 0.9), polish=False)
        first = found.x
    found = scipy.optimize.minimize(cost, np.clip(first, low, high), method="Nelder-Mead", options={"maxfev": 1500, "xatol": 1e-2, "fatol": 1e-5, "adaptive": True})
    p = np.clip(found.x, low, high)
    return p, correlation(image(*surface(name, p)), target)


# --- the committed meshes ---------------------------------------------------------------------------------------------


def read_obj(path):
    vertices, triangles = [], []
    for line in pathlib.Path(path).read_text().splitlines():
        words = line.split()
        if words and words[0] == "v":
            vertices.append([float(w) for w in words[1:4]])
        elif words and words[0] == "f":
            triangles.append([int(w.split("/")[0]) - 1 for w in words[1:4]])
    return np.array(vertices), np.array(triangles)


def mesh_surface(path, row, col, rotation, tilt_x, tilt_y):
    """Underside of a placed mesh at the cell centres: height, m, and 0/1 cover."""
    v, t = read_obj(path)
    cz, sz, cx, sx, cy, sy = (f(a) for a in (rotation, tilt_x, tilt_y) for f in (np.cos, np.sin))
    rz = np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]])
    rx = np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]])
    ry = np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
    v = v @ (ry @ rx @ rz).T + [(col - 4.5) * PITCH_M, (4.5 - row) * PITCH_M, 0]
    height = np.full(GRID_X_M.shape, np.inf)
    step = PITCH_M / CELLS
    for a, b, c in v[t]:
        twice_area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if abs(twice_area) < 1e-14:
            continue
        corners = np.array([a, b, c])
        j0, j1 = np.searchsorted(CENTRES_M, [corners[:, 0].min() - step / 9, corners[:, 0].max() + step / 9])
        i0, i1 = np.searchsorted(CENTRES_M, [-corners[:, 1].max() - step / 9, -corners[:, 1].min() + step / 9])
        x, y = GRID_X_M[i0:i1, j0:j1], GRID_Y_M[i0:i1, j0:j1]
        u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / twice_area
        w = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / twice_area
        z = u * a[2] + w * b[2] + (1 - u - w) * c[2]
        inside = (u >= -1e-9) & (w >= -1e-9) & (u + w <= 1 + 1e-9)
        patch = height[i0:i1, j0:j1]
        patch[inside] = np.minimum(patch[inside], z[inside])
    cover = np.isfinite(height).astype(float)
    return np.where(cover > 0, height, 0.0), cover


def gains_of(models, targets, left_out=None, prior_sd=0.3, noise=0.35):
    """Log-normal taxel gains by ridge regression of log(recorded/model), objects scaled to equal sums first."""
    total, weight = np.zeros((10, 10)), np.zeros((10, 10))
    for name in models:
        if name == left_out:
            continue
        m, v = models[name], np.maximum(targets[name], 0)
        touched = m > 0.35 * np.percentile(m, 97)
        scale = v[touched].sum() / m[touched].sum()
        ratio = np.log(np.clip(v / np.maximum(scale * m, 1e-9), 0.25, 4.0))
        total += np.where(touched, ratio, 0)
        weight += touched
    gains = total / (weight + (noise / prior_sd) ** 2)
    return np.exp(gains), weight


def meshes(directory):
    """Underside of every committed mesh in its committed place."""
    directory = pathlib.Path(directory)
    out = {}
    for row in csv.DictReader((directory / "placements.csv").open()):
        pose = [float(row[k]) for k in ("row", "col", "rotation_rad", "tilt_x_rad", "tilt_y_rad")]
        out[row["name"]] = mesh_surface(directory / f"{row['name']}.obj", *pose)
    return out


def score(surfaces, targets):
    models = {name: image(*s) for name, s in surfaces.items()}
    everyone, weight = gains_of(models, targets)
    print(f"{'object':8s} {'plain':>6s} {'gains':>6s} {'others':>6s}")
    table = []
    for name in NAMES:
        others, _ = gains_of(models, targets, name)
        table.append([correlation(m, targets[name]) for m in (models[name], models[name] * everyone, models[name] * others)])
        print(f"{name:8s} " + " ".join(f"{r:6.3f}" for r in table[-1]))
    table = np.array(table)
    print("mean    ", *np.round(table.mean(0), 3), " least", *np.round(table.min(0), 3))
    often = weight > 2
    print(f"gains: log-sd {np.log(everyone[often]).std():.3f} over the {often.sum()} taxels that 3 objects or more touch")
    return models


def compressive_sum(directory, name):
    """Sum of all taxels, volts, by least squares on the compressive recording; None where there is none.

    The raster files are clipped at zero and lose weak taxels; the compressive ones are not. Taxel k (from 0) draws its
    weights from the generator s -> 1664525 s + 1013904223 mod 2^32 seeded with 8 + k: +1 when s >= 2^31, else -1.
    """
    path = recording(directory, name, "random2")
    clock = recording(directory, name, "random2_time")
    if path is None or clock is None:
        return None
    volts, clocks = scipy.io.loadmat(path)["C"], scipy.io.loadmat(clock)["framePosition"].ravel()

    def total(press, first, last):
        step = (int(clocks[press]) - 1000 + first) * 100 + 1
        a, c = 1, 0  # the generator, step times
        for bit in bin(step)[2:]:
            a, c = a * a % 2**32, (a * c + c) % 2**32
            if bit == "1":
                a, c = a * 1664525 % 2**32, (1664525 * c + 1013904223) % 2**32
        state = (a * np.arange(8, 108) + c) % 2**32
        weights = np.empty(((last - first) * 100, 101))
        weights[:, 100] = 1
        for row in weights:
            row[:100] = np.where(state >= 2**31, 1, -1)
            state = (state * 1664525 + 1013904223) % 2**32
        y = volts[:, first:last, press].T.ravel()
        good = np.isfinite(y)
        return np.linalg.lstsq(weights[good], y[good], rcond=None)[0][:100].sum()

    return float(np.median([total(p, 500, 650) - total(p, 0, 150) for p in range(1, len(clocks))]))


def volts(arguments, surfaces):
    """Amplitude A from the compressive sums, and what it makes of a 62 N bounce of the ball."""
    global SATURATION_PA
    measured = {name: compressive_sum(arguments.recordings, name) for name in NAMES}
    measured = {name: v for name, v in measured.items() if v is not None}
    print("summed volts:", {name: round(v, 2) for name, v in measured.items()})
    for SATURATION_PA in (1e5, 3e5, 1e6, 1e12):
        for exponent in (0.35, 0.4, 0.45, 0.5, 0.55, 0.6):
            each = np.array([v / image(*surfaces[name], exponent).sum() for name, v in measured.items()])
            amplitude = np.exp(np.log(each).mean())
            ball = amplitude * law(electrode_means(press(*surfaces["tennis"], 62.0), ELECTRODE_M), exponent)
            print(
                f"P_s {SATURATION_PA:.0e} Pa  n {exponent:.2f}  A {amplitude:.5f} V/Pa^n, log-sd over objects {np.log(each).std():.3f}"
                f"  ball at 62 N: peak {ball.max():.2f} V, sum {ball.sum():.2f} V"
            )


def sheet(models, targets, path):
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(6, 6, figsize=(15, 15.5))
    for axis in axes.flat:
        axis.axis("off")
    for k, name in enumerate(NAMES):
        row, col = divmod(k, 3)
        for axis, picture, title in ((axes[row, 2 * col], models[name], "model"), (axes[row, 2 * col + 1], targets[name], "recorded")):
            axis.imshow(np.maximum(picture, 0), cmap="viridis")
            axis.set_title(f"{name} {title} r={correlation(models[name], targets[name]):.2f}", fontsize=9)
    figure.tight_layout()
    figure.savefig(path, dpi=60)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recordings")
    parser.add_argument("task", choices=("fit", "laws", "volts", "score"))
    parser.add_argument("out", nargs="?")
    parser.add_argument("--objects")
    parser.add_argument("--start")
    parser.add_argument("--polish", action="store_true")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--electrode-mm", type=float, default=10.0)
    parser.add_argument("--exponent", type=float, default=0.5)
    parser.add_argument("--iterations", type=int, default=70)
    parser.add_argument("--assets", default=str(pathlib.Path(__file__).resolve().parent.parent / "contact" / "assets"))
    parser.add_argument("--sheet")
    arguments = parser.parse_args()
    global ELECTRODE_M, EXPONENT
    ELECTRODE_M, EXPONENT = 1e-3 * arguments.electrode_mm, arguments.exponent
    targets = {name: recorded(arguments.recordings, name) for name in NAMES}
    if arguments.task in ("score", "laws", "volts"):
        surfaces = meshes(arguments.assets)
    if arguments.task == "volts":
        volts(arguments, surfaces)
        return
    if arguments.task == "score":
        models = score(surfaces, targets)
        if arguments.sheet:
            sheet(models, targets, arguments.sheet)
        return
    if arguments.task == "laws":
        for electrode_m in (8e-3, 10e-3, 12e-3, 14e-3, 15e-3):
            for exponent in (0.3, 0.4, 0.5, 0.6, 0.8):
                images = {n: image(*s, exponent, electrode_m) for n, s in surfaces.items()}
                r = [correlation(images[n], targets[n]) for n in NAMES]
                print(f"electrode {electrode_m * 1e3:4.0f} mm  n {exponent:.2f}  mean r {np.mean(r):.3f}  least {min(r):.3f}")
        return
    if not arguments.out:
        parser.error("fit needs OUT.json")
    out = pathlib.Path(arguments.out)
    found = json.loads(out.read_text()) if out.exists() else {}
    start = json.loads(pathlib.Path(arguments.start).read_text()) if arguments.start else {}
    earlier = {name: image(*surface(name, list(p.values())[:-1])) for name, p in start.items()}
    for name in arguments.objects.split(",") if arguments.objects else NAMES:
        gains = gains_of(earlier, targets, name)[0] if earlier else np.ones((10, 10))
        begin = list(start[name].values())[:-1] if arguments.polish and name in start else None
        p, r = fit(name, targets[name], gains, begin, arguments.iterations, arguments.seed)
        found[name] = dict(zip((*POSE, *SHAPES[name][3]), np.round(p, 3).tolist()), r=round(r, 3))
        print(name, found[name], flush=True)
        out.write_text(json.dumps(found, indent=1))
    print("mean", np.mean([f["r"] for f in found.values()]), "least", min(f["r"] for f in found.values()))


if __name__ == "__main__":
    main()
