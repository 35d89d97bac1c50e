//! Least-squares fits of the image in windows of a recording, and what of their residual the memory explains.

use super::statistics::robust_sd;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use spts_circuit::{Recording, WeightMode, WeightRows};
use std::ops::Range;

/// Number of robust standard deviations beyond which a value is an outlier.
pub(super) const OUTLIER_SD: f64 = 5.0;

/// Number of frames in a window. An image of 100 taxels from 2500 measurements has a noise of σ/√2500 a taxel, which
/// adds 4 % to the variance of the predicted output. During 25 frames (39 ms) creep changes the image by less than
/// that.
pub const WINDOW_FRAMES: usize = 25;

/// One window and what was fitted to it.
#[derive(Debug, Clone)]
pub(crate) struct FitWindow {
    /// Row of its first measurement.
    pub(crate) first_row: u64,
    /// Weights.
    pub(crate) design: Design,
    /// Image, V a taxel.
    pub(crate) image: Vec<f64>,
    /// Constant c, V.
    pub(crate) offset_v: f64,
    /// Half the difference between even and odd rows, V; 0 if it was not fitted.
    pub(crate) parity_v: f64,
    /// y − Φx − c, V; NaN for a lost sample.
    pub(crate) residual_v: Vec<f64>,
    /// Φx, V.
    pub(crate) model_v: Vec<f64>,
    /// √(1 − p/n): share of the noise that remains in the residual when p coefficients are fitted to n measurements.
    pub(crate) left_over: f64,
}

/// Fits windows of `window` frames within the `frames` of a block; twice, the second time without the outliers of the
/// first. A window that does not determine its image is left out. The cells `reseeded` have another seed; with
/// `parity`, even and odd rows may differ.
pub(crate) fn fit_windows(
    recording: &Recording,
    block: usize,
    reseeded: &[Reseeded],
    parity: bool,
    frames: Range<usize>,
    window: usize,
) -> Vec<FitWindow> {
    let per_frame = recording.measurements_per_frame();
    let volts = &recording.blocks()[block].volts;
    let starts = frames.clone().step_by(window.max(1)).filter(|start| start + window <= frames.end);
    starts
        .filter_map(|start| {
            let measurements = start * per_frame..(start + window) * per_frame;
            let rows = recording.rows(block, measurements.clone());
            let design = Design::new(rows, reseeded, parity)?;
            fit(design, &volts[measurements], recording.taxels(), rows.first_row())
        })
        .collect()
}

fn fit(design: Design, y: &[f64], taxels: usize, first_row: u64) -> Option<FitWindow> {
    let finite: Vec<bool> = y.iter().map(|v| v.is_finite()).collect();
    let first = design.solve(y, &finite)?;
    let residual = |coefficients: &[f64]| -> Vec<f64> {
        let model = design.apply(coefficients);
        y.iter().zip(model).map(|(y, m)| y - m).collect()
    };
    let rough = residual(&first);
    let limit = OUTLIER_SD * robust_sd(&rough)?;
    // a residual of exactly 0 is kept: a noiseless recording has a limit of 0
    let kept: Vec<bool> = rough.iter().map(|r| r.abs() <= limit.max(f64::MIN_POSITIVE)).collect();
    let coefficients = design.solve(y, &kept).unwrap_or(first);
    let left_over = (1.0 - design.count as f64 / design.len as f64).max(0.0).sqrt();
    Some(FitWindow {
        first_row,
        residual_v: residual(&coefficients),
        model_v: design.apply(&coefficients[..taxels]),
        image: coefficients[..taxels].to_vec(),
        offset_v: coefficients[taxels],
        parity_v: coefficients.get(taxels + 1).copied().unwrap_or(0.0),
        left_over,
        design,
    })
}

/// A cell that runs with a seed other than its address.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Reseeded {
    /// Taxel, from 0, row-major.
    pub taxel: u32,
    /// Seed of its generator.
    pub seed: u32,
}

/// Columns of ±1, one bit a measurement: every taxel, then the constant, then the parity of the row.
///
/// Products of such columns are counts of equal bits: aᵀb = n − 2·popcount(a ⊕ b).
#[derive(Debug, Clone)]
pub(crate) struct Design {
    len: usize,
    words: usize,
    columns: Vec<u64>,
    count: usize,
}

