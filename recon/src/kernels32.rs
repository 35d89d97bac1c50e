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
/// Spans of [`span_squares`] are shorter, the first eight shorter than `SHORT`; it reads so many numbers and a lane.
pub(crate) const LONG: usize = 128;
const SHORT: usize = 16;

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

/// The first lanes of `values`.
#[inline(always)]
fn lanes<const G: usize>(values: &[f32]) -> [Lane; G] {
    let mut lanes = [[0.0; LANES]; G];
    lanes.iter_mut().zip(values.as_chunks().0).for_each(|(lane, v)| *lane = *v);
    lanes
}

#[inline(always)]
fn total(v: Lane) -> f32 {
    let half: [f32; 4] = std::array::from_fn(|l| v[l] + v[l + 4]);
    (half[0] + half[2]) + (half[1] + half[3])
}

/// Rows of `n` values, times `scale`, as `n` slices of whole lanes, whose rest is to be zero before.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn transpose(values: &[f64], n: usize, scale: f64, out: &mut [f32]) {
    let lanes = out.len() / n;
    for (at, rows) in values.chunks(LANES * n).enumerate() {
        let slices = out.chunks_exact_mut(lanes).enumerate();
        if rows.len() == LANES * n {
            let rows: [&[f64]; LANES] = std::array::from_fn(|i| &rows[i * n..(i + 1) * n]);
            for (k, out) in slices {
                let column: [f64; LANES] = std::array::from_fn(|i| scale * rows[i][k]);
                out[at * LANES..(at + 1) * LANES].copy_from_slice(&column.map(single));
            }
        } else {
            for (k, out) in slices {
                let column = rows.iter().skip(k).step_by(n);
                out[at * LANES..].iter_mut().zip(column).for_each(|(out, v)| *out = single(scale * v));
            }
        }
    }
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
        for i in (0..width).step_by(LANES) {
            let mut j = i;
            while j < width {
                j += if width - j < 2 * LANES {
                    outer_tile::<LANES, 1>(a, b, [i, j, width], out)
                } else {
                    outer_tile::<ROWS, 2>(a, b, [i, j, width], out);
                    outer_tile::<ROWS, 2>(a, b, [i + ROWS, j, width], out)
                };
            }
        }
    }
}

/// Adds to `G` lanes of `R` rows of the sums, from row i and column j on; returns how many columns they are.
#[inline(always)]
fn outer_tile<const R: usize, const G: usize>(
    a: &[f32],
    b: &[f32],
    [i, j, width]: [usize; 3],
    out: &mut [f32],
) -> usize {
    let mut sums = [[[0.0; LANES]; G]; R];
    // said here, so that the loop has no checks
    if i + R > width || j + G * LANES > width {
        return G * LANES;
    }
    sums.iter_mut().zip(out[i * width..].chunks_exact(width)).for_each(|(sums, out)| *sums = lanes(&out[j..]));
    for (a, b) in a.chunks_exact(width).zip(b.chunks_exact(width)) {
        let b: [Lane; G] = lanes(&b[j..j + G * LANES]);
        for (a, sums) in a[i..i + R].iter().zip(&mut sums) {
            for (sum, b) in sums.iter_mut().zip(b) {
                *sum = add(*sum, *a, b);
            }
        }
    }
    for (out, sums) in out[i * width..].chunks_exact_mut(width).zip(&sums) {
        out[j..j + G * LANES].copy_from_slice(sums.as_flattened());
    }
    G * LANES
}

/// `to[r]` = Σ matrix[r, r'] `from[r']` for the slices of `from`, which are of `width`; there are as many `r'` as
/// `size`. Zeros at the ends of a row of the matrix are skipped.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn apply(from: &[f32], matrix: &[f32], [size, width]: [usize; 2], to: &mut [f32]) {
    let mut at = 0;
    // some lanes of all slices at a time, which stay in the first cache
    while at < width {
        let lanes = ((width - at) / LANES).min(4);
        for (to, row) in to.chunks_exact_mut(width).zip(matrix.chunks_exact(size)) {
            let first = row.iter().position(|w| *w != 0.0).unwrap_or(0);
            let end = row.iter().rposition(|w| *w != 0.0).map_or(0, |last| last + 1);
            let (row, from, to) = (&row[first..end], &from[first * width..], &mut to[at..]);
            match lanes {
                0 => to[0] = row.iter().zip(from.chunks(width)).fold(0.0, |sum, (w, from)| w.mul_add(from[at], sum)),
                1 => combine::<1>(row, from, at, width, to),
                2 => combine::<2>(row, from, at, width, to),
                3 => combine::<3>(row, from, at, width, to),
                _ => combine::<4>(row, from, at, width, to),
            }
        }
        at += (lanes * LANES).max(1);
    }
}

