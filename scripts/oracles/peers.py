"""One function a program: gap map [m], side [m], force [N], moduli in; pressure map [Pa] and what went with it out.

Set OMP_NUM_THREADS and the like before the import; `one_thread` does.
"""

import os


def one_thread():
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"


class Tamaas:
    """Polonsky–Keer–Rey conjugate gradients, zero-padded FFT with Love's coefficients (`dcfft`)."""

    name = "tamaas"

    def __init__(self, n, length_m, modulus_pa, poisson):
        import tamaas

        tamaas.set_log_level(tamaas.LogLevel.error)
        self.tm, self.n, self.length_m = tamaas, n, length_m
        self.model = tamaas.Model(tamaas.model_type.basic_2d, [length_m, length_m], [n, n])
        self.model.E, self.model.nu = modulus_pa, poisson
        tamaas.ModelFactory.registerNonPeriodic(self.model, "dcfft")

    def prepare(self, gap_m, tolerance):
        self.gap_m = gap_m
        self.solver = self.tm.PolonskyKeerRey(self.model, -gap_m, tolerance)
        self.solver.setIntegralOperator("dcfft")
        self.solver.setDumpFrequency(0x7FFFFFFF)
        self.solver.max_iter = 20000

    def solve(self, force_n, start=None):
        """Pressure; from nothing, or from the pressure `start`."""
        self.model.traction[:] = 0.0 if start is None else start
        self.error = self.solver.solve(force_n / self.length_m**2)
        return self.model.traction

    def approach_m(self):
        """Mean of displacement + gap over the contact; the solver itself shifts its displacements."""
        import numpy as np

        pressure, sunk = self.model.traction.copy(), np.zeros((self.n, self.n))
        self.model.operators["dcfft"](pressure, sunk)
        touching = pressure > 0
        return float((sunk + self.gap_m)[touching].mean())


class Aspher:
    """Preconditioned Polonsky–Keer, exact FFT convolution with Love's coefficients."""

    name = "aspher"

    def __init__(self, n, length_m, modulus_pa, poisson):
        import aspher

        self.length_m = length_m
        self.solver = aspher.ContactSolver(
            grid_size=n, domain_size=length_m, E_star=modulus_pa / (1 - poisson**2), backend="fft"
        )

    def prepare(self, gap_m, tolerance):
        self.gap_m, self.tolerance = gap_m, tolerance

    def solve(self, force_n, start=None):
        self.result = self.solver.solve(
            self.gap_m, force_n / self.length_m**2, tol=self.tolerance, precond="fourier-fft", p_init=start
        )
        return self.result.pressure

    def approach_m(self):
        return self.result.approach


class AspherNested:
    """Aspher from coarse to fine grids, plans and operators made anew in each solution as its interface has it."""

    name = "aspher nested"

    def __init__(self, n, length_m, modulus_pa, poisson):
        import aspher

        self.solve_nested, self.length_m = aspher.solve_nested, length_m
        self.problem = {"grid_size": n, "domain_size": length_m, "E_star": modulus_pa / (1 - poisson**2)}
        self.problem |= {"coarsest": 16, "backend": "fft"}

    def prepare(self, gap_m, tolerance):
        self.gap_m, self.tolerance = gap_m, tolerance

    def solve(self, force_n, start=None):
        mean_pa = force_n / self.length_m**2
        self.result = self.solve_nested(gap=self.gap_m, p_nominal=mean_pa, tol=self.tolerance, **self.problem)
        return self.result.pressure


def layer(gap_m, length_m, force_n, modulus_pa, poisson, thickness_m, periods=3):
    """ContactMechanics: bonded layer, periodic; the map is set into a period `periods` times as long.

    The solver has no relative tolerance: penetration and stray force are asked to be below 1e-12 of their scale.
    """
    import numpy as np
    from ContactMechanics import PeriodicFFTElasticHalfSpace
    from ContactMechanics.Optimization import constrained_conjugate_gradients

    n = len(gap_m)
    whole = periods * n
    inset = slice((whole - n) // 2, (whole - n) // 2 + n)
    # far below the indenter's rim
    heights = np.full((whole, whole), -10 * max(gap_m.max(), 0.01))
    heights[inset, inset] = -gap_m
    side_m = length_m * periods
    substrate = PeriodicFFTElasticHalfSpace(
        (whole, whole), modulus_pa, (side_m, side_m), thickness=thickness_m, poisson=poisson
    )
    result = constrained_conjugate_gradients(
        substrate,
        heights,
        external_force=force_n,
        pentol=1e-14,
        forcetol=1e-9 * force_n / n**2,
        thermotol=1e-12,
        maxiter=20000,
    )
    assert result.success, result.message
    pressure = result.jac[inset, inset] / (length_m / n) ** 2
    return np.maximum(pressure, 0.0), float(result.offset)
