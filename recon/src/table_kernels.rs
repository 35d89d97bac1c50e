//! Inner loop of [`SignTables`](crate::SignTables): sums of table rows. The bits do not depend on the chosen
//! instruction set.

use multiversion::multiversion;

/// Weights of one look-up: the bits of a byte.
pub(crate) const GROUP: usize = 8;

/// Table rows of one group of weights.
pub(crate) const ENTRIES: usize = 1 << GROUP;

/// Sums `B` columns from `c` of the table rows that the bytes of `signs` choose.
#[inline(always)]
fn block<T: Gather, const B: usize>(values: &[T], signs: &[u64], groups: usize, ncols: usize, c: usize) -> [T; B] {
    let mut sums = [T::default(); B];
    for (group, table) in values.chunks_exact(ENTRIES * ncols).take(groups).enumerate() {
        let byte = (signs[group / 8] >> (8 * (group % 8))) & 0xff;
        let start = byte as usize * ncols + c;
        if let Some(row) = table.get(start..).and_then(<[T]>::first_chunk::<B>) {
            for (sum, &v) in sums.iter_mut().zip(row) {
                *sum += v;
            }
        }
    }
    sums
}

/// Rows of Φ·D: `words` words of `signs` and `ncols` numbers of `out` each.
#[inline(always)]
fn gather_of<T: Gather>(values: &[T], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
    for (signs, out) in signs.chunks_exact(words).zip(out.chunks_exact_mut(ncols)) {
        let mut c = 0;
        let (wide, rest) = out.as_chunks_mut::<64>();
        for out in wide {
            *out = block::<T, 64>(values, signs, groups, ncols, c).map(Into::into);
            c += 64;
        }
        let (blocks, rest) = rest.as_chunks_mut::<32>();
        for out in blocks {
            *out = block::<T, 32>(values, signs, groups, ncols, c).map(Into::into);
            c += 32;
        }
        let (fours, rest) = rest.as_chunks_mut::<4>();
        for out in fours {
            *out = block::<T, 4>(values, signs, groups, ncols, c).map(Into::into);
            c += 4;
        }
        for out in rest {
            [*out] = block::<T, 1>(values, signs, groups, ncols, c).map(Into::into);
            c += 1;
        }
    }
}

/// Precision of the tables, with its own compiled loop.
pub trait Gather: Copy + Default + Into<f64> + std::ops::AddAssign {
    /// The nearest number of this precision.
    fn nearest(value: f64) -> Self;

    /// Rows of Φ·D from tables: `words` words of `signs` and `ncols` numbers of `out` each, `groups` look-ups a row.
    fn gather(values: &[Self], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]);
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn gather_f32(values: &[f32], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
    gather_of(values, signs, words, groups, ncols, out);
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn gather_f64(values: &[f64], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
    gather_of(values, signs, words, groups, ncols, out);
}

impl Gather for f32 {
    #[expect(clippy::cast_possible_truncation, reason = "rounding is what is asked for")]
    fn nearest(value: f64) -> Self {
        value as Self
    }

    fn gather(values: &[Self], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
        gather_f32(values, signs, words, groups, ncols, out);
    }
}

impl Gather for f64 {
    fn nearest(value: f64) -> Self {
        value
    }

    fn gather(values: &[Self], signs: &[u64], words: usize, groups: usize, ncols: usize, out: &mut [f64]) {
        gather_f64(values, signs, words, groups, ncols, out);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let (groups, words, ncols) = (9, 2, 71);
        let values: Vec<f64> = (0..groups * ENTRIES * ncols).map(|i| (0.37 * i as f64).sin()).collect();
        let signs = [0x0123_4567_89ab_cdef, 0xfe, 0xf0f0_0f0f_aa55_1234, 0x3c];
        let (mut chosen, mut plain) = (vec![f64::NAN; 2 * ncols], vec![f64::NAN; 2 * ncols]);
        f64::gather(&values, &signs, words, groups, ncols, &mut chosen);
        gather_of(&values, &signs, words, groups, ncols, &mut plain);
        assert!(chosen.iter().zip(&plain).all(|(a, b)| a.to_bits() == b.to_bits()));
        let values: Vec<f32> = values.iter().map(|&v| f32::nearest(v)).collect();
        f32::gather(&values, &signs, words, groups, ncols, &mut chosen);
        gather_of(&values, &signs, words, groups, ncols, &mut plain);
        assert!(chosen.iter().zip(&plain).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
