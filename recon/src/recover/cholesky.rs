//! Cholesky factorisation in memory that the caller keeps, for the small systems of a decode.

use crate::kernels::dot;

/// A matrix that is not positive definite to rounding.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct NotPositiveDefinite {
    /// First column whose pivot is not positive.
    pub(super) pivot: usize,
}

/// Pivots below this share of the diagonal entry are rounding: the column depends on the ones before.
const DEPENDENT: f64 = 1e-14;

/// Overwrites the lower triangle of the symmetric n × n row-major `a` with its Cholesky factor L, A = L Lᵀ. The upper
/// triangle is neither read nor written. Of a matrix that is refused at pivot p, the rows up to p hold those of the factor,
/// but for the pivot itself.
///
/// Source: G. H. Golub, C. F. Van Loan, "Matrix Computations" (4th ed.), §4.2.
pub(super) fn factor(a: &mut [f64], n: usize) -> Result<(), NotPositiveDefinite> {
    for i in 0..n {
        let (above, rest) = a.split_at_mut(i * n);
        let row = &mut rest[..=i];
        for j in 0..i {
            let other = &above[j * n..=j * n + j];
            row[j] = (row[j] - dot(&row[..j], &other[..j])) / other[j];
        }
        let smallest = DEPENDENT * row[i].abs();
        let square = row[i] - dot(&row[..i], &row[..i]);
        // not `<=`: a NaN must be refused as well
        if square.partial_cmp(&smallest) != Some(std::cmp::Ordering::Greater) {
            return Err(NotPositiveDefinite { pivot: i });
        }
        row[i] = square.sqrt();
    }
    Ok(())
}

/// Solves L z = b in place for the factor of [`factor`].
pub(super) fn solve_lower(l: &[f64], n: usize, b: &mut [f64]) {
    for i in 0..n {
        let row = &l[i * n..=i * n + i];
        b[i] = (b[i] - dot(&row[..i], &b[..i])) / row[i];
    }
}

/// Solves Lᵀ z = b in place for the factor of [`factor`].
pub(super) fn solve_upper(l: &[f64], n: usize, b: &mut [f64]) {
    for i in (0..n).rev() {
        let row = &l[i * n..=i * n + i];
        let value = b[i] / row[i];
        b[i] = value;
        for (v, &r) in b[..i].iter_mut().zip(row) {
            *v -= value * r;
        }
    }
}

/// Solves A z = b in place for the factor of [`factor`].
pub(super) fn solve(l: &[f64], n: usize, b: &mut [f64]) {
    solve_lower(l, n, b);
    solve_upper(l, n, b);
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
