//! From a source of conductance to volts: segments, batches, weighted sums.

use crate::batch::{Batch, Cells};
use crate::effect::Effect;
use crate::source::{ConductanceSource, Segment};
use crate::weights::{ANALOG_SCALE, CellCodes, LANES, Lines, Rows, Sums, WeightMode, Weights};
use spts_input::Refusal;

/// Most measurements in a batch: the sums of one fit into the first-level cache.
const BATCH: usize = 128;

/// What the readout does with a block, whatever its effects.
pub(crate) struct Engine {
    volts_per_siemens: f64,
    sample_rate_hz: f64,
    batch: usize,
    rows: Rows,
    /// Source of the codes; `None` if the generator gives the levels.
    codes: Option<Box<dyn CellCodes>>,
    sums: Sums,
    share: Vec<f64>,
    sum_v: Vec<f64>,
    norm_v: Vec<f64>,
    cells: Cells,
}

impl Engine {
    /// Engine for a skin with `weights`, at `volts_per_siemens` V/S and `sample_rate_hz` measurements a second.
    pub(crate) fn new(weights: Weights, volts_per_siemens: f64, sample_rate_hz: f64) -> Self {
        Self {
            volts_per_siemens,
            sample_rate_hz,
            batch: BATCH,
            rows: Rows::new(weights),
            codes: None,
            sums: Sums::default(),
            share: Vec::new(),
            sum_v: Vec::new(),
            norm_v: Vec::new(),
            cells: Cells::default(),
        }
    }

    /// The same engine with at most `batch` measurements at a time.
    pub(crate) fn with_batch(self, batch: usize) -> Self {
        Self { batch, ..self }
    }

    /// The same engine with cells that put out `codes`, as many as the skin has taxels.
    pub(crate) fn with_codes(self, codes: Box<dyn CellCodes>) -> Self {
        Self { codes: Some(codes), ..self }
    }

    /// Weights of the skin.
    pub(crate) fn weights(&self) -> &Weights {
        self.rows.weights()
    }

    /// Measurements a second, Hz.
    pub(crate) fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    /// Fills `volts` with measurements of `source` from row `first_row` on.
    ///
    /// # Errors
    /// [`Refusal`] when the source hands out a segment that does not hold the time asked for, or there are no codes.
    pub(crate) fn run(
        &mut self,
        effects: &mut [Box<dyn Effect>],
        first_row: u64,
        source: &mut dyn ConductanceSource,
        volts: &mut [f64],
    ) -> Result<(), Refusal> {
        let mut done = 0;
        while done < volts.len() {
            let time_s = self.time_s(done);
            let segment = source.segment(time_s);
            segment.check(time_s, self.weights().taxels())?;
            let moments = Moments::of(&segment);
            while done < volts.len() {
                let len = self.shares(&segment, done, volts.len() - done);
                if len == 0 {
                    break;
                }
                let row = first_row + done as u64;
                match &mut self.codes {
                    Some(codes) => self.rows.go_to_codes(&mut **codes, row, len).map_err(|e| e.at("cells"))?,
                    None => self.rows.go_to(row, len),
                }
                let mut batch = self.sum(&segment, &moments, &mut volts[done..done + len]);
                for effect in effects.iter_mut() {
                    effect.apply(&mut batch);
                }
                done += len;
            }
        }
        Ok(())
    }

    /// Time of measurement `m` since the start of the block, s.
    fn time_s(&self, m: usize) -> f64 {
        m as f64 / self.sample_rate_hz
    }

    /// Where measurements `first..` lie between the ends of `segment`, for as many as lie in it and make one batch; how
    /// many.
    fn shares(&mut self, segment: &Segment<'_>, first: usize, left: usize) -> usize {
        let most = left.min(self.batch);
        self.share.clear();
        self.share.resize(most.next_multiple_of(LANES), 0.0);
        let span_s = segment.end_s - segment.start_s;
        for i in 0..most {
            let time_s = self.time_s(first + i);
            if time_s >= segment.end_s {
                return i;
            }
            if segment.end_conductance_s.is_some() {
                self.share[i] = (time_s - segment.start_s) / span_s;
            }
        }
        most
    }

