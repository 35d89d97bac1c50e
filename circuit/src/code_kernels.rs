//! Sums over all taxels for many measurements at once, with given levels. The order of additions, and so every bit of
//! the result, is that of [`kernels`](crate::kernels) with the same levels.
//!
//! In `kernels` a binary term is the value with its sign bit flipped or not; here it is the product with ±1, which is
//! equal. An analog term is the same product in both. Both add zeros of either sign after the last taxel; zeros do not
//! change a sum that starts at +0.

use crate::kernels::{Lines, four};
use multiversion::multiversion;

/// `sums` += Σₖ dₖ·`values[k]`; `drives` holds dₖ taxel-major, as many measurements a taxel as `sums` has, for at least
/// as many taxels as there are values, in fours.
#[inline(always)]
fn given_sums_of(drives: &[f64], values: &[f64], sums: &mut [f64]) {
    let len = sums.len();
    for (first, drives) in (0..values.len()).step_by(4).zip(drives.chunks_exact((4 * len).max(1))) {
        let x = four(values, first);
        let [a, b, c, d] = std::array::from_fn(|j| &drives[j * len..(j + 1) * len]);
        for i in 0..len {
            sums[i] += (a[i] * x[0] + b[i] * x[1]) + (c[i] * x[2] + d[i] * x[3]);
        }
    }
}

/// `sums` += Σₖ dₖ·xₖ and `squares` += Σₖ (dₖ·xₖ)²; `drives` as in [`given_sums_of`].
#[inline(always)]
fn given_sums_and_squares_of(drives: &[f64], lines: Lines<'_>, sums: &mut [f64], squares: &mut [f64]) {
    let len = sums.len();
    let (share, squares) = (&lines.share[..len], &mut squares[..len]);
    let fours = (0..lines.from.len()).step_by(4);
    for (first, drives) in fours.zip(drives.chunks_exact((4 * len).max(1))) {
        let (from, to) = (four(lines.from, first), four(lines.to.unwrap_or(lines.from), first));
        let taxels: [&[f64]; 4] = std::array::from_fn(|j| &drives[j * len..(j + 1) * len]);
        for i in 0..len {
            let [a, b, c, d] = std::array::from_fn(|j| taxels[j][i] * ((1.0 - share[i]) * from[j] + share[i] * to[j]));
            sums[i] += (a + b) + (c + d);
            squares[i] += (a * a + b * b) + (c * c + d * d);
        }
    }
}

/// [`given_sums_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn given_sums(drives: &[f64], values: &[f64], sums: &mut [f64]) {
    given_sums_of(drives, values, sums);
}

/// [`given_sums_and_squares_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn given_sums_and_squares(drives: &[f64], lines: Lines<'_>, sums: &mut [f64], squares: &mut [f64]) {
    given_sums_and_squares_of(drives, lines, sums, squares);
}
