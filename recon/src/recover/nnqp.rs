//! Strictly convex quadratic programs with non-negative unknowns.

use super::cholesky;
use crate::kernels;
use crate::problem::RecoverError;

/// Conditions hold to this share of the largest term: what rounding leaves of them.
const TOL: f64 = 1e-12;
/// Exchanges of whole sets that may fail to lower the number of violations before single exchanges begin.
const PATIENCE: usize = 3;

/// H = Aᵀ A + σ² Q (n × n), which is never formed.
pub(super) struct Hessian<'a> {
    /// A, M × n.
    pub(super) rows: &'a [f64],
    /// σ²
    pub(super) variance: f64,
    /// Q, n × n, symmetric.
    pub(super) precision: &'a [f64],
}

/// Memory of [`minimise`].
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// Which unknowns may differ from zero.
    free: Vec<bool>,
    indices: Vec<usize>,
    /// Columns of A that belong to free unknowns, M × their number, and their transpose.
    face_rows: Vec<f64>,
    face_columns: Vec<f64>,
    factor: Vec<f64>,
    point: Vec<f64>,
    /// A x
    image: Vec<f64>,
    /// H x
    product: Vec<f64>,
    /// Violation of every condition, at most 0 where it holds.
    violation: Vec<f64>,
}

/// min ½ xᵀ H x − hᵀ x subject to x ≥ 0, for a positive definite H. `x` holds a guess of which unknowns are above zero,
/// and then the answer: x ≥ 0, H x − h ≥ 0 and one of the two zero in every entry, all checked to 1e-12 of the largest
/// x and h.
///
/// Block principal pivoting: solve on the free unknowns, exchange all that violate a condition, fall back to the last
/// one (Murty's rule) when whole exchanges stop to help. Finite for positive definite H. With F free unknowns a round
/// costs O(M F² + F³ + (M + F) n).
/// Source: L. F. Portugal, J. J. Júdice, L. N. Vicente, Math. Comp. 63 (1994) 625; as used by J. Kim, H. Park, SIAM J.
/// Sci. Comput. 33 (2011) 3261.
pub(super) fn minimise(
    hessian: &Hessian<'_>,
    linear: &[f64],
    x: &mut [f64],
    work: &mut Buffers,
) -> Result<(), RecoverError> {
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
        multiply(hessian, x, work);
        let count = violations(linear, largest, x, work);
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
fn solve_free(hessian: &Hessian<'_>, linear: &[f64], x: &mut [f64], work: &mut Buffers) -> Result<(), RecoverError> {
    let n = linear.len();
    work.indices.clear();
    work.indices.extend((0..n).filter(|&i| work.free[i]));
    let size = work.indices.len();
    work.face_rows.clear();
    for row in hessian.rows.chunks_exact(n) {
        work.face_rows.extend(work.indices.iter().map(|&i| row[i]));
    }
    work.face_columns.clear();
    for i in 0..size {
        work.face_columns
            .extend(work.face_rows.chunks_exact(size).map(|row| row[i]));
    }
    work.factor.clear();
    work.point.clear();
    for &i in &work.indices {
        let row = &hessian.precision[i * n..(i + 1) * n];
        work.factor
            .extend(work.indices.iter().map(|&j| hessian.variance * row[j]));
        work.point.push(linear[i]);
    }
    kernels::add_gram(&work.face_rows, &work.face_columns, size, &mut work.factor);
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

/// `product` = H x for the x that [`solve_free`] has left.
fn multiply(hessian: &Hessian<'_>, x: &[f64], work: &mut Buffers) {
    let (n, size) = (x.len(), work.indices.len());
    work.product.clear();
    work.product.resize(n, 0.0);
    if size == 0 {
        return;
    }
    work.image.clear();
    let rows = work.face_rows.chunks_exact(size);
    work.image.extend(rows.map(|row| kernels::dot(row, &work.point)));
    kernels::adjoint(hessian.rows, &work.image, &mut work.product);
    for (&i, &value) in work.indices.iter().zip(&work.point) {
        let row = &hessian.precision[i * n..(i + 1) * n];
        kernels::axpy(hessian.variance * value, row, &mut work.product);
    }
}

/// Number of violated conditions; relative violations are left in `violation`.
fn violations(linear: &[f64], largest: f64, x: &[f64], work: &mut Buffers) -> usize {
    let x_largest = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, violation) in work.violation.iter_mut().enumerate() {
        let (short, whole) = if work.free[i] {
            (-x[i], x_largest)
        } else {
            (linear[i] - work.product[i], largest)
        };
        *violation = if short > TOL * whole { short / whole } else { 0.0 };
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
