//! Inner loops of the filter: one step for all components, one block of SIMD lanes at a time. Every lane has the same
//! order of operations whichever instruction set is chosen.

use crate::elementary::ln;
use multiversion::multiversion;

/// Components side by side in a block.
pub(super) const LANES: usize = 4;

type Lanes = [f64; LANES];

/// `sum` += a·b, lane by lane.
#[inline(always)]
fn add_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
        *s += a * b;
    }
}

/// `sum` −= a·b, lane by lane.
#[inline(always)]
fn subtract_product(sum: &mut Lanes, a: &Lanes, b: &Lanes) {
    for ((s, a), b) in sum.iter_mut().zip(a).zip(b) {
        *s -= a * b;
    }
}

#[inline(always)]
fn product(a: &Lanes, b: &Lanes) -> Lanes {
    std::array::from_fn(|l| a[l] * b[l])
}

/// Gains g = P f/q of one block with the covariance lowered by them; returns 1/q.
#[inline(always)]
fn gain(noise: &Lanes, factors: &[Lanes], covariance: &mut [Lanes], gains: &mut [Lanes]) -> Lanes {
    let rank = factors.len().max(1);
    let mut variance = *noise;
    for ((w, row), f) in gains.iter_mut().zip(covariance.chunks_exact(rank)).zip(factors) {
        let mut sum = [0.0; LANES];
        for (p, f) in row.iter().zip(factors) {
            add_product(&mut sum, p, f);
        }
        *w = sum;
        add_product(&mut variance, &sum, f);
    }
    // rounding must not take q below the noise
    let precision: Lanes = std::array::from_fn(|l| 1.0 / variance[l].max(noise[l]));
    for (i, row) in covariance.chunks_exact_mut(rank).enumerate() {
        let scaled = product(&gains[i], &precision);
        for (p, w) in row.iter_mut().zip(&*gains) {
            subtract_product(p, &scaled, w);
        }
    }
    for w in gains {
        *w = product(w, &precision);
    }
    precision
}

/// Innovation ε = `value` − fᵀ ẑ of one block; the state ẑ moves on by g ε.
#[inline(always)]
fn innovate(value: &Lanes, factors: &[Lanes], gains: &[Lanes], state: &mut [Lanes]) -> Lanes {
    let mut innovation = *value;
    for (f, z) in factors.iter().zip(&*state) {
        subtract_product(&mut innovation, f, z);
    }
    for (g, z) in gains.iter().zip(state) {
        add_product(z, g, &innovation);
    }
    innovation
}

/// One row for all components: lowers `covariance`, moves the `state` of Φ t, and writes the gains, the innovations of
/// Φ t and 1/q. `row` and all other slices go block by block.
#[expect(clippy::too_many_arguments, reason = "the arrays of one step")]
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn prepare(
    rank: usize,
    noise: &[f64],
    row: &[f64],
    covariance: &mut [f64],
    state: &mut [f64],
    gains: &mut [f64],
    innovations: &mut [f64],
    precisions: &mut [f64],
) {
    let row = row.as_chunks::<LANES>().0.chunks_exact(1 + rank);
    let noise = noise.as_chunks::<LANES>().0.iter();
    let outputs = innovations.as_chunks_mut::<LANES>().0.iter_mut();
    let outputs = outputs.zip(precisions.as_chunks_mut::<LANES>().0);
    let (covariance, state) = (covariance.as_chunks_mut::<LANES>().0, state.as_chunks_mut::<LANES>().0);
    let gains = gains.as_chunks_mut::<LANES>().0;
    for (b, ((row, noise), (innovation, precision))) in row.zip(noise).zip(outputs).enumerate() {
        let Some((mean, factors)) = row.split_first() else {
            return;
        };
        let of_block = b * rank..(b + 1) * rank;
        let covariance = &mut covariance[b * rank * rank..(b + 1) * rank * rank];
        let gains = &mut gains[of_block.clone()];
        *precision = gain(noise, factors, covariance, gains);
        *innovation = innovate(mean, factors, gains, &mut state[of_block]);
    }
}

/// One sample for all components: moves the `state` of y and adds to ỹᵀỹ and ỹᵀt̃.
#[expect(clippy::too_many_arguments, reason = "the arrays of one step")]
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn observe(
    rank: usize,
    y: f64,
    row: &[f64],
    gains: &[f64],
    innovations: &[f64],
    precisions: &[f64],
    state: &mut [f64],
    yy: &mut [f64],
    yt: &mut [f64],
) {
    let row = row.as_chunks::<LANES>().0.chunks_exact(1 + rank);
    let templates = innovations.as_chunks::<LANES>().0.iter();
    let templates = templates.zip(precisions.as_chunks::<LANES>().0);
    let sums = yy.as_chunks_mut::<LANES>().0.iter_mut();
    let sums = sums.zip(yt.as_chunks_mut::<LANES>().0);
    let (gains, state) = (gains.as_chunks::<LANES>().0, state.as_chunks_mut::<LANES>().0);
    for (b, ((row, (template, precision)), (yy, yt))) in row.zip(templates).zip(sums).enumerate() {
        let of_block = b * rank..(b + 1) * rank;
        let e = innovate(&[y; LANES], &row[1..], &gains[of_block.clone()], &mut state[of_block]);
        let scaled = product(&e, precision);
        add_product(yy, &e, &scaled);
        add_product(yt, template, &scaled);
    }
}

/// Adds a row's ε²/q and ln q to their sums.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn accumulate(innovations: &[f64], precisions: &[f64], squares: &mut [f64], log_determinants: &mut [f64]) {
    let sums = squares.iter_mut().zip(log_determinants);
    for ((e, p), (square, log_determinant)) in innovations.iter().zip(precisions).zip(sums) {
        *square += e * e * p;
        *log_determinant -= ln(*p);
    }
}
