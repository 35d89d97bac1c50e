//! Loops in single precision over maps of a grid, eight numbers side by side. Every product is added without rounding
//! in between (`mul_add`), so that all processors give the same bits; those without such an instruction take long.
//!
//! A map has a slice of `width` numbers for every taxel, row after row of the grid; the width is a multiple of
//! [`LANES`] where one is asked for.

use multiversion::multiversion;

/// Numbers that are computed side by side.
pub(crate) const LANES: usize = 8;
/// Side of the squares of [`outer_sums`] whose sums are in registers: four rows, and as many columns as three slices
/// have.
const ROWS: usize = 4;
/// Slices that are passed over at a time: as many as the first cache holds.
const BLOCK: usize = 64;

type Lane = [f32; LANES];

/// The nearest number of single precision.
#[expect(clippy::cast_possible_truncation, reason = "rounding is what it is for")]
pub(crate) fn single(value: f64) -> f32 {
    value as f32
}

#[inline(always)]
fn lane(values: &[f32], at: usize) -> Lane {
    values[at..].first_chunk().copied().unwrap_or_default()
}

#[inline(always)]
fn add(sum: Lane, w: f32, v: Lane) -> Lane {
    std::array::from_fn(|l| w.mul_add(v[l], sum[l]))
}

#[inline(always)]
fn total(v: Lane) -> f32 {
    let half: [f32; 4] = std::array::from_fn(|l| v[l] + v[l + 4]);
    (half[0] + half[2]) + (half[1] + half[3])
}

/// `out[k]` = Σᵢ aₖᵢ uᵢ for the slices aₖ of `a`, which are as wide as `u`.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn products(a: &[f32], u: &[f32], out: &mut [f32]) {
    for (out, a) in out.iter_mut().zip(a.chunks_exact(u.len().max(1))) {
        let mut sums = [0.0; LANES];
        for (a, u) in a.as_chunks::<LANES>().0.iter().zip(u.as_chunks::<LANES>().0) {
            sums = std::array::from_fn(|l| a[l].mul_add(u[l], sums[l]));
        }
        *out = total(sums);
    }
}

/// Adds Σₖ xₖ aₖ to `out` for the slices aₖ of `a`, which are as wide as `out`.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn add_weighted(a: &[f32], x: &[f32], out: &mut [f32]) {
    for (&x, a) in x.iter().zip(a.chunks_exact(out.len().max(1))) {
        out.iter_mut().zip(a).for_each(|(sum, v)| *sum = x.mul_add(*v, *sum));
    }
}

/// Σₖ aₖ bₖᵀ on and above the diagonal for slices of `width`, a multiple of [`LANES`]: `width` × `width`. What is below
/// the diagonal is not meant.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn outer_sums(a: &[f32], b: &[f32], width: usize, out: &mut [f32]) {
    out.fill(0.0);
    for (a, b) in a.chunks(BLOCK * width).zip(b.chunks(BLOCK * width)) {
        for i in (0..width).step_by(ROWS) {
            let mut j = i / LANES * LANES;
            while j < width {
                let out = &mut out[i * width + j..];
                match (width - j) / LANES {
                    1 => outer_square::<1>(&a[i..], &b[j..], width, out),
                    2 => outer_square::<2>(&a[i..], &b[j..], width, out),
                    _ => outer_square::<3>(&a[i..], &b[j..], width, out),
                }
                j += 3 * LANES;
            }
        }
    }
}

#[inline(always)]
fn outer_square<const G: usize>(a: &[f32], b: &[f32], width: usize, out: &mut [f32]) {
    let mut sums: [[Lane; G]; ROWS] =
        std::array::from_fn(|r| std::array::from_fn(|g| lane(out, r * width + g * LANES)));
    for (a, b) in a.chunks(width).zip(b.chunks(width)) {
        let (Some(a), Some(b)) = (a.first_chunk::<ROWS>(), b.get(..G * LANES)) else { break };
        let b = b.as_chunks::<LANES>().0;
        for r in 0..ROWS {
            for g in 0..G {
                sums[r][g] = add(sums[r][g], a[r], b[g]);
            }
        }
    }
    for (r, sums) in sums.iter().enumerate() {
        for (g, sum) in sums.iter().enumerate() {
            out[r * width + g * LANES..][..LANES].copy_from_slice(sum);
        }
    }
}

