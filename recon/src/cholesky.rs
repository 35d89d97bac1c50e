//! Cholesky factorisation in the caller's memory.

use crate::kernels::{axpy_of, column_sums_of, dot_of};
use multiversion::multiversion;

/// A matrix that is not positive definite to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NotPositiveDefinite {
    /// First column whose pivot is not positive.
    pub(crate) pivot: usize,
}

/// Pivots below this share of the diagonal entry are rounding: the column depends on the ones before.
const DEPENDENT: f64 = 1e-14;

/// Overwrites the symmetric n × n row-major `a`, of which the upper triangle is read, with its Cholesky factor: A = L
/// Lᵀ, L in the lower triangle and Lᵀ in the upper one. Of a matrix that is refused at pivot p, the rows of L up to p
/// are there, but for the pivot itself.
///
/// Source: G. H. Golub, C. F. Van Loan, "Matrix Computations" (4th ed.), §4.2.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn factor(a: &mut [f64], n: usize) -> Result<(), NotPositiveDefinite> {
    factor_of(a, n)
}

#[inline(always)]
fn factor_of(a: &mut [f64], n: usize) -> Result<(), NotPositiveDefinite> {
    for i in 0..n {
        let (above, rest) = a.split_at_mut(i * n);
        let (left, row) = rest[..n].split_at_mut(i);
        for (l, u) in left.iter_mut().zip(above.chunks_exact(n)) {
            *l = u[i];
        }
        let smallest = DEPENDENT * row[0].abs();
        column_sums_of(above, n, i, left, row, |l, u| -(l * u));
        // not `<=`: a NaN must be refused as well
        if row[0].partial_cmp(&smallest) != Some(std::cmp::Ordering::Greater) {
            return Err(NotPositiveDefinite { pivot: i });
        }
        let inverse = 1.0 / row[0].sqrt();
        row.iter_mut().for_each(|v| *v *= inverse);
    }
    Ok(())
}

/// Solves L z = b in place for the factor of [`factor`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn solve_lower(factor: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let (known, rest) = b.split_at_mut(i + 1);
        let row = &factor[i * n + i..(i + 1) * n];
        known[i] /= row[0];
        axpy_of(-known[i], &row[1..], rest);
    }
}

/// Solves Lᵀ z = b in place for the factor of [`factor`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn solve_upper(factor: &[f64], n: usize, b: &mut [f64]) {
    for i in (0..n).rev() {
        let row = &factor[i * n + i..(i + 1) * n];
        b[i] = (b[i] - dot_of(&row[1..], &b[i + 1..])) / row[0];
    }
}

/// Solves A z = b in place for the factor of [`factor`].
pub(crate) fn solve(factor: &[f64], n: usize, b: &mut [f64]) {
    solve_lower(factor, n, b);
    solve_upper(factor, n, b);
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn solves_like_nalgebra() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for n in [1, 2, 7, 8, 9, 30] {
            let b = DMatrix::from_fn(n, n, |_, _| rng.random_range(-1.0..1.0));
            let a = &b * b.transpose() + DMatrix::identity(n, n);
            let rhs = DVector::from_fn(n, |_, _| rng.random_range(-1.0..1.0));
            let expected = a.clone().cholesky().unwrap().solve(&rhs);
            let (mut l, mut x) = (a.as_slice().to_vec(), rhs.as_slice().to_vec());
            factor(&mut l, n).unwrap();
            solve(&l, n, &mut x);
            for (g, e) in x.iter().zip(expected.iter()) {
                // condition below n² + 1 < 1e3: 1e3·ε with a margin of 10
                assert!((g - e).abs() < 1e-12, "{g} against {e}");
            }
        }
    }

    #[test]
    fn refuses_what_is_not_positive_definite() {
        for (a, pivot) in [([1.0, 2.0, 2.0, 4.0], 1), ([0.0; 4], 0), ([f64::NAN; 4], 0)] {
            assert_eq!(factor(&mut a.clone(), 2), Err(NotPositiveDefinite { pivot }));
        }
    }
}
