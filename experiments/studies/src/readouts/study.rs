//! The benchmark: every readout with the same skins, touches, wire, noise and clock.

use super::wire::SkinWire;
use super::{Reading, ReadoutLine, ReadoutSkin, WireReadout};
use crate::touches::{Touch, TouchObjects, TouchScene, TouchScore, band};
use rand::RngExt as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::dictionary::shifted;
use spts_recon::statistics::{Band, mean};
use std::sync::Arc;

/// Pitch of every skin, m: that of the published one.
const PITCH_M: f64 = 15e-3;
/// Objects that are told apart.
const OBJECTS: usize = 17;
/// Presses of each that its template is made of.
const TEMPLATE_PRESSES: usize = 2;
/// Random shapes that, with one press of every object, calibrate the feedback and the clock.
const CALIBRATION_SHAPES: usize = 16;

/// Settings of `spts readouts`, which compares readout methods with few wires.
#[derive(Clone)]
pub struct ReadoutsStudy {
    /// Readouts.
    pub readouts: Vec<&'static ReadoutLine>,
    /// Sides of the square skins, taxels.
    pub sides: Vec<usize>,
    /// Number of repetitions, each with its own specimen of the skin, parts, noise and touches.
    pub repetitions: usize,
    /// Number of shapes in a repetition, at random places, for image, place and latency.
    pub shapes: usize,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// One repetition on one size of skin.
struct Repetition {
    device: Streams,
    shapes: Vec<Touch>,
    objects: Vec<Touch>,
    templates: Templates,
}

/// Means of a readout over the touches of a repetition, one a number of measurements.
#[derive(Debug, Clone, Default)]
struct Means {
    measurements: usize,
    iou: f64,
    place_px: Vec<f64>,
    lost: usize,
    named: usize,
    noticed: Vec<f64>,
    placed: Vec<f64>,
    unnoticed: usize,
}

impl ReadoutsStudy {
    /// The settings as they are written to `parameters.json`.
    pub fn parameters(&self) -> impl Serialize + use<> {
        #[derive(Serialize)]
        struct Parameters {
            readouts: Vec<&'static str>,
            taxels: Vec<usize>,
            pitch_m: f64,
            repetitions: usize,
            shapes: usize,
            objects: usize,
            seed: u64,
        }
        Parameters {
            readouts: self.readouts.iter().map(|line| line.name).collect(),
            taxels: self.sides.iter().map(|side| side * side).collect(),
            pitch_m: PITCH_M,
            repetitions: self.repetitions,
            shapes: self.shapes,
            objects: OBJECTS,
            seed: self.seed,
        }
    }

    /// Runs every readout on every skin. All values are the same for any number of threads.
    ///
    /// # Errors
    /// [`Refusal`] if a skin cannot be built, touched or measured.
    pub fn run(&self, progress: &dyn Progress) -> Result<ReadoutsReport, Refusal> {
        let a_size = self.readouts.len() * (1 + self.repetitions);
        progress.stage("comparing readouts", Some(self.sides.len() * a_size));
        let mut report = ReadoutsReport { wires: Vec::new(), rows: Vec::new(), published: PUBLISHED };
        for &side in &self.sides {
            self.size(side, &mut report, progress)?;
        }
        progress.end();
        Ok(report)
    }

