//! Student's t distribution, for means of a few sessions.

/// Probability that |T| is at least |`t`|, for Student's T with `freedom` ≥ 1 degrees of freedom; NaN for a NaN.
///
/// Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.7.3 and 26.7.4: with θ = atan(t/√ν), 1 − p is
/// sin θ · (1 + ½ cos² θ + … + 1·3·…(ν−3)/(2·4·…(ν−2)) cos^(ν−2) θ) for an even ν, and for an odd one
/// 2/π · (θ + sin θ · (cos θ + ⅔ cos³ θ + … + 2·4·…(ν−3)/(1·3·…(ν−2)) cos^(ν−2) θ)).
pub(crate) fn two_sided(t: f64, freedom: u32) -> f64 {
    let theta = (t.abs() / f64::from(freedom).sqrt()).atan();
    let (sin, cos) = theta.sin_cos();
    let odd = freedom % 2 == 1;
    let (mut term, mut sum) = (if odd { cos } else { 1.0 }, 0.0);
    // a term for every power of the cosine up to ν − 2
    for power in (u32::from(odd)..freedom.saturating_sub(1)).step_by(2) {
        sum += term;
        term *= cos * cos * f64::from(power + 1) / f64::from(power + 2);
    }
    if odd {
        1.0 - std::f64::consts::FRAC_2_PI * (theta + sin * sum)
    } else {
        1.0 - sin * sum
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Quantiles as tabulated, to three decimals (Abramowitz and Stegun, table 26.10). Half a unit of the last of them
    /// moves the probability by less than 1e-3 of itself.
    #[test]
    fn tabulated_quantiles_are_met() {
        for (freedom, t, p) in [
            (1, 12.706, 0.05),
            (1, 63.657, 0.01),
            (2, 4.303, 0.05),
            (2, 9.925, 0.01),
            (3, 3.182, 0.05),
            (4, 4.604, 0.01),
            (9, 2.262, 0.05),
            (9, 3.250, 0.01),
            (10, 3.169, 0.01),
            (30, 2.042, 0.05),
        ] {
            assert_relative_eq!(two_sided(t, freedom), p, max_relative = 1e-3);
            assert_relative_eq!(two_sided(-t, freedom), p, max_relative = 1e-3);
        }
        assert_relative_eq!(two_sided(0.0, 2), 1.0);
        assert_relative_eq!(two_sided(0.0, 9), 1.0);
    }
}
