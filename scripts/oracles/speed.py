"""Seconds a solve at equal accuracy, one thread, side by side in one run: Tamaas, aspher, ours.

Half-space, E = 150 kPa, ν = 0.2, 20 N, 45 mm, sphere and flat punch, and the object T on the skin's 60 × 60 cells. Each
program's tolerance is the loosest in steps of √10 at which its pressure is within 1e-7 (relative L2) of its own answer at
1e-12. Set-up (plans, coefficients) is not counted. Rounds alternate between the programs; medians are reported and their
ratios are the result: the machine's speed cancels. Time is the thread's CPU time, the same as the wall's on an idle
machine, so that others at work do not favour short solutions.

    cargo build --release -p spts-contact --example elastic_time
    python scripts/oracles/speed.py [--json] [--rounds 5] [--cells 64 128 256]

Ours is the example `elastic_time`, timed as a process of many repeats less a process of one. The T by ours, cold and warm:
`cargo bench -p spts-contact --bench contact -- respond/`.
"""

import peers

peers.one_thread()

import argparse
import json
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import shapes

MODULUS_PA, POISSON, FORCE_N, LENGTH_M = 150e3, 0.2, 20.0, 0.045
SKIN_M, SKIN_CELLS = 0.15, 60
ERROR, CONVERGED = 1e-7, 1e-12
ROOT = pathlib.Path(__file__).parents[2]
OURS = ROOT / "target/release/examples/elastic_time"
# a round lasts at least this long, s
ROUND_S = 0.2


class Ours:
    """The Rust solver, a process a call."""

    name = "ours"

    def __init__(self, n, shape):
        self.arguments = [shape, n, LENGTH_M, FORCE_N, MODULUS_PA, POISSON]
        self.n = n

    def run(self, tolerance, repeats=1, dump=None):
        command = [OURS, *self.arguments, tolerance, repeats]
        command += [dump] if dump else []
        subprocess.run(list(map(str, command)), check=True)

    def pressure(self, tolerance):
        with tempfile.NamedTemporaryFile() as file:
            self.run(tolerance, dump=file.name)
            return np.fromfile(file.name).reshape(self.n, self.n)

    def seconds(self, tolerance, repeats):
        def spent(count):
            begin = resource.getrusage(resource.RUSAGE_CHILDREN)
            self.run(tolerance, count)
            end = resource.getrusage(resource.RUSAGE_CHILDREN)
            return end.ru_utime + end.ru_stime - begin.ru_utime - begin.ru_stime

        return (spent(1 + repeats) - spent(1)) / repeats


class Theirs:
    """A program of `peers.py` on one height map."""

    def __init__(self, program, n, gap_m, length_m):
        self.name, self.gap_m = program.name, gap_m
        self.solver = program(n, length_m, MODULUS_PA, POISSON)

    def pressure(self, tolerance):
        self.solver.prepare(self.gap_m, tolerance)
        return np.array(self.solver.solve(FORCE_N))

    def seconds(self, tolerance, repeats, start=None):
        self.solver.prepare(self.gap_m, tolerance)
        times = []
        for _ in range(repeats):
            begin = time.process_time()
            self.solver.solve(FORCE_N, start)
            times.append(time.process_time() - begin)
        return statistics.median(times)


def error(pressure, converged):
    return float(np.linalg.norm(pressure - converged) / np.linalg.norm(converged))


def tuned(program):
    """(tolerance, error, converged pressure): the loosest, in steps of √10, that is accurate enough."""
    converged = program.pressure(CONVERGED)
    for half_decades in range(11, 25):
        tolerance = 10.0 ** (-0.5 * half_decades)
        reached = error(program.pressure(tolerance), converged)
        if reached <= ERROR:
            return tolerance, reached, converged
    raise SystemExit(f"{program.name} does not reach {ERROR:g}")


