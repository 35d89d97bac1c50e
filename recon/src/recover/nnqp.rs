//! Strictly convex quadratic programs with non-negative unknowns.

use crate::checks::{not_converged, not_positive_definite};
use crate::cholesky;
use crate::kernels;
use spts_input::Refusal;

/// Conditions hold to this share of the largest term: what rounding leaves of them.
const TOL: f64 = 1e-12;
/// Exchanges of whole sets that may fail to lower the number of violations before single exchanges begin.
const PATIENCE: usize = 3;
/// Rounds of exchanges, of which more than a dozen are rare, before the active set takes over.
const ROUNDS: usize = 100;

/// A symmetric, positive definite H (n × n).
pub(super) trait Quadratic {
    /// Appends the rows of H_FF to `face`, of which the upper triangle is read.
    fn face(&self, n: usize, free: &[usize], work: &mut Faces, face: &mut Vec<f64>);

    /// Writes H x to `product`, which is zero before, for the x that is `point` on the unknowns `free`, the same ones
    /// as of the last [`Quadratic::face`], and zero elsewhere.
    fn product(&self, free: &[usize], point: &[f64], work: &mut Faces, product: &mut [f64]);
}

/// H = C − Vᵀ D V, C and D V of which are there.
pub(super) struct Lowered<'a> {
    /// C, n × n, symmetric.
    pub(super) matrix: &'a [f64],
    /// V, K × n; may have no row.
    pub(super) rows: &'a [f64],
    /// Diagonal of D, length K.
    pub(super) shares: &'a [f64],
}

impl Quadratic for Lowered<'_> {
    fn face(&self, n: usize, free: &[usize], work: &mut Faces, face: &mut Vec<f64>) {
        let size = free.len();
        work.rows.clear();
        for row in self.rows.chunks_exact(n) {
            work.rows.extend(free.iter().map(|&i| row[i]));
        }
        work.columns.clear();
        for k in 0..size {
            let column = work.rows.chunks_exact(size).zip(self.shares);
            work.columns.extend(column.map(|(row, share)| -share * row[k]));
        }
        for (k, &i) in free.iter().enumerate() {
            let row = &self.matrix[i * n..(i + 1) * n];
            face.resize(face.len() + k, 0.0);
            face.extend(free[k..].iter().map(|&j| row[j]));
        }
        kernels::add_gram(&work.rows, &work.columns, size, face);
    }

    fn product(&self, free: &[usize], point: &[f64], work: &mut Faces, product: &mut [f64]) {
        let size = free.len();
        if size == 0 {
            return;
        }
        work.image.clear();
        let rows = work.rows.chunks_exact(size).zip(self.shares);
        work.image.extend(rows.map(|(row, share)| -share * kernels::dot(row, point)));
        kernels::adjoint(self.rows, &work.image, product);
        kernels::add_rows(self.matrix, free, point, product);
    }
}

/// H = Aᵀ A + σ² Q (n × n), which is never formed.
pub(super) struct Hessian<'a> {
    /// A, M × n.
    pub(super) rows: &'a [f64],
    /// σ²
    pub(super) variance: f64,
    /// Q, n × n, symmetric.
    pub(super) precision: &'a [f64],
}

impl Quadratic for Hessian<'_> {
    fn face(&self, n: usize, free: &[usize], work: &mut Faces, face: &mut Vec<f64>) {
        let size = free.len();
        work.rows.clear();
        for row in self.rows.chunks_exact(n) {
            work.rows.extend(free.iter().map(|&i| row[i]));
        }
        work.columns.clear();
        for i in 0..size {
            work.columns.extend(work.rows.chunks_exact(size).map(|row| row[i]));
        }
        for &i in free {
            let row = &self.precision[i * n..(i + 1) * n];
            face.extend(free.iter().map(|&j| self.variance * row[j]));
        }
        kernels::add_gram(&work.rows, &work.columns, size, face);
    }

    fn product(&self, free: &[usize], point: &[f64], work: &mut Faces, product: &mut [f64]) {
        let (n, size) = (product.len(), free.len());
        if size == 0 {
            return;
        }
        work.image.clear();
        let rows = work.rows.chunks_exact(size);
        work.image.extend(rows.map(|row| kernels::dot(row, point)));
        kernels::adjoint(self.rows, &work.image, product);
        for (&i, &value) in free.iter().zip(point) {
            let row = &self.precision[i * n..(i + 1) * n];
            kernels::axpy(self.variance * value, row, product);
        }
    }
}

/// Memory of a [`Quadratic`].
#[derive(Debug, Default)]
pub(crate) struct Faces {
    /// Columns of A that belong to free unknowns, M × their number, and their transpose.
    rows: Vec<f64>,
    columns: Vec<f64>,
    /// A x
    image: Vec<f64>,
}

/// Memory of [`minimise`].
#[derive(Debug, Default)]
pub(crate) struct Buffers {
    /// Which unknowns may differ from zero.
    free: Vec<bool>,
    indices: Vec<usize>,
    faces: Faces,
    factor: Vec<f64>,
    point: Vec<f64>,
    /// H x
    product: Vec<f64>,
    /// Violation of every condition, at most 0 where it holds.
    violation: Vec<f64>,
    /// The last x that was feasible.
    feasible: Vec<f64>,
}

impl Buffers {
    /// H x of the answer.
    pub(super) fn product(&self) -> &[f64] {
        &self.product
    }
}

