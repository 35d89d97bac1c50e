//! Inner loops of operators and pursuits, compiled for several instruction sets.
//!
//! Lanes are columns, or positions in fixed groups of eight, and no product is fused with a sum. Results have the same
//! bits whichever instruction set is chosen at run time.

use multiversion::multiversion;

/// Numbers that are summed side by side. Vectors of measurements are padded to a multiple of this.
pub(crate) const LANES: usize = 8;

/// Columns summed in registers at a time.
const BLOCK: usize = 32;

/// Up to this many columns a block of them is summed over all rows; wider rows are read from end to end, as the memory
/// likes it.
const NARROW: usize = 4096;

/// `sums` + Σᵣ term(`y[r]`, row r) over `B` columns from `c`, in the order of the rows.
#[inline(always)]
fn block<const B: usize>(
    mut sums: [f64; B],
    values: &[f64],
    ncols: usize,
    y: &[f64],
    c: usize,
    term: impl Fn(f64, f64) -> f64 + Copy,
) -> [f64; B] {
    for (&w, row) in y.iter().zip(values.chunks_exact(ncols)) {
        if let Some(row) = row.get(c..).and_then(<[f64]>::first_chunk::<B>) {
            for (sum, &v) in sums.iter_mut().zip(row) {
                *sum += term(w, v);
            }
        }
    }
    sums
}

/// Adds Σᵣ term(`y[r]`, `values[r][first + c]`) to `out[c]`, for row-major `values` of `ncols` columns; the order of
/// additions does not depend on the shape.
#[inline(always)]
pub(crate) fn column_sums_of(
    values: &[f64],
    ncols: usize,
    first: usize,
    y: &[f64],
    out: &mut [f64],
    term: impl Fn(f64, f64) -> f64 + Copy,
) {
    if ncols > NARROW {
        for (&w, row) in y.iter().zip(values.chunks_exact(ncols)) {
            for (sum, &v) in out.iter_mut().zip(&row[first..]) {
                *sum += term(w, v);
            }
        }
        return;
    }
    let mut c = first;
    let (wide, rest) = out.as_chunks_mut::<BLOCK>();
    for out in wide {
        *out = block(*out, values, ncols, y, c, term);
        c += BLOCK;
    }
    let (eights, rest) = rest.as_chunks_mut::<LANES>();
    for out in eights {
        *out = block(*out, values, ncols, y, c, term);
        c += LANES;
    }
    let (fours, rest) = rest.as_chunks_mut::<4>();
    for out in fours {
        *out = block(*out, values, ncols, y, c, term);
        c += 4;
    }
    for out in rest {
        [*out] = block([*out], values, ncols, y, c, term);
        c += 1;
    }
}

/// `out = Aᵀ y` for row-major `values`.
#[inline(always)]
fn adjoint_of(values: &[f64], y: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    column_sums_of(values, out.len(), 0, y, out, |w, v| w * v);
}

/// Adds Σₖ `shares[k]` · row `rows[k]` of the row-major `values` to `out`, in the order of `rows`.
#[inline(always)]
fn add_rows_of(values: &[f64], rows: &[usize], shares: &[f64], out: &mut [f64]) {
    let ncols = out.len();
    let mut first = 0;
    for out in out.chunks_mut(BLOCK) {
        let end = first + out.len();
        if let Some(whole) = out.first_chunk_mut::<BLOCK>() {
            let mut sums = *whole;
            for (&r, &share) in rows.iter().zip(shares) {
                if let Some(row) = values[r * ncols + first..r * ncols + end].first_chunk::<BLOCK>() {
                    sums.iter_mut().zip(row).for_each(|(sum, v)| *sum += share * v);
                }
            }
            *whole = sums;
        } else {
            for (&r, &share) in rows.iter().zip(shares) {
                axpy_of(share, &values[r * ncols + first..r * ncols + end], out);
            }
        }
        first = end;
    }
}

/// Σᵣ vᵣ² of every column; `ones` is as long as there are rows.
#[inline(always)]
fn squares_of(values: &[f64], ones: &[f64], out: &mut [f64]) {
    out.fill(0.0);
    column_sums_of(values, out.len(), 0, ones, out, |_, v| v * v);
}

/// Adds the upper triangle of Aᵀ A to `out` (n × n): `rows` holds A (M × n), `columns` Aᵀ, both row-major.
#[inline(always)]
fn add_gram_of(rows: &[f64], columns: &[f64], n: usize, out: &mut [f64]) {
    let (m, n) = (rows.len() / n.max(1), n.max(1));
    for (i, (column, out)) in columns.chunks_exact(m.max(1)).zip(out.chunks_exact_mut(n)).enumerate() {
        column_sums_of(rows, n, i, column, &mut out[i..], |w, v| w * v);
    }
}

