//! Windows of measurements, the input of every algorithm. Only this module divides recordings into windows.

use crate::protocol::Protocol;
use crate::untouched::Untouched;
use spts_circuit::{Recording, WeightRows};
use spts_recon::metrics::median;
use spts_recon::{Matrix, MatrixView};
use std::ops::Range;
use std::sync::Arc;

/// Rows of weights of consecutive measurements. Presses recorded at the same rows share them.
#[derive(Debug, Clone)]
pub struct PressRows {
    taxels: usize,
    phi: Vec<f64>,
    signs: Option<Vec<u64>>,
}

/// Consecutive measurements of one press, or of one contact of a ball, with their rows of weights.
///
/// ```
/// use spts_eval::{Press, PressRows};
/// use spts_recon::Matrix;
/// use std::sync::Arc;
///
/// let rows = PressRows::of_matrix(&Matrix::from_column_slices(3, &[&[1.0, -1.0, 1.0], &[1.0, 1.0, -1.0]]));
/// let press = Press::on(Arc::new(rows), vec![2.5, f64::NAN, 0.5], 0.5);
/// let window = press.window(0, 1).unwrap();
/// assert_eq!((window.y, window.phi.values()), (&[2.0][..], &[1.0, 1.0][..]));
/// // the second measurement was lost
/// let starts: Vec<usize> = press.windows(0..3, 1, 1).map(|(start, _)| start).collect();
/// assert_eq!(starts, [0, 2]);
/// ```
#[derive(Debug, Clone)]
pub struct Press {
    rows: Arc<PressRows>,
    volts: Vec<f64>,
    y: Vec<f64>,
}

/// The M samples that are decoded together, with their rows of the sensing matrix.
#[derive(Debug, Clone, Copy)]
pub struct Window<'a> {
    /// Rows of weights, M × taxels.
    pub phi: MatrixView<'a>,
    /// The rows as bits, if all weights are ±1: [`WeightRows::sign_bits`].
    pub signs: Option<&'a [u64]>,
    /// Output of the summing amplifier, V.
    pub volts: &'a [f64],
    /// Output minus the mean output of the untouched skin, V.
    pub y: &'a [f64],
}

impl<'a> Window<'a> {
    /// The first `m` measurements of the window; all if it has fewer.
    #[must_use]
    pub fn first(&self, m: usize) -> Self {
        self.part(0..m.min(self.y.len()))
    }

    /// Every measurement as a window of its own.
    pub fn samples(&self) -> impl Iterator<Item = Self> {
        (0..self.y.len()).map(|k| self.part(k..k + 1))
    }

    fn part(&self, range: Range<usize>) -> Self {
        let taxels = self.phi.ncols();
        let words = taxels.div_ceil(64);
        let phi = &self.phi.values()[range.start * taxels..range.end * taxels];
        Self {
            // as many numbers as rows times taxels
            phi: MatrixView::new(range.len(), taxels, phi).unwrap_or(self.phi),
            signs: self.signs.map(|signs| &signs[range.start * words..range.end * words]),
            volts: &self.volts[range.clone()],
            y: &self.y[range],
        }
    }
}

impl PressRows {
    /// The weights of `rows`.
    #[must_use]
    pub fn new(rows: WeightRows<'_>) -> Self {
        Self {
            taxels: rows.taxels(),
            phi: rows.to_vec(),
            signs: rows.sign_bits(),
        }
    }

    /// The weights in `phi`, measurements × taxels.
    #[must_use]
    pub fn of_matrix(phi: &Matrix) -> Self {
        let (taxels, values) = (phi.ncols(), phi.view().values());
        let binary = values.iter().all(|w| w.abs().to_bits() == 1.0_f64.to_bits());
        Self {
            taxels,
            phi: values.to_vec(),
            signs: binary.then(|| sign_bits(values, taxels)),
        }
    }

