//! Exponential and logarithm for SIMD lanes, which the standard library lacks.

/// eˣ for x ≤ 700, 0 below −700, to 1e-12 of itself.
///
/// x = k ln 2 + r with |r| ≤ ½ ln 2, the Taylor series of eʳ to r¹⁰ (rest 0.35¹¹/11! = 2e-13), and 2ᵏ put together from
/// its bits.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
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

/// ln x for normal x > 0, to 1e-13 absolute or 1e-15 of itself.
///
/// x = 2ᵏ m with m in [√½, √2), and ln m = 2 artanh z, z = (m − 1)/(m + 1), |z| ≤ 0.172, by its series to z¹⁵ (rest
/// 0.172¹⁷/8 = 1e-14).
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    /// Bits of √½: what lies above it in the exponent's place is k.
    const HALF_ROOT: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();
    const ONE: u64 = 1.0_f64.to_bits();
    const MANTISSA: u64 = (1 << 52) - 1;
    /// Bits of 2⁵², whose lowest bits count ones.
    const WHOLE: u64 = 0x4330_0000_0000_0000;
    /// 1/(2n + 1) from n = 7 down to 0.
    const SERIES: [f64; 8] = [
        1.0 / 15.0,
        1.0 / 13.0,
        1.0 / 11.0,
        1.0 / 9.0,
        1.0 / 7.0,
        1.0 / 5.0,
        1.0 / 3.0,
        1.0,
    ];
    // adding 1 − √½ in bits carries into the exponent exactly where the mantissa reaches √2
    let carried = x.to_bits().wrapping_add(ONE - HALF_ROOT);
    let k = f64::from_bits(WHOLE | (carried >> 52)) - (4_503_599_627_370_496.0 + 1023.0);
    let m = f64::from_bits((carried & MANTISSA) + HALF_ROOT);
    let z = (m - 1.0) / (m + 1.0);
    let square = z * z;
    let series = SERIES.iter().fold(0.0, |sum, c| sum * square + c);
    k * std::f64::consts::LN_2 + 2.0 * z * series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exponential_equals_the_library_s() {
        for k in -70_000..=70_000 {
            let x = f64::from(k) * 0.01;
            // the series' rest and a few roundings
            assert!((exp(x) / x.exp() - 1.0).abs() < 1e-12, "{x}");
        }
        assert!(exp(-1e300) <= 0.0 && exp(f64::NEG_INFINITY) <= 0.0);
    }

    #[test]
    fn logarithm_equals_the_library_s() {
        let x = |k: i32| (f64::from(k) * 0.011).exp();
        let edges = [1.0, 0.5, 2.0, std::f64::consts::SQRT_2, f64::MIN_POSITIVE, f64::MAX];
        for x in (-64_000..=64_000).map(x).chain(edges) {
            // the series' rest of 2e-14 and the rounding of k ln 2, up to 710
            let error = (ln(x) - x.ln()).abs();
            assert!(
                error < 1e-13_f64.max(4.0 * f64::EPSILON * x.ln().abs()),
                "{x:e}: {error:e}"
            );
        }
    }
}
