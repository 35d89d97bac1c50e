//! Means of a few repetitions, and how far they can be trusted.

use serde::{Deserialize, Serialize};
use std::borrow::Borrow;

/// Mean of `values`; `None` without one.
///
/// ```
/// use spts_recon::statistics::mean;
///
/// assert_eq!(mean([1.0, 2.0, 6.0]), Some(3.0));
/// assert_eq!(mean(&[0.0; 0]), None);
/// ```
pub fn mean(values: impl IntoIterator<Item = impl Borrow<f64>>) -> Option<f64> {
    let mut count = 0.0;
    let sum: f64 = values.into_iter().inspect(|_| count += 1.0).map(|v| *v.borrow()).sum();
    (count > 0.0).then(|| sum / count)
}

/// The value that the share `share`, in [0, 1], of `sorted` does not exceed, by a straight line between neighbours;
/// `None` without values.
#[expect(clippy::cast_possible_truncation, reason = "a place in a list")]
pub fn quantile(sorted: &[f64], share: f64) -> Option<f64> {
    let last = sorted.len().checked_sub(1)?;
    let place = share * last as f64;
    let below = (place.floor() as usize).min(last);
    let above = (below + 1).min(last);
    Some(sorted[below] + (place - below as f64) * (sorted[above] - sorted[below]))
}

/// Probability that |T| is at least |`t`|, for Student's T with `freedom` ≥ 1 degrees of freedom; NaN for a NaN.
///
/// Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.7.3 and 26.7.4: with θ = atan(t/√ν), 1 − p is
/// sin θ · (1 + ½ cos² θ + … + 1·3·…(ν−3)/(2·4·…(ν−2)) cos^(ν−2) θ) for an even ν, and for an odd one
/// 2/π · (θ + sin θ · (cos θ + ⅔ cos³ θ + … + 2·4·…(ν−3)/(1·3·…(ν−2)) cos^(ν−2) θ)).
pub fn two_sided(t: f64, freedom: u32) -> f64 {
    let theta = (t.abs() / f64::from(freedom).sqrt()).atan();
    let (sin, cos) = theta.sin_cos();
    let odd = freedom % 2 == 1;
    let (mut term, mut sum) = (if odd { cos } else { 1.0 }, 0.0);
    // a term for every power of the cosine up to ν − 2
    for power in (u32::from(odd)..freedom.saturating_sub(1)).step_by(2) {
        sum += term;
        term *= cos * cos * f64::from(power + 1) / f64::from(power + 2);
    }
    if odd { 1.0 - std::f64::consts::FRAC_2_PI * (theta + sin * sum) } else { 1.0 - sin * sum }
}

/// The t with P(|T| > t) = `outside`, in (0, 1), for Student's T with `freedom` ≥ 1 degrees of freedom.
pub fn student_t(outside: f64, freedom: u32) -> f64 {
    let mut high = 1.0;
    while two_sided(high, freedom) > outside && high < 1e12 {
        high *= 2.0;
    }
    let mut low = 0.0;
    // as many halvings as end at the spacing of f64
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if two_sided(middle, freedom) > outside {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}

/// Mean and variance of independent repetitions.
///
/// ```
/// use spts_recon::statistics::Sample;
///
/// let iou = Sample::of(&[0.78, 0.80, 0.82]).expect("three repetitions");
/// let band = iou.band(0.1);
/// assert!((band.mean - 0.80).abs() < 1e-12 && band.low < 0.78 && band.high > 0.82);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Number of repetitions n.
    pub count: usize,
    /// Their mean.
    pub mean: f64,
    /// Their variance s², with n − 1 degrees of freedom; 0 of a single one.
    pub variance: f64,
}

impl Sample {
    /// Of `values`; `None` without one.
    pub fn of(values: &[f64]) -> Option<Self> {
        let (count, mean) = (values.len(), mean(values)?);
        let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
        let variance = if count > 1 { squares / (count - 1) as f64 } else { 0.0 };
        Some(Self { count, mean, variance })
    }

    /// Standard error of the mean, s/√n.
    pub fn standard_error(&self) -> f64 {
        (self.variance / self.count as f64).sqrt()
    }