    /// All readouts on skins of one size.
    fn size(&self, side: usize, report: &mut ReadoutsReport, progress: &dyn Progress) -> Result<(), Refusal> {
        let layout = SkinLayout::with_pitch(side, side, PITCH_M)?;
        let calibration = self.calibration(layout)?;
        let sum = |touch: &Touch| touch.conductance_s.values().iter().sum::<f64>();
        let largest = calibration.iter().max_by(|a, b| sum(a).total_cmp(&sum(b)));
        let largest_s = largest.map_or_else(Vec::new, |touch| touch.conductance_s.values().to_vec());
        let wire = SkinWire::new(layout, &largest_s)?;
        let skin = ReadoutSkin::new(layout, self.seed);
        let repetitions: Vec<Repetition> = (0..self.repetitions as u64)
            .into_par_iter()
            .map(|index| self.repetition(layout, index))
            .collect::<Result<_, _>>()?;
        // a prior is prepared once, whoever asks for it first
        let mut prepared = Vec::with_capacity(self.readouts.len());
        for line in &self.readouts {
            let readout = (line.build)(&skin)?;
            let sums = calibration.iter().map(|touch| wire.largest_sum_s(&*readout, touch));
            let largest_sum_s = sums.fold(0.0, f64::max);
            prepared.push((*line, readout, largest_sum_s));
            progress.step();
        }
        let tasks: Vec<(usize, usize)> = (0..prepared.len())
            .flat_map(|line| (0..repetitions.len()).map(move |repetition| (line, repetition)))
            .collect();
        let means: Vec<(f64, Vec<Means>)> = tasks
            .into_par_iter()
            .with_max_len(1)
            .map(|(line, repetition)| {
                let (_, readout, largest_sum_s) = &prepared[line];
                let means = measure(&**readout, *largest_sum_s, &wire, &repetitions[repetition]);
                progress.step();
                means
            })
            .collect::<Result<_, _>>()?;
        report.wires.push(SizeWire { taxels: layout.taxels(), period_s: wire.period_s });
        for ((line, ..), means) in prepared.iter().zip(means.chunks(self.repetitions.max(1))) {
            let feedback_ohm = means.first().map_or(0.0, |(feedback_ohm, _)| *feedback_ohm);
            let repetitions: Vec<&[Means]> = means.iter().map(|(_, means)| &means[..]).collect();
            report.rows.push(ReadoutRow {
                readout: line.name,
                label: line.label,
                wires: line.wires,
                taxels: layout.taxels(),
                feedback_ohm,
                trials: trials(&repetitions, wire.period_s),
            });
        }
        Ok(())
    }

    /// Touches that set feedback and clock, on a specimen of their own.
    fn calibration(&self, layout: SkinLayout) -> Result<Vec<Touch>, Refusal> {
        let seed = Streams::new(self.seed).rng("readouts/calibration", 0).random();
        let shapes = TouchScene::new(layout, TouchObjects::Shapes, CALIBRATION_SHAPES, seed);
        let objects = TouchScene { placed: true, ..TouchScene::new(layout, TouchObjects::Objects, OBJECTS, seed) };
        let mut touches = shapes.draw()?;
        touches.extend(objects.draw()?);
        Ok(touches)
    }

    fn repetition(&self, layout: SkinLayout, index: u64) -> Result<Repetition, Refusal> {
        let device = Streams::new(self.seed).child("readouts/repetition", index);
        let seed = |label: &str| device.rng(label, 0).random();
        let specimen = Some(seed("specimen"));
        let objects = |label: &str, presses: usize| TouchScene {
            placed: true,
            specimen,
            ..TouchScene::new(layout, TouchObjects::Objects, presses * OBJECTS, seed(label))
        };
        let shapes =
            TouchScene { specimen, ..TouchScene::new(layout, TouchObjects::Shapes, self.shapes, seed("shapes")) };
        let learned = objects("templates", TEMPLATE_PRESSES).draw()?;
        Ok(Repetition {
            device,
            shapes: shapes.draw()?,
            objects: objects("objects", 1).draw()?,
            templates: Templates::new(&learned, layout.cols()),
        })
    }
}

/// One readout in one repetition: its feedback, Ω, and its means.
fn measure(
    readout: &dyn WireReadout,
    largest_sum_s: f64,
    skin: &SkinWire,
    repetition: &Repetition,
) -> Result<(f64, Vec<Means>), Refusal> {
    let mut session = skin.session(largest_sum_s, repetition.device)?;
    let mut means: Vec<Means> = Vec::new();
    let touches = repetition.shapes.iter().chain(&repetition.objects);
    for (number, touch) in (0..).zip(touches) {
        let readings = readout.read(session.hold(touch, number))?;
        means.resize(readings.len(), Means::default());
        for (means, reading) in means.iter_mut().zip(&readings) {
            means.measurements = reading.measurements;
            if number < repetition.shapes.len() as u64 {
                means.add_shape(reading, touch, &skin.layout, repetition.shapes.len() as f64);
            } else {
                let named = repetition.templates.name(&reading.image);
                means.named += usize::from(named == Some(&*touch.name));
            }
        }
    }
    Ok((session.profile.feedback_ohm, means))
}

impl Means {
    fn add_shape(&mut self, reading: &Reading, touch: &Touch, layout: &SkinLayout, count: f64) {
        let score = TouchScore::of(&reading.image, touch, layout);
        self.iou += score.iou / count;
        match score.place_px {
            Some(place_px) => self.place_px.push(place_px),
            None => self.lost += 1,
        }
        self.noticed.extend(reading.noticed);
        self.placed.extend(reading.placed);
        self.unnoticed += usize::from(reading.noticed.is_none());
    }
}

/// Bands over the repetitions, one line a number of measurements.
fn trials(repetitions: &[&[Means]], period_s: f64) -> Vec<ReadoutTrial> {
    let count = repetitions.first().map_or(0, |means| means.len());
    let trial = |index: usize| {
        let means: Vec<&Means> = repetitions.iter().filter_map(|means| means.get(index)).collect();
        let each =
            |value: &dyn Fn(&Means) -> Option<f64>| band(&means.iter().filter_map(|m| value(m)).collect::<Vec<f64>>());
        let measurements = means.first().map_or(0, |m| m.measurements);
        let touches = |m: &Means| (m.place_px.len() + m.lost).max(1) as f64;
        let share = |part: &dyn Fn(&Means) -> usize| mean(means.iter().map(|m| part(m) as f64 / touches(m)));
        ReadoutTrial {
            measurements,
            frames_hz: 1.0 / (measurements as f64 * period_s),
            iou: each(&|m| Some(m.iou)),
            place_px: each(&|m| mean(&m.place_px)),
            accuracy: each(&|m| Some(m.named as f64 / OBJECTS as f64)),
            noticed_s: each(&|m| Some(mean(&m.noticed)? * period_s)),
            placed_s: each(&|m| Some(mean(&m.placed)? * period_s)),
            lost: share(&|m| m.lost).unwrap_or(0.0),
            unnoticed: share(&|m| m.unnoticed).unwrap_or(0.0),
        }
    };
    (0..count).map(trial).collect()
}

/// IoU from which an image counts as good.
pub const GOOD_IOU: f64 = 0.8;

/// The clock for skins of one size, the same for all readouts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SizeWire {
    /// Taxels N.
    pub taxels: usize,
    /// Duration of a measurement, s.
    pub period_s: f64,
}

