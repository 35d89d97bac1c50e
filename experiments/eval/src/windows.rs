//! Windows of measurements, the input of every algorithm. Only this module divides recordings into windows.

use crate::chunk::{Chunk, converter_step_v};
use crate::protocol::Protocol;
use crate::training::TrainingData;
use spts_circuit::{Mode, Recording, WeightRows, Wires};
use spts_recon::metrics::median;
use spts_recon::operator::{LinearOperator as _, SignRows};
use spts_recon::{Matrix, MatrixView};
use std::ops::Range;
use std::sync::Arc;

/// Rows of weights of consecutive measurements. Presses recorded at the same rows share them. Of rows of ±1 on a skin
/// of more than 2,048 taxels the bits alone are kept.
#[derive(Debug, Clone)]
pub struct PressRows {
    taxels: usize,
    phi: Vec<f64>,
    signs: Option<Vec<u64>>,
    /// Wire of every row; empty for one wire.
    wires: Vec<u16>,
    /// Taxels of every wire as bits; empty for one wire.
    masks: Vec<u64>,
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
    /// Rows of weights, M × taxels; 0 × taxels where they are kept as bits alone ([`Window::with_rows`]).
    pub phi: MatrixView<'a>,
    /// The rows as bits, if all weights are ±1: [`WeightRows::sign_bits`]. Rows of several wires have zeros, and are in
    /// [`Window::bits`].
    pub signs: Option<&'a [u64]>,
    /// The rows as bits, if all weights of a row's own wire are ±1.
    pub bits: Option<SignRows<'a>>,
    /// Wire of every row; empty for one wire.
    pub wires: &'a [u16],
    /// Output of the summing amplifier, V.
    pub volts: &'a [f64],
    /// Output minus the mean output of the untouched skin, V.
    pub y: &'a [f64],
}

impl<'a> Window<'a> {
    /// The first `m` measurements of the window; all if it has fewer.
    pub fn first(&self, m: usize) -> Self {
        self.part(0..m.min(self.y.len()))
    }

    /// Every measurement as a window of its own.
    pub fn samples(&self) -> impl Iterator<Item = Self> {
        (0..self.y.len()).map(|k| self.part(k..k + 1))
    }

    /// Whether the rows are there as numbers.
    pub fn has_rows(&self) -> bool {
        self.phi.nrows() == self.y.len()
    }

    /// The window with its rows as numbers, which are formed in `rows` if only their bits are kept.
    pub fn with_rows<'b>(&self, rows: &'b mut Vec<f64>) -> Window<'b>
    where
        'a: 'b,
    {
        let (Some(bits), false) = (self.bits, self.has_rows()) else { return *self };
        let taxels = self.phi.ncols();
        rows.resize(self.y.len() * taxels, 0.0);
        bits.fill(rows);
        // as many numbers as rows times taxels
        Window { phi: MatrixView::new(self.y.len(), taxels, rows).unwrap_or(self.phi), ..*self }
    }

    fn part(&self, range: Range<usize>) -> Self {
        let taxels = self.phi.ncols();
        let words = taxels.div_ceil(64);
        let phi = self.phi.values().get(range.start * taxels..range.end * taxels);
        Self {
            // as many numbers as rows times taxels
            phi: phi.and_then(|phi| MatrixView::new(range.len(), taxels, phi).ok()).unwrap_or(self.phi),
            signs: self.signs.map(|signs| &signs[range.start * words..range.end * words]),
            bits: self.bits.map(|bits| bits.part(range.clone())),
            wires: self.wires.get(range.clone()).unwrap_or_default(),
            volts: &self.volts[range.clone()],
            y: &self.y[range],
        }
    }
}

impl PressRows {
    /// The weights of `rows`.
    pub fn new(rows: WeightRows<'_>) -> Self {
        let signs = rows.sign_bits();
        let large = rows.taxels() > TrainingData::MOST_TAXELS && signs.is_some();
        let wires = rows.weights().wires().filter(|_| rows.weights().mode().readout() == Mode::Compressive);
        Self {
            taxels: rows.taxels(),
            phi: if large { Vec::new() } else { rows.to_vec() },
            signs,
            #[expect(clippy::cast_possible_truncation, reason = "a skin has fewer wires")]
            wires: wires.map_or_else(Vec::new, |_| (0..rows.len()).map(|row| rows.wire(row) as u16).collect()),
            masks: wires.map_or_else(Vec::new, Wires::masks),
        }
    }

