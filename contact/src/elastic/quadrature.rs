//! Gauss–Legendre points and the Bessel function J₀.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Points and weights of the Gauss–Legendre rule of order `order` on [−1, 1], by Newton's method on P_n from the
/// asymptotic roots.
pub(crate) fn gauss_legendre(order: usize) -> Vec<(f64, f64)> {
    let n = order as f64;
    (0..order)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut last, mut p) = (1.0, x);
                for j in 2..=order {
                    let j = j as f64;
                    (last, p) = (p, ((2.0 * j - 1.0) * x * p - (j - 1.0) * last) / j);
                }
                // P'_n = n (x P_n − P_{n−1}) / (x² − 1)
                slope = if order == 1 {
                    1.0
                } else {
                    n * (x * p - last) / (x * x - 1.0)
                };
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Where J₀ changes from its integral to its asymptotic series: the series' smallest term there is about e^(−2x) =
/// 4e-18.
const ASYMPTOTIC_FROM: f64 = 20.0;
/// The series ends at a term of this size, or at the latest after so many.
const LAST_TERM: f64 = 1e-17;
const MOST_TERMS: u32 = 24;

/// Bessel function J₀(x), x ≥ 0, to 2e-15 absolute, and to the rounding of the phase at large x.
///
/// Below 20: (1/m) Σ cos(x cos θ_j), the midpoint rule with 64 points on the circle (16 by symmetry); its error 2
/// J₆₄(x) is below 1e-20. Above: Hankel's expansion (Abramowitz and Stegun 9.2.5), whose terms are below 1e-16 after 24
/// at x = 20.
pub(crate) fn bessel_j0(x: f64) -> f64 {
    const POINTS: u32 = 16;
    if x < ASYMPTOTIC_FROM {
        let angle = |j: u32| FRAC_PI_2 * (f64::from(j) + 0.5) / f64::from(POINTS);
        return (0..POINTS).map(|j| (x * angle(j).cos()).cos()).sum::<f64>() / f64::from(POINTS);
    }
    let (mut p, mut q, mut term) = (1.0, 0.0, 1.0);
    for k in 1..=MOST_TERMS {
        let odd = f64::from(2 * k - 1);
        term *= odd * odd / (f64::from(k) * 8.0 * x);
        // signs of P: + at k = 0, 4, 8; of Q (after J₀'s −sin): − at k = 1, + at 3
        match k % 4 {
            0 => p += term,
            1 => q -= term,
            2 => p -= term,
            _ => q += term,
        }
        if term < LAST_TERM {
            break;
        }
    }
    let (s, c) = (x - FRAC_PI_4).sin_cos();
    (2.0 / (PI * x)).sqrt() * (p * c - q * s)
}