/// Σ wₖ of `G` lanes of the slices of `from`, from `at` on.
#[inline(always)]
fn combine<const G: usize>(weights: &[f32], from: &[f32], at: usize, width: usize, out: &mut [f32]) {
    let mut sums = [[0.0; LANES]; G];
    if at + G * LANES > width {
        return;
    }
    for (&w, from) in weights.iter().zip(from.chunks_exact(width)) {
        let from: [Lane; G] = lanes(&from[at..at + G * LANES]);
        for (sum, v) in sums.iter_mut().zip(from) {
            *sum = add(*sum, w, v);
        }
    }
    out[..G * LANES].copy_from_slice(sums.as_flattened());
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
    let taxels = out.len() / outputs;
    let mut first = 0;
    while first < taxels {
        let (inputs, out) = (&inputs[first * count..], &mut out[first * outputs..]);
        first += match taxels - first {
            1 => affine_taxels::<1>(inputs, weights, bias, least, out),
            2 => affine_taxels::<2>(inputs, weights, bias, least, out),
            _ => affine_taxels::<3>(inputs, weights, bias, least, out),
        };
    }
}

/// All outputs of the first `T` taxels; returns `T`.
#[inline(always)]
fn affine_taxels<const T: usize>(inputs: &[f32], weights: &[f32], bias: &[f32], least: f32, out: &mut [f32]) -> usize {
    let mut at = 0;
    while at < bias.len() {
        at += match (bias.len() - at) / LANES {
            1 => affine_tile::<T, 1>(inputs, weights, bias, at, least, out),
            2 => affine_tile::<T, 2>(inputs, weights, bias, at, least, out),
            _ => affine_tile::<T, 3>(inputs, weights, bias, at, least, out),
        };
    }
    T
}

/// `G` lanes of outputs from `at` on, of `T` taxels; returns how many outputs they are.
#[inline(always)]
fn affine_tile<const T: usize, const G: usize>(
    inputs: &[f32],
    weights: &[f32],
    bias: &[f32],
    at: usize,
    least: f32,
    out: &mut [f32],
) -> usize {
    let (outputs, end) = (bias.len(), at + G * LANES);
    let count = weights.len() / outputs;
    let mut rows: [&[f32]; T] = [&[]; T];
    rows.iter_mut().zip(inputs.chunks_exact(count)).for_each(|(row, inputs)| *row = inputs);
    // said here, so that the loop has no checks
    if end > outputs || rows.iter().any(|row| row.len() != count) {
        return G * LANES;
    }
    let mut sums: [[Lane; G]; T] = [lanes(&bias[at..end]); T];
    for (k, w) in (0..count).zip(weights.chunks_exact(outputs)) {
        let w: [Lane; G] = lanes(&w[at..end]);
        for (sums, row) in sums.iter_mut().zip(rows) {
            for (sum, w) in sums.iter_mut().zip(w) {
                *sum = add(*sum, row[k], w);
            }
        }
    }
    for (out, sums) in out.chunks_exact_mut(outputs).zip(&sums) {
        out[at..end].iter_mut().zip(sums.as_flattened()).for_each(|(out, sum)| *out = sum.max(least));
    }
    G * LANES
}

/// max(0, D ∗ z + b) in every channel for a row of the grid, D being 9 × channels, a multiple of [`LANES`]. `z` are the
/// row and its two neighbours, with a slice of channels more at both ends than `out` has.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn around(z: &[f32], weights: &[f32], bias: &[f32], out: &mut [f32]) {
    let (channels, cols) = (bias.len(), out.len() / bias.len());
    let wide = (cols + 2) * channels;
    for at in (0..channels).step_by(LANES) {
        let w: [Lane; 9] = std::array::from_fn(|k| lane(weights, k * channels + at));
        let bias = lane(bias, at);
        let mut col = 0;
        while col < cols {
            let (z, out) = (&z[col * channels + at..], &mut out[col * channels + at..]);
            col += match cols - col {
                1 => around_tile::<1>(z, [channels, wide], &w, bias, out),
                2 | 3 => around_tile::<2>(z, [channels, wide], &w, bias, out),
                _ => around_tile::<ROWS>(z, [channels, wide], &w, bias, out),
            };
        }
    }
}

