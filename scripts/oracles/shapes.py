"""Rigid indenters as height maps, and the form in which the oracles record a field.

A map is indexed [row, col]; the cell's centre is x = (col + 1/2) h − L/2, y = (row + 1/2) h − L/2, h = L / n.
Heights are the gap between the undeformed surface and the indenter when its lowest point just touches: ≥ 0, metres.
"""

import json
import re

import numpy as np

SPHERE_RADIUS_M = 0.0334
PUNCH_RADIUS_M = 0.010
# far more than any deflection here: cells beside the punch never touch
RECESS_M = 0.05
# (x, y, radius of curvature, height above the first), metres: no symmetry, so that a swapped axis shows
BUMPS_M = ((-9e-3, 4e-3, 20e-3, 0.0), (8e-3, -3e-3, 12e-3, 0.8e-3))


def centres(n, length_m):
    """Centres of the cells, (x, y), each of shape (n, n)."""
    at = (np.arange(n) + 0.5) * length_m / n - 0.5 * length_m
    y, x = np.meshgrid(at, at, indexing="ij")
    return x, y


def sphere(n, length_m):
    x, y = centres(n, length_m)
    return SPHERE_RADIUS_M - np.sqrt(SPHERE_RADIUS_M**2 - x**2 - y**2)


def punch(n, length_m):
    x, y = centres(n, length_m)
    return np.where(np.hypot(x, y) <= PUNCH_RADIUS_M, 0.0, RECESS_M)


def two_bumps(n, length_m):
    x, y = centres(n, length_m)
    return np.min([(np.hypot(x - a, y - b) ** 2) / (2 * r) + up for a, b, r, up in BUMPS_M], axis=0)


SHAPES = {"sphere": sphere, "punch": punch, "two_bumps": two_bumps}


def summary(pressure_pa, approach_m, length_m, stride=4):
    """What is recorded of a solution: integral values and every `stride`th cell, starting at stride/2."""
    n = len(pressure_pa)
    sample = pressure_pa[stride // 2 :: stride, stride // 2 :: stride]
    return {
        "force_n": float(pressure_pa.sum() * (length_m / n) ** 2),
        "approach_m": float(approach_m),
        "peak_pa": float(pressure_pa.max()),
        "contact_cells": int((pressure_pa > 0).sum()),
        "stride": stride,
        "sample_pa": [float(f"{p:.7g}") + 0.0 for p in sample.ravel()],
    }


def write(path, record):
    """JSON with a field's values in lines of eight."""
    text = json.dumps(record, indent=1)

    def lines(match):
        values = match.group(0)[1:-1].split(",")
        rows = (", ".join(v.strip() for v in values[i : i + 8]) for i in range(0, len(values), 8))
        return "[" + ",\n    ".join(rows) + "]"

    path.write_text(re.sub(r"\[[^\[\]{}\"]*\]", lines, text) + "\n")
