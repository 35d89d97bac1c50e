//! Theoretical limits of sparse recovery: the curves of a phase-transition diagram.

use super::parameter::{ParameterError, share};
use super::phase::Signs;
use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Steps of the bisection: as many as it takes to halve [0, [`LAST`]] down to the spacing of numbers.
const STEPS: usize = 64;

/// Parameter at which δ is below the smallest normal number.
const LAST: f64 = 37.0;

/// Weak threshold ρ(δ). Below S = ρ·M non-zero coefficients, minimising Σ|x| (over x ≥ 0 if all signs are positive)
/// finds almost every signal of N = M/δ unknowns from M exact random measurements; above it, almost none. The threshold
/// holds as N tends to infinity.
///
/// As a curve with the parameter z ≥ 0, with φ and Φ of the standard normal, h = φ(z) − zΦ(−z), and κ = 1 for positive
/// signals, 2 for either sign:
///
/// δ = κφ(z) / (z + κh), ρ = h / φ(z).
///
/// It is the stationary point of ρ(z) = (1 − κμ/δ) / (1 + z² − κμ), μ = (1 + z²)Φ(−z) − zφ(z), and equals the
/// thresholds from the faces of randomly projected simplices and cross-polytopes.
/// Source: D. L. Donoho, A. Maleki, A. Montanari, "Message-passing algorithms for compressed sensing", PNAS 106 (2009)
/// 18914, eq. 5; D. L. Donoho, J. Tanner, "Counting faces of randomly projected polytopes when the projection radically
/// lowers dimension", J. AMS 22 (2009).
///
/// ```
/// use spts_recon::recover::{Signs, weak_threshold};
///
/// // 20 measurements of 100 taxels: how many non-zero coefficients can be recovered?
/// let either = 20.0 * weak_threshold(0.2, Signs::Either)?;
/// let positive = 20.0 * weak_threshold(0.2, Signs::Positive)?;
/// assert!((4.0..6.0).contains(&either) && positive > either);
/// # Ok::<(), spts_recon::recover::ParameterError>(())
/// ```
///
/// # Errors
/// [`ParameterError`] unless `delta` = M/N is in (0, 1].
pub fn weak_threshold(delta: f64, signs: Signs) -> Result<f64, ParameterError> {
    share("delta", delta)?;
    let kappa = match signs {
        Signs::Positive => 1.0,
        Signs::Either => 2.0,
    };
    // δ falls from 1 at z = 0
    let (mut low, mut high) = (0.0, LAST);
    for _ in 0..STEPS {
        let z = 0.5 * (low + high);
        let excess = excess(z);
        if kappa * density(z) / (z + kappa * excess) > delta {
            low = z;
        } else {
            high = z;
        }
    }
    Ok(excess(low) / density(low))
}

/// Threshold of non-negativity alone, ρ = max(0, 2 − 1/δ). Below S = ρ·M positive coefficients, almost every x ≥ 0 is
/// the only non-negative one with its measurements, so any method that finds a non-negative fit finds it.
///
/// For matrices whose rows are as likely as their negatives.
/// Source: D. L. Donoho, J. Tanner, "Counting the faces of randomly-projected hypercubes and orthants, with
/// applications", Discrete Comput. Geom. 43 (2010) 522.
///
/// # Errors
/// [`ParameterError`] unless `delta` = M/N is in (0, 1].
pub fn orthant_threshold(delta: f64) -> Result<f64, ParameterError> {
    Ok((2.0 - 1.0 / share("delta", delta)?).max(0.0))
}

/// φ(z).
fn density(z: f64) -> f64 {
    (-0.5 * z * z).exp() / (2.0 * PI).sqrt()
}

/// φ(z) − zΦ(−z), the mean excess of a standard normal over z.
fn excess(z: f64) -> f64 {
    density(z) - z * tail(z)
}

/// Φ(−z).
fn tail(z: f64) -> f64 {
    0.5 * libm::erfc(z * FRAC_1_SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The largest ρ(z) of the source's eq. 5 on a grid of 1e-4: at a maximum the value is exact to the square of the
    /// grid.
    #[test]
    fn the_curve_is_the_maximum_over_the_threshold_parameter() {
        for (signs, kappa) in [(Signs::Positive, 1.0), (Signs::Either, 2.0)] {
            for delta in [0.01, 0.1, 0.25, 0.5, 0.75, 0.9] {
                let at = |z: f64| {
                    let risk = kappa * ((1.0 + z * z) * tail(z) - z * density(z));
                    (1.0 - risk / delta) / (1.0 + z * z - risk)
                };
                let expected = (1..60_000).map(|i| at(f64::from(i) * 1e-4)).fold(0.0, f64::max);
                let found = weak_threshold(delta, signs).unwrap();
                assert!(
                    (found - expected).abs() < 1e-7,
                    "{signs:?} δ = {delta}: {found}, expected {expected}"
                );
            }
        }
    }

    /// Ends of the curves: everything is found when M = N, next to nothing for M ≪ N, and ρ·2·ln(1/δ) → 1 there
    /// (Donoho and Tanner, J. AMS 2009), slowly: within a third at δ = 1e-9.
    #[test]
    fn the_curves_have_their_known_ends() {
        for signs in [Signs::Positive, Signs::Either] {
            assert!((weak_threshold(1.0, signs).unwrap() - 1.0).abs() < 1e-7);
            let small = weak_threshold(1e-9, signs).unwrap() * 2.0 * 1e9_f64.ln();
            assert!((small - 1.0).abs() < 0.34, "{signs:?}: {small}");
        }
        for (delta, expected) in [(0.25, 0.0), (0.5, 0.0), (0.75, 2.0 / 3.0), (1.0, 1.0)] {
            assert!((orthant_threshold(delta).unwrap() - expected).abs() < 1e-15);
        }
    }

    #[test]
    fn knowing_the_signs_helps() {
        let mut last = 0.0;
        for i in 1..100 {
            let delta = f64::from(i) / 100.0;
            let either = weak_threshold(delta, Signs::Either).unwrap();
            let positive = weak_threshold(delta, Signs::Positive).unwrap();
            assert!(last < either && either < positive && positive < 1.0, "δ = {delta}");
            assert!(orthant_threshold(delta).unwrap() < positive, "δ = {delta}");
            last = either;
        }
    }

    #[test]
    fn an_undersampling_outside_its_range_is_refused() {
        for delta in [0.0, -0.1, 1.1, f64::NAN, f64::INFINITY] {
            assert_eq!(weak_threshold(delta, Signs::Either).unwrap_err().field, "delta");
            assert_eq!(orthant_threshold(delta).unwrap_err().range, "(0, 1]");
        }
    }
}
