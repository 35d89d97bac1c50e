//! Estimates from one press.

use super::cells::Overdriven;
use super::late::{Counts, Late};
use super::statistics::{OUTLIER_SD, TAPS, kurtosis, mean, robust_sd, sd, taps, without_memory};
use nalgebra::{DMatrix, DVector};
use spts_circuit::{Recording, WeightMode, WeightRows};
use std::ops::Range;

/// Estimates from one press, in V unless stated otherwise. "Residual" is the residual of a least-squares fit of image
/// and constant on the plateau. "Clean" is the residual minus memory, and minus the contributions of cells that are not
/// binary.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct PressNumbers {
    /// Mean with nothing on the skin.
    pub idle_mean_v: f64,
    /// Standard deviation with nothing on the skin.
    pub idle_sd_v: f64,
    /// Noise floor: standard deviation with nothing on the skin, after subtracting image, constant and parity of the
    /// row.
    pub idle_noise_v: f64,
    /// Half the difference between even and odd rows with nothing on the skin.
    pub idle_parity_v: f64,
    /// Σx with nothing on the skin.
    pub idle_sum_v: f64,
    /// Root mean square of the residual.
    pub residual_v: f64,
    /// Root mean square of the clean residual.
    pub clean_v: f64,
    /// Standard deviation of the clean residual's core, from the median absolute value.
    pub core_v: f64,
    /// First tap of the memory.
    pub h1: f64,
    /// Second tap.
    pub h2: f64,
    /// Third tap.
    pub h3: f64,
    /// Constant c of the fit.
    pub offset_v: f64,
    /// Half the difference between even and odd rows.
    pub parity_v: f64,
    /// Σx.
    pub sum_v: f64,
    /// ‖x‖₂.
    pub norm_v: f64,
    /// Constant part of the drive offset: c = (1 + h1 + h2)·(constant + asymmetry·Σx), with and without contact; 1 + h1
    /// + h2 is the memory's gain for constant signals. NaN without contact.
    pub constant_v: f64,
    /// Part of the drive offset that is proportional to Σx: (c − idle c)/((1 + h1 + h2)·(Σx − idle Σx)). NaN without
    /// contact.
    pub asymmetry: f64,
    /// Share of clean residuals beyond 5 standard deviations of the core.
    pub outliers: f64,
    /// Kurtosis of the clean residual.
    pub kurtosis: f64,
    /// Late updates divided by flips.
    pub late_per_flip: f64,
    /// Share of outliers that are not late updates.
    pub unexplained: f64,
    /// Noise that grows with the contact, relative to ‖x‖₂: √(core² − idle noise²)/‖x‖₂. NaN without contact.
    pub contact_fraction: f64,
}

/// One press, analysed.
#[derive(Debug, Clone)]
pub(super) struct PressAnalysis {
    /// Its numbers.
    pub(super) numbers: PressNumbers,
    /// Mean image of the plateau, V.
    pub(super) image: Vec<f64>,
    /// Flips and late flips of every taxel.
    pub(super) late: Vec<Counts>,
    /// Late flips: taxel and row.
    pub(super) events: Vec<(usize, u64)>,
    /// Clean residual, V.
    pub(super) clean_v: Vec<f64>,
}

