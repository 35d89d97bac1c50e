//! Marginalising the unknown size of an answer: y = s·(t + noise), where `s` has no scale of its own.

use crate::checks::{RangeError, within};
use multiversion::multiversion;

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

/// Amplitudes integrated out, component by component.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Marginals {
    /// ln ∫ p(y | s) p(s) ds, up to the factor (2π)^(−M/2) |C|^(−1/2).
    pub(crate) log_evidence: Vec<f64>,
    /// Posterior mean of `s`.
    pub(crate) means: Vec<f64>,
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
}

impl Marginals {
    /// Integrates the amplitudes out over `range`: trapezoidal rule in ln s, on nodes that follow the posterior. `yy`, `yt` and `tt` are
    /// those of [`Moments`], whole blocks of [`BLOCK`] components; `tt` may be empty when `count` is 0.
    pub(crate) fn compute(&mut self, range: AmplitudeRange, count: f64, yy: &[f64], yt: &[f64], tt: &[f64]) {
        self.log_evidence.resize(yy.len(), 0.0);
        self.means.resize(yy.len(), 0.0);
        marginals(range, count, yy, yt, tt, &mut self.log_evidence, &mut self.means);
    }
}

/// Components side by side in the integration.
pub(crate) const BLOCK: usize = 4;

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn marginals(
    range: AmplitudeRange,
    count: f64,
    yy: &[f64],
    yt: &[f64],
    tt: &[f64],
    log_evidence: &mut [f64],
    means: &mut [f64],
) {
    let blocks = yy.as_chunks::<BLOCK>().0.iter().zip(yt.as_chunks::<BLOCK>().0);
    let mut squares = tt.as_chunks::<BLOCK>().0.iter();
    let outputs = log_evidence.as_chunks_mut::<BLOCK>().0.iter_mut();
    for ((yy, yt), (log_evidence, means)) in blocks.zip(outputs.zip(means.as_chunks_mut::<BLOCK>().0)) {
        let tt = squares.next().unwrap_or(&[0.0; BLOCK]);
        let moments = std::array::from_fn(|l| Moments {
            count,
            yy: yy[l],
            yt: yt[l],
            tt: tt[l],
        });
        (*log_evidence, *means) = integrate(range, &moments);
    }
}

/// Nodes ln τ = `start` + k·`step` of the rule, about the mode.
#[inline(always)]
fn nodes(range: AmplitudeRange, m: &Moments) -> (f64, f64, f64) {
    let (low, high) = (-range.ln_max, -range.ln_min);
    let centre = m.mode().ln().clamp(low, high);
    let tau = centre.exp();
    let reach = REACH / (m.yy * tau * tau + m.count).sqrt();
    let start = (centre - reach).max(low);
    let step = (((centre + reach).min(high) - start) / f64::from(INTERVALS)).max(f64::MIN_POSITIVE);
    (start, step, m.log_density(centre, tau))
}

/// Log evidence and posterior mean amplitude of a block.
#[inline(always)]
fn integrate(range: AmplitudeRange, moments: &[Moments; BLOCK]) -> ([f64; BLOCK], [f64; BLOCK]) {
    let (mut start, mut step, mut peak) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
    for (l, m) in moments.iter().enumerate() {
        (start[l], step[l], peak[l]) = nodes(range, m);
    }
    let mut tau: [f64; BLOCK] = std::array::from_fn(|l| exp(start[l]));
    let ratio: [f64; BLOCK] = std::array::from_fn(|l| exp(step[l]));
    let (mut sum, mut sum_s) = ([0.0; BLOCK], [0.0; BLOCK]);
    for k in 0..=INTERVALS {
        let end = if k == 0 || k == INTERVALS { 0.5 } else { 1.0 };
        for l in 0..BLOCK {
            let at = start[l] + f64::from(k) * step[l];
            let weight = end * exp(moments[l].log_density(at, tau[l]) - peak[l]);
            sum[l] += weight;
            sum_s[l] += weight / tau[l];
            tau[l] *= ratio[l];
        }
    }
    let width = range.ln_max - range.ln_min;
    let (mut log_evidence, mut means) = ([0.0; BLOCK], [0.0; BLOCK]);
    for l in 0..BLOCK {
        // a density far narrower than a step, at the end of the range, leaves nothing but its own value there
        let (of, first) = if sum[l] > 0.0 {
            (sum[l], sum_s[l])
        } else {
            let s = moments[l].mode().recip().ln().clamp(range.ln_min, range.ln_max).exp();
            (0.5, 0.5 * s)
        };
        log_evidence[l] = peak[l] + (of * step[l] / width).ln();
        means[l] = first / of;
    }
    (log_evidence, means)
}

/// eˣ for x ≤ 700, 0 below −700, to 1e-12 of itself: the exponential of the standard library cannot run in SIMD lanes.
///
/// x = k ln 2 + r with |r| ≤ ½ ln 2, the Taylor series of eʳ to r¹⁰ (rest 0.35¹¹/11! = 2e-13), and 2ᵏ put together from its bits.
#[inline(always)]
fn exp(x: f64) -> f64 {
    /// Adding 1.5·2⁵² rounds to a whole number and leaves it in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts, the first with so few bits that its product with k is exact.
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    /// 1/n! from n = 10 down to 0.
    const SERIES: [f64; 11] = [
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let inside = x.clamp(-700.0, 700.0);
    let shifted = inside * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (inside - k * LN_2[0]) - k * LN_2[1];
    let series = SERIES.iter().fold(0.0, |sum, c| sum * r + c);
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    if x < -700.0 { 0.0 } else { series * power }
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
        Marginal {
            log_evidence: out.log_evidence[1],
            mean: out.means[1],
        }
    }

    #[test]
    fn exponential_equals_the_library_s() {
        for k in -70_000..=70_000 {
            let x = f64::from(k) * 0.01;
            // the series' rest and a few roundings
            assert!((exp(x) / x.exp() - 1.0).abs() < 1e-12, "{x}");
        }
        assert!(exp(-1e300) <= 0.0 && exp(f64::NEG_INFINITY) <= 0.0);
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
            let got = marginal(&m, range);
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
            let m = Moments {
                count: 20.0,
                yy,
                yt,
                tt: 3.0,
            };
            let got = marginal(&m, range);
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