/// One readout with one number of measurements; bands over the repetitions.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ReadoutTrial {
    /// Number of measurements for an image, M.
    pub measurements: usize,
    /// Images a second with the common clock.
    pub frames_hz: f64,
    /// Intersection over union of the supports, for shapes at random places.
    pub iou: Option<Band>,
    /// Distance of the centres, taxels, for the shapes with a non-empty image.
    pub place_px: Option<Band>,
    /// Share of the seventeen objects that are classified correctly.
    pub accuracy: Option<Band>,
    /// Mean time from a touch at a random moment to a sample beyond the alarm threshold, s, for the touches that are
    /// noticed.
    pub noticed_s: Option<Band>,
    /// Mean time from a touch until its place is known, s.
    pub placed_s: Option<Band>,
    /// Share of the shapes with an empty image.
    pub lost: f64,
    /// Share of the shapes without a sample beyond the alarm threshold.
    pub unnoticed: f64,
}

impl ReadoutTrial {
    /// Whether the mean IoU is good.
    pub fn is_good(&self) -> bool {
        self.iou.is_some_and(|iou| iou.mean >= GOOD_IOU)
    }
}

/// Results of one readout method on skins of one size.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadoutRow {
    /// Name.
    pub readout: &'static str,
    /// Name in figures.
    #[serde(skip)]
    pub label: &'static str,
    /// Number of measured wires.
    pub wires: usize,
    /// Taxels N.
    pub taxels: usize,
    /// Largest feedback resistance for which its sums fit, Ω.
    pub feedback_ohm: f64,
    /// One entry for each number of measurements, in increasing order.
    pub trials: Vec<ReadoutTrial>,
}

impl ReadoutRow {
    /// The trial with the fewest measurements and a good image; otherwise the one with the best IoU.
    pub fn deciding(&self) -> Option<&ReadoutTrial> {
        let iou = |t: &ReadoutTrial| t.iou.map_or(0.0, |iou| iou.mean);
        let best = self.trials.iter().max_by(|a, b| iou(a).total_cmp(&iou(b)));
        self.trials.iter().find(|t| t.is_good()).or(best)
    }
}

/// Results of `spts readouts`: all readout methods on skins of all sizes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReadoutsReport {
    /// The clock of every size.
    pub wires: Vec<SizeWire>,
    /// Ordered by size, then in the order of the table.
    pub rows: Vec<ReadoutRow>,
    /// Figures stated by published systems.
    pub published: &'static [PublishedSystem],
}

/// Shifts that are tried along either axis, taxels.
const REACH: usize = 1;

/// Names of known objects, and their images from other presses on the same skin, shifted by up to a taxel along each
/// axis: an image is classified by the most similar one.
struct Templates(Vec<(Arc<str>, Matrix)>);