/// Analyses one press, steady in the frames `hold`; `None` when they do not determine an image.
pub(super) fn analyse(
    recording: &Recording,
    hold: &Range<usize>,
    block: usize,
    reseeded: &[Reseeded],
    overdriven: &[Overdriven],
) -> Option<PressAnalysis> {
    let ask = FitRequest {
        block,
        reseeded,
        parity: true,
    };
    let idle_frames = recording.blocks()[block].idle_frames?;
    let idle = fit_windows(recording, ask, 0..idle_frames, idle_frames).pop()?;
    let windows = fit_windows(recording, ask, hold.clone(), WINDOW_FRAMES);
    let taxels = windows.first()?.image.len();
    let whole = |window: &FitWindow| {
        let left_over = window.left_over;
        // what the fit took out of the noise is put back: every window then has the noise's own standard deviation
        move |v: f64| v / left_over
    };
    let residual_v: Vec<f64> = windows
        .iter()
        .flat_map(|w| w.residual_v.iter().copied().map(whole(w)))
        .collect();
    let windows: Vec<FitWindow> = windows.into_iter().map(|w| without_overdriven(w, overdriven)).collect();
    let taps = taps(&windows);
    let mut clean_v = Vec::new();
    for window in &windows {
        let whole = whole(window);
        clean_v.extend(without_memory(window, taps).into_iter().map(whole));
    }
    let core_v = robust_sd(&clean_v)?;
    let over_windows = |get: &dyn Fn(&FitWindow) -> f64| mean(&windows.iter().map(get).collect::<Vec<_>>());
    let image: Vec<f64> = (0..taxels).map(|k| over_windows(&|w| w.image[k])).collect();
    let mut late = Late::new(core_v, taxels);
    let mut rest = clean_v.as_slice();
    for window in &windows {
        let (of_window, after) = rest.split_at(window.residual_v.len() - TAPS);
        late.add(window, of_window);
        rest = after;
    }
    let idle_volts = &recording.blocks()[block].volts[..idle_frames * recording.measurements_per_frame()];
    let idle_noise_v = sd(&idle.residual_v) / idle.left_over;
    let numbers = PressNumbers {
        idle_mean_v: mean(idle_volts),
        idle_sd_v: sd(idle_volts),
        idle_noise_v,
        idle_parity_v: idle.parity_v,
        idle_sum_v: idle.image.iter().sum(),
        residual_v: sd(&residual_v),
        clean_v: sd(&clean_v),
        core_v,
        h1: taps[0],
        h2: taps[1],
        h3: taps[2],
        offset_v: over_windows(&|w| w.offset_v),
        parity_v: over_windows(&|w| w.parity_v),
        sum_v: image.iter().sum(),
        norm_v: image.iter().map(|x| x * x).sum::<f64>().sqrt(),
        constant_v: f64::NAN,
        asymmetry: f64::NAN,
        outliers: share_beyond(&clean_v, OUTLIER_SD * core_v),
        kurtosis: kurtosis(&clean_v),
        late_per_flip: late.per_flip(),
        unexplained: late.unexplained(),
        contact_fraction: f64::NAN,
    };
    Some(PressAnalysis {
        numbers: with_ratios(numbers, &idle),
        image,
        late: late.cells(),
        events: late.events,
        clean_v,
    })
}

/// The window less what `cells` add beyond ±1.
fn without_overdriven(mut window: FitWindow, cells: &[Overdriven]) -> FitWindow {
    for cell in cells {
        let binary_v = window.image[cell.taxel as usize];
        let extra = cell.beyond_binary(binary_v, window.first_row, window.residual_v.len());
        window.residual_v.iter_mut().zip(extra).for_each(|(r, e)| *r -= e);
    }
    window
}

/// Fills in the numbers that need contact: the press must raise Σx, and reach an ‖x‖₂, by more than the noise of one
/// measurement.
fn with_ratios(n: PressNumbers, idle: &FitWindow) -> PressNumbers {
    let raised_v = n.sum_v - n.idle_sum_v;
    if raised_v <= n.core_v || n.norm_v <= n.core_v {
        return n;
    }
    // the drive's offset comes before the memory, c after it
    let passed = 1.0 + n.h1 + n.h2;
    let asymmetry = (n.offset_v - idle.offset_v) / (passed * raised_v);
    PressNumbers {
        asymmetry,
        constant_v: idle.offset_v / passed - asymmetry * n.idle_sum_v,
        contact_fraction: (n.core_v.powi(2) - n.idle_noise_v.powi(2)).max(0.0).sqrt() / n.norm_v,
        ..n
    }
}

/// Share of the finite `values` whose absolute value is beyond `limit`.
fn share_beyond(values: &[f64], limit: f64) -> f64 {
    let beyond: Vec<f64> = values
        .iter()
        .filter(|v| v.is_finite())
        .map(|v| f64::from(v.abs() > limit))
        .collect();
    mean(&beyond)
}

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

/// What is fitted.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FitRequest<'a> {
    /// Block of the recording.
    pub(crate) block: usize,
    /// Cells with another seed.
    pub(crate) reseeded: &'a [Reseeded],
    /// Whether even and odd rows may differ.
    pub(crate) parity: bool,
}

