"""Three rigid shapes pressed into an elastic half-space, solved by Tamaas and by aspher, each to 1e-12.

Writes tests/oracles/half_space.json. Run: python scripts/oracles/half_space.py
"""

import peers

peers.one_thread()

import importlib.metadata
import pathlib

import numpy as np
import shapes

MODULUS_PA, POISSON, FORCE_N, LENGTH_M, CELLS = 150e3, 0.2, 20.0, 0.045, 64
TOLERANCE = 1e-12
OUT = pathlib.Path(__file__).parents[2] / "tests/oracles/half_space.json"


def main():
    record = {
        "made_by": "scripts/oracles/half_space.py",
        "versions": {name: importlib.metadata.version(name) for name in ("tamaas", "aspher", "numpy")},
        "modulus_pa": MODULUS_PA,
        "poisson": POISSON,
        "force_n": FORCE_N,
        "length_m": LENGTH_M,
        "cells": CELLS,
        "tolerance": TOLERANCE,
        "shapes": {
            "sphere": {"radius_m": shapes.SPHERE_RADIUS_M},
            "punch": {"radius_m": shapes.PUNCH_RADIUS_M, "recess_m": shapes.RECESS_M},
            "two_bumps": {"x_y_radius_height_m": shapes.BUMPS_M},
        },
        "solutions": [],
    }
    for name, shape in shapes.SHAPES.items():
        gap_m = shape(CELLS, LENGTH_M)
        pair = []
        for program in (peers.Tamaas, peers.Aspher):
            solver = program(CELLS, LENGTH_M, MODULUS_PA, POISSON)
            solver.prepare(gap_m, TOLERANCE)
            pressure_pa = np.array(solver.solve(FORCE_N))
            pair.append(pressure_pa)
            solution = shapes.summary(pressure_pa, solver.approach_m(), LENGTH_M)
            record["solutions"].append({"shape": name, "program": program.name, **solution})
            print(f"{name:10} {program.name:7}", {k: v for k, v in solution.items() if k != "sample_pa"})
        print(f"{name:10} apart by {np.linalg.norm(pair[0] - pair[1]) / np.linalg.norm(pair[1]):.1e} (relative L2)")
    shapes.write(OUT, record)


if __name__ == "__main__":
    main()
