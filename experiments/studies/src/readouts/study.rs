//! The benchmark: every readout with the same skins, touches, wire, noise and clock.

use super::classify::Templates;
use super::readout::{PreparedReadout, Reading, ReadoutSkin};
use super::report::{ReadoutRow, ReadoutTrial, ReadoutsReport, SizeWire};
use super::table::ReadoutLine;
use super::wire::WireSession;
use super::wiring::SkinWire;
use crate::touches::{Touch, TouchObjects, TouchScene, TouchScore, band};
use rand::RngExt as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::statistics::mean;

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

/// The settings of a run of `spts readouts` as they are written to `parameters.json`.
#[derive(Debug, Clone, Serialize)]
pub struct ReadoutsParameters {
    readouts: Vec<&'static str>,
    taxels: Vec<usize>,
    pitch_m: f64,
    repetitions: usize,
    shapes: usize,
    objects: usize,
    seed: u64,
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
    /// The parameters of the study.
    #[must_use]
    pub fn parameters(&self) -> ReadoutsParameters {
        ReadoutsParameters {
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
        let mut report = ReadoutsReport::default();
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
        let wire = SkinWire::new(u32::try_from(layout.taxels()).unwrap_or(u32::MAX), &largest_s)?;
        let skin = ReadoutSkin::new(layout, self.seed);
        let repetitions: Vec<Repetition> = (0..self.repetitions as u64)
            .into_par_iter()
            .map(|index| self.repetition(layout, index))
            .collect::<Result<_, _>>()?;
        // a prior is prepared once, whoever asks for it first
        let mut prepared = Vec::with_capacity(self.readouts.len());
        for line in &self.readouts {
            let readout = (line.build)().prepare(&skin)?;
            let sums = calibration.iter().map(|touch| {
                let pressed: Vec<f64> = touch.conductance_s.values().iter().map(|g| g + wire.idle_s).collect();
                readout.largest_sum_s(&pressed)
            });
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
                let means = measure(&**readout, *largest_sum_s, &wire, layout, &repetitions[repetition]);
                progress.step();
                means
            })
            .collect::<Result<_, _>>()?;
        report.wires.push(SizeWire {
            taxels: layout.taxels(),
            period_s: wire.period_s,
        });
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
        let objects = TouchScene {
            placed: true,
            ..TouchScene::new(layout, TouchObjects::Objects, OBJECTS, seed)
        };
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
        let shapes = TouchScene {
            specimen,
            ..TouchScene::new(layout, TouchObjects::Shapes, self.shapes, seed("shapes"))
        };
        let learned = objects("templates", TEMPLATE_PRESSES).draw()?;
        Ok(Repetition {
            device,
            shapes: shapes.draw()?,
            objects: objects("objects", 1).draw()?,
            templates: Templates::new(&learned, layout.rows(), layout.cols()),
        })
    }
}

/// One readout in one repetition: its feedback, Ω, and its means.
fn measure(
    readout: &dyn PreparedReadout,
    largest_sum_s: f64,
    skin: &SkinWire,
    layout: SkinLayout,
    repetition: &Repetition,
) -> Result<(f64, Vec<Means>), Refusal> {
    let wire = skin.fitted(largest_sum_s, repetition.device.child("session", 0))?;
    let conductances = [skin.idle_s, skin.pressed_s()];
    let mut session = WireSession::new(&wire, layout, repetition.device, skin.period_s, conductances);
    let mut means: Vec<Means> = Vec::new();
    let touches = repetition.shapes.iter().chain(&repetition.objects);
    for (number, touch) in (0..).zip(touches) {
        let readings = readout.read(&mut session.hold(touch, number))?;
        means.resize(readings.len(), Means::default());
        for (means, reading) in means.iter_mut().zip(&readings) {
            means.measurements = reading.measurements;
            if number < repetition.shapes.len() as u64 {
                means.add_shape(reading, touch, &layout, repetition.shapes.len() as f64);
            } else {
                let named = repetition.templates.name(&reading.image);
                means.named += usize::from(named == Some(&*touch.name));
            }
        }
    }
    Ok((wire.feedback_ohm, means))
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
