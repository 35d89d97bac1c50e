//! The decodes on the board, and a press projected onto the dictionary once for all of them.

use super::protocol::Protocol;
use serde::{Serialize, Serializer};
use spts_circuit::{Recording, WeightRows};
use spts_recon::metrics::median;
use spts_recon::recover::ReferenceOmp;
use spts_recon::{Matrix, MatrixView, Problem, Recover as _, Workspace};
use std::sync::Arc;

/// How a window of measurements is turned into an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Decode {
    /// As the published script: weights {0, 1}, no offset, 20 atoms.
    ScriptS20,
    /// As the paper's text: weights {0, 1}, no offset, M/4 atoms.
    ScriptM4,
    /// Matched to the device: Φ − ½, the idle mean removed, M/4 atoms.
    Matched,
}

impl Decode {
    /// Every decode.
    pub const ALL: [Self; 3] = [Self::ScriptS20, Self::ScriptM4, Self::Matched];

    /// Name on the board.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ScriptS20 => "script_s20",
            Self::ScriptM4 => "script_m4",
            Self::Matched => "matched",
        }
    }

    /// Pursuit for `m` measurements. M/4 is rounded half up, and at least one atom is chosen.
    #[must_use]
    pub fn pursuit(self, m: usize) -> ReferenceOmp {
        match self {
            Self::ScriptS20 => ReferenceOmp::new(20),
            Self::ScriptM4 | Self::Matched => ReferenceOmp::new(quarter(m)),
        }
    }
}

/// M/4 rounded half up, at least 1: the published rule for the number of atoms.
#[must_use]
pub fn quarter(m: usize) -> usize {
    ((m + 2) / 4).max(1)
}

impl Serialize for Decode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

/// Rows of Φ·D for both kinds of weights.
#[derive(Debug, Clone)]
pub struct Projection {
    script: Matrix,
    matched: Matrix,
}

impl Projection {
    /// `rows` projected onto `dictionary` (taxels × atoms).
    #[must_use]
    pub fn new(rows: WeightRows<'_>, dictionary: &Matrix) -> Self {
        let len = rows.len();
        let mut clock = rows.clock();
        let mut row = vec![0.0; rows.taxels()];
        let mut script = Matrix::zeros(len, dictionary.ncols());
        let mut matched = Matrix::zeros(len, dictionary.ncols());
        let half_sums: Vec<f64> = dictionary.column_sums().iter().map(|s| 0.5 * s).collect();
        for i in 0..len {
            clock.next_row(&mut row);
            // ±1 → {0, 1}
            row.iter_mut().for_each(|w| *w = 0.5 * (*w + 1.0));
            dictionary.accumulate_row(&row, script.row_mut(i));
            for ((m, s), h) in matched.row_mut(i).iter_mut().zip(script.row(i)).zip(&half_sums) {
                *m = s - h;
            }
        }
        Self { script, matched }
    }
}

/// A run of measurements with the matching rows of Φ·D, for both kinds of weights.
#[derive(Debug, Clone)]
pub struct Projected {
    projection: Arc<Projection>,
    y: Vec<f64>,
    idle: f64,
    centred: Vec<f64>,
}

impl Projected {
    /// Measurements `start..start + len` of `block`, projected onto `dictionary` (taxels × atoms).
    #[must_use]
    pub fn new(recording: &Recording, block: usize, start: usize, len: usize, idle: f64, dictionary: &Matrix) -> Self {
        let projection = Projection::new(recording.rows(block, start..start + len), dictionary);
        Self::on(
            Arc::new(projection),
            &recording.blocks()[block].volts[start..start + len],
            idle,
        )
    }

    /// The measurements `volts` of the rows that were projected, with the mean output `idle` of the untouched skin, V.
    #[must_use]
    pub fn on(projection: Arc<Projection>, volts: &[f64], idle: f64) -> Self {
        Self {
            projection,
            centred: volts.iter().map(|v| v - idle).collect(),
            y: volts.to_vec(),
            idle,
        }
    }

    /// The scored frames of one press.
    #[must_use]
    pub fn press(recording: &Recording, block: usize, protocol: &Protocol, dictionary: &Matrix) -> Self {
        let m = recording.measurements_per_frame();
        let first = protocol.first_frame.min(recording.frames());
        let frames = protocol.frames.min(recording.frames() - first);
        let idle = idle_mean(recording, block);
        Self::new(recording, block, first * m, frames * m, idle, dictionary)
    }

    /// Number of measurements.
    #[must_use]
    pub fn len(&self) -> usize {
        self.y.len()
    }

    /// True without a measurement.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.y.is_empty()
    }

    /// Mean of the amplifier's output with nothing on the skin, V.
    #[must_use]
    pub fn idle(&self) -> f64 {
        self.idle
    }

    /// Operator and measurements of the window `start..start + m` as `decode` sees them.
    #[must_use]
    pub fn window(&self, decode: Decode, start: usize, m: usize) -> (MatrixView<'_>, &[f64]) {
        let (a, y) = match decode {
            Decode::ScriptS20 | Decode::ScriptM4 => (&self.projection.script, &self.y),
            Decode::Matched => (&self.projection.matched, &self.centred),
        };
        (a.view().rows(start, m), &y[start..start + m])
    }
}

/// Mean of the idle frames at the start of a block, V; the median of the whole block when it is not known which frames are idle. Lost
/// samples do not count.
#[must_use]
pub fn idle_mean(recording: &Recording, block: usize) -> f64 {
    let block = &recording.blocks()[block];
    let Some(idle_frames) = block.idle_frames else {
        let finite: Vec<f64> = block.volts.iter().copied().filter(|v| v.is_finite()).collect();
        return median(&finite).unwrap_or(0.0);
    };
    let end = idle_frames * recording.measurements_per_frame();
    let (mut sum, mut count) = (0.0, 0.0);
    for v in block.volts[..end].iter().filter(|v| v.is_finite()) {
        sum += v;
        count += 1.0;
    }
    if count > 0.0 { sum / count } else { 0.0 }
}

/// Decodes windows of a [`Projected`] run into images; its memory is reused from window to window.
#[derive(Debug)]
pub struct Decoder<'a> {
    dictionary: &'a Matrix,
    work: Workspace,
    image: Vec<f64>,
}

impl<'a> Decoder<'a> {
    /// Decoder with `dictionary`, the one that the run was projected onto.
    #[must_use]
    pub fn new(dictionary: &'a Matrix) -> Self {
        Self {
            dictionary,
            work: Workspace::default(),
            image: vec![0.0; dictionary.nrows()],
        }
    }

    /// Image of the window `start..start + m`, seen as `decode` sees it and recovered by its own pursuit. `None` when the
    /// window reaches beyond the run or holds a lost sample.
    pub fn decode(&mut self, run: &Projected, decode: Decode, start: usize, m: usize) -> Option<&[f64]> {
        self.decode_by(run, decode, &decode.pursuit(m), start, m)
    }

    /// The same with another pursuit.
    pub fn decode_by(
        &mut self,
        run: &Projected,
        decode: Decode,
        pursuit: &ReferenceOmp,
        start: usize,
        m: usize,
    ) -> Option<&[f64]> {
        if start + m > run.len() {
            return None;
        }
        let (a, y) = run.window(decode, start, m);
        let solution = pursuit.recover(&Problem::new(a, y).ok()?, &mut self.work).ok()?;
        solution.synthesise(self.dictionary.view(), &mut self.image);
        Some(&self.image)
    }
}