    /// The rows in `range` as numbers: none of them where bits alone are kept.
    fn numbers(&self, range: Range<usize>) -> &[f64] {
        self.phi.get(range.start * self.taxels..range.end * self.taxels).unwrap_or_default()
    }

    /// The weights in `phi`, measurements × taxels.
    pub fn of_matrix(phi: &Matrix) -> Self {
        let (taxels, values) = (phi.ncols(), phi.view().values());
        let binary = values.iter().all(|w| w.abs().to_bits() == 1.0_f64.to_bits());
        let signs = binary.then(|| sign_bits(values, taxels));
        Self { taxels, phi: values.to_vec(), signs, wires: Vec::new(), masks: Vec::new() }
    }

    /// The rows with the numbers `indices`, in this order.
    fn picked(&self, indices: &[usize]) -> Self {
        let words = self.taxels.div_ceil(64);
        let rows = indices.iter().flat_map(|&k| self.numbers(k..k + 1));
        let signs = self.signs.as_ref().map(|signs| {
            let rows = indices.iter().flat_map(|&k| &signs[k * words..(k + 1) * words]);
            rows.copied().collect()
        });
        let wires = indices.iter().filter_map(|&k| self.wires.get(k).copied()).collect();
        Self { taxels: self.taxels, phi: rows.copied().collect(), signs, wires, masks: self.masks.clone() }
    }