/// Σ aᵢ bᵢ, eight sums side by side; entries past the last whole eight are added one by one.
#[inline(always)]
pub(crate) fn dot_of(a: &[f64], b: &[f64]) -> f64 {
    let ((a8, a1), (b8, b1)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut sums = [0.0; LANES];
    for (a, b) in a8.iter().zip(b8) {
        for (sum, (x, y)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += x * y;
        }
    }
    let [a, b, c, d, e, f, g, h] = sums;
    let whole = ((a + b) + (c + d)) + ((e + f) + (g + h));
    a1.iter().zip(b1).fold(whole, |sum, (x, y)| sum + x * y)
}

/// `y += a x`.
#[inline(always)]
pub(crate) fn axpy_of(a: f64, x: &[f64], y: &mut [f64]) {
    for (o, &v) in y.iter_mut().zip(x) {
        *o += a * v;
    }
}

/// Takes the directions `done` (unit vectors of `q`'s length, one after the other) out of `q` and adds their shares to
/// `overlaps`; returns what is left of ‖q‖².
///
/// A second pass removes what rounding left of the first; it is needed only when the first one cancelled more than half
/// of ‖q‖².
/// Source: J. W. Daniel et al., "Reorthogonalization and stable algorithms for updating the Gram–Schmidt QR
/// factorization", Math. Comp. 30 (1976); L. Giraud et al., "Rounding error analysis of the classical Gram–Schmidt
/// orthogonalization process", Numer. Math. 101 (2005).
#[inline(always)]
fn orthogonalise_of(done: &[f64], q: &mut [f64], overlaps: &mut [f64]) -> f64 {
    let mut square = dot_of(q, q);
    for _ in 0..2 {
        for (overlap, direction) in overlaps.iter_mut().zip(done.chunks_exact(q.len().max(1))) {
            let share = dot_of(direction, q);
            *overlap += share;
            axpy_of(-share, direction, q);
        }
        let before = std::mem::replace(&mut square, dot_of(q, q));
        if square > 0.5 * before {
            break;
        }
    }
    square
}

/// argmaxₖ of `score(cₖ)·wₖ` among the positive ones, the first of equals, with its score.
#[inline(always)]
fn best_of(c: &[f64], w: &[f64], score: impl Fn(f64, f64) -> f64) -> Option<(usize, f64)> {
    let mut most = [0.0; LANES];
    let ((c8, c1), (w8, w1)) = (c.as_chunks::<LANES>(), w.as_chunks::<LANES>());
    for (c, w) in c8.iter().zip(w8) {
        for (most, (&c, &w)) in most.iter_mut().zip(c.iter().zip(w)) {
            let s = score(c, w);
            *most = if s > *most { s } else { *most };
        }
    }
    let tail = c1.iter().zip(w1).map(|(&c, &w)| score(c, w));
    let best = most.into_iter().chain(tail).fold(0.0, |m, s| if s > m { s } else { m });
    if best > 0.0 { c.iter().zip(w).position(|(&c, &w)| score(c, w) >= best).map(|k| (k, best)) } else { None }
}

/// 1/√`squares`, 0 where a square is 0.
#[inline(always)]
fn inverse_roots_of(squares: &[f64], out: &mut [f64]) {
    for (out, &square) in out.iter_mut().zip(squares) {
        let inverse = 1.0 / square.sqrt();
        *out = if square > 0.0 { inverse } else { 0.0 };
    }
}

/// One step of the pursuit by Gram matrices of [`crate::dictionary`]: `v = (g − Σᵢ overlapᵢ vᵢ) / d`, then `c −= p v`.
#[inline(always)]
fn gram_step_of(g: &[f64], done: &[f64], overlaps: &[f64], d: f64, p: f64, v: &mut [f64], c: &mut [f64]) {
    v.copy_from_slice(g);
    for (overlap, direction) in overlaps.iter().zip(done.chunks_exact(v.len().max(1))) {
        axpy_of(-overlap, direction, v);
    }
    let inverse = 1.0 / d;
    for (c, v) in c.iter_mut().zip(v) {
        *v *= inverse;
        *c -= p * *v;
    }
}

/// `out = Aᵀ y` for row-major `values` with as many rows as `y` has entries and as many columns as `out`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn adjoint(values: &[f64], y: &[f64], out: &mut [f64]) {
    adjoint_of(values, y, out);
}

/// [`add_rows_of`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn add_rows(values: &[f64], rows: &[usize], shares: &[f64], out: &mut [f64]) {
    add_rows_of(values, rows, shares, out);
}

/// [`add_gram_of`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn add_gram(rows: &[f64], columns: &[f64], n: usize, out: &mut [f64]) {
    add_gram_of(rows, columns, n, out);
}

