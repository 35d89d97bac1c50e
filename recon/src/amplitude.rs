//! Marginalising the unknown size of an answer: y = s·(t + noise), where `s` has no scale of its own.

use crate::checks::{RangeError, within};

/// Range of the amplitude `s`, the a-priori density of ln s being constant over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeRange {
    ln_min: f64,
    ln_max: f64,
}

/// Amplitudes beyond these would let squares of y/s overflow.
const LIMITS: [f64; 2] = [1e-60, 1e60];

/// Half the width of the integration about the mode, standard deviations. A Gaussian has e⁻¹⁸ of its height there; the tail of few
/// measurements towards large amplitudes is longer: 1e-2 of the integral is cut at M = 1, 2e-4 at 5, 4e-6 at 20.
const REACH: f64 = 6.0;

/// Intervals of the trapezoidal rule, 0.8 standard deviations each: on a Gaussian its error is exp(−2π²/0.8²) ≈ e⁻³⁰.
const INTERVALS: u32 = 15;

impl AmplitudeRange {
    /// Amplitudes from `min` to `max`, in units of y per unit of the templates.
    ///
    /// # Errors
    /// [`RangeError`] unless 1e-60 ≤ `min` < `max` ≤ 1e60.
    pub fn new(min: f64, max: f64) -> Result<Self, RangeError> {
        within("min", min, LIMITS[0], LIMITS[1])?;
        within("max", max, LIMITS[0], LIMITS[1])?;
        if min < max {
            Ok(Self {
                ln_min: min.ln(),
                ln_max: max.ln(),
            })
        } else {
            Err(RangeError {
                field: "max",
                value: max,
                min,
                max: LIMITS[1],
            })
        }
    }
}

/// What the density of `count` whitened measurements depends on, given the amplitude: with ỹ and t̃ whitened by the
/// covariance of y/s, yy = ỹᵀỹ, yt = ỹᵀt̃ and tt = t̃ᵀt̃.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Moments {
    pub(crate) count: f64,
    pub(crate) yy: f64,
    pub(crate) yt: f64,
    pub(crate) tt: f64,
}

/// An amplitude integrated out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Marginal {
    /// ln ∫ p(y | s) p(s) ds, up to the factor (2π)^(−M/2) |C|^(−1/2).
    pub(crate) log_evidence: f64,
    /// Posterior mean of `s`.
    pub(crate) mean: f64,
}

impl Moments {
    /// ln p(y | s) as a function of τ = 1/s: M ln τ − ½(yy τ² − 2 yt τ + tt).
    fn log_density(&self, ln_tau: f64, tau: f64) -> f64 {
        self.count * ln_tau - 0.5 * (self.yy * tau * tau - 2.0 * self.yt * tau + self.tt)
    }

    /// The τ that maximises [`Self::log_density`], the positive root of yy τ² − yt τ − M = 0. Infinite without a signal.
    pub(crate) fn mode(&self) -> f64 {
        if self.yy <= 0.0 {
            return f64::INFINITY;
        }
        let root = (self.yt * self.yt + 4.0 * self.count * self.yy).sqrt();
        // of the two forms of the root, the one that does not cancel
        if self.yt >= 0.0 {
            (self.yt + root) / (2.0 * self.yy)
        } else {
            2.0 * self.count / (root - self.yt)
        }
    }

    /// Laplace's approximation of ln ∫ p(y | s) d(ln s) over all amplitudes: the curvature in ln τ at the mode is −(yy τ² + M).
    /// Its error is about 1/(6 M) at most.
    pub(crate) fn laplace(&self) -> f64 {
        let tau = self.mode();
        let curvature = self.yy * tau * tau + self.count;
        self.log_density(tau.ln(), tau) + 0.5 * (std::f64::consts::TAU / curvature).ln()
    }