    /// The rows in `range` as bits, if all weights of a row's own wire are ±1.
    fn bits(&self, range: Range<usize>) -> Option<SignRows<'_>> {
        let words = self.taxels.div_ceil(64);
        let bits = SignRows::new(&self.signs.as_ref()?[range.start * words..range.end * words], self.taxels);
        Some(if self.wires.is_empty() { bits } else { bits.on_wires(&self.wires[range], &self.masks) })
    }

    /// The weights with taxel k renumbered as `to(k)`, as numbers.
    pub fn renamed(&self, to: impl Fn(usize) -> usize) -> Self {
        let mut old = self.phi.clone();
        let rows = self.signs.as_ref().map_or(0, |signs| signs.len() / self.taxels.div_ceil(64).max(1));
        if let Some(bits) = self.bits(0..rows).filter(|_| old.is_empty()) {
            old.resize(bits.nrows() * self.taxels, 0.0);
            bits.fill(&mut old);
        }
        let (mut phi, taxels) = (vec![0.0; old.len()], self.taxels.max(1));
        for (new, old) in phi.chunks_exact_mut(taxels).zip(old.chunks_exact(taxels)) {
            old.iter().enumerate().for_each(|(k, w)| new[to(k)] = *w);
        }
        // taxels of a wire are elsewhere now
        let one_wire = self.signs.is_some() && self.wires.is_empty();
        let signs = one_wire.then(|| sign_bits(&phi, self.taxels));
        Self { taxels: self.taxels, phi, signs, wires: self.wires.clone(), masks: Vec::new() }
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
    pub fn new(recording: &Recording, block: usize, protocol: &Protocol) -> Self {
        Untouched::of(recording, block).press(recording, block, protocol.measurements(recording))
    }

    /// Measurements `range` of block `block` of `recording`. The output of the untouched skin is `idle_v`, V.
    pub fn within(recording: &Recording, block: usize, range: Range<usize>, idle_v: f64) -> Self {
        let untouched = Untouched { offsets_v: vec![idle_v], image: None };
        untouched.press(recording, block, range)
    }

    /// The measurements `volts`, V, with the rows `rows`. The output of the untouched skin is `idle_v`, V.
    pub fn on(rows: Arc<PressRows>, volts: Vec<f64>, idle_v: f64) -> Self {
        Self { y: volts.iter().map(|v| v - idle_v).collect(), rows, volts }
    }

    /// The measurements with the numbers `indices`, in this order, with their rows.
    ///
    /// # Panics
    /// If there is no such measurement.
    pub fn picked(&self, indices: &[usize]) -> Self {
        Self {
            rows: Arc::new(self.rows.picked(indices)),
            volts: indices.iter().map(|&k| self.volts[k]).collect(),
            y: indices.iter().map(|&k| self.y[k]).collect(),
        }
    }

    /// The same measurements with taxel k renumbered as `to(k)`.
    pub fn renamed(&self, to: impl Fn(usize) -> usize) -> Self {
        Self { rows: Arc::new(self.rows.renamed(to)), ..self.clone() }
    }

    /// Rows as numbers, wires and samples above the untouched skin's output of the measurements in `range`.
    pub(crate) fn measured(&self, range: Range<usize>) -> (&[f64], &[u16], &[f64]) {
        let wires = self.rows.wires.get(range.clone()).unwrap_or_default();
        (self.rows.numbers(range.clone()), wires, &self.y[range])
    }

    /// Number of measurements.
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// Whether there is no measurement.
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// The measurements `start..start + m`; `None` if they extend beyond the press, or one of them was lost.
    pub fn window(&self, start: usize, m: usize) -> Option<Window<'_>> {
        let y = self.y.get(start..start + m)?;
        let taxels = self.rows.taxels;
        let words = taxels.div_ceil(64);
        let phi = self.rows.numbers(start..start + m);
        y.iter().all(|v| v.is_finite()).then_some(())?;
        let signs = self.rows.signs.as_ref().map(|s| &s[start * words..(start + m) * words]);
        let bits = self.rows.bits(start..start + m);
        let wires = self.rows.wires.get(start..start + m).unwrap_or_default();
        Some(Window {
            phi: MatrixView::new(phi.len() / taxels.max(1), taxels, phi).ok()?,
            signs: signs.filter(|_| wires.is_empty()),
            bits,
            wires,
            volts: &self.volts[start..start + m],
            y,
        })
    }

    /// Windows of `m` measurements within `range`, one every `step`, each with the number of its first measurement.
    /// Windows with a lost measurement are left out.
    pub fn windows(&self, range: Range<usize>, m: usize, step: usize) -> impl Iterator<Item = (usize, Window<'_>)> {
        let starts = range.start..(range.end.min(self.len()) + 1).saturating_sub(m);
        starts.step_by(step.max(1)).filter_map(move |start| Some((start, self.window(start, m)?)))
    }
}

/// Mean of the idle frames at the start of a block, V; the median of the whole block if the idle frames are not known
/// or all lost. Lost samples are ignored. Of several wires the mean of [`idle_means`].
pub fn idle_mean(recording: &Recording, block: usize) -> f64 {
    let means = idle_means(recording, block);
    means.iter().sum::<f64>() / means.len() as f64
}

/// Mean output of every untouched wire; see [`idle_mean`].
pub fn idle_means(recording: &Recording, block: usize) -> Vec<f64> {
    let wires = compressive_wires(recording);
    let first = recording.rows(block, 0..0).wire(0);
    let block = &recording.blocks()[block];
    let end = block.idle_frames.unwrap_or(0) * recording.measurements_per_frame();
    let mean = |wire: usize| {
        let own = |volts: &'_ [f64]| {
            // samples of the wires in turn, from the first one's on
            let skipped = (wire + wires - first) % wires;
            let own = volts.iter().skip(skipped).step_by(wires).copied();
            own.filter(|v| v.is_finite()).collect::<Vec<f64>>()
        };
        let idle = own(&block.volts[..end]);
        if idle.is_empty() {
            return median(&own(&block.volts)).unwrap_or(0.0);
        }
        let (mut sum, mut count) = (0.0, 0.0);
        for v in &idle {
            sum += v;
            count += 1.0;
        }
        sum / count
    };
    (0..wires).map(mean).collect()
}