/// `to[r]` = Σ matrix[r, r'] `from[r']` for the slices of `from`, which are of `width`; there are as many `r'` as
/// `size`. Zeros at the ends of a row of the matrix are skipped.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn apply(from: &[f32], matrix: &[f32], [size, width]: [usize; 2], to: &mut [f32]) {
    for (to, row) in to.chunks_exact_mut(width).zip(matrix.chunks_exact(size)) {
        let first = row.iter().position(|w| *w != 0.0).unwrap_or(0);
        let end = row.iter().rposition(|w| *w != 0.0).map_or(0, |last| last + 1);
        let mut at = 0;
        while at < width {
            let out = &mut to[at..];
            match width - at {
                left if left >= 4 * LANES => {
                    combine::<4>(&row[first..end], &from[first * width + at..], width, out);
                    at += 4 * LANES;
                }
                left if left >= LANES => {
                    combine::<1>(&row[first..end], &from[first * width + at..], width, out);
                    at += LANES;
                }
                _ => {
                    out[0] = (first..end).fold(0.0, |sum, k| row[k].mul_add(from[k * width + at], sum));
                    at += 1;
                }
            }
        }
    }
}

/// Σ wₖ of the first `G` lanes of the slices of `from`.
#[inline(always)]
fn combine<const G: usize>(weights: &[f32], from: &[f32], width: usize, out: &mut [f32]) {
    let mut sums = [[0.0; LANES]; G];
    for (&w, from) in weights.iter().zip(from.chunks(width)) {
        let Some(from) = from.get(..G * LANES) else { break };
        for (sum, v) in sums.iter_mut().zip(from.as_chunks::<LANES>().0) {
            *sum = add(*sum, w, *v);
        }
    }
    for (out, sum) in out.as_chunks_mut::<LANES>().0.iter_mut().zip(sums) {
        *out = sum;
    }
}

/// (1 2 1)/4 of slices of `width`; nothing lies beyond the ends.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn blur(from: &[f32], width: usize, to: &mut [f32]) {
    to.iter_mut().zip(from).for_each(|(to, v)| *to = 0.5 * v);
    let shifted = from.len() - width;
    to[width..].iter_mut().zip(&from[..shifted]).for_each(|(to, v)| *to = 0.25_f32.mul_add(*v, *to));
    to[..shifted].iter_mut().zip(&from[width..]).for_each(|(to, v)| *to = 0.25_f32.mul_add(*v, *to));
}

/// Wᵀ u + b for the inputs u of every taxel, for weights of inputs × outputs; the outputs are a multiple of [`LANES`].
/// `least` is the least value of an output.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn affine(inputs: &[f32], weights: &[f32], bias: &[f32], least: f32, out: &mut [f32]) {
    let (outputs, count) = (bias.len(), weights.len() / bias.len());
    let whole = inputs.len() / (ROWS * count) * ROWS;
    let mut at = 0;
    while at < outputs {
        let tiles = inputs.chunks_exact(ROWS * count).zip(out.chunks_exact_mut(ROWS * outputs));
        let lanes = ((outputs - at) / LANES).min(3);
        for (inputs, out) in tiles {
            match lanes {
                1 => {
                    affine_tile::<ROWS, 1>(inputs, &weights[at..], &bias[at..], [count, outputs], least, &mut out[at..])
                }
                2 => {
                    affine_tile::<ROWS, 2>(inputs, &weights[at..], &bias[at..], [count, outputs], least, &mut out[at..])
                }
                _ => {
                    affine_tile::<ROWS, 3>(inputs, &weights[at..], &bias[at..], [count, outputs], least, &mut out[at..])
                }
            }
        }
        let rest = inputs[whole * count..].chunks_exact(count).zip(out[whole * outputs..].chunks_exact_mut(outputs));
        for (inputs, out) in rest {
            for at in (at..at + lanes * LANES).step_by(LANES) {
                affine_tile::<1, 1>(inputs, &weights[at..], &bias[at..], [count, outputs], least, &mut out[at..]);
            }
        }
        at += lanes * LANES;
    }
}

/// The first `G` lanes of outputs of `T` taxels.
#[inline(always)]
fn affine_tile<const T: usize, const G: usize>(
    inputs: &[f32],
    weights: &[f32],
    bias: &[f32],
    [count, outputs]: [usize; 2],
    least: f32,
    out: &mut [f32],
) {
    let mut sums: [[Lane; G]; T] = [std::array::from_fn(|g| lane(bias, g * LANES)); T];
    for (k, w) in weights.chunks(outputs).enumerate() {
        let Some(w) = w.get(..G * LANES) else { break };
        let w = w.as_chunks::<LANES>().0;
        for (t, sums) in sums.iter_mut().enumerate() {
            let value = inputs[t * count + k];
            for (sum, w) in sums.iter_mut().zip(w) {
                *sum = add(*sum, value, *w);
            }
        }
    }
    for (t, sums) in sums.iter().enumerate() {
        for (g, sum) in sums.iter().enumerate() {
            let out = &mut out[t * outputs + g * LANES..][..LANES];
            out.iter_mut().zip(sum).for_each(|(out, sum)| *out = sum.max(least));
        }
    }
}

