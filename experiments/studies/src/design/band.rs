//! The band in which the result of a check is expected.

use spts_recon::statistics::{Band, Sample};

/// Probability that the check of a correct design finds one of its quantities outside the band.
pub const OUTSIDE: f64 = 0.01;

/// The promise of a quantity that `repetitions` have found, for a check of as many repetitions, one of `quantities`
/// that are checked together; `range` is where the quantity can lie at all. `None` for fewer than two repetitions.
///
/// Repetitions are independent and alike: each has a specimen of the skin, parts of the device, touches and noise of
/// its own. Their mean of R and the check's mean of R differ with a variance of σ² (1/R + 1/R), so that with the
/// standard deviation s of the R repetitions
///
/// (check − mean) / (s √(2/R)) has Student's t with R − 1 degrees of freedom,
///
/// and mean ± t s √(2/R) holds the check with the probability 1 − α. A repetition is itself a mean of several touches,
/// which is close enough to normal for that. With q quantities, α = 0.01/q for each leaves at most 1 % for all
/// (Bonferroni). The band is for the check, and not a confidence interval of the mean, which would be √2 narrower.
/// Source: G. J. Hahn, W. Q. Meeker, "Statistical Intervals" (1991), §4.8.
pub(super) fn promise(repetitions: &[f64], quantities: usize, range: [f64; 2]) -> Option<Band> {
    let sample = Sample::of(repetitions).filter(|sample| sample.count > 1)?;
    let t = sample.t(OUTSIDE / quantities.max(1) as f64);
    let half = t * (sample.variance * 2.0 / sample.count as f64).sqrt();
    Some(Band::around(sample.mean, half).within(range))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt as _;
    use spts_models::Streams;

    #[test]
    fn a_band_by_hand() {
        let p = promise(&[1.0, 2.0, 3.0], 1, [-100.0, 9.0]).unwrap();
        // s = 1, √(2/3); t of 99 % with 2 degrees of freedom is 9.925 as tabulated, to half a digit
        assert!((p.mean - 2.0).abs() < 1e-12 && (p.low - (2.0 - 9.925 * (2.0_f64 / 3.0).sqrt())).abs() < 1e-3);
        assert!((p.high - 9.0).abs() < 1e-12 && p.holds(3.0) && !p.holds(9.5) && !p.holds(f64::NAN));
        assert!(promise(&[1.0], 1, [0.0, 1.0]).is_none());
    }

    /// 2,000 designs of twelve repetitions and as many checks, of uniform numbers: 1 % of the checks lie outside, ±
    /// four standard deviations of the count.
    #[test]
    fn one_check_in_a_hundred_lies_outside() {
        let mut rng = Streams::new(1).rng("band", 0);
        let mut run = || -> Vec<f64> { (0..12).map(|_| (0..8).map(|_| rng.random::<f64>()).sum()).collect() };
        let outside = (0..2000).filter(|_| {
            let p = promise(&run(), 1, [-1e9, 1e9]).unwrap();
            !p.holds(run().iter().sum::<f64>() / 12.0)
        });
        let count = outside.count();
        assert!((2..=38).contains(&count), "{count} of 2000");
    }
}
