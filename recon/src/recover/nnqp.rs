//! Strictly convex quadratic programs with non-negative unknowns.

use super::cholesky;
use crate::kernels::dot;
use crate::problem::RecoverError;

/// Conditions hold to this share of the largest term: what rounding leaves of them.
const TOL: f64 = 1e-12;
/// Exchanges of whole sets that may fail to lower the number of violations before single exchanges begin.
const PATIENCE: usize = 3;

/// Memory of [`minimise`].
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// Which unknowns may differ from zero.
    free: Vec<bool>,
    indices: Vec<usize>,
    factor: Vec<f64>,
    point: Vec<f64>,
    /// Violation of every condition, at most 0 where it holds.
    violation: Vec<f64>,
}

/// min ½ xᵀ H x − hᵀ x subject to x ≥ 0, for a symmetric positive definite H (n × n, row-major, both triangles). `x` holds
/// a guess of which unknowns are above zero, and then the answer: x ≥ 0, H x − h ≥ 0 and one of the two zero in every
/// entry, all checked to 1e-12 of the largest x and h.
///
/// Block principal pivoting: solve on the free unknowns, exchange all that violate a condition, fall back to the last
/// one (Murty's rule) when whole exchanges stop to help. Finite for positive definite H.
/// Source: L. F. Portugal, J. J. Júdice, L. N. Vicente, Math. Comp. 63 (1994) 625; as used by J. Kim, H. Park, SIAM J. Sci.
/// Comput. 33 (2011) 3261.
pub(super) fn minimise(hessian: &[f64], linear: &[f64], x: &mut [f64], work: &mut Buffers) -> Result<(), RecoverError> {
    let n = linear.len();
    let largest = linear.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    work.free.clear();
    work.free.extend(x.iter().map(|v| *v > 0.0));
    work.violation.resize(n, 0.0);
    let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
    // Murty's rule visits a set once; whole exchanges rarely need more than a dozen rounds
    let limit = 100 + 10 * n;
    for _ in 0..limit {
        solve_free(hessian, linear, x, work)?;
        let count = violations(hessian, linear, largest, x, work);
        if count == 0 {
            x.iter_mut().for_each(|v| *v = v.max(0.0));
            return Ok(());
        }
        if count < fewest {
            (fewest, patience) = (count, PATIENCE);
        } else {
            patience = patience.saturating_sub(1);
        }
        exchange(work, patience == 0);
    }
    Err(RecoverError::NotConverged {
        iterations: limit,
        error: work.violation.iter().copied().fold(0.0, f64::max),
        tol: TOL,
    })
}

/// x = H_FF⁻¹ h_F on the free unknowns, zero elsewhere.
fn solve_free(hessian: &[f64], linear: &[f64], x: &mut [f64], work: &mut Buffers) -> Result<(), RecoverError> {
    let n = linear.len();
    work.indices.clear();
    work.indices.extend((0..n).filter(|&i| work.free[i]));
    let size = work.indices.len();
    work.factor.resize(size * size, 0.0);
    work.point.clear();
    for (i, &row) in work.indices.iter().enumerate() {
        for (j, &col) in work.indices[..=i].iter().enumerate() {
            work.factor[i * size + j] = hessian[row * n + col];
        }
        work.point.push(linear[row]);
    }
    cholesky::factor(&mut work.factor, size).map_err(|e| RecoverError::NotPositiveDefinite {
        pivot: work.indices[e.pivot],
    })?;
    cholesky::solve(&work.factor, size, &mut work.point);
    x.fill(0.0);
    for (&i, &value) in work.indices.iter().zip(&work.point) {
        x[i] = value;
    }
    Ok(())
}

/// Number of violated conditions; relative violations are left in `violation`.
fn violations(hessian: &[f64], linear: &[f64], largest: f64, x: &[f64], work: &mut Buffers) -> usize {
    let n = linear.len();
    let x_largest = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for i in 0..n {
        let (short, whole) = if work.free[i] {
            (-x[i], x_largest)
        } else {
            (linear[i] - dot(&hessian[i * n..(i + 1) * n], x), largest)
        };
        work.violation[i] = if short > TOL * whole { short / whole } else { 0.0 };
    }
    work.violation.iter().filter(|v| **v > 0.0).count()
}

/// Moves what violates a condition to the other side; with `single` only the last of them.
fn exchange(work: &mut Buffers, single: bool) {
    for i in (0..work.free.len()).rev() {
        if work.violation[i] > 0.0 {
            work.free[i] = !work.free[i];
            if single {
                return;
            }
        }
    }
}