/// min ½ xᵀ H x − hᵀ x subject to x ≥ 0, for a positive definite H. `x` holds a guess of which unknowns are above zero,
/// and then the answer: x ≥ 0, H x − h ≥ 0 and one of the two zero in every entry, all checked to 1e-12 of the largest
/// x and h.
///
/// Block principal pivoting: solve on the free unknowns, exchange all that violate a condition, fall back to the last
/// one (Murty's rule) when whole exchanges stop to help. Murty's rule is finite for positive definite H, but it may
/// visit very many sets; after [`ROUNDS`] an active set takes over ([`active_set`]). With F free unknowns a round costs
/// O(M F² + F³ + (M + F) n).
/// Source: L. F. Portugal, J. J. Júdice, L. N. Vicente, Math. Comp. 63 (1994) 625; as used by J. Kim, H. Park, SIAM J.
/// Sci. Comput. 33 (2011) 3261.
pub(super) fn minimise(
    hessian: &impl Quadratic,
    linear: &[f64],
    x: &mut [f64],
    work: &mut Buffers,
) -> Result<(), Refusal> {
    let n = linear.len();
    let largest = linear.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    work.free.clear();
    work.free.extend(x.iter().map(|v| *v > 0.0));
    work.violation.resize(n, 0.0);
    let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
    for _ in 0..ROUNDS {
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
    active_set(hessian, linear, x, work)
}

/// As [`minimise`], from x = 0: frees the most violated unknown, and goes towards the minimum on the free ones as far
/// as none of them falls below zero. The objective falls in every round, so that no set comes twice.
/// Source: C. L. Lawson, R. J. Hanson, "Solving Least Squares Problems" (1974), ch. 23, algorithm NNLS.
fn active_set(hessian: &impl Quadratic, linear: &[f64], x: &mut [f64], work: &mut Buffers) -> Result<(), Refusal> {
    let n = linear.len();
    let largest = linear.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    work.free.clear();
    work.free.resize(n, false);
    work.violation.resize(n, 0.0);
    work.feasible.clear();
    work.feasible.resize(n, 0.0);
    let limit = 100 + 10 * n;
    for _ in 0..limit {
        solve_free(hessian, linear, x, work)?;
        let mut blocked = None;
        let mut step = 1.0_f64;
        for (i, &before) in work.feasible.iter().enumerate() {
            let share = before / (before - x[i]);
            if work.free[i] && x[i] < 0.0 && share < step {
                (blocked, step) = (Some(i), share);
            }
        }
        if let Some(blocked) = blocked {
            let values = work.feasible.iter_mut().zip(&mut work.free).enumerate();
            for (i, (value, free)) in values.filter(|(_, (_, free))| **free) {
                *value += step * (x[i] - *value);
                if i == blocked || *value <= 0.0 {
                    (*free, *value) = (false, 0.0);
                }
            }
            continue;
        }
        work.feasible.copy_from_slice(x);
        multiply(hessian, x, work);
        violations(linear, largest, x, work);
        let most = work.violation.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        match most.filter(|(_, violation)| *violation > 0.0) {
            Some((i, _)) => work.free[i] = true,
            None => return Ok(()),
        }
    }
    Err(not_converged(limit, work.violation.iter().copied().fold(0.0, f64::max), TOL))
}

/// x = H_FF⁻¹ h_F on the free unknowns, zero elsewhere.
fn solve_free(hessian: &impl Quadratic, linear: &[f64], x: &mut [f64], work: &mut Buffers) -> Result<(), Refusal> {
    let n = linear.len();
    work.indices.clear();
    work.indices.extend((0..n).filter(|&i| work.free[i]));
    let size = work.indices.len();
    work.factor.clear();
    hessian.face(n, &work.indices, &mut work.faces, &mut work.factor);
    work.point.clear();
    work.point.extend(work.indices.iter().map(|&i| linear[i]));
    cholesky::factor(&mut work.factor, size).map_err(|e| not_positive_definite(work.indices[e.pivot]))?;
    cholesky::solve(&work.factor, size, &mut work.point);
    x.fill(0.0);
    for (&i, &value) in work.indices.iter().zip(&work.point) {
        x[i] = value;
    }
    Ok(())
}

/// `product` = H x for the x that [`solve_free`] has left.
fn multiply(hessian: &impl Quadratic, x: &[f64], work: &mut Buffers) {
    work.product.clear();
    work.product.resize(x.len(), 0.0);
    hessian.product(&work.indices, &work.point, &mut work.faces, &mut work.product);
}

/// Number of violated conditions; relative violations are left in `violation`.
fn violations(linear: &[f64], largest: f64, x: &[f64], work: &mut Buffers) -> usize {
    let x_largest = x.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (i, violation) in work.violation.iter_mut().enumerate() {
        let (short, whole) = if work.free[i] { (-x[i], x_largest) } else { (linear[i] - work.product[i], largest) };
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

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// On problems that exchanges solve, the active set gives the same bits: the free unknowns are the same.
    #[test]
    fn the_active_set_finds_the_same_minimum() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for (m, n) in [(3, 5), (8, 20), (20, 60)] {
            for _ in 0..20 {
                let mut draw = |count: usize| -> Vec<f64> { (0..count).map(|_| rng.random_range(-1.0..1.0)).collect() };
                let (rows, linear) = (draw(m * n), draw(n));
                let precision: Vec<f64> = (0..n * n).map(|k| if k % (n + 1) == 0 { 1.0 } else { 0.0 }).collect();
                let hessian = Hessian { rows: &rows, variance: 0.1, precision: &precision };
                let (mut by_exchange, mut by_set) = (vec![0.0; n], vec![0.0; n]);
                let mut work = Buffers::default();
                minimise(&hessian, &linear, &mut by_exchange, &mut work).unwrap();
                active_set(&hessian, &linear, &mut by_set, &mut work).unwrap();
                let bits = |x: &[f64]| x.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(&by_exchange), bits(&by_set));
            }
        }
    }
}