/// Mean output of every wire over the measurements `range` of block `block`, V; lost samples are ignored, and a wire
/// without any has 0.
pub fn wire_means(recording: &Recording, block: usize, range: Range<usize>) -> Vec<f64> {
    let rows = recording.rows(block, range.clone());
    let mut sums = vec![(0.0, 0_usize); compressive_wires(recording)];
    let samples = recording.blocks()[block].volts[range].iter().enumerate();
    for (k, v) in samples.filter(|(_, v)| v.is_finite()) {
        let (sum, count) = &mut sums[rows.wire(k)];
        *sum += v;
        *count += 1;
    }
    sums.iter().map(|(sum, count)| sum / (*count).max(1) as f64).collect()
}

/// Wires whose samples follow one another in `recording`.
pub(crate) fn compressive_wires(recording: &Recording) -> usize {
    if recording.mode() == Mode::Compressive { recording.weights().wire_count() } else { 1 }
}

/// A skin whose idle output has a standard deviation of more steps of the converter than this may be under preload.
/// Without a preload it is the idle noise, two steps in the published recordings.
const STEPS: f64 = 6.0;
/// It also has to be more than this share of that of the whole block.
const SHARE: f64 = 0.1;
/// Share of the variance that an image has to explain to be a preload.
const EXPLAINED: f64 = 0.5;
/// Measurements that an image is estimated from, at most, for every taxel.
const MEASUREMENTS_PER_TAXEL: usize = 100;
/// Weights of these measurements at most: 1 GiB.
pub(crate) const MOST_WEIGHTS: usize = 1 << 27;
/// Measurements that it needs at least, for every taxel.
const LEAST_PER_TAXEL: usize = 4;

/// Output of an untouched skin. A flat skin gives a constant. A bent skin, such as one around an arm, is under preload
/// and gives sums like those of a touch; they are subtracted measurement by measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Untouched {
    /// Output without load on any taxel, V: of every wire, or one for all.
    pub offsets_v: Vec<f64>,
    /// Image of the preload, V; `None` for a flat skin.
    pub image: Option<Vec<f64>>,
}

impl Untouched {
    /// The untouched skin of block `block`, from its idle frames: [`idle_means`] for a flat skin. A preload takes four
    /// idle measurements a taxel, and at most 5,792 taxels.
    pub fn of(recording: &Recording, block: usize) -> Self {
        let frames = recording.blocks()[block].idle_frames.unwrap_or(0);
        Self::in_frames(recording, block, frames)
    }

    /// A skin without a preload, from the idle frames of block `block`: [`idle_means`].
    pub fn flat(recording: &Recording, block: usize) -> Self {
        Self { offsets_v: idle_means(recording, block), image: None }
    }

    /// The untouched skin, from the first `frames` frames of the block.
    pub(crate) fn in_frames(recording: &Recording, block: usize, frames: usize) -> Self {
        let flat = || Self::flat(recording, block);
        let taxels = recording.taxels();
        let most = (MEASUREMENTS_PER_TAXEL * taxels).min(MOST_WEIGHTS / taxels);
        let idle = (frames * recording.measurements_per_frame()).min(most);
        if recording.mode() != Mode::Compressive || idle < LEAST_PER_TAXEL * taxels {
            return flat();
        }
        // the last of the idle frames are the nearest to what follows
        let start = frames * recording.measurements_per_frame() - idle;
        let chunk = Chunk::new(recording, block, start, idle);
        let whole = Chunk::new(recording, block, 0, recording.blocks()[block].volts.len());
        let step_v = converter_step_v(recording).unwrap_or(0.0);
        if chunk.sd() <= (STEPS * step_v).max(SHARE * whole.sd()) {
            return flat();
        }
        let fit = chunk.fit(0).filter(|fit| fit.residual.powi(2) < 1.0 - EXPLAINED);
        fit.map_or_else(flat, |fit| Self { offsets_v: fit.offsets_v, image: Some(fit.image) })
    }

