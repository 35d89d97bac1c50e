//! The error that reaches the user: the same decoder on the recordings of every rung.
//!
//! Dictionary and library are learned once, from the reference's conductance images of the first press; every rung's second
//! press is recorded with the same noise, decoded with the matched weights at M = 20 and scored against the reference's
//! conductance image of the same instant. What differs between two rungs is then the contact alone.

use super::Reference;
use super::error::FidelityError;
use super::run::{ContactRun, nearest};
use spts::chain::Take;
use spts::scene::{Scene, Task};
use spts::twin::TwinError;
use spts_circuit::Mode;
use spts_eval::score::{Decode, Decoder, Projected};
use spts_models::Streams;
use spts_recon::classify::{Library, Src};
use spts_recon::dictionary::{Ksvd, Selection, select};
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::{Matrix, Workspace};

/// Measurements of a window.
const M: usize = 20;
/// Most windows scored of one recording, spread evenly over the span.
const WINDOWS: usize = 300;
/// Library images of a scene.
const LIBRARY_IMAGES: usize = 10;
/// Training images of a scene at most.
const TRAINING_IMAGES: usize = 120;
/// Sweeps of the dictionary learning.
const SWEEPS: usize = 10;
/// Presses that work the sheet in before the one that is recorded.
const PRESSES_BEFORE: usize = 2;
/// Share of the time to the first touch that is idle for sure.
const IDLE: f64 = 0.8;

/// Scores of one run.
#[derive(Debug, Clone, Copy)]
pub(super) struct ChainScores {
    /// Support accuracy.
    pub(super) support: f64,
    /// Intersection over union.
    pub(super) iou: f64,
    /// Share of windows classified correctly.
    pub(super) class: f64,
}

/// Images of a run: conductance above that of the idle skin, relative to its peak, frame by frame.
type Images = Vec<Vec<f64>>;

/// What every rung is scored with: what the decoder has learned, and the truth and the scores of every reference.
pub(super) struct ReferenceScores {
    dictionary: Matrix,
    classifier: Src,
    truths: Vec<Truth>,
    references: Vec<ChainScores>,
}

/// The reference of a scene: when its frames were, what was pressed at them, and when the scores are taken.
struct Truth {
    run: ContactRun,
    masks: Vec<Vec<bool>>,
}

