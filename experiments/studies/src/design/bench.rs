//! Sends touches through the circuit of a design, decodes and scores them.

use super::classes::Classes;
use super::objects::DesignObjects;
use super::rows::BandRows;
use super::wire::Pressing;
use crate::touches::{Touch, TouchScore, TouchWire};
use rand::RngExt as _;
use rayon::prelude::*;
use spts_circuit::Profile;
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::matrix_free::{SheetDecoder, SheetNoise, SheetPrior};

/// Touches of a repetition of procedural shapes, and of the seventeen objects, each once.
pub(super) const TOUCHES: [usize; 2] = [8, 17];

/// Touches on one specimen of the skin, and their samples.
#[derive(Debug)]
pub(super) struct Repetition {
    pub(super) touches: Vec<Touch>,
    /// Samples of every touch, V: by measurement, then by wire.
    volts: Vec<Vec<f64>>,
}

/// What a repetition found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct RepetitionScore {
    /// Mean IoU.
    pub(super) iou: f64,
    /// Median distance of the centres, taxels. A touch without an image counts with the skin's diagonal.
    pub(super) place_px: f64,
    /// Share of correctly classified objects, where objects are classified.
    pub(super) class: Option<f64>,
}

/// Draws the touches of `count` repetitions, each with a seed of its own under `label`.
pub(super) fn draw(
    objects: &DesignObjects,
    layout: &SkinLayout,
    label: &'static str,
    seed: u64,
    count: usize,
) -> Result<Vec<(Vec<Touch>, Streams)>, Refusal> {
    let touches = TOUCHES[usize::from(objects.seventeen)];
    (0..count as u64)
        .into_par_iter()
        .map(|index| {
            let streams = Streams::new(seed).child(label, index);
            let scene = objects.scene(layout, touches, streams.rng("design/touches", 0).random::<u64>() >> 1);
            Ok((scene.draw()?, streams))
        })
        .collect()
}

/// ΣG and ΣG² of the fullest touch on one of the bands.
pub(super) fn pressing(touches: &[&Touch], bands: &[std::ops::Range<usize>], cols: usize) -> Pressing {
    let mut most = Pressing {
        sum_s: f64::MIN_POSITIVE,
        square_s2: f64::MIN_POSITIVE,
    };
    for touch in touches {
        for band in bands {
            let values = &touch.conductance_s.values()[band.start * cols..band.end * cols];
            let (sum, square) = values.iter().fold((0.0, 0.0), |(s, q), g| (s + g, q + g * g));
            most.sum_s = most.sum_s.max(sum);
            most.square_s2 = most.square_s2.max(square);
        }
    }
    most
}

/// A design with its decoder, which learns rows as they are asked for.
pub(super) struct Bench {
    pub(super) layout: SkinLayout,
    pub(super) rows: BandRows,
    profile: Profile,
    pub(super) decoder: SheetDecoder,
    places: usize,
}

/// Taxels that are solved for with M measurements of a wire: this share of M. With as many taxels as measurements,
/// noise is fitted. The share is interpolated: M/2, M and 3M/2 were compared, on 48 touches of each of a few skins.
const PLACES_SHARE: f64 = 0.75;
/// Fewest taxels that are solved for.
const FEWEST_PLACES: usize = 4;

impl Bench {
    /// A design on `layout` with these rows and this readout, whose decoder expects images as `prior` says and solves
    /// for at most `places` taxels.
    pub(super) fn new(
        layout: SkinLayout,
        rows: BandRows,
        profile: Profile,
        prior: SheetPrior,
        places: usize,
    ) -> Result<Self, Refusal> {
        let decoder = SheetDecoder::new(prior, SheetNoise::default(), rows.bands.len()).map_err(Refusal::from_error)?;
        Ok(Self {
            layout,
            rows,
            profile,
            decoder,
            places,
        })
    }

    /// Taxels that are solved for with `measurements` of every wire.
    pub(super) fn places(&self, measurements: usize) -> usize {
        #[expect(clippy::cast_possible_truncation, reason = "thousands of measurements")]
        let of_rows = (PLACES_SHARE * measurements as f64).round() as usize;
        self.places.min(of_rows.max(FEWEST_PLACES))
    }

    /// Gets the decoder ready for `measurements` of every wire.
    pub(super) fn prepare(&mut self, measurements: usize) -> Result<(), Refusal> {
        let done = self.decoder.measurements() / self.rows.bands.len();
        if measurements > done {
            let (rows, wires) = self.rows.rows(done..measurements);
            self.decoder.extend(&rows, &wires).map_err(Refusal::from_error)?;
        }
        Ok(())
    }