impl Design {
    /// Columns of the measurements of `weights`; `parity` adds the column that alternates with the row. `None` for
    /// weights that are not binary.
    fn new(weights: WeightRows<'_>, reseeded: &[Reseeded], parity: bool) -> Option<Self> {
        let (taxels, first_row, len) = (weights.taxels(), weights.first_row(), weights.len());
        let words = len.div_ceil(64);
        let count = taxels + 1 + usize::from(parity);
        let mut columns = vec![0_u64; words * count];
        let row_words = taxels.div_ceil(64).max(1);
        let rows = weights.sign_bits()?;
        for (at, rows) in rows.chunks(64 * row_words).enumerate() {
            for word in 0..row_words {
                let mut block = [0; 64];
                let of_rows = rows.chunks_exact(row_words).map(|row| row[word]);
                block.iter_mut().zip(of_rows).for_each(|(bits, row)| *bits = row);
                transpose(&mut block);
                for (k, bits) in (64 * word..taxels).zip(block) {
                    columns[k * words + at] = bits;
                }
            }
        }
        let mut design = Self { len, words, columns, count };
        for cell in reseeded {
            design.fill(cell.taxel as usize, |i| {
                WeightMode::Binary.level_from_seed(cell.seed, first_row + i as u64) > 0.0
            });
        }
        design.fill(taxels, |_| true);
        if parity {
            design.fill(taxels + 1, |i| (first_row + i as u64).is_multiple_of(2));
        }
        Some(design)
    }

    fn fill(&mut self, column: usize, is_plus: impl Fn(usize) -> bool) {
        let bits = &mut self.columns[column * self.words..(column + 1) * self.words];
        bits.fill(0);
        set_bits(bits, (0..self.len).filter(|i| is_plus(*i)));
    }

    fn column(&self, k: usize) -> &[u64] {
        &self.columns[k * self.words..(k + 1) * self.words]
    }

    /// True where taxel `k` has weight +1 at measurement `i`.
    #[inline]
    pub(super) fn is_plus(&self, k: usize, i: usize) -> bool {
        self.columns[k * self.words + i / 64] >> (i % 64) & 1 == 1
    }

    /// Number of measurements in `range` at which the weight of taxel `k` differs from the one before.
    pub(super) fn flips(&self, k: usize, range: Range<usize>) -> u32 {
        let (column, mut count, mut i) = (self.column(k), 0, range.start);
        while i < range.end {
            // those of a word together
            let (word, first) = (column[i / 64], i % 64);
            let before = if first == 0 { word << 1 | column[i / 64 - 1] >> 63 } else { word << 1 };
            let len = (64 - first).min(range.end - i);
            count += ((word ^ before) >> first & (!0 >> (64 - len))).count_ones();
            i += len;
        }
        count
    }

    /// Σₖ coefficientsₖ·columnₖ; fewer coefficients than columns leave the last columns out.
    fn apply(&self, coefficients: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; self.len];
        for (k, &c) in coefficients.iter().enumerate() {
            for (chunk, word) in out.chunks_mut(64).zip(self.column(k)) {
                for (i, v) in chunk.iter_mut().enumerate() {
                    *v += signed(c, word >> i & 1);
                }
            }
        }
        out
    }

    /// Coefficients with the least Σ (y − Φ·coefficients)² over the measurements that are `kept`; `None` when these do
    /// not determine them.
    fn solve(&self, y: &[f64], kept: &[bool]) -> Option<Vec<f64>> {
        let mut mask = vec![0_u64; self.words];
        set_bits(&mut mask, (0..self.len).filter(|i| kept[*i]));
        let count = |bits: &mut dyn Iterator<Item = u64>| bits.map(|w| f64::from(w.count_ones())).sum::<f64>();
        let n = count(&mut mask.iter().copied());
        let gram = DMatrix::from_fn(self.count, self.count, |i, j| {
            if j > i {
                return 0.0;
            }
            let pairs = self.column(i).iter().zip(self.column(j)).zip(&mask);
            n - 2.0 * count(&mut pairs.map(|((a, b), m)| (a ^ b) & m))
        });
        let kept_y: Vec<f64> = y.iter().zip(kept).map(|(v, k)| if *k { *v } else { 0.0 }).collect();
        let moments = DVector::from_fn(self.count, |k, _| self.dot(k, &kept_y));
        // only the lower triangle is read
        Some(gram.cholesky()?.solve(&moments).as_slice().to_vec())
    }

    /// columnₖ · y.
    fn dot(&self, k: usize, y: &[f64]) -> f64 {
        let mut sum = 0.0;
        for (chunk, word) in y.chunks(64).zip(self.column(k)) {
            for (i, v) in chunk.iter().enumerate() {
                sum += signed(*v, word >> i & 1);
            }
        }
        sum
    }
}