    /// The rows with the numbers `indices`, in this order.
    fn picked(&self, indices: &[usize]) -> Self {
        let words = self.taxels.div_ceil(64);
        let rows = indices
            .iter()
            .flat_map(|&k| &self.phi[k * self.taxels..(k + 1) * self.taxels]);
        let signs = self.signs.as_ref().map(|signs| {
            let rows = indices.iter().flat_map(|&k| &signs[k * words..(k + 1) * words]);
            rows.copied().collect()
        });
        Self {
            taxels: self.taxels,
            phi: rows.copied().collect(),
            signs,
        }
    }

    /// The weights with taxel k renumbered as `to(k)`.
    #[must_use]
    pub fn renamed(&self, to: impl Fn(usize) -> usize) -> Self {
        let mut phi = vec![0.0; self.phi.len()];
        let taxels = self.taxels.max(1);
        for (new, old) in phi.chunks_exact_mut(taxels).zip(self.phi.chunks_exact(taxels)) {
            old.iter().enumerate().for_each(|(k, w)| new[to(k)] = *w);
        }
        Self {
            taxels: self.taxels,
            signs: self.signs.is_some().then(|| sign_bits(&phi, self.taxels)),
            phi,
        }
    }
}

/// Signs of weights of ±1, ⌈taxels/64⌉ words a row.
fn sign_bits(phi: &[f64], taxels: usize) -> Vec<u64> {
    let words = taxels.div_ceil(64);
    let taxels = taxels.max(1);
    let mut bits = vec![0; phi.len() / taxels * words];
    for (bits, row) in bits.chunks_exact_mut(words.max(1)).zip(phi.chunks_exact(taxels)) {
        for (k, w) in row.iter().enumerate() {
            bits[k / 64] |= u64::from(*w > 0.0) << (k % 64);
        }
    }
    bits
}

impl Press {
    /// Scored frames of block `block` of `recording`.
    #[must_use]
    pub fn new(recording: &Recording, block: usize, protocol: &Protocol) -> Self {
        let per_frame = recording.measurements_per_frame();
        let first = protocol.first_frame.min(recording.frames());
        let end = (first + protocol.frames).min(recording.frames());
        Untouched::of(recording, block).press(recording, block, first * per_frame..end * per_frame)
    }

    /// Measurements `range` of block `block` of `recording`. The output of the untouched skin is `idle_v`, V.
    #[must_use]
    pub fn within(recording: &Recording, block: usize, range: Range<usize>, idle_v: f64) -> Self {
        let volts = recording.blocks()[block].volts[range.clone()].to_vec();
        Self::on(Arc::new(PressRows::new(recording.rows(block, range))), volts, idle_v)
    }

    /// The measurements `volts`, V, with the rows `rows`. The output of the untouched skin is `idle_v`, V.
    #[must_use]
    pub fn on(rows: Arc<PressRows>, volts: Vec<f64>, idle_v: f64) -> Self {
        let y = volts.iter().map(|v| v - idle_v).collect();
        Self::measured(rows, volts, y)
    }

    /// The measurements `volts` at the rows `rows`, which are `y` without what the untouched skin gives, V; one each a
    /// row.
    pub(crate) fn measured(rows: Arc<PressRows>, volts: Vec<f64>, y: Vec<f64>) -> Self {
        Self { rows, volts, y }
    }

    /// The measurements with the numbers `indices`, in this order, with their rows.
    ///
    /// # Panics
    /// If there is no such measurement.
    #[must_use]
    pub fn picked(&self, indices: &[usize]) -> Self {
        Self {
            rows: Arc::new(self.rows.picked(indices)),
            volts: indices.iter().map(|&k| self.volts[k]).collect(),
            y: indices.iter().map(|&k| self.y[k]).collect(),
        }
    }

    /// The same measurements with taxel k renumbered as `to(k)`.
    #[must_use]
    pub fn renamed(&self, to: impl Fn(usize) -> usize) -> Self {
        Self {
            rows: Arc::new(self.rows.renamed(to)),
            ..self.clone()
        }
    }

