//! Reduction of the half-space's displacement by a rigid base.

use super::kernel::layer_deficit;
use super::quadrature::{bessel_j0, gauss_legendre};

/// Beyond this many thicknesses a bonded layer does not feel a load: its kernel decays at least as exp(−0.7 r/h), as
/// exp(−r/h) for ν ≤ 0.2 (first pole of C(k)), and 1e-8 … 1e-11 of the value at the load is left.
pub(crate) const REACH: f64 = 25.0;

/// G(ρ) = ∫ D(x) J₀(x ρ) dx at ρ = r/h, tabulated up to [`REACH`] and −1/ρ, which cancels the half-space, beyond.
#[derive(Debug, Clone)]
pub(crate) struct Deficit {
    values: Vec<f64>,
}

/// Table points a thickness; eight-point interpolation errs by about 40 (1/(2 · 16))⁸ = 4e-11 of G(0).
const PER_THICKNESS: f64 = 16.0;
/// D(x) is below 1e-16 from here on.
const LAST_X: f64 = 21.0;
/// Largest phase x ρ across one panel of the 16-point rule, and largest panel.
const PANEL_PHASE: f64 = 10.0;

impl Deficit {
    #[expect(clippy::cast_possible_truncation, reason = "at most a few thousand points")]
    /// Table for distances up to `farthest` thicknesses.
    pub(crate) fn new(poisson: f64, farthest: f64) -> Self {
        let rule = gauss_legendre(16);
        let points = (farthest.min(REACH) * PER_THICKNESS).ceil() as usize + 6;
        let mut values = Vec::with_capacity(points);
        let (mut panels, mut nodes): (usize, Vec<(f64, f64)>) = (0, Vec::new());
        for i in 0..points {
            let rho = i as f64 / PER_THICKNESS;
            // in steps of a quarter, so that the nodes serve many radii
            let wanted = ((LAST_X * (rho / PANEL_PHASE).max(1.0) / 6.0).ceil() * 6.0) as usize;
            if wanted != panels {
                panels = wanted;
                let width = LAST_X / panels as f64;
                nodes.clear();
                for panel in 0..panels {
                    nodes.extend(rule.iter().map(|&(x, w)| {
                        let x = (panel as f64 + 0.5 + 0.5 * x) * width;
                        (x, 0.5 * width * w * layer_deficit(x, poisson))
                    }));
                }
            }
            values.push(nodes.iter().map(|&(x, w)| w * bessel_j0(x * rho)).sum());
        }
        Self { values }
    }

    /// Eight-point Lagrange interpolation; G is even, so negative indices mirror.
    #[expect(clippy::cast_possible_truncation, reason = "ρ lies inside the table")]
    pub(crate) fn at(&self, rho: f64) -> f64 {
        /// Products of the distances of one node to the others, signs included: 1/∏(i − j).
        const WEIGHTS: [f64; 8] = [
            -1.0 / 5040.0,
            1.0 / 720.0,
            -1.0 / 240.0,
            1.0 / 144.0,
            -1.0 / 144.0,
            1.0 / 240.0,
            -1.0 / 720.0,
            1.0 / 5040.0,
        ];
        if rho > REACH {
            return -1.0 / rho;
        }
        let s = rho * PER_THICKNESS;
        let cell = (s as usize).min(self.values.len() - 5);
        let f = s - cell as f64;
        let d: [f64; 8] = std::array::from_fn(|i| f + 3.0 - i as f64);
        // products of all distances before and after each node
        let (mut before, mut after) = ([1.0; 8], [1.0; 8]);
        for i in 1..8 {
            before[i] = before[i - 1] * d[i - 1];
            after[7 - i] = after[8 - i] * d[8 - i];
        }
        (0..8)
            .map(|i| {
                let index = (cell + i).abs_diff(3);
                WEIGHTS[i] * before[i] * after[i] * self.values[index]
            })
            .sum()
    }
}
