//! Properties that every operator must have.

use super::LinearOperator;
use crate::kernels::{dot, norm};

/// Numbers in (−1, 1) that are the same at every call.
fn values(n: usize, phase: f64) -> Vec<f64> {
    (0_u32..).map(|k| (1.7 * f64::from(k) + phase).sin()).take(n).collect()
}

/// Rounding that a product of `nrows` × `ncols` weights may leave of what it adds up, `whole`: one unit for every
/// addition on the longest way, which no order of summing exceeds, and a transform's constant.
fn rounding(nrows: usize, ncols: usize, whole: f64) -> f64 {
    16.0 * (nrows + ncols) as f64 * f64::EPSILON * whole.max(f64::MIN_POSITIVE)
}

/// Checks that `a` is linear, that ⟨A x, y⟩ = ⟨x, Aᵀ y⟩, and that results do not depend on the earlier content of
/// output slices.
///
/// # Panics
/// If a property fails; the message holds the numbers.
pub fn check_operator(a: &impl LinearOperator) {
    let (m, n) = (a.nrows(), a.ncols());
    let (x, z, y) = (values(n, 0.0), values(n, 1.0), values(m, 2.0));
    let apply = |x: &[f64]| {
        let mut out = vec![f64::NAN; m];
        a.apply(x, &mut out);
        out
    };
    let mut aty = vec![f64::NAN; n];
    a.apply_adjoint(&y, &mut aty);
    let (ax, az) = (apply(&x), apply(&z));
    let (lhs, rhs) = (dot(&ax, &y), dot(&aty, &x));
    let whole = norm(&ax) * norm(&y) + norm(&aty) * norm(&x);
    let allowed = rounding(m, n, whole);
    assert!(
        (lhs - rhs).abs() <= allowed,
        "⟨Ax, y⟩ = {lhs}, ⟨x, Aᵀy⟩ = {rhs}, allowed {allowed:e}"
    );

    let sum: Vec<f64> = x.iter().zip(&z).map(|(x, z)| 2.0 * x - z).collect();
    let off: Vec<f64> = apply(&sum)
        .iter()
        .zip(ax.iter().zip(&az))
        .map(|(s, (x, z))| s - (2.0 * x - z))
        .collect();
    let allowed = rounding(
        m,
        n,
        norm(&ax) + norm(&az) + norm(&x) * norm(&aty) / norm(&y).max(f64::MIN_POSITIVE),
    );
    assert!(
        norm(&off) <= allowed,
        "not linear by {:e}, allowed {allowed:e}",
        norm(&off)
    );
}