/// Fits windows of `window` frames within `frames`; twice, the second time without the outliers of the first. A window
/// that does not determine its image is left out.
pub(crate) fn fit_windows(
    recording: &Recording,
    ask: FitRequest<'_>,
    frames: Range<usize>,
    window: usize,
) -> Vec<FitWindow> {
    let per_frame = recording.measurements_per_frame();
    let volts = &recording.blocks()[ask.block].volts;
    let starts = frames
        .clone()
        .step_by(window.max(1))
        .filter(|start| start + window <= frames.end);
    starts
        .filter_map(|start| {
            let measurements = start * per_frame..(start + window) * per_frame;
            let rows = recording.rows(ask.block, measurements.clone());
            let design = Design::new(rows, ask.reseeded, ask.parity)?;
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
    let left_over = (1.0 - design.columns() as f64 / design.len() as f64).max(0.0).sqrt();
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
    pub(super) fn new(weights: WeightRows<'_>, reseeded: &[Reseeded], parity: bool) -> Option<Self> {
        let (taxels, first_row, len) = (weights.taxels(), weights.first_row(), weights.len());
        let words = len.div_ceil(64);
        let count = taxels + 1 + usize::from(parity);
        let mut columns = vec![0_u64; words * count];
        let row_words = taxels.div_ceil(64).max(1);
        let rows = weights.sign_bits()?;
        for (i, row) in rows.chunks_exact(row_words).enumerate() {
            for k in 0..taxels {
                columns[k * words + i / 64] |= (row[k / 64] >> (k % 64) & 1) << (i % 64);
            }
        }
        let mut design = Self {
            len,
            words,
            columns,
            count,
        };
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
        for i in (0..self.len).filter(|i| is_plus(*i)) {
            bits[i / 64] |= 1 << (i % 64);
        }
    }

    /// Number of measurements.
    pub(super) fn len(&self) -> usize {
        self.len
    }

    /// Number of columns.
    pub(super) fn columns(&self) -> usize {
        self.count
    }

    fn column(&self, k: usize) -> &[u64] {
        &self.columns[k * self.words..(k + 1) * self.words]
    }

    /// True where taxel `k` has weight +1 at measurement `i`.
    #[inline]
    pub(super) fn is_plus(&self, k: usize, i: usize) -> bool {
        self.columns[k * self.words + i / 64] >> (i % 64) & 1 == 1
    }

    /// Σₖ coefficientsₖ·columnₖ; fewer coefficients than columns leave the last columns out.
    pub(super) fn apply(&self, coefficients: &[f64]) -> Vec<f64> {
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
    pub(super) fn solve(&self, y: &[f64], kept: &[bool]) -> Option<Vec<f64>> {
        let mut mask = vec![0_u64; self.words];
        for i in (0..self.len).filter(|i| kept[*i]) {
            mask[i / 64] |= 1 << (i % 64);
        }
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

/// `v` where the bit is 1, −`v` where it is 0.
#[inline]
fn signed(v: f64, bit: u64) -> f64 {
    f64::from_bits(v.to_bits() ^ ((bit ^ 1) << 63))
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Seeding, Weights};

    /// A noiseless run gives its image back, whatever measurements are left out, as long as enough are left.
    #[test]
    fn an_exact_run_is_solved_exactly() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
        let design = Design::new(
            WeightRows::new(&weights, 12_345, 1000),
            &[Reseeded { taxel: 7, seed: 2 }],
            true,
        )
        .unwrap();
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
            assert_eq!(
                design.is_plus(k, i),
                weights.level(u32::try_from(k).unwrap(), 12_345 + i as u64) > 0.0
            );
        }
        assert_eq!(
            design.is_plus(7, 5),
            WeightMode::Binary.level_from_seed(2, 12_350) > 0.0
        );
    }

    #[test]
    fn too_few_measurements_determine_nothing() {
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
        let design = Design::new(WeightRows::new(&weights, 0, 90), &[], false).unwrap();
        assert!(design.solve(&[0.0; 90], &[true; 90]).is_none());
    }
}