/// max(0, D ∗ z + b) in every channel, D being 9 × channels, a multiple of [`LANES`]. `z` has a border of zeros: (rows
/// +
/// 2) × (cols + 2) slices of the channels; `out` has none.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn around(z: &[f32], cols: usize, weights: &[f32], bias: &[f32], out: &mut [f32]) {
    let channels = bias.len();
    let wide = (cols + 2) * channels;
    for at in (0..channels).step_by(LANES) {
        let w: [Lane; 9] = std::array::from_fn(|k| lane(weights, k * channels + at));
        let bias = lane(bias, at);
        for (row, out) in out.chunks_exact_mut(cols * channels).enumerate() {
            let lines: [&[f32]; 3] = std::array::from_fn(|r| &z[(row + r) * wide..][..wide]);
            for (col, out) in out.chunks_exact_mut(channels).enumerate() {
                let mut sum = bias;
                for (r, line) in lines.iter().enumerate() {
                    for c in 0..3 {
                        let z = lane(line, (col + c) * channels + at);
                        sum = std::array::from_fn(|l| w[3 * r + c][l].mul_add(z[l], sum[l]));
                    }
                }
                out[at..][..LANES].iter_mut().zip(sum).for_each(|(out, sum)| *out = sum.max(0.0));
            }
        }
    }
}

/// For `line`, which has `width` numbers for each of the samples `y`, and for each place k: s = the numbers at k +
/// `side` less those at k; |s|² and s·y over the samples. There is a lane of places more in a line than are asked for.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn span_products(
    line: &[f32],
    width: usize,
    side: usize,
    y: &[f32],
    squares: &mut [f32],
    along: &mut [f32],
) {
    let places = squares.len().min(along.len());
    let mut at = 0;
    while at < places {
        let (squares, along) = (&mut squares[at..], &mut along[at..]);
        if places - at > LANES {
            spans::<2>(&line[at..], width, side, y, squares, along);
            at += 2 * LANES;
        } else {
            spans::<1>(&line[at..], width, side, y, squares, along);
            at += LANES;
        }
    }
}

#[inline(always)]
fn spans<const G: usize>(line: &[f32], width: usize, side: usize, y: &[f32], squares: &mut [f32], along: &mut [f32]) {
    let (mut squared, mut sums) = ([[0.0; LANES]; G], [[0.0; LANES]; G]);
    for (line, y) in line.chunks(width).zip(y) {
        for g in 0..G {
            let (from, to) = (lane(line, g * LANES), lane(line, g * LANES + side));
            let s: Lane = std::array::from_fn(|l| to[l] - from[l]);
            squared[g] = std::array::from_fn(|l| s[l].mul_add(s[l], squared[g][l]));
            sums[g] = add(sums[g], *y, s);
        }
    }
    for (out, found) in [(squares, squared), (along, sums)] {
        out.iter_mut().zip(found.as_flattened()).for_each(|(out, v)| *out = *v);
    }
}

/// Of rectangles with the sums |s|² and s·y: `spread` = c + share |s|², `height` = share max(s·y, 0) / `spread` and
/// `explained` = `height` s·y `scale`; the largest one is returned.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn explain(
    spread: &mut [f32],
    height: &mut [f32],
    explained: &mut [f32],
    shares: &[f32],
    [c, scale]: [f32; 2],
) -> f32 {
    for (((spread, height), explained), share) in spread.iter_mut().zip(height).zip(&mut *explained).zip(shares) {
        let product = height.max(0.0);
        *spread = share.mul_add(*spread, c);
        *height = share * product / *spread;
        *explained = *height * product * scale;
    }
    explained.iter().fold(0.0, |most: f32, e| most.max(*e))
}

/// √(((1 − most) / (1 − e))ᵏ / spread) for every `e`, which is at most `most` < 1.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn likelihoods(e: &[f32], spread: &[f32], most: f32, count: usize, out: &mut [f32]) {
    // a lane at a time, so that the loop over the bits of the exponent is the outer one
    let whole = e.len() / LANES * LANES;
    for at in (0..whole).step_by(LANES) {
        let (e, spread) = (lane(e, at), lane(spread, at));
        let power = powers(std::array::from_fn(|l| (1.0 - most) / (1.0 - e[l])), count);
        out[at..][..LANES].iter_mut().zip(power.iter().zip(spread)).for_each(|(out, (p, s))| *out = (p / s).sqrt());
    }
    for at in whole..e.len() {
        let power = powers([(1.0 - most) / (1.0 - e[at]); LANES], count);
        out[at] = (power[0] / spread[at]).sqrt();
    }
}

#[inline(always)]
fn powers(mut base: Lane, mut count: usize) -> Lane {
    let mut power = [1.0; LANES];
    while count > 0 {
        if count % 2 == 1 {
            power = std::array::from_fn(|l| power[l] * base[l]);
        }
        base = std::array::from_fn(|l| base[l] * base[l]);
        count /= 2;
    }
    power
}