    /// The two-sided quantile of Student's distribution of n − 1 degrees of freedom that is exceeded with the
    /// probability `outside`; 0 of a single repetition, which says nothing of an error.
    pub fn t(&self, outside: f64) -> f64 {
        match u32::try_from(self.count - 1).unwrap_or(u32::MAX) {
            0 => 0.0,
            freedom => student_t(outside, freedom),
        }
    }

    /// The confidence interval of the mean, mean ± t·s/√n, which misses the true one with the probability `outside`. It
    /// has no width for a single repetition.
    pub fn band(&self, outside: f64) -> Band {
        Band::around(self.mean, self.t(outside) * self.standard_error())
    }
}

/// A mean and the band about it, in which something is expected.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Band {
    /// Mean.
    pub mean: f64,
    /// Lower end of the band.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
}

impl Band {
    /// `mean` ± `half`.
    pub fn around(mean: f64, half: f64) -> Self {
        Self { mean, low: mean - half, high: mean + half }
    }

    /// The same mean with the band cut off at `least` and `most`.
    pub fn within(self, [least, most]: [f64; 2]) -> Self {
        Self { low: self.low.max(least), high: self.high.min(most), ..self }
    }

    /// Whether `found` lies in the band.
    pub fn holds(&self, found: f64) -> bool {
        (self.low..=self.high).contains(&found)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Quantiles as tabulated, to three decimals (Abramowitz and Stegun, table 26.10): half a unit of the last of them,
    /// which moves the probability by less than 1e-3 of itself.
    #[test]
    fn tabulated_quantiles_are_met() {
        for (freedom, t, p) in [
            (1, 6.314, 0.1),
            (1, 12.706, 0.05),
            (1, 63.657, 0.01),
            (2, 2.920, 0.1),
            (2, 4.303, 0.05),
            (2, 9.925, 0.01),
            (3, 3.182, 0.05),
            (4, 4.604, 0.01),
            (9, 2.262, 0.05),
            (9, 3.250, 0.01),
            (10, 3.169, 0.01),
            (11, 3.106, 0.01),
            (30, 2.042, 0.05),
            (120, 1.658, 0.1),
        ] {
            assert!((student_t(p, freedom) - t).abs() < 5.1e-4, "{freedom} {p}");
            for t in [t, -t] {
                assert!((two_sided(t, freedom) / p - 1.0).abs() < 1e-3, "{freedom} {t}");
            }
        }
        assert!((two_sided(0.0, 2) - 1.0).abs() < 1e-15 && (two_sided(0.0, 9) - 1.0).abs() < 1e-15);
        // one degree of freedom is Cauchy's distribution: t = tan(π·p/2)
        assert!((student_t(0.5, 1) - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_band_by_hand() {
        // mean 2, s = 1; t = 2.920 as tabulated, to half a unit of its last digit
        let sample = Sample::of(&[1.0, 2.0, 3.0]).unwrap();
        let band = sample.band(0.1);
        assert!((sample.standard_error() - 1.0 / 3.0_f64.sqrt()).abs() < 1e-15);
        assert!((band.mean - 2.0).abs() < 1e-12 && (band.high - 2.0 - 2.920 / 3.0_f64.sqrt()).abs() < 5e-4);
        assert!((band.high + band.low - 4.0).abs() < 1e-12);
        let cut = band.within([1.9, 9.0]);
        assert!(cut.holds(2.0) && cut.holds(3.0) && !cut.holds(1.8) && !cut.holds(f64::NAN));
        let one = Sample::of(&[0.5]).unwrap().band(0.1);
        assert_eq!([one.low, one.high].map(f64::to_bits), [0.5_f64.to_bits(); 2]);
        assert_eq!(Sample::of(&[]), None);
    }

    #[test]
    fn quantiles_lie_between_neighbours() {
        let sorted = [1.0, 2.0, 4.0];
        for (share, expected) in [(0.0, 1.0), (0.25, 1.5), (0.5, 2.0), (0.75, 3.0), (1.0, 4.0)] {
            assert!((quantile(&sorted, share).unwrap() - expected).abs() < 1e-15, "{share}");
        }
        assert_eq!(quantile(&[], 0.5), None);
    }
}
