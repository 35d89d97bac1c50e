//! What a design promises, from touches and specimens that the search has not seen.

use super::band::{OUTSIDE, promise};
use super::bench::{RepetitionScore, TOUCHES, draw};
use super::classes::Classes;
use super::report::{DecoderDesign, Design, Expectation};
use super::rows::{BandRows, RowSource};
use super::search::Tried;
use super::study::{DesignStudy, Ground};
use crate::touches::Touch;
use spts_input::Refusal;

/// Repetitions that the promise rests on.
const PROMISED: usize = 16;
/// Measurements are raised by this factor when the promise falls short of what the search found, so many times.
const RAISE: (f64, usize) = (1.2, 4);
/// Most taxels with classes: their templates are dense.
const MOST_CLASS_TAXELS: usize = 2048;
/// Labels of the promises' touches: every attempt has its own.
const PROMISES: [&str; 5] = [
    "design/promised",
    "design/promised/1",
    "design/promised/2",
    "design/promised/3",
    "design/promised/4",
];

impl DesignStudy {
    /// What the chosen design promises, from touches and specimens that the search has not seen. Where that is short of
    /// the IoU, there are more measurements.
    pub(super) fn promised(&self, ground: &Ground, mut tried: Tried) -> Result<(Tried, Design), Refusal> {
        let wires = tried.curve.wires;
        let classes = self.classes(ground)?;
        let mut m = tried.chosen();
        for raise in 0.. {
            let rows = match tried.source {
                RowSource::Generator => tried.bench.rows.clone(),
                // the pattern that the cells repeat has as many rows as are measured
                RowSource::Designer(_) => BandRows::new(&tried.source, &ground.prior, wires, m, self.seed)?,
            };
            tried.bench.rows = rows;
            tried.bench.prepare(m)?;
            let label = PROMISES[usize::min(raise, PROMISES.len() - 1)];
            let drawn = draw(&self.objects, &ground.layout, label, self.seed, PROMISED)?;
            let measured = tried.bench.measure(drawn, m)?;
            let scores = tried.bench.score(&measured, m, classes.as_ref())?;
            let expected = self.expectation(ground, &scores)?;
            let short = expected.iou.mean < self.iou && tried.reached.is_some();
            if short && m < tried.most && raise < RAISE.1 {
                #[expect(clippy::cast_possible_truncation, reason = "thousands of measurements")]
                let more = (m as f64 * RAISE.0).ceil() as usize;
                m = more.min(tried.most);
                continue;
            }
            tried.reached = (!short && tried.reached.is_some()).then_some(m);
            let design = self.design(ground, &tried, m, expected);
            return Ok((tried, design));
        }
        unreachable!("the range has no end")
    }

    /// Classes of the seventeen objects, where they can be told apart.
    pub(super) fn classes(&self, ground: &Ground) -> Result<Option<Classes>, Refusal> {
        if self.no_class(ground).is_some() {
            return Ok(None);
        }
        let touches: Vec<&Touch> = ground.learned.iter().collect();
        Classes::new(&touches, ground.layout.cols()).map(Some)
    }

    /// Why classes cannot be told apart.
    fn no_class(&self, ground: &Ground) -> Option<String> {
        let taxels = ground.layout.taxels();
        if !self.objects.seventeen {
            Some("procedural shapes have no classes".to_owned())
        } else if !self.objects.placed {
            Some("the classifier knows the seventeen objects at their published places only".to_owned())
        } else if taxels > MOST_CLASS_TAXELS {
            Some(format!(
                "{taxels} taxels: templates are for {MOST_CLASS_TAXELS} at most"
            ))
        } else {
            None
        }
    }

    fn expectation(&self, ground: &Ground, scores: &[RepetitionScore]) -> Result<Expectation, Refusal> {
        let of = |values: Vec<f64>, quantities: usize, range: [f64; 2]| {
            promise(&values, quantities, range).ok_or_else(|| Refusal::new("promise: fewer than two repetitions"))
        };
        let class: Option<Vec<f64>> = scores.iter().map(|s| s.class).collect();
        let quantities = if class.is_some() { 3 } else { 2 };
        let place = |scale: f64| scores.iter().map(|s| scale * s.place_px).collect::<Vec<f64>>();
        let open = [0.0, f64::MAX];
        Ok(Expectation {
            iou: of(scores.iter().map(|s| s.iou).collect(), quantities, [0.0, 1.0])?,
            place_px: of(place(1.0), quantities, open)?,
            place_mm: of(place(1e3 * ground.layout.pitch_m()), quantities, open)?,
            class: class.map(|class| of(class, quantities, [0.0, 1.0])).transpose()?,
            no_class: self.no_class(ground),
            repetitions: scores.len(),
            touches: TOUCHES[usize::from(self.objects.seventeen)],
            outside: OUTSIDE,
        })
    }

    fn design(&self, ground: &Ground, tried: &Tried, m: usize, expected: Expectation) -> Design {
        let layout = &ground.layout;
        let (rows, cols, wires) = (layout.rows(), layout.cols(), tried.curve.wires);
        let decoder = &tried.bench.decoder;
        let prior = &ground.prior;
        Design {
            rows,
            cols,
            taxels: layout.taxels(),
            pitch_m: layout.pitch_m(),
            electrode_m: layout.electrode_m(),
            objects: self.objects.clone(),
            wires,
            sub_arrays: tried.bench.rows.bands.iter().map(|band| band.len() * cols).collect(),
            wire: tried.wire.clone(),
            row_source: tried.source.clone(),
            m_per_wire: m,
            m: m * wires,
            decoder: DecoderDesign {
                name: "SheetDecoder".to_owned(),
                places: tried.bench.places(m),
                covariance_along_rows: (0..cols).map(|d| prior.covariance(0, d)).collect(),
                covariance_along_cols: (0..rows).map(|d| prior.covariance(0, d * cols)).collect(),
                bytes: decoder.bytes(m * wires),
                products: decoder.products(m * wires, tried.bench.places(m)),
            },
            expected,
            seed: self.seed,
        }
    }
}
