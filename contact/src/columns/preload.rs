//! Foam that is already compressed where nothing touches the skin.

use super::foam::FoamLaw;
use crate::envelope::Envelope;

/// Initial compression of the columns, as under the taut cover of a bent skin.
///
/// With p₀ = f(δ₀) from the foam's law f, a body that sinks in by d meets p = g(D₀ + d), where g is the law of foam and
/// body in series and D₀ = δ₀ + p₀/K_b the compression at which that series carries p₀ (K_b: stiffness of the body's
/// surface). The electrode feels p; the body feels p − p₀, since the cover carries p₀ with or without it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Preload {
    /// δ₀ of every fine cell, m.
    depth_m: Vec<f64>,
    /// p₀ of every fine cell, Pa.
    rest_pa: Vec<f64>,
}

/// Preload of the fine cells `start..start + n` of one row, for one body.
#[derive(Debug, Clone, Copy)]
pub(super) struct PreloadedRow<'a> {
    depth_m: &'a [f64],
    rest_pa: &'a [f64],
    /// 1/K_b, m/Pa.
    body_m_per_pa: f64,
}

impl Preload {
    /// Preload of a skin whose taxels are compressed by `taxel_depth_m`, row by row, on the fine cells of `envelope`;
    /// and the pressure of every taxel then, Pa. `law` is that of the foam under a rigid body.
    pub(super) fn new(
        taxel_depth_m: &[f64],
        cells_per_taxel: usize,
        law: &FoamLaw,
        envelope: &Envelope,
    ) -> (Self, Vec<f64>) {
        let [rows, cols] = envelope.shape();
        let taxel_cols = cols / cells_per_taxel;
        let rest_pa: Vec<f64> = taxel_depth_m.iter().map(|d| law.pressure_pa(*d)).collect();
        let fine = |values: &[f64]| -> Vec<f64> {
            let cell = |k: usize| values[k / cols / cells_per_taxel * taxel_cols + k % cols / cells_per_taxel];
            (0..rows * cols).map(cell).collect()
        };
        let preload = Self {
            depth_m: fine(taxel_depth_m),
            rest_pa: fine(&rest_pa),
        };
        (preload, rest_pa)
    }

    /// The cells `line` of the grid under a body of surface stiffness `body_pa_per_m`.
    pub(super) fn row(&self, line: std::ops::Range<usize>, body_pa_per_m: f64) -> PreloadedRow<'_> {
        PreloadedRow {
            depth_m: &self.depth_m[line.clone()],
            rest_pa: &self.rest_pa[line],
            body_m_per_pa: 1.0 / body_pa_per_m,
        }
    }
}

impl PreloadedRow<'_> {
    /// Pressure on the body above cell `k`, Pa, and its slope, Pa/m, where it sinks in by `depth_m`; both 0 above the
    /// surface. Never tensile.
    #[inline]
    pub(super) fn pressure_and_slope(&self, k: usize, law: &FoamLaw, depth_m: f64) -> (f64, f64) {
        if depth_m <= 0.0 {
            return (0.0, 0.0);
        }
        let rest_pa = self.rest_pa[k];
        let start_m = self.depth_m[k] + rest_pa * self.body_m_per_pa;
        let (p, slope) = law.pressure_and_slope(start_m + depth_m);
        ((p - rest_pa).max(0.0), slope)
    }
}