    /// Integrates the amplitude out over `range`: trapezoidal rule in ln s, on nodes that follow the posterior.
    pub(crate) fn marginal(&self, range: AmplitudeRange) -> Marginal {
        let (low, high) = (-range.ln_max, -range.ln_min);
        let centre = self.mode().ln().clamp(low, high);
        let tau = centre.exp();
        let peak = self.log_density(centre, tau);
        let reach = REACH / (self.yy * tau * tau + self.count).sqrt();
        let start = (centre - reach).max(low);
        let step = (((centre + reach).min(high) - start) / f64::from(INTERVALS)).max(f64::MIN_POSITIVE);
        let (mut tau, ratio) = (start.exp(), step.exp());
        let (mut sum, mut sum_s) = (0.0, 0.0);
        for k in 0..=INTERVALS {
            let end = if k == 0 || k == INTERVALS { 0.5 } else { 1.0 };
            let weight = end * (self.log_density(start + f64::from(k) * step, tau) - peak).exp();
            sum += weight;
            sum_s += weight / tau;
            tau *= ratio;
        }
        // a density far narrower than a step, at the end of the range, leaves nothing but its own value there
        let (sum, sum_s) = if sum > 0.0 {
            (sum, sum_s)
        } else {
            (0.5, 0.5 * (-centre).exp())
        };
        Marginal {
            log_evidence: peak + (sum * step / (high - low)).ln(),
            mean: sum_s / sum,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What the midpoint rule with 200,000 steps finds.
    struct Quadrature {
        log_integral: f64,
        mean: f64,
        /// Shares of the integral and of the mean's that lie further than [`REACH`] from the mode.
        cut: [f64; 2],
    }

    fn quadrature(m: &Moments, min: f64, max: f64) -> Quadrature {
        let (low, n) = (min.ln(), 200_000_i32);
        let step = (max.ln() - low) / f64::from(n);
        let values: Vec<(f64, f64)> = (0..n)
            .map(|k| {
                let s = (low + (f64::from(k) + 0.5) * step).exp();
                (m.log_density(-s.ln(), 1.0 / s), s)
            })
            .collect();
        let peak = values.iter().fold(f64::NEG_INFINITY, |p, v| p.max(v.0));
        let tau = m.mode();
        let reach = REACH / (m.yy * tau * tau + m.count).sqrt();
        let (mut sum, mut first, mut cut) = (0.0, 0.0, [0.0; 2]);
        for (density, s) in values {
            let w = (density - peak).exp();
            sum += w;
            first += w * s;
            if (s * tau).ln().abs() > reach {
                cut = [cut[0] + w, cut[1] + w * s];
            }
        }
        Quadrature {
            log_integral: peak + (sum * step).ln(),
            mean: first / sum,
            cut: [cut[0] / sum, cut[1] / first],
        }
    }

    fn cases() -> impl Iterator<Item = Moments> {
        [1.0, 2.0, 5.0, 20.0, 200.0].into_iter().flat_map(|count: f64| {
            [-0.5, 0.0, 0.7, 0.99].into_iter().map(move |correlation| {
                let (yy, tt) = (count * 4.0, count * 3.0);
                Moments {
                    count,
                    yy,
                    tt,
                    yt: correlation * f64::sqrt(yy * tt),
                }
            })
        })
    }

    #[test]
    fn marginal_equals_quadrature() {
        let range = AmplitudeRange::new(1e-4, 1e5).unwrap();
        for m in cases() {
            let got = m.marginal(range);
            let direct = quadrature(&m, 1e-4, 1e5);
            let expected = direct.log_integral - 1e9_f64.ln().ln();
            // 1e-8 of both rules' own; the ends cut what lies beyond them and add half a step, .4 deviations, of a density that falls by
            // e⁶ a deviation there: 2.4 times as much
            let tolerance = 1e-8 + 3.0 * direct.cut[0];
            assert!(
                (got.log_evidence - expected).abs() < tolerance,
                "{m:?}: {got:?}, expected {expected} ± {tolerance:e}"
            );
            let tolerance = 1e-7 + 3.0 * (direct.cut[0] + direct.cut[1]);
            assert!(
                (got.mean / direct.mean - 1.0).abs() < tolerance,
                "{m:?}: mean {} for {}, ± {tolerance:e}",
                got.mean,
                direct.mean
            );
        }
    }

    #[test]
    fn laplace_is_close_to_quadrature() {
        for m in cases() {
            let expected = quadrature(&m, 1e-6, 1e6).log_integral;
            // for yt = 0 this is Stirling's formula for Γ(M/2), whose next term is 1/(6 M)
            let error = (m.laplace() - expected).abs();
            assert!(error < 0.2 / m.count, "{m:?}: off by {error}");
        }
    }

    #[test]
    fn no_signal_and_too_much_of_it_stay_finite() {
        let range = AmplitudeRange::new(0.2, 6.0).unwrap();
        for (yy, yt) in [
            (0.0, 0.0),
            (1e-300, 1e-150),
            (1e200, 1e100),
            (1e200, -1e100),
            (1e290, 1e140),
        ] {
            let got = Moments {
                count: 20.0,
                yy,
                yt,
                tt: 3.0,
            }
            .marginal(range);
            assert!(got.log_evidence.is_finite(), "{yy}: {got:?}");
            assert!((0.19..6.1).contains(&got.mean), "{yy}: {got:?}");
        }
    }

    #[test]
    fn refuses_a_range_upside_down() {
        for (min, max) in [
            (0.0, 1.0),
            (2.0, 1.0),
            (1.0, 1.0),
            (f64::NAN, 1.0),
            (1.0, f64::INFINITY),
        ] {
            assert!(AmplitudeRange::new(min, max).is_err(), "{min}…{max}");
        }
    }
}