/// Squared length of every column of row-major `values`; `ones` is as long as there are rows.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn column_squares(values: &[f64], ones: &[f64], out: &mut [f64]) {
    squares_of(values, ones, out);
}

/// Σ aᵢ bᵢ.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    dot_of(a, b)
}

/// `y += a x`.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn axpy(a: f64, x: &[f64], y: &mut [f64]) {
    axpy_of(a, x, y);
}

/// [`orthogonalise_of`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn orthogonalise(done: &[f64], q: &mut [f64], overlaps: &mut [f64]) -> f64 {
    orthogonalise_of(done, q, overlaps)
}

/// 1/√`squares`, 0 where a square is 0.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn inverse_roots(squares: &[f64], out: &mut [f64]) {
    inverse_roots_of(squares, out);
}

/// The index of the largest |cₖ|·wₖ above 0, the first of equals, with its score.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn best_magnitude(c: &[f64], w: &[f64]) -> Option<(usize, f64)> {
    best_of(c, w, |c, w| c.abs() * w)
}

/// The index of the largest cₖ·wₖ above 0, the first of equals, with its score.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn best_positive(c: &[f64], w: &[f64]) -> Option<(usize, f64)> {
    best_of(c, w, |c, w| c * w)
}

/// [`gram_step_of`].
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn gram_step(g: &[f64], done: &[f64], overlaps: &[f64], d: f64, p: f64, v: &mut [f64], c: &mut [f64]) {
    gram_step_of(g, done, overlaps, d, p, v, c);
}

/// Euclidean length, scaled so that neither 1e-300 nor 1e300 is lost.
pub(crate) fn norm(v: &[f64]) -> f64 {
    let square = dot(v, v);
    if square.is_normal() {
        return square.sqrt();
    }
    let scale = v.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    if scale == 0.0 || !scale.is_finite() {
        return scale;
    }
    scale * v.iter().map(|x| (x / scale).powi(2)).sum::<f64>().sqrt()
}

/// eˣ for x ≤ 700, 0 below −700, to 1e-12 of itself.
///
/// x = k ln 2 + r with |r| ≤ ½ ln 2, the Taylor series of eʳ to r¹⁰ (rest 0.35¹¹/11! = 2e-13), and 2ᵏ put together from
/// its bits.
#[inline(always)]
pub(crate) fn exp(x: f64) -> f64 {
    /// Adding 1.5·2⁵² rounds to a whole number and leaves it in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts, the first with so few bits that its product with k is exact.
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    /// 1/n! from n = 10 down to 0.
    const SERIES: [f64; 11] = [
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
        1.0,
        1.0,
    ];
    let inside = x.clamp(-700.0, 700.0);
    let shifted = inside * std::f64::consts::LOG2_E + ROUND;
    let k = shifted - ROUND;
    let r = (inside - k * LN_2[0]) - k * LN_2[1];
    let series = SERIES.iter().fold(0.0, |sum, c| sum * r + c);
    let power = f64::from_bits(shifted.to_bits().wrapping_add(1023) << 52);
    if x < -700.0 { 0.0 } else { series * power }
}