def race(programs, rounds, **row):
    """One row a program: median seconds over alternating rounds."""
    settings = [tuned(program) for program in programs]
    best = settings[-1][2]
    repeats = [max(1, int(ROUND_S / max(p.seconds(s[0], 3), 1e-4))) for p, s in zip(programs, settings)]
    times = [[] for _ in programs]
    for _ in range(rounds):
        for program, setting, count, taken in zip(programs, settings, repeats, times):
            taken.append(program.seconds(setting[0], count))
    return [
        {
            **row,
            "program": program.name,
            "tolerance": setting[0],
            "error": setting[1],
            "apart_from_ours": error(setting[2], best),
            "seconds": statistics.median(taken),
        }
        for program, setting, taken in zip(programs, settings, times)
    ]


def t_gap_m():
    """Lower envelope of the object T on the skin's cells, 50 mm where there is nothing."""
    import trimesh

    mesh = trimesh.load(ROOT / "contact/assets/T.obj")
    x, y = shapes.centres(SKIN_CELLS, SKIN_M)
    gap = np.full(SKIN_CELLS**2, shapes.RECESS_M)
    points = np.stack([x.ravel(), y.ravel()], axis=1)
    for a, b, c in mesh.triangles:
        u, v, w = b[:2] - a[:2], c[:2] - a[:2], points - a[:2]
        area = u[0] * v[1] - u[1] * v[0]
        if abs(area) < 1e-15:
            continue
        s, t = (w[:, 0] * v[1] - w[:, 1] * v[0]) / area, (u[0] * w[:, 1] - u[1] * w[:, 0]) / area
        inside = (s >= -1e-9) & (t >= -1e-9) & (s + t <= 1 + 1e-9)
        height = a[2] + s * (b[2] - a[2]) + t * (c[2] - a[2])
        gap[inside] = np.minimum(gap[inside], height[inside])
    return (gap - gap.min()).reshape(SKIN_CELLS, SKIN_CELLS)


def warm(rounds):
    """T on the skin, peers only: cold, and from the pressure of a force 5 % smaller."""
    gap_m, rows = t_gap_m(), []
    for program in (peers.Tamaas, peers.Aspher):
        theirs = Theirs(program, SKIN_CELLS, gap_m, SKIN_M)
        tolerance, reached, converged = tuned(theirs)
        for kind, start in (("cold", None), ("warm", converged / 1.05)):
            seconds = statistics.median(theirs.seconds(tolerance, 10, start) for _ in range(rounds))
            row = {"shape": f"T {kind}", "cells": SKIN_CELLS, "program": program.name, "tolerance": tolerance}
            rows.append({**row, "error": reached, "seconds": seconds})
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--cells", type=int, nargs="+", default=[64, 128, 256])
    options = parser.parse_args()
    rows = []
    for n in options.cells:
        for name in ("sphere", "punch"):
            gap_m = shapes.SHAPES[name](n, LENGTH_M)
            theirs = [Theirs(program, n, gap_m, LENGTH_M) for program in (peers.Tamaas, peers.Aspher, peers.AspherNested)]
            rows += race([*theirs, Ours(n, name)], options.rounds, shape=name, cells=n)
            print(f"{name} {n}² done", file=sys.stderr)
    rows += warm(options.rounds)
    for row in rows:
        ours = [r for r in rows if r["program"] == "ours" and (r["shape"], r["cells"]) == (row["shape"], row["cells"])]
        row["times_ours"] = row["seconds"] / ours[0]["seconds"] if ours else None
    if options.json:
        print(json.dumps({"rows": rows}))
        return
    print(f"{'shape':8} {'cells':>5} {'program':13} {'tolerance':>9} {'error':>8} {'ms':>9} {'× ours':>7}")
    for r in rows:
        ratio = f"{r['times_ours']:7.1f}" if r["times_ours"] else ""
        print(
            f"{r['shape']:8} {r['cells']:5} {r['program']:13} {r['tolerance']:9.0e} {r['error']:8.1e} "
            f"{1e3 * r['seconds']:9.3f} {ratio}"
        )


if __name__ == "__main__":
    main()