    /// Measurements `range` of block `block` minus the output of the untouched skin, V.
    pub fn without(&self, recording: &Recording, block: usize, range: Range<usize>) -> Vec<f64> {
        let rows = recording.rows(block, range.clone());
        let volts = recording.blocks()[block].volts[range.clone()].iter();
        let offset_v = |k: usize| self.offsets_v.get(rows.wire(k)).or(self.offsets_v.first()).copied().unwrap_or(0.0);
        let Some(image) = &self.image else {
            return volts.enumerate().map(|(k, v)| v - offset_v(k)).collect();
        };
        let mut sums = vec![0.0; range.len()];
        recording.weights().weighted_sums(rows.first_row(), image, &mut sums);
        volts.zip(sums).enumerate().map(|(k, (v, sum))| v - offset_v(k) - sum).collect()
    }

    /// Measurements `range` of block `block` as a press whose [`y`](crate::Window::y) is free of the untouched skin's
    /// output.
    pub fn press(&self, recording: &Recording, block: usize, range: Range<usize>) -> Press {
        Press {
            volts: recording.blocks()[block].volts[range.clone()].to_vec(),
            y: self.without(recording, block, range.clone()),
            rows: Arc::new(PressRows::new(recording.rows(block, range))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::find_touches;
    use spts_circuit::{Block, Interpolated, Profile, Readout, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::{ConductanceMap, SkinLayout, Streams};

    /// Parts of a window keep weights, signs and samples together.
    #[test]
    fn parts_of_a_window_are_windows() {
        let phi = Matrix::from_rows(3, 2, vec![1.0, 1.0, -1.0, 1.0, 1.0, -1.0]).unwrap();
        let press = Press::on(Arc::new(PressRows::of_matrix(&phi)), vec![3.0, 1.0, -1.0], 0.5);
        let window = press.window(0, 3).unwrap();
        let two = window.first(2);
        assert_eq!((two.y, two.volts, two.signs), (&[2.5, 0.5][..], &[3.0, 1.0][..], Some(&[3, 2][..])));
        assert_eq!((two.phi.nrows(), two.phi.values()), (2, &phi.view().values()[..4]));
        assert_eq!(window.first(9).y.len(), 3);
        let third = window.samples().nth(2).unwrap();
        assert_eq!((third.y, third.signs, third.phi.values()), (&[-1.5][..], Some(&[1][..]), phi.row(2)));
        assert_eq!(window.samples().count(), 3);
    }

    /// Rows that are kept as bits alone are formed again.
    #[test]
    fn rows_come_back_from_their_bits() {
        let values: Vec<f64> = (0..3 * 70).map(|k| if k * k % 7 < 3 { 1.0 } else { -1.0 }).collect();
        let dense = PressRows::of_matrix(&Matrix::from_rows(3, 70, values.clone()).unwrap());
        let bits = PressRows { phi: Vec::new(), ..dense };
        let press = Press::on(Arc::new(bits), vec![1.0, 2.0, 3.0], 0.0);
        let window = press.window(0, 3).unwrap();
        assert_eq!((window.phi.nrows(), window.phi.ncols(), window.has_rows()), (0, 70, false));
        let mut rows = Vec::new();
        assert_eq!(window.with_rows(&mut rows).phi.values(), values);
        let last = window.samples().nth(2).unwrap();
        assert_eq!(last.with_rows(&mut rows).phi.values(), &values[140..]);
        assert_eq!(press.picked(&[1]).window(0, 1).unwrap().with_rows(&mut rows).phi.values(), &values[70..140]);
    }

    /// Rows that are kept as bits are renumbered as numbers, of one wire and of two.
    #[test]
    fn taxels_are_renumbered_however_rows_are_kept() {
        let layout = SkinLayout::with_pitch(10, 7, 5e-3).unwrap();
        for entries in [Vec::new(), vec![spts_circuit::WireConfig::bands(2)]] {
            let wires = Wires::new(&entries, &layout).unwrap();
            let weights = Weights::new(WeightMode::Binary, Seeding::Mixed, 70).wired(wires).unwrap();
            let rows = WeightRows::new(&weights, 5, 6);
            let bits = PressRows { phi: Vec::new(), ..PressRows::new(rows) };
            let renamed = bits.renamed(|k| (k + 3) % 70);
            let expected = |k: usize| rows.to_vec()[k / 70 * 70 + (k % 70 + 67) % 70];
            assert!((0..6 * 70).all(|k| renamed.phi[k].to_bits() == expected(k).to_bits()));
            assert_eq!(renamed.signs.is_some(), entries.is_empty());
            let press = Press::on(Arc::new(bits), vec![0.0; 6], 0.0);
            assert_eq!(press.window(0, 6).unwrap().with_rows(&mut Vec::new()).phi.values(), rows.to_vec());
        }
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
            let block = Block { frame_position: 3, idle_frames, volts: volts.to_vec() };
            let recording = Recording::new(info.clone(), vec![block]).unwrap();
            let found = idle_mean(&recording, 0);
            assert_eq!(found.to_bits(), f64::to_bits(expected), "{idle_frames:?} {volts:?}: {found}");
        }
    }

    /// Conductance of taxel 34 at the largest touch, S, and of each preloaded taxel.
    const TOUCH_S: f64 = 1.5e-3;
    const PRELOAD_S: f64 = 0.1e-3;

    /// A touch of taxel 34 between 0.2 s and 0.4 s, on a skin of which every seventh taxel is under `preload_s`.
    fn touched(preload_s: f64) -> Recording {
        let map = |touch: f64| {
            let taxel = |k: usize| {
                let preload = if k.is_multiple_of(7) { preload_s } else { 0.0 };
                preload + if k == 34 { touch * TOUCH_S } else { 0.0 }
            };
            ConductanceMap::from_values(10, 10, (0..100).map(taxel).collect())
        };
        let times = vec![0.0, 0.2, 0.25, 0.35, 0.4, 10.0];
        let press = Interpolated::new(times, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0].map(map).to_vec()).unwrap();
        let profile = Profile::named("as_built").unwrap();
        let streams = Streams::new(1);
        let mut readout = Readout::new(&profile, Mode::Compressive, &SkinLayout::default(), streams, 0).unwrap();
        readout.record(&mut [press], 400 * 100, 0).unwrap().with_idle_frames(Some(100))
    }

    /// The image of the preload, 0.43 V on 15 taxels, is found to a tenth of a taxel's. Before the touch noise is left:
    /// up to 0.12 V when idle, 0.06 of ‖x‖ = 1.7 V in contact, and as much of late updates; together 0.2 V.
    #[test]
    fn preload_is_subtracted() {
        let recording = touched(PRELOAD_S);
        let untouched = Untouched::of(&recording, 0);
        let image = untouched.image.as_ref().unwrap();
        let volts_per_siemens = 4.3 * 1e3;
        for (k, found) in image.iter().enumerate() {
            let expected = if k.is_multiple_of(7) { volts_per_siemens * PRELOAD_S } else { 0.0 };
            let tolerance = 0.1 * volts_per_siemens * PRELOAD_S;
            assert!((found - expected).abs() < tolerance, "taxel {k}: {found} V, expected {expected} V");
        }
        let idle = untouched.without(&recording, 0, 0..10_000);
        let rms = (idle.iter().map(|v| v * v).sum::<f64>() / 1e4).sqrt();
        assert!(rms < 0.3, "{rms} V");
        let touches = find_touches(&recording);
        assert_eq!(touches.len(), 1);
        assert_eq!(touches[0].taxel(&recording), Some(34));
        // the touch begins at measurement 12 860 and ends at 25 720; it is seen a little later and less long
        assert!((12_800..14_000).contains(&touches[0].start), "{}", touches[0].start);
        assert!((24_700..25_900).contains(&touches[0].end), "{}", touches[0].end);
    }

    /// Of a flat skin the mean of the idle frames is subtracted, to the bit.
    #[test]
    fn flat_skins_have_no_preload() {
        let recording = touched(0.0);
        let untouched = Untouched::of(&recording, 0);
        assert_eq!(untouched.image, None);
        assert_eq!(untouched.offsets_v, [idle_mean(&recording, 0)]);
        let y = untouched.without(&recording, 0, 500..510);
        let expected = recording.blocks()[0].volts[500..510].iter().map(|v| v - idle_mean(&recording, 0));
        assert!(y.iter().zip(expected).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