    /// Measures what was drawn, `measurements` times on every wire.
    pub(super) fn measure(
        &self,
        drawn: Vec<(Vec<Touch>, Streams)>,
        measurements: usize,
    ) -> Result<Vec<Repetition>, Refusal> {
        let one = |(touches, streams): (Vec<Touch>, Streams)| -> Result<Repetition, Refusal> {
            let cols = self.layout.cols();
            let wires = self.rows.bands.len();
            let mut volts = vec![vec![0.0; wires * measurements]; touches.len()];
            for (wire, (band, weights)) in self.rows.bands.iter().zip(&self.rows.weights).enumerate() {
                let layout = SkinLayout::new(band.len(), cols, self.layout.pitch_m(), self.layout.electrode_m())?;
                let device = streams.child("design/wire", wire as u64);
                let mut line = TouchWire::new(&self.profile, weights, &layout, device)?;
                for ((number, touch), volts) in (0..).zip(&touches).zip(&mut volts) {
                    let own = touch.conductance_s.values()[band.start * cols..band.end * cols].to_vec();
                    let part = Touch {
                        conductance_s: ConductanceMap::from_values(band.len(), cols, own),
                        support: Vec::new(),
                        ..touch.clone()
                    };
                    let samples = line.measure(&part, number, 0, measurements)?;
                    for (k, v) in samples.into_iter().enumerate() {
                        volts[k * wires + wire] = v;
                    }
                }
            }
            Ok(Repetition { touches, volts })
        };
        drawn.into_par_iter().map(one).collect()
    }

    /// Scores of the first `measurements` of every wire, repetition by repetition.
    pub(super) fn score(
        &self,
        repetitions: &[Repetition],
        measurements: usize,
        classes: Option<&Classes>,
    ) -> Result<Vec<RepetitionScore>, Refusal> {
        let count = measurements * self.rows.bands.len();
        let places = self.places(measurements);
        let rows = classes.map(|classes| classes.rows(&self.rows.rows(0..measurements).0));
        let touches: Vec<(usize, &Touch, &[f64])> = repetitions
            .iter()
            .enumerate()
            .flat_map(|(r, rep)| {
                rep.touches
                    .iter()
                    .zip(&rep.volts)
                    .map(move |(t, v)| (r, t, &v[..count]))
            })
            .collect();
        let one = |(r, touch, volts): (usize, &Touch, &[f64])| -> Result<_, Refusal> {
            let image = self.decoder.non_negative(volts, places).map_err(Refusal::from_error)?;
            let right = match (classes, &rows) {
                (Some(classes), Some(rows)) => Some(classes.is_right(rows, volts, &touch.name)?),
                _ => None,
            };
            Ok((r, TouchScore::of(&image, touch, &self.layout), right))
        };
        let scores = touches.into_par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
        let far = (self.layout.rows() as f64).hypot(self.layout.cols() as f64);
        let of = |repetition: usize| {
            let own: Vec<_> = scores.iter().filter(|(r, _, _)| *r == repetition).collect();
            let share = 1.0 / own.len().max(1) as f64;
            let right = own.iter().map(|(_, _, right)| *right).collect::<Option<Vec<bool>>>();
            RepetitionScore {
                iou: own.iter().map(|(_, s, _)| share * s.iou).sum(),
                place_px: median(own.iter().map(|(_, s, _)| s.place_px.unwrap_or(far)).collect()),
                class: right.map(|right| share * right.iter().filter(|right| **right).count() as f64),
            }
        };
        Ok((0..repetitions.len()).map(of).collect())
    }
}

/// Mean of a quantity over repetitions.
pub(super) fn mean(scores: &[RepetitionScore], of: impl Fn(&RepetitionScore) -> f64) -> f64 {
    scores.iter().map(of).sum::<f64>() / scores.len().max(1) as f64
}

/// The middle one, or the mean of both.
fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len();
    if n == 0 {
        return 0.0;
    }
    0.5 * (values[(n - 1) / 2] + values[n / 2])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::design::rows::RowSource;

    #[test]
    fn the_middle_of_numbers() {
        assert!((median(vec![5.0, 1.0, 2.0]) - 2.0).abs() < 1e-15);
        assert!((median(vec![4.0, 1.0]) - 2.5).abs() < 1e-15 && median(Vec::new()).abs() < 1e-15);
    }

    /// An ideal wire with as many measurements as taxels shows touches nearly as they are, on one wire and on two; and
    /// any number of threads finds the same.
    #[test]
    fn ideal_wires_show_touches() {
        let layout = SkinLayout::new(8, 8, 0.015, 0.01).unwrap();
        let objects = DesignObjects::named("large").unwrap();
        for wires in [1, 2] {
            let run = |threads: usize| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| {
                    let drawn = draw(&objects, &layout, "test", 1, 2).unwrap();
                    let images: Vec<Touch> = drawn.iter().flat_map(|(t, _)| t.clone()).collect();
                    let prior = SheetPrior::like(images.iter().map(|t| t.conductance_s.values()), [8, 8]).unwrap();
                    let rows = BandRows::new(&RowSource::Generator, &prior, wires, 64, 1).unwrap();
                    let ideal = Profile::named("ideal").unwrap();
                    let mut bench = Bench::new(layout, rows, ideal, prior, 64).unwrap();
                    bench.prepare(64 / wires).unwrap();
                    let measured = bench.measure(drawn, 64 / wires).unwrap();
                    bench.score(&measured, 64 / wires, None).unwrap()
                })
            };
            let scores = run(1);
            assert!(mean(&scores, |s| s.iou) > 0.85, "{scores:?}");
            assert!(mean(&scores, |s| s.place_px) < 0.3, "{scores:?}");
            assert_eq!(scores, run(3));
        }
    }
}