/// ln x for normal x > 0, to 1e-13 absolute or 1e-15 of itself.
///
/// x = 2ᵏ m with m in [√½, √2), and ln m = 2 artanh z, z = (m − 1)/(m + 1), |z| ≤ 0.172, by its series to z¹⁵ (rest
/// 0.172¹⁷/8 = 1e-14).
#[inline(always)]
pub(crate) fn ln(x: f64) -> f64 {
    /// Bits of √½: what lies above it in the exponent's place is k.
    const HALF_ROOT: u64 = std::f64::consts::FRAC_1_SQRT_2.to_bits();
    const ONE: u64 = 1.0_f64.to_bits();
    const MANTISSA: u64 = (1 << 52) - 1;
    /// Bits of 2⁵², whose lowest bits count ones.
    const WHOLE: u64 = 0x4330_0000_0000_0000;
    /// 1/(2n + 1) from n = 7 down to 0.
    const SERIES: [f64; 8] = [1.0 / 15.0, 1.0 / 13.0, 1.0 / 11.0, 1.0 / 9.0, 1.0 / 7.0, 1.0 / 5.0, 1.0 / 3.0, 1.0];
    // adding 1 − √½ in bits carries into the exponent exactly where the mantissa reaches √2
    let carried = x.to_bits().wrapping_add(ONE - HALF_ROOT);
    let k = f64::from_bits(WHOLE | (carried >> 52)) - (4_503_599_627_370_496.0 + 1023.0);
    let m = f64::from_bits((carried & MANTISSA) + HALF_ROOT);
    let z = (m - 1.0) / (m + 1.0);
    let square = z * z;
    let series = SERIES.iter().fold(0.0, |sum, c| sum * square + c);
    k * std::f64::consts::LN_2 + 2.0 * z * series
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    fn bits(values: &[f64]) -> Vec<u64> {
        values.iter().map(|v| v.to_bits()).collect()
    }

    /// The chosen instructions against the ones that every machine has.
    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for (m, k) in [(1, 1), (7, 3), (25, 100), (33, 77), (3, NARROW + 5)] {
            let mut draw = |n: usize| -> Vec<f64> { (0..n).map(|_| rng.random_range(-1.0..1.0)).collect() };
            let (a, y, w) = (draw(m * k), draw(m), draw(k));
            let (mut chosen, mut plain) = (vec![f64::NAN; k], vec![f64::NAN; k]);
            adjoint(&a, &y, &mut chosen);
            adjoint_of(&a, &y, &mut plain);
            assert_eq!(bits(&chosen), bits(&plain), "{m} × {k}");
            assert_eq!(best_magnitude(&chosen, &w), best_of(&plain, &w, |c, w| c.abs() * w));
            assert_eq!(best_positive(&chosen, &w), best_of(&plain, &w, |c, w| c * w));
            column_squares(&a, &y, &mut chosen);
            squares_of(&a, &y, &mut plain);
            assert_eq!(bits(&chosen), bits(&plain), "{m} × {k}");
            assert_eq!(dot(&w, &chosen).to_bits(), dot_of(&w, &chosen).to_bits());
            let (mut roots, mut roots1) = (vec![f64::NAN; k], vec![f64::NAN; k]);
            inverse_roots(&w, &mut roots);
            inverse_roots_of(&w, &mut roots1);
            assert_eq!(bits(&roots), bits(&roots1), "{m} × {k}");
            if k < NARROW {
                let at = Matrix::from_columns(k, m, &a).unwrap();
                let (mut gram, mut gram1) = (vec![0.5; k * k], vec![0.5; k * k]);
                add_gram(&a, at.view().values(), k, &mut gram);
                add_gram_of(&a, at.view().values(), k, &mut gram1);
                assert_eq!(bits(&gram), bits(&gram1), "{m} × {k}");
            }
            let (mut q, mut o) = (draw(m), vec![0.0; k]);
            let (mut q1, mut o1) = (q.clone(), o.clone());
            let left = orthogonalise(&a, &mut q, &mut o);
            assert_eq!(left.to_bits(), orthogonalise_of(&a, &mut q1, &mut o1).to_bits());
            assert_eq!((bits(&q), bits(&o)), (bits(&q1), bits(&o1)), "{m} × {k}");
            let (mut v, mut v1, mut c, mut c1) = (w.clone(), w.clone(), w.clone(), w.clone());
            gram_step(&chosen, &a, &y, 0.7, 0.3, &mut v, &mut c);
            gram_step_of(&chosen, &a, &y, 0.7, 0.3, &mut v1, &mut c1);
            assert_eq!((bits(&v), bits(&c)), (bits(&v1), bits(&c1)), "{m} × {k}");
        }
    }

    #[test]
    fn the_first_of_equals_is_the_best_and_nothing_is_better_than_nothing() {
        assert_eq!(best_magnitude(&[1.0, -2.0, 2.0], &[1.0; 3]), Some((1, 2.0)));
        assert_eq!(best_positive(&[1.0, -2.0, 2.0, 2.0], &[1.0; 4]), Some((2, 2.0)));
        assert_eq!(best_positive(&[-1.0, 0.0, f64::NAN], &[1.0; 3]), None);
        assert_eq!(best_magnitude(&[5.0; 20], &[0.0; 20]), None);
    }

    #[test]
    fn exponential_equals_the_library_s() {
        for k in -70_000..=70_000 {
            let x = f64::from(k) * 0.01;
            // the series' rest and a few roundings
            assert!((exp(x) / x.exp() - 1.0).abs() < 1e-12, "{x}");
        }
        assert!(exp(-1e300) <= 0.0 && exp(f64::NEG_INFINITY) <= 0.0);
    }

    #[test]
    fn logarithm_equals_the_library_s() {
        let x = |k: i32| (f64::from(k) * 0.011).exp();
        let edges = [1.0, 0.5, 2.0, std::f64::consts::SQRT_2, f64::MIN_POSITIVE, f64::MAX];
        for x in (-64_000..=64_000).map(x).chain(edges) {
            // the series' rest of 2e-14 and the rounding of k ln 2, up to 710
            let error = (ln(x) - x.ln()).abs();
            assert!(error < 1e-13_f64.max(4.0 * f64::EPSILON * x.ln().abs()), "{x:e}: {error:e}");
        }
    }
}