    /// The batch before any effect.
    fn sum<'a>(&'a mut self, segment: &Segment<'a>, moments: &Moments, output_v: &'a mut [f64]) -> Batch<'a> {
        let len = output_v.len();
        let (from, to, fours) = (segment.conductance_s, segment.end_conductance_s, segment.fours);
        let skin = Lines { from, to, share: &self.share, fours };
        let mode = self.rows.weights().mode();
        self.rows.sum(skin, &mut self.sums);
        self.sum_v.resize(len, 0.0);
        self.norm_v.resize(len, 0.0);
        self.cells.clear();
        for (i, output_v) in output_v.iter_mut().enumerate() {
            let weighted = self.rows.weighted(&skin, &self.sums, i);
            let norm = match mode {
                WeightMode::Raster => weighted,
                WeightMode::Analog => self.sums.squares[i].sqrt() / ANALOG_SCALE,
                WeightMode::Binary => moments.norm(self.share[i]),
            };
            *output_v = weighted * self.volts_per_siemens;
            self.norm_v[i] = norm * self.volts_per_siemens;
            self.sum_v[i] = moments.sum(self.share[i]) * self.volts_per_siemens;
        }
        for (i, norm) in self.rows.odd_norms(&skin) {
            self.norm_v[i] = norm * self.volts_per_siemens;
        }
        Batch {
            period_s: self.sample_rate_hz.recip(),
            volts_per_siemens: self.volts_per_siemens,
            sum_v: &mut self.sum_v,
            norm_v: &mut self.norm_v,
            output_v,
            rows: &self.rows,
            skin,
            cells: &mut self.cells,
        }
    }
}

/// Sums over the taxels at the ends of a segment. All terms are ≥ 0, and the sums in between are weighted means of
/// them, so that nothing cancels.
#[derive(Debug, Clone, Copy, Default)]
struct Moments {
    from: f64,
    to: f64,
    from_from: f64,
    from_to: f64,
    to_to: f64,
}

impl Moments {
    fn of(segment: &Segment<'_>) -> Self {
        let from = segment.conductance_s;
        let to = segment.end_conductance_s.unwrap_or(from);
        let mut lanes = [[0.0; LANES]; 5];
        let mut add = |l: usize, a: f64, b: f64| {
            lanes[0][l] += a;
            lanes[1][l] += b;
            lanes[2][l] += a * a;
            lanes[3][l] += a * b;
            lanes[4][l] += b * b;
        };
        match segment.fours {
            None => {
                for (a, b) in from.chunks(LANES).zip(to.chunks(LANES)) {
                    a.iter().zip(b).enumerate().for_each(|(l, (a, b))| add(l, *a, *b));
                }
            }
            // the same sums: what is left out is zero
            Some(fours) => {
                let taxels = fours.iter().flat_map(|four| 4 * *four as usize..4 * *four as usize + 4);
                taxels.take_while(|k| *k < from.len()).for_each(|k| add(k % LANES, from[k], to[k]));
            }
        }
        let [from, to, from_from, from_to, to_to] = lanes.map(|l| l.iter().sum());
        Self { from, to, from_from, from_to, to_to }
    }

    /// Σx at `share` of the segment.
    #[inline]
    fn sum(&self, share: f64) -> f64 {
        (1.0 - share) * self.from + share * self.to
    }

    /// √Σx² at `share` of the segment.
    #[inline]
    fn norm(&self, share: f64) -> f64 {
        let rest = 1.0 - share;
        (rest * rest * self.from_from + 2.0 * rest * share * self.from_to + share * share * self.to_to).sqrt()
    }
}