impl Templates {
    /// Templates from `touches` on a skin of `cols` columns: the mean of all touches of an object, normalised to length
    /// 1.
    fn new(touches: &[Touch], cols: usize) -> Self {
        let length = |values: &[f64]| values.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        let mut sums: Vec<(Arc<str>, Vec<f64>)> = Vec::new();
        for touch in touches {
            let values = touch.conductance_s.values();
            let own = length(values);
            match sums.iter_mut().find(|(name, _)| *name == touch.name) {
                Some((_, sum)) => sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v / own),
                None => sums.push((touch.name.clone(), values.iter().map(|v| v / own).collect())),
            }
        }
        let known = sums.into_iter().map(|(name, sum)| {
            let own = length(&sum);
            let mean: Vec<f64> = sum.iter().map(|v| v / own).collect();
            (name, shifted(&Matrix::from_column_slices(mean.len(), &[&mean]), cols, REACH))
        });
        Self(known.collect())
    }

    /// The object whose template correlates most with `image`. The length of `image` does not matter. `None` for an
    /// empty image.
    fn name(&self, image: &[f64]) -> Option<&str> {
        let scores = self.0.iter().map(|(name, shifted)| {
            let mut correlations = vec![0.0; shifted.ncols()];
            shifted.accumulate_row(image, &mut correlations);
            (correlations.into_iter().fold(0.0, f64::max), &**name)
        });
        let best = scores.reduce(|a, b| if b.0 > a.0 { b } else { a });
        best.filter(|(score, _)| *score > 0.0).map(|(_, name)| name)
    }
}

/// A published system.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PublishedSystem {
    /// Name.
    pub name: &'static str,
    /// Taxels.
    pub taxels: usize,
    /// Images a second, as stated; for events, the inverse of the stated latency.
    pub frames_hz: f64,
    /// Signal wires, as text.
    pub wires: &'static str,
    /// The stated figure.
    pub stated: &'static str,
    /// Source.
    pub source: &'static str,
}

/// A system as published: name, taxels, images a second, wires, the stated figure, source.
const fn system(
    name: &'static str,
    taxels: usize,
    frames_hz: f64,
    [wires, stated, source]: [&'static str; 3],
) -> PublishedSystem {
    PublishedSystem { name, taxels, frames_hz, wires, stated, source }
}

/// Published systems, from few taxels to many.
const PUBLISHED: &[PublishedSystem] = &[
    system("CDMA skin", 16, 78.0, ["1", "measured", "arXiv 2509.10888"]),
    system("SPTS", 100, 3500.0, ["1, and a bus", "measured, M = 20", "arXiv 2511.16898"]),
    system("ACES", 240, 1000.0, ["1", "measured, 1 ms an event", "Science Robotics 4 (2019) eaax2198"]),
    system("ACTS, adaptive", 1024, 1000.0, ["rows and columns", "measured, the most", "arXiv 2410.13847"]),
    system("ACTS, raster", 1024, 56.0, ["rows and columns", "measured", "arXiv 2410.13847"]),
    system("Hollis", 4096, 100.0, ["not stated", "simulated, M = 1024, at least", "arXiv 1705.05247"]),
    system(
        "TUM H1",
        7560,
        250.0,
        ["47 patches", "measured, sensors of several kinds", "G. Cheng et al., Proc. IEEE 107 (2019) 2034"],
    ),
    system("BYU fabric", 8000, 50.0, ["SPI, daisy-chained", "measured, at least, on 1 m²", "arXiv 2508.20959"]),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// Other presses of the seventeen objects are named from their images as they are, also a taxel further.
    #[test]
    fn other_presses_are_named() {
        let scene = TouchScene {
            placed: true,
            specimen: Some(5),
            ..TouchScene::new(SkinLayout::default(), TouchObjects::Objects, 34, 1)
        };
        let templates = Templates::new(&scene.draw().unwrap(), 10);
        let others = TouchScene { seed: 2, touches: 17, ..scene }.draw().unwrap();
        let right = |shift: usize| {
            let named = others.iter().filter(|touch| {
                let mut image = touch.conductance_s.values().to_vec();
                image.rotate_right(shift);
                templates.name(&image) == Some(&*touch.name)
            });
            named.count()
        };
        assert!(right(0) >= 15 && right(1) >= 10, "{} and {} of 17", right(0), right(1));
        assert_eq!(templates.name(&[0.0; 100]), None);
    }
}