/// A lane of channels of the first `T` taxels; returns `T`.
#[inline(always)]
fn around_tile<const T: usize>(
    z: &[f32],
    [channels, wide]: [usize; 2],
    w: &[Lane; 9],
    bias: Lane,
    out: &mut [f32],
) -> usize {
    let mut sums = [bias; T];
    for r in 0..3 {
        for place in 0..T + 2 {
            let z = lane(z, r * wide + place * channels);
            for c in 0..3 {
                if let Some(sum) = place.checked_sub(c).and_then(|t| sums.get_mut(t)) {
                    *sum = std::array::from_fn(|l| w[3 * r + c][l].mul_add(z[l], sum[l]));
                }
            }
        }
    }
    for (t, sum) in sums.iter().enumerate() {
        let out = &mut out[t * channels..][..LANES];
        out.iter_mut().zip(sum).for_each(|(out, sum)| *out = sum.max(0.0));
    }
    T
}

/// For the lines `below` less `above`, which have `width` numbers for each sample, for all `sides` and for the places k
/// from 0 to `cols` − side: |s|² over the samples, s being the numbers at k + side less those at k. Sides ascend and
/// are shorter than [`LONG`], the first eight shorter than [`SHORT`]. `found` has whole lanes of `cols` places for
/// each.
/// `line` becomes the difference, and has [`LONG`] numbers more.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn span_squares(
    [above, below]: [&[f32]; 2],
    line: &mut [f32],
    width: usize,
    cols: usize,
    sides: &[Side],
    found: &mut [f32],
) {
    line.iter_mut().zip(below.iter().zip(above)).for_each(|(v, (below, above))| *v = below - above);
    let places = cols.next_multiple_of(LANES);
    for at in (0..cols).step_by(LANES) {
        let fitting = &sides[..sides.partition_point(|side| at + side.length <= cols)];
        let (short, long) = fitting.split_at(fitting.len().min(8));
        let (line, end) = (&line[at..], above.len() - at);
        let (found, found_long) = found[at..].split_at_mut(places * short.len());
        match short.len() {
            0 => {}
            1 | 2 => squares::<2, SHORT>(line, [width, end], short, places, found),
            3 | 4 => squares::<4, SHORT>(line, [width, end], short, places, found),
            _ => squares::<8, SHORT>(line, [width, end], short, places, found),
        }
        match long.len() {
            0 => {}
            1 | 2 => squares::<2, LONG>(line, [width, end], long, places, found_long),
            _ => squares::<6, LONG>(line, [width, end], long, places, found_long),
        }
    }
}

/// A lane of places for `sides`, at most `G` and shorter than `LIMIT`, a power of two.
#[inline(always)]
fn squares<const G: usize, const LIMIT: usize>(
    line: &[f32],
    [width, end]: [usize; 2],
    sides: &[Side],
    places: usize,
    found: &mut [f32],
) {
    let mut lengths = [0; G];
    lengths.iter_mut().zip(sides).for_each(|(length, side)| *length = side.length);
    let mut sums = [[0.0; LANES]; G];
    for start in (0..end).step_by(width) {
        let Some(line) = line.get(start..start + LIMIT + LANES) else { break };
        let from = lane(line, 0);
        for (sum, length) in sums.iter_mut().zip(lengths) {
            // said here, so that there is no check
            let to = lane(line, length % LIMIT);
            let s: Lane = std::array::from_fn(|l| to[l] - from[l]);
            *sum = std::array::from_fn(|l| s[l].mul_add(s[l], sum[l]));
        }
    }
    for ((found, sum), _) in found.chunks_mut(places).zip(sums).zip(sides) {
        found[..LANES].copy_from_slice(&sum);
    }
}

/// Length of spans, taxels, and how far they lie apart.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Side {
    pub(crate) length: usize,
    pub(crate) step: usize,
}

