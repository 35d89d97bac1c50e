//! Kernels and influence coefficients against limits, a recorded table and each other.

use super::kernel::layer_deficit;
use super::quadrature::bessel_j0;
use super::{ElasticKernel, Influence, confined_stiffness_pa_per_m, modulus_of_confined_pa};
use approx::assert_relative_eq;
use std::f64::consts::PI;

const H: f64 = 6e-3;
const E: f64 = 150e3;

fn layer(poisson: f64) -> ElasticKernel {
    ElasticKernel::Layer {
        modulus_pa: E,
        poisson,
        thickness_m: H,
    }
}

/// C = (1/K)(1 + O((kh)²)) with a factor below 1/(1 − 2ν) · 10 = 500: at kh = 1e-8 the limit is met to 1e-13. C differs
/// from the half-space's by x² exp(−2x), 1e-23 at kh = 30. Round-off leaves about 1/(1 − 2ν) ulp.
#[test]
fn limits_of_the_layer() {
    for poisson in [0.0, 0.2, 0.3, 0.45, 0.49] {
        let kernel = layer(poisson);
        let stiffness = confined_stiffness_pa_per_m(E, poisson, H);
        for wave in [0.0, 1e-8 / H] {
            assert_relative_eq!(kernel.compliance_m_per_pa(wave) * stiffness, 1.0, max_relative = 1e-10);
        }
        let half = ElasticKernel::HalfSpace { modulus_pa: E, poisson };
        for x in [30.0, 1e3, 1e6] {
            let ratio = kernel.compliance_m_per_pa(x / H) / half.compliance_m_per_pa(x / H);
            assert_relative_eq!(ratio, 1.0, max_relative = 1e-10);
        }
        assert_relative_eq!(modulus_of_confined_pa(stiffness, poisson, H), E, max_relative = 1e-14);
        for x in [0.01, 0.3, 1.0, 5.0] {
            let ratio = kernel.compliance_m_per_pa(x / H) / half.compliance_m_per_pa(x / H);
            assert_relative_eq!(1.0 + layer_deficit(x, poisson), ratio, epsilon = 1e-13);
        }
    }
}

/// C(k) K from a solution of Navier's equations as a boundary-value problem, made apart from this program; half a unit
/// of the last printed digit.
#[test]
fn table_of_the_layer() {
    const WAVES: [f64; 5] = [0.3, 0.63, 1.0, 1.5, 2.0];
    const TABLE: [(f64, f64, [f64; 5]); 6] = [
        (0.0, 5e-4, [1.000, 0.994, 0.971, 0.909, 0.820]),
        (0.2, 5e-4, [0.997, 0.988, 0.967, 0.916, 0.842]),
        (0.3, 5e-4, [1.006, 1.016, 1.019, 0.992, 0.933]),
        (0.4, 5e-3, [1.05, 1.17, 1.27, 1.32, 1.29]),
        (0.45, 5e-3, [1.17, 1.53, 1.84, 2.04, 2.07]),
        (0.49, 5e-2, [2.2, 4.6, 6.6, 8.0, 8.5]),
    ];
    for (poisson, half_unit, row) in TABLE {
        let stiffness = confined_stiffness_pa_per_m(E, poisson, H);
        for (x, expected) in WAVES.iter().zip(row) {
            let ratio = layer(poisson).compliance_m_per_pa(x / H) * stiffness;
            // 1 % of a unit for values that end in 5
            assert!(
                (ratio - expected).abs() <= 1.02 * half_unit,
                "ν {poisson}, kh {x}: {ratio}"
            );
        }
    }
}

/// Abramowitz and Stegun, table 9.1, and the first zeros; about the branch at 20, where the asymptotic series is worst,
/// the power series summed with 60 digits. Values near 1 carry a few ulp of a sum of 16; 50 and more, the rounding of
/// the phase.
#[test]
fn bessel() {
    for (x, expected) in [
        (0.0, 1.0),
        (1.0, 0.765_197_686_557_966_6),
        (10.0, -0.245_935_764_451_348_3),
        (19.5, 0.178_853_827_040_172_89),
        (20.0, 0.167_024_664_340_583_15),
        (20.5, 0.115_096_960_253_674_76),
        (21.0, 0.036_579_071_000_862_74),
        (25.0, 0.096_266_783_275_958_12),
        (2.404_825_557_695_773, 0.0),
        (30.634_606_468_431_976, 0.0),
        (50.0, 0.055_812_327_669_251_72),
    ] {
        assert!((bessel_j0(x) - expected).abs() < 2e-15, "J0({x}) = {}", bessel_j0(x));
    }
}

/// The middle of a square of side a under unit pressure sinks by 4 asinh(1) a/(π E*); far away, by a²/(π E* r) with the
/// relative correction (a/r)²/24 of the square's second moment.
#[test]
fn love_near_and_far() {
    let half = ElasticKernel::HalfSpace {
        modulus_pa: E,
        poisson: 0.2,
    };
    let cell_m = 1e-3;
    let influence = Influence::new(&half, [4, 200], cell_m);
    let unit = cell_m * half.inverse_reduced_modulus_per_pa() / PI;
    assert_relative_eq!(influence.at(0, 0), 4.0 * 1.0_f64.asinh() * unit, max_relative = 1e-14);
    assert_relative_eq!(
        influence.at(0, 199) * 199.0 / unit,
        1.0 + 1.0 / (24.0 * 199.0 * 199.0),
        max_relative = 1e-9
    );
    assert!(influence.bulge_m_per_pa() <= 0.0 && influence.bulge() <= 0.0);
}

/// Cells loaded with cos(k x) sink at their centres by Σ_m C(|k_m|) sinc(k_m a/2), k_m = k + 2πm/a (the spectrum of
/// piecewise constant pressure, sampled): an independent way from C(k) to the coefficients. The sum over m is cut at
/// 2000, where the terms, alternating and falling as m⁻², leave (1/2)(a/π)² 2/(E* a) / (2000²) ≈ 1e-8 of C. The
/// coefficients end at 25 h, where exp(−0.7 · 25) · (cells a row) is below 1e-6.
#[test]
fn coefficients_carry_waves() {
    for (poisson, cell) in [(0.0, 0.4), (0.2, 0.4), (0.2, 0.05), (0.3, 1.5), (0.45, 0.4)] {
        let kernel = layer(poisson);
        let cell_m = cell * H;
        let count = if cell < 0.1 { 240 } else { 70 };
        let influence = Influence::new(&kernel, [count, count], cell_m);
        for index in [0.0, 0.05, 0.3] {
            let wave = index * PI / cell_m;
            let mut sum = 0.0;
            for i in 0..count {
                for j in 0..count {
                    let twice = |n: usize| if n == 0 { 1.0 } else { 2.0 };
                    let phase = (wave * cell_m * f64::from(u32::try_from(j).unwrap())).cos();
                    sum += twice(i) * twice(j) * phase * influence.at(i, j);
                }
            }
            let expected: f64 = (-2000..=2000)
                .map(|m| {
                    let k = wave + 2.0 * PI * f64::from(m) / cell_m;
                    let half_phase = 0.5 * k * cell_m;
                    let sinc = if half_phase.abs() < 1e-12 {
                        1.0
                    } else {
                        half_phase.sin() / half_phase
                    };
                    kernel.compliance_m_per_pa(k.abs()) * sinc
                })
                .sum();
            // 12 h are covered by the fine grid: exp(−12) is left
            let tail = if cell < 0.1 { 2e-5 } else { 1e-6 };
            assert_relative_eq!(sum, expected, max_relative = tail);
        }
    }
}
