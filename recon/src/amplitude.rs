//! Integrates over an unknown amplitude: y = s·(t + noise), where the scale of `s` is not known.

use crate::checks::out_of_range;
use crate::checks::within;
use crate::kernels::{exp, ln};
use multiversion::multiversion;
use spts_input::Refusal;

/// Range of the amplitude `s`. The prior density of ln s is constant over it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AmplitudeRange {
    ln_min: f64,
    ln_max: f64,
}

/// Amplitudes beyond these would let squares of y/s overflow.
const LIMITS: [f64; 2] = [1e-60, 1e60];

/// Half the width of the integration about the mode, standard deviations. A Gaussian has e⁻¹⁸ of its height there; the
/// tail of few measurements towards large amplitudes is longer: 1e-2 of the integral is cut at M = 1, 2e-4 at 5, 4e-6
/// at 20.
const REACH: f64 = 6.0;

/// Nodes of the trapezoidal rule, 0.8 standard deviations apart: on a Gaussian its error is exp(−2π²/0.8²) ≈ e⁻³⁰.
/// Whole SIMD registers.
const NODES: usize = 16;

impl AmplitudeRange {
    /// Amplitudes from `min` to `max`, in units of y per unit of the templates.
    ///
    /// # Errors
    /// [`Refusal`] unless 1e-60 ≤ `min` < `max` ≤ 1e60.
    pub fn new(min: f64, max: f64) -> Result<Self, Refusal> {
        within("min", min, LIMITS[0], LIMITS[1])?;
        within("max", max, LIMITS[0], LIMITS[1])?;
        if min < max {
            Ok(Self { ln_min: min.ln(), ln_max: max.ln() })
        } else {
            Err(out_of_range("max", max, min, LIMITS[1]))
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

/// Amplitudes integrated out, component by component.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Marginals {
    /// ln ∫ p(y | s) p(s) ds, up to the factor (2π)^(−M/2) |C|^(−1/2).
    pub(crate) log_evidence: Vec<f64>,
    /// Posterior mean of `s`.
    pub(crate) means: Vec<f64>,
    /// ln τ of the first node, and from one to the next.
    start: Vec<f64>,
    step: Vec<f64>,
}

impl Moments {
    /// ln p(y | s) as a function of τ = 1/s: M ln τ − ½(yy τ² − 2 yt τ + tt).
    #[inline(always)]
    fn log_density(&self, ln_tau: f64, tau: f64) -> f64 {
        self.count * ln_tau - 0.5 * (self.yy * tau * tau - 2.0 * self.yt * tau + self.tt)
    }

    /// The τ that maximises [`Self::log_density`], the positive root of yy τ² − yt τ − M = 0. Infinite without a
    /// signal.
    #[inline(always)]
    pub(crate) fn mode(&self) -> f64 {
        let root = (self.yt * self.yt + 4.0 * self.count * self.yy).sqrt();
        // of the two forms of the root, the one that does not cancel; both are computed, so that lanes need not part
        let sum = (self.yt + root) / (2.0 * self.yy);
        let quotient = 2.0 * self.count / (root - self.yt);
        let mode = if self.yt >= 0.0 { sum } else { quotient };
        if self.yy > 0.0 { mode } else { f64::INFINITY }
    }

    /// Laplace's approximation of ln ∫ p(y | s) d(ln s) over all amplitudes: the curvature in ln τ at the mode is −(yy
    /// τ² + M). Its error is about 1/(6 M) at most. Needs a signal, yy > 0, and a sample.
    #[inline(always)]
    pub(crate) fn laplace(&self) -> f64 {
        let tau = self.mode();
        let curvature = self.yy * tau * tau + self.count;
        self.log_density(ln(tau), tau) + 0.5 * ln(std::f64::consts::TAU / curvature)
    }
}

impl Marginals {
    /// Integrates the amplitudes out over `range`: trapezoidal rule in ln s, on nodes that follow the posterior. `yy`,
    /// `yt` and `tt` are those of [`Moments`], one a component.
    pub(crate) fn compute(&mut self, range: AmplitudeRange, count: f64, yy: &[f64], yt: &[f64], tt: &[f64]) {
        for values in [&mut self.log_evidence, &mut self.means, &mut self.start, &mut self.step] {
            values.resize(yy.len(), 0.0);
        }
        place_nodes(range, count, [yy, yt, tt], self);
        let nodes = self.start.iter().zip(&self.step);
        let outputs = self.log_evidence.iter_mut().zip(&mut self.means);
        for (lane, (out, (&start, &step))) in outputs.zip(nodes).enumerate() {
            let moments = Moments { count, yy: yy[lane], yt: yt[lane], tt: tt[lane] };
            let [sum, sum_s] = integrate(&moments, start, step, *out.0);
            // a density far narrower than a step, at the end of the range, leaves nothing but its own value at the mode
            let (sum, mean) = if sum > 0.0 { (sum, sum_s / sum) } else { (0.5, *out.1) };
            *out.0 += ln(sum) + ln(step) - ln(range.ln_max - range.ln_min);
            *out.1 = mean;
        }
    }
}

/// Places the nodes about the mode and writes the log density and the amplitude there.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn place_nodes(range: AmplitudeRange, count: f64, [yy, yt, tt]: [&[f64]; 3], out: &mut Marginals) {
    let (low, high) = (-range.ln_max, -range.ln_min);
    let intervals = (NODES - 1) as f64;
    let moments = yy.iter().zip(yt).zip(tt);
    let nodes = out.start.iter_mut().zip(&mut out.step);
    let modes = out.log_evidence.iter_mut().zip(&mut out.means);
    for ((((&yy, &yt), &tt), (start, step)), (peak, mean)) in moments.zip(nodes).zip(modes) {
        let m = Moments { count, yy, yt, tt };
        // the limits lie beyond those of any range
        let centre = ln(m.mode().clamp(1e-61, 1e61)).max(low).min(high);
        let tau = exp(centre);
        let reach = REACH / (yy * tau * tau + count).sqrt();
        *start = (centre - reach).max(low);
        *step = (((centre + reach).min(high) - *start) / intervals).max(f64::MIN_POSITIVE);
        *peak = m.log_density(centre, tau);
        *mean = 1.0 / tau;
    }
}

/// Sums over the nodes of the density, as a share of e^`peak`, and of the density times s.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn integrate(m: &Moments, start: f64, step: f64, peak: f64) -> [f64; 2] {
    let (mut weights, mut amplitudes) = ([0.0; NODES], [0.0; NODES]);
    for ((w, s), k) in weights.iter_mut().zip(&mut amplitudes).zip(0_u32..) {
        let ln_tau = start + f64::from(k) * step;
        let tau = exp(ln_tau);
        *w = exp(m.log_density(ln_tau, tau) - peak);
        *s = *w / tau;
    }
    for values in [&mut weights, &mut amplitudes] {
        values[0] *= 0.5;
        values[NODES - 1] *= 0.5;
    }
    [weights, amplitudes].map(|values| {
        let mut lanes = [0.0; 4];
        for four in values.as_chunks::<4>().0 {
            lanes.iter_mut().zip(four).for_each(|(sum, v)| *sum += v);
        }
        (lanes[0] + lanes[1]) + (lanes[2] + lanes[3])
    })
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
        Quadrature { log_integral: peak + (sum * step).ln(), mean: first / sum, cut: [cut[0] / sum, cut[1] / first] }
    }

    #[derive(Debug)]
    struct Marginal {
        log_evidence: f64,
        mean: f64,
    }

    /// The second lane of a block whose other lanes are different.
    fn marginal(m: &Moments, range: AmplitudeRange) -> Marginal {
        let mut out = Marginals::default();
        let lanes = |v: f64| [0.3 * v, v, 2.0 * v, 0.0];
        out.compute(range, m.count, &lanes(m.yy), &lanes(m.yt), &lanes(m.tt));
        Marginal { log_evidence: out.log_evidence[1], mean: out.means[1] }
    }

    fn cases() -> impl Iterator<Item = Moments> {
        [1.0, 2.0, 5.0, 20.0, 200.0].into_iter().flat_map(|count: f64| {
            [-0.5, 0.0, 0.7, 0.99].into_iter().map(move |correlation| {
                let (yy, tt) = (count * 4.0, count * 3.0);
                Moments { count, yy, tt, yt: correlation * f64::sqrt(yy * tt) }
            })
        })
    }

    #[test]
    fn marginal_equals_quadrature() {
        let range = AmplitudeRange::new(1e-4, 1e5).unwrap();
        for m in cases() {
            let got = marginal(&m, range);
            let direct = quadrature(&m, 1e-4, 1e5);
            let expected = direct.log_integral - 1e9_f64.ln().ln();
            // 1e-8 of both rules' own; the ends cut what lies beyond them and add half a step, .4 deviations, of a
            // density that falls by e⁶ a deviation there: 2.4 times as much
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
        for (yy, yt) in [(0.0, 0.0), (1e-300, 1e-150), (1e200, 1e100), (1e200, -1e100), (1e290, 1e140)] {
            let m = Moments { count: 20.0, yy, yt, tt: 3.0 };
            let got = marginal(&m, range);
            assert!(got.log_evidence.is_finite(), "{yy}: {got:?}");
            assert!((0.19..6.1).contains(&got.mean), "{yy}: {got:?}");
        }
    }
}