/// What the samples say of the rectangles between two rows: `out` becomes c + share |s|², infinite beyond the last one,
/// then share max(s·y, 0) over that, the height, then height s·y `scale`, the part that it explains; each of them as
/// long as `shares`, whole lanes. Their |s|² are what [`span_squares`] has `found`, their s·y differences of `along`,
/// the sums of Φᵀy over the taxels to the left. The largest part is returned.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn explain(
    found: &[f32],
    along: &[f64],
    sides: &[Side],
    shares: &[f32],
    [c, scale]: [f32; 2],
    out: &mut [f32],
) -> f32 {
    let (spread, out) = out.split_at_mut(shares.len());
    let (height, explained) = out.split_at_mut(shares.len());
    let cols = along.len() - 1;
    let mut first = 0;
    for (found, &Side { length, step }) in found.chunks_exact(cols.next_multiple_of(LANES)).zip(sides) {
        let count = (cols - length) / step + 1;
        let own = spread[first..].iter_mut().zip(&mut height[first..]);
        let products = along[length..].iter().zip(along).map(|(to, from)| single(to - from));
        let values = found.iter().copied().zip(products);
        let set = |((square, product), found): ((&mut f32, &mut f32), (f32, f32))| (*square, *product) = found;
        match step {
            1 => own.zip(values).for_each(set),
            _ => own.zip(values.step_by(step)).for_each(set),
        }
        first += count;
    }
    spread[first..].fill(0.0);
    height[first..].fill(0.0);
    let mut most = [0.0_f32; LANES];
    for (((spread, height), explained), share) in spread
        .as_chunks_mut::<LANES>()
        .0
        .iter_mut()
        .zip(height.as_chunks_mut::<LANES>().0)
        .zip(explained.as_chunks_mut::<LANES>().0)
        .zip(shares.as_chunks::<LANES>().0)
    {
        for l in 0..LANES {
            let product = height[l].max(0.0);
            spread[l] = share[l].mul_add(spread[l], c);
            height[l] = share[l] * product / spread[l];
            explained[l] = height[l] * product * scale;
            most[l] = most[l].max(explained[l]);
        }
    }
    spread[first..].fill(f32::INFINITY);
    most.iter().fold(0.0, |most: f32, e| most.max(*e))
}

/// Weighs the `rectangles` between two rows, of which [`explain`] has told spread, height and e: p = √(((1 − most)/(1 −
/// e))ᵏ / spread), 0 where it is below `least`; no e is above `most` < 1. Adds p and p times the height to the maps of
/// `top`, and takes them from those of `bottom`; returns Σ p, Σ p e and Σ p `log`.
#[multiversion(targets("x86_64+avx512f+fma", "x86_64+avx2+fma", "aarch64+neon"))]
pub(crate) fn weigh(
    rectangles: &[f32],
    logs: &[f32],
    [most, least]: [f32; 2],
    k: usize,
    top: [&mut [f32]; 2],
    bottom: [&mut [f32]; 2],
) -> [f32; 3] {
    let (spread, rest) = rectangles.split_at(logs.len());
    let (height, explained) = rest.split_at(logs.len());
    let (mut total_p, mut total_e, mut total_log) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
    for at in (0..spread.len()).step_by(LANES) {
        let (spread, e, height, log) = (lane(spread, at), lane(explained, at), lane(height, at), lane(logs, at));
        let power = powers(std::array::from_fn(|l| (1.0 - most) / (1.0 - e[l])), k);
        let weight: Lane = std::array::from_fn(|l| (power[l] / spread[l]).sqrt());
        let p: Lane = std::array::from_fn(|l| if weight[l] < least { 0.0 } else { weight[l] });
        total_p = std::array::from_fn(|l| total_p[l] + p[l]);
        total_e = std::array::from_fn(|l| p[l].mul_add(e[l], total_e[l]));
        total_log = std::array::from_fn(|l| p[l].mul_add(log[l], total_log[l]));
        let values: [Lane; 2] = [p, std::array::from_fn(|l| p[l] * height[l])];
        for (map, value) in values.iter().enumerate() {
            top[map][at..][..LANES].iter_mut().zip(value).for_each(|(sum, v)| *sum += v);
            bottom[map][at..][..LANES].iter_mut().zip(value).for_each(|(sum, v)| *sum -= v);
        }
    }
    [total(total_p), total(total_e), total(total_log)]
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