/// Transposes a square of bits: bit i of word k becomes bit k of word i (H. S. Warren, Hacker's Delight, 7-3).
fn transpose(bits: &mut [u64; 64]) {
    let (mut half, mut mask) = (32, u64::MAX >> 32);
    while half > 0 {
        for k in (0..64).filter(|k| k & half == 0) {
            let swapped = (bits[k] >> half ^ bits[k + half]) & mask;
            bits[k] ^= swapped << half;
            bits[k + half] ^= swapped;
        }
        half /= 2;
        mask ^= mask << half;
    }
}

fn set_bits(words: &mut [u64], which: impl Iterator<Item = usize>) {
    which.for_each(|i| words[i / 64] |= 1 << (i % 64));
}

/// `v` where the bit is 1, −`v` where it is 0.
#[inline]
fn signed(v: f64, bit: u64) -> f64 {
    f64::from_bits(v.to_bits() ^ ((bit ^ 1) << 63))
}

/// Number of taps that are fitted; the third says whether two are enough.
pub(super) const TAPS: usize = 3;

/// Taps h₁, h₂, h₃ of the windows together, without outliers. The image's own fit takes the share p/n of any
/// disturbance; that share is put back.
pub(super) fn taps(windows: &[FitWindow]) -> [f64; TAPS] {
    let (mut normal, mut moments) = (Matrix3::zeros(), Vector3::zeros());
    let mut left_over = 0.0;
    for window in windows {
        let limit = OUTLIER_SD * robust_sd(&window.residual_v).unwrap_or(0.0);
        for i in TAPS..window.residual_v.len() {
            let r = window.residual_v[i];
            // NaN, a lost sample, is not within the limit
            if r.abs() <= limit {
                let past = Vector3::new(window.model_v[i - 1], window.model_v[i - 2], window.model_v[i - 3]);
                normal += past * past.transpose();
                moments += past * r;
            }
        }
        left_over += window.left_over.powi(2);
    }
    let Some(factor) = normal.cholesky() else {
        return [0.0; TAPS];
    };
    let share = left_over / windows.len() as f64;
    (factor.solve(&moments) / share).into()
}

/// Residual of a window less what `taps` explain, V; the first [`TAPS`] measurements, whose past is outside, are left
/// out.
pub(super) fn without_memory(window: &FitWindow, taps: [f64; TAPS]) -> Vec<f64> {
    (TAPS..window.residual_v.len())
        .map(|i| {
            let past: f64 = (0..TAPS).map(|k| taps[k] * window.model_v[i - 1 - k]).sum();
            window.residual_v[i] - past
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Seeding, Weights};

    /// A noiseless run gives its image back, whatever measurements are left out, as long as enough are left.
    #[test]
    fn an_exact_run_is_solved_exactly() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
        let design =
            Design::new(WeightRows::new(&weights, 12_345, 1000), &[Reseeded { taxel: 7, seed: 2 }], true).unwrap();
        let image: Vec<f64> = (0..102).map(|k| f64::from(k % 7) * 0.1 - 0.2).collect();
        let y = design.apply(&image);
        let kept: Vec<bool> = (0..1000).map(|i| i % 5 != 3).collect();
        let found = design.solve(&y, &kept).unwrap();
        // condition number of 800 near-orthogonal rows below 10, sums of 1000 terms below 10: 1e-11 is a hundred times
        // that
        for (a, b) in found.iter().zip(&image) {
            assert!((a - b).abs() < 1e-11, "{a} against {b}");
        }
        // the packed columns are the weights themselves
        for (k, i) in [(0, 0), (99, 999), (50, 64)] {
            assert_eq!(design.is_plus(k, i), weights.level(u32::try_from(k).unwrap(), 12_345 + i as u64) > 0.0);
        }
        assert_eq!(design.is_plus(7, 5), WeightMode::Binary.level_from_seed(2, 12_350) > 0.0);
        for range in [1..1000, 20..64, 64..129, 77..78, 90..90] {
            let flips = range.clone().filter(|i| design.is_plus(3, *i) != design.is_plus(3, i - 1)).count();
            assert_eq!(design.flips(3, range) as usize, flips);
        }
    }

    #[test]
    fn too_few_measurements_determine_nothing() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
        let design = Design::new(WeightRows::new(&weights, 0, 90), &[], false).unwrap();
        assert!(design.solve(&[0.0; 90], &[true; 90]).is_none());
    }
}
