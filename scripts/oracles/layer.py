"""Sphere and flat punch on a bonded elastic layer of 6 mm, solved by ContactMechanics in Fourier space.

Its pressure is a band-limited field through the cell values, not one of uniformly loaded cells: both discretisations
converge to the same layer, and each case is therefore recorded at the grid itself and at a finer one (averaged over
the grid's cells), so that the distance between the two says how much of a difference is discretisation. The punch
keeps the staircase of the coarse grid on the finer one: the same indenter.

Writes tests/oracles/layer.json. Run: python scripts/oracles/layer.py
"""

import peers

peers.one_thread()

import importlib.metadata
import pathlib

import numpy as np
import shapes

MODULUS_PA, THICKNESS_M, FORCE_N, LENGTH_M, CELLS = 150e3, 6e-3, 20.0, 0.045, 64
FINER = 4
# the map's own margin, at least 0.5 L − 15 mm, and 2 L of padding: 97 mm, 16 h, between the contact and its image
PERIODS = 3
OUT = pathlib.Path(__file__).parents[2] / "tests/oracles/layer.json"


def sphere(finer):
    return shapes.sphere(CELLS * finer, LENGTH_M)


def punch(finer):
    return np.kron(shapes.punch(CELLS, LENGTH_M), np.ones((finer, finer)))


def main():
    record = {
        "made_by": "scripts/oracles/layer.py",
        "versions": {name: importlib.metadata.version(name) for name in ("ContactMechanics", "muGrid", "numpy")},
        "modulus_pa": MODULUS_PA,
        "thickness_m": THICKNESS_M,
        "force_n": FORCE_N,
        "length_m": LENGTH_M,
        "cells": CELLS,
        "periods": PERIODS,
        "shapes": {
            "sphere": {"radius_m": shapes.SPHERE_RADIUS_M},
            "punch": {"radius_m": shapes.PUNCH_RADIUS_M, "recess_m": shapes.RECESS_M},
        },
        "solutions": [],
    }
    for name, shape in (("sphere", sphere), ("punch", punch)):
        for poisson in (0.2, 0.45):
            for finer in (1, FINER):
                pressure_pa, approach_m = peers.layer(
                    shape(finer), LENGTH_M, FORCE_N, MODULUS_PA, poisson, THICKNESS_M, PERIODS
                )
                cells = pressure_pa.reshape(CELLS, finer, CELLS, finer).mean(axis=(1, 3))
                solution = {
                    "shape": name,
                    "program": "ContactMechanics",
                    "poisson": poisson,
                    "finer": finer,
                    **shapes.summary(cells, approach_m, LENGTH_M),
                }
                record["solutions"].append(solution)
                print({k: v for k, v in solution.items() if k != "sample_pa"})
    shapes.write(OUT, record)


if __name__ == "__main__":
    main()