impl ReferenceScores {
    /// Learns from the first repeats of the references, and from `others`, which stand for what else might be pressed, and
    /// scores the references' second ones.
    pub(super) fn learn(
        references: &[Reference],
        others: &[(Scene, ContactRun)],
        seed: u64,
    ) -> Result<Self, FidelityError> {
        let (mut training, mut library, mut labels) = (Images::new(), Images::new(), Vec::new());
        let known = references.iter().map(|r| (&r.at_reference, &r.learned));
        for (label, (scene, run)) in known.chain(others.iter().map(|(s, r)| (s, r))).enumerate() {
            let images = images(scene, run)?;
            let stride = images.len().div_ceil(TRAINING_IMAGES).max(1);
            training.extend(images.iter().step_by(stride).cloned());
            let full: Vec<&Vec<f64>> = images.iter().filter(|image| peak(image) > 0.7).collect();
            for k in 0..LIBRARY_IMAGES.min(full.len()) {
                library.push(full[k * full.len() / LIBRARY_IMAGES.min(full.len())].clone());
                labels.push(label);
            }
        }
        let streams = Streams::new(seed);
        // relative to the peak, published thresholds of 0.25 V on images of a few volts become a tenth
        let selection = Selection {
            min_peak: 0.1,
            ..Selection::default()
        };
        let chosen: Images = select(&training, &selection)
            .into_iter()
            .map(|i| training[i].clone())
            .collect();
        let ksvd = Ksvd {
            n_iter: SWEEPS,
            ..Ksvd::default()
        };
        let dictionary = ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))?;
        let columns: Vec<&[f64]> = library.iter().map(Vec::as_slice).collect();
        let library = Library::new(&Matrix::from_column_slices(dictionary.nrows(), &columns), &labels)?;
        let mut learned = Self {
            dictionary,
            classifier: Src::new(library, Src::PUBLISHED_SPARSITY),
            truths: Vec::new(),
            references: Vec::new(),
        };
        for (label, reference) in references.iter().enumerate() {
            learned
                .truths
                .push(Truth::new(&reference.at_reference, &reference.scored)?);
            let scores = learned.score(&reference.at_reference, &reference.scored, label)?;
            learned.references.push(scores);
        }
        Ok(learned)
    }

    /// Scores of the reference of the scene with the index `label`.
    pub(super) fn reference(&self, label: usize) -> ChainScores {
        self.references[label]
    }

    /// Records and decodes `run`, of the scene with the index `label`.
    pub(super) fn score(&self, scene: &Scene, run: &ContactRun, label: usize) -> Result<ChainScores, TwinError> {
        let truth = &self.truths[label];
        let task = match scene.task() {
            Task::Press(_) => Take::presses,
            Task::Drop(_) => Take::drops,
        };
        let take = Take {
            worked_in: PRESSES_BEFORE,
            ..task(Mode::Compressive, label as u64)
        };
        let recording = scene.chain().record(&[&run.frames], scene.duration_s(), &take)?;
        let volts = &recording.blocks()[0].volts;
        let rate_hz = recording.sample_rate_hz();
        #[expect(clippy::cast_possible_truncation, reason = "cut to the recording's length")]
        let index = |time_s: f64| (time_s * rate_hz).clamp(0.0, volts.len() as f64) as usize;
        let [start, end] = truth.run.span_s.map(index);
        let first_s = truth.run.frames.iter().find(|f| f.wrench.force_n[2] > 0.0);
        let quiet = index(IDLE * first_s.map_or(scene.duration_s(), |f| f.time_s));
        let idle = volts[..quiet].iter().sum::<f64>() / quiet.max(1) as f64;
        let projected = Projected::new(&recording, 0, start, end - start, idle, &self.dictionary);
        let mut decoder = Decoder::new(&self.dictionary);
        let (mut mean, mut work, mut mask) = (MeanScore::default(), Workspace::default(), Vec::new());
        let (mut correct, mut windows) = (0.0, 0.0);
        let stride = ((end - start) / WINDOWS).max(M);
        for window in (0..(end - start).saturating_sub(M - 1)).step_by(stride) {
            let Some(image) = decoder.decode(&projected, Decode::Matched, window, M) else {
                continue;
            };
            support(image, SUPPORT_THRESHOLD, &mut mask);
            let time_s = (start + window + M / 2) as f64 / rate_hz;
            if let Some(expected) = truth.mask(time_s) {
                mean.add(SupportScore::new(&mask, expected));
            }
            let decision = self.classifier.classify(image, &mut work).unwrap_or_default();
            correct += f64::from(u8::from(decision == Some(label)));
            windows += 1.0;
        }
        let score = mean.mean();
        Ok(ChainScores {
            support: score.map_or(0.0, |s| s.accuracy),
            iou: score.map_or(0.0, |s| s.iou),
            class: if windows > 0.0 { correct / windows } else { 0.0 },
        })
    }
}

impl Truth {
    fn new(scene: &Scene, run: &ContactRun) -> Result<Self, TwinError> {
        let images = images(scene, run)?;
        let masks = images.iter().map(|image| {
            let mut mask = Vec::new();
            support(image, SUPPORT_THRESHOLD, &mut mask);
            mask
        });
        Ok(Self {
            masks: masks.collect(),
            run: run.clone(),
        })
    }

    fn mask(&self, time_s: f64) -> Option<&[bool]> {
        let index = nearest(&self.run.frames, time_s)?;
        self.masks.get(index).map(Vec::as_slice)
    }
}

/// Conductance of every frame above that of the first, with nothing on the skin, relative to the run's peak.
fn images(scene: &Scene, run: &ContactRun) -> Result<Images, TwinError> {
    let same: Vec<&[spts_sim::Frame]> = vec![&run.frames; PRESSES_BEFORE + 1];
    let maps = scene.chain().conductance_maps(&same, 0).pop().unwrap_or_default();
    let idle = maps.first().map_or_else(Vec::new, |map| map.values().to_vec());
    let above = maps.iter().map(|map| {
        let pairs = map.values().iter().zip(&idle);
        pairs.map(|(g, g0)| (g - g0).max(0.0)).collect::<Vec<f64>>()
    });
    let mut images: Images = above.collect();
    let full = images.iter().map(|image| peak(image)).fold(0.0, f64::max);
    if full > 0.0 {
        images.iter_mut().flatten().for_each(|v| *v /= full);
    }
    Ok(images)
}

fn peak(image: &[f64]) -> f64 {
    image.iter().copied().fold(0.0, f64::max)
}