    /// Number of measurements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether there is no measurement.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// The measurements `start..start + m`; `None` if they extend beyond the press, or one of them was lost.
    #[must_use]
    pub fn window(&self, start: usize, m: usize) -> Option<Window<'_>> {
        let y = self.y.get(start..start + m)?;
        let taxels = self.rows.taxels;
        let words = taxels.div_ceil(64);
        let phi = &self.rows.phi[start * taxels..(start + m) * taxels];
        y.iter().all(|v| v.is_finite()).then_some(())?;
        Some(Window {
            phi: MatrixView::new(m, taxels, phi).ok()?,
            signs: self.rows.signs.as_ref().map(|s| &s[start * words..(start + m) * words]),
            volts: &self.volts[start..start + m],
            y,
        })
    }

    /// Windows of `m` measurements within `range`, one every `step`, each with the number of its first measurement.
    /// Windows with a lost measurement are left out.
    pub fn windows(&self, range: Range<usize>, m: usize, step: usize) -> impl Iterator<Item = (usize, Window<'_>)> {
        let starts = range.start..(range.end.min(self.len()) + 1).saturating_sub(m);
        starts
            .step_by(step.max(1))
            .filter_map(move |start| Some((start, self.window(start, m)?)))
    }
}

/// Mean of the idle frames at the start of a block, V; the median of the whole block if the idle frames are not known
/// or all lost. Lost samples are ignored.
#[must_use]
pub fn idle_mean(recording: &Recording, block: usize) -> f64 {
    let block = &recording.blocks()[block];
    let end = block.idle_frames.unwrap_or(0) * recording.measurements_per_frame();
    let (mut sum, mut count) = (0.0, 0.0);
    for v in block.volts[..end].iter().filter(|v| v.is_finite()) {
        sum += v;
        count += 1.0;
    }
    if count > 0.0 {
        return sum / count;
    }
    let finite: Vec<f64> = block.volts.iter().copied().filter(|v| v.is_finite()).collect();
    median(&finite).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Block, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;

    /// Parts of a window keep weights, signs and samples together.
    #[test]
    fn parts_of_a_window_are_windows() {
        let phi = Matrix::from_rows(3, 2, vec![1.0, 1.0, -1.0, 1.0, 1.0, -1.0]).unwrap();
        let press = Press::on(Arc::new(PressRows::of_matrix(&phi)), vec![3.0, 1.0, -1.0], 0.5);
        let window = press.window(0, 3).unwrap();
        let two = window.first(2);
        assert_eq!(
            (two.y, two.volts, two.signs),
            (&[2.5, 0.5][..], &[3.0, 1.0][..], Some(&[3, 2][..]))
        );
        assert_eq!((two.phi.nrows(), two.phi.values()), (2, &phi.view().values()[..4]));
        assert_eq!(window.first(9).y.len(), 3);
        let third = window.samples().nth(2).unwrap();
        assert_eq!(
            (third.y, third.signs, third.phi.values()),
            (&[-1.5][..], Some(&[1][..]), phi.row(2))
        );
        assert_eq!(window.samples().count(), 3);
    }

    #[test]
    fn the_idle_output_is_the_median_where_no_idle_sample_is_left() {
        let layout = SkinLayout::new(1, 2, 5e-3, 3e-3).unwrap();
        let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 2), 64_300.0);
        let cases = [
            (Some(1), [1.0, 3.0, 9.0, 9.0, 9.0, 9.0], 2.0),
            (Some(1), [f64::NAN, 3.0, 9.0, 9.0, 9.0, 9.0], 3.0),
            (Some(1), [f64::NAN, f64::NAN, 7.0, 8.0, 8.0, 9.0], 8.0),
            (Some(0), [7.0, 7.0, 8.0, 8.0, 8.0, 9.0], 8.0),
            (None, [7.0, 7.0, 8.0, 8.0, 8.0, 9.0], 8.0),
            (None, [f64::NAN; 6], 0.0),
        ];
        for (idle_frames, volts, expected) in cases {
            let block = Block {
                frame_position: 3,
                idle_frames,
                volts: volts.to_vec(),
            };
            let recording = Recording::new(info.clone(), vec![block]).unwrap();
            let found = idle_mean(&recording, 0);
            assert_eq!(
                found.to_bits(),
                f64::to_bits(expected),
                "{idle_frames:?} {volts:?}: {found}"
            );
        }
    }
}
