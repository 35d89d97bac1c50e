//! Errors of scores: the same decoder on the recordings of every level.
//!
//! Dictionary and library are learned once, from the reference's conductance images of the first press. Every level's
//! second press is recorded with the same noise, decoded with the variant `matched` at M = 20, and scored against the
//! reference's conductance image at the same instant. Two levels then differ only in the contact.

use super::Reference;
use super::error::FidelityError;
use super::run::{ContactRun, nearest};
use spts::chain::Acquisition;
use spts::record::TwinError;
use spts::scene::{Scene, Task};
use spts_circuit::Mode;
use spts_eval::decoders::{PublishedDecode, TrainedDecoder};
use spts_eval::training::Learned;
use spts_eval::{Press, ScoreError, Scorer, Tally, Window};
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::dictionary::{Ksvd, Selection, select};
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};

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
/// Presses that condition the sheet before the one that is recorded.
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

/// What every level is scored with: what the decoder has learned, and the truth and the scores of every reference.
pub(super) struct ReferenceScores {
    decoder: TrainedDecoder,
    truths: Vec<Truth>,
    references: Vec<ChainScores>,
}

/// The reference of a scene: when its frames were, what was pressed at them, and when the scores are taken.
struct Truth {
    run: ContactRun,
    masks: Vec<Vec<bool>>,
}

impl ReferenceScores {
    /// Learns from the first repeats of the references, and from `others`, which stand for what else might be pressed,
    /// and scores the references' second ones.
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
        let cols = references.first().map_or(1, |r| r.at_reference.skin().cols());
        let learned = Learned::new(dictionary, None, library, cols);
        let mut learned = Self {
            decoder: PublishedDecode::Matched.decoder(&learned)?,
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
    pub(super) fn score(&self, scene: &Scene, run: &ContactRun, label: usize) -> Result<ChainScores, FidelityError> {
        let truth = &self.truths[label];
        let of_task = match scene.task() {
            Task::Press(_) => Acquisition::presses,
            Task::Drop(_) => Acquisition::drops,
        };
        let acquisition = Acquisition {
            conditioning_presses: PRESSES_BEFORE,
            ..of_task(Mode::Compressive, label as u64)
        };
        let recording = scene.chain().record(&[&run.frames], scene.duration_s(), &acquisition)?;
        let volts = &recording.blocks()[0].volts;
        let rate_hz = recording.sample_rate_hz();
        #[expect(clippy::cast_possible_truncation, reason = "cut to the recording's length")]
        let index = |time_s: f64| (time_s * rate_hz).clamp(0.0, volts.len() as f64) as usize;
        let [start, end] = truth.run.span_s.map(index);
        let first_s = truth.run.frames.iter().find(|f| f.wrench.force_n[2] > 0.0);
        let quiet = index(IDLE * first_s.map_or(scene.duration_s(), |f| f.time_s));
        let idle = volts[..quiet].iter().sum::<f64>() / quiet.max(1) as f64;
        let press = Press::within(&recording, 0, start..end, idle);
        let stride = (press.len() / WINDOWS).max(M);
        let (starts, windows): (Vec<usize>, Vec<Window<'_>>) = press.windows(0..press.len(), M, stride).unzip();
        let mut scorer = Scorer::new(&self.decoder);
        let answers = scorer.answers(&windows).map_err(ScoreError::from)?;
        let mut tally = Tally::default();
        for (window, answer) in starts.iter().zip(&answers) {
            let time_s = (start + window + M / 2) as f64 / rate_hz;
            if let Some(expected) = truth.mask(time_s) {
                tally.image(&answer.image, expected);
            }
        }
        let decisions: Vec<Option<usize>> = answers.iter().map(|a| scorer.class(a)).collect();
        tally.decisions(&decisions, label, decisions.len());
        let scores = tally.scores();
        Ok(ChainScores {
            support: scores.support.unwrap_or(0.0),
            iou: scores.iou.unwrap_or(0.0),
            class: scores.class_single.unwrap_or(0.0),
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
    let same: Vec<&[spts_contact::Frame]> = vec![&run.frames; PRESSES_BEFORE + 1];
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
