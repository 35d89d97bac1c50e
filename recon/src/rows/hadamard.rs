//! Walsh functions in two orders.

use super::cosine::{by_frequency, products};
use super::error::RowError;
use super::headroom::take;
use super::task::{DesignRows, RowTask};
use crate::matrix::Matrix;

/// Two-dimensional Walsh functions: rows of a Hadamard matrix, cropped to the sheet if its sides are not powers of two.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hadamard {
    /// Ordered by number of sign changes, similar to frequencies.
    Sequency,
    /// Ordered by number of blocks of one sign, the fewest first.
    /// Source: W.-K. Yu, Sensors 19 (2019) 4122 ("cake-cutting").
    CakeCutting,
}

impl DesignRows for Hadamard {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        let shape = task.expected.shape();
        let reason = "a sheet has as many Walsh functions as taxels, and some of them may not keep to the headroom";
        task.check(task.expected.taxels(), reason)?;
        let axes = shape.map(walsh);
        let mut pairs = by_frequency(shape);
        if *self == Self::CakeCutting {
            // blocks of a product of signs: a rectangle between any two changes of either factor
            let runs = |f: &Vec<f64>| 1 + f.windows(2).filter(|w| w[0] * w[1] < 0.0).count();
            pairs.sort_by_key(|(u, v)| runs(&axes[0][*u]) * runs(&axes[1][*v]));
        }
        take(task, products(shape, &axes, pairs), reason)
    }
}

/// The first n Walsh functions by sequency, on n places of the next power of two that begin with the first.
fn walsh(n: usize) -> Vec<Vec<f64>> {
    let size = n.next_power_of_two();
    let bits = size.trailing_zeros();
    (0..n)
        .map(|w| {
            let gray = w ^ (w >> 1);
            let row = if bits == 0 {
                0
            } else {
                gray.reverse_bits() >> (usize::BITS - bits)
            };
            let sign = |i: usize| {
                if (row & i).count_ones().is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                }
            };
            (0..n).map(sign).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Function w of 2^k changes its sign w times, and all are orthogonal.
    #[test]
    fn walsh_functions_have_their_sequency() {
        let functions = walsh(16);
        for (w, f) in functions.iter().enumerate() {
            assert_eq!(f.windows(2).filter(|p| p[0] * p[1] < 0.0).count(), w);
            for (v, g) in functions.iter().enumerate() {
                let product: f64 = f.iter().zip(g).map(|(a, b)| a * b).sum();
                assert!((product - if v == w { 16.0 } else { 0.0 }).abs() < 1e-12);
            }
        }
    }
}
