//! How the settings of the regularised decoders were chosen: on raster presses of the real skin that are not scored.

use crate::recordings::recordings;
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;
use spts_eval::{PublishedSkin, ScoredSession};
use spts_models::Streams;
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::recover::{ImagePrior, NnLmmse, Noise};
use spts_recon::{Matrix, MatrixView, Problem, Recover, Workspace};
use std::sync::Arc;

/// Frames of a raster press that a prior is learned from: rise, plateau and lift.
const FRAMES: [usize; 3] = [520, 580, 640];
/// Contact noise and what the model misses, as a share of the root mean square of y; chosen below.
const NOISE: Noise = Noise::Relative(0.12);

/// Noise of the windows that settings are chosen on, as a share of ‖x‖₂: that of a good session, and one that also
/// covers what changes between a raster and a compressive session.
const SYNTHETIC_NOISE: [f64; 2] = [0.08, 0.16];
/// Measurements of these windows.
const SYNTHETIC_M: [usize; 4] = [7, 13, 20, 25];
/// The frame that these windows measure.
const SYNTHETIC_FRAME: usize = 599;

/// Noises that are tried with every prior.
const NOISES: [f64; 3] = [0.08, 0.12, 0.18];

/// Every prior that is tried: all settings coarsely, then those of the best kind more finely.
fn priors() -> Vec<ImagePrior> {
    let mut priors = Vec::new();
    let mut push = |reach, stay, threshold, equal_length, centred| {
        priors.extend([0.01, 0.03, 0.1].map(|floor| ImagePrior {
            reach,
            stay,
            threshold,
            equal_length,
            centred,
            floor,
        }));
    };
    for (stay, reach) in [(0.0, 1), (0.3, 1), (0.6, 1), (0.9, 1), (0.3, 2), (0.6, 2)] {
        for threshold in [0.0, 0.2, 0.4] {
            for (equal_length, centred) in [(false, false), (false, true), (true, false), (true, true)] {
                push(reach, stay, threshold, equal_length, centred);
            }
        }
    }
    for reach in [1, 2, 3] {
        for stay in [0.15, 0.3, 0.45] {
            for threshold in [0.3, 0.4, 0.5, 0.6] {
                push(reach, stay, threshold, true, false);
            }
        }
    }
    priors
}

/// How `ImagePrior::UNSEEN` and `NOISE` were chosen: each object in turn is left out of the prior, and windows of ±1
/// weights are made of its raster images, with noise. No compressive frame and no scored press takes part. What counts
/// is the mean of two numbers, both means over numbers of measurements and noises: the IoU of all objects, and that of
/// the half that comes off worst. Prints the best of the grid.
#[test]
#[ignore = "decodes a million windows to choose settings"]
fn settings_are_chosen_on_raster_presses_that_are_not_scored() {
    let Some(root) = recordings() else { return };
    let real = PublishedSkin::open(&root).unwrap();
    let mut rows: Vec<Choice> = priors().into_par_iter().flat_map(|prior| choices(&real, prior)).collect();
    rows.sort_by(|a, b| b.value().total_cmp(&a.value()));
    eprintln!("value  all    worst half  of all at M = {SYNTHETIC_M:?}  settings");
    rows.iter().take(25).for_each(|choice| eprintln!("{choice}"));
    let chosen = |c: &&Choice| c.prior == ImagePrior::UNSEEN && Noise::Relative(c.noise) == NOISE;
    let chosen = rows.iter().find(chosen).unwrap();
    eprintln!("{chosen} is chosen");
    // the grid is flat at its top: a hundredth is less than what another draw of the noise changes
    assert!(chosen.value() >= rows[0].value() - 0.01);
}

/// Settings of a left-out decoder, and what they are worth.
struct Choice {
    prior: ImagePrior,
    noise: f64,
    /// Mean IoU of every object, from the worst to the best.
    objects: Vec<f64>,
    /// Mean IoU for every M.
    of_m: [f64; SYNTHETIC_M.len()],
}

impl Choice {
    /// Mean IoU of all objects and of the worst half.
    fn means(&self) -> [f64; 2] {
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        [mean(&self.objects), mean(&self.objects[..self.objects.len() / 2])]
    }

    fn value(&self) -> f64 {
        let [all, worst_half] = self.means();
        0.5 * (all + worst_half)
    }
}

impl std::fmt::Display for Choice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [all, worst_half] = self.means();
        let Self { of_m, noise, prior, .. } = self;
        write!(f, "{:.4} {all:.4} {worst_half:.4} {of_m:.3?}  noise {noise} {prior:?}", self.value())
    }
}

/// One prior with every noise.
fn choices(real: &PublishedSkin, prior: ImagePrior) -> [Choice; NOISES.len()] {
    let sessions = &real.skin.sessions;
    let mut choices = NOISES.map(|noise| Choice { prior, noise, objects: Vec::new(), of_m: [0.0; SYNTHETIC_M.len()] });
    for session in sessions {
        let others = sessions.iter().filter(|s| s.object != session.object);
        let learned = Arc::new(prior.learn(&images(others), real.skin.learned.cols).unwrap());
        for choice in &mut choices {
            let method = NnLmmse::new(Arc::clone(&learned), Noise::Relative(choice.noise)).unwrap();
            let of_m = SYNTHETIC_M.map(|m| synthetic_iou(session, &method, m));
            choice.objects.push(of_m.iter().sum::<f64>() / of_m.len() as f64);
            let share = sessions.len() as f64;
            choice.of_m.iter_mut().zip(of_m).for_each(|(sum, v)| *sum += v / share);
        }
    }
    choices.iter_mut().for_each(|c| c.objects.sort_by(f64::total_cmp));
    choices
}

/// Mean IoU over windows of `m` measurements of the raster images of presses that are not scored.
fn synthetic_iou(session: &ScoredSession, method: &dyn Recover, m: usize) -> f64 {
    let (mut mean, mut work) = (MeanScore::default(), Workspace::default());
    let (mut mask, mut truth) = (Vec::new(), Vec::new());
    let raster = session.raster.as_ref().unwrap();
    let taxels = raster.taxels();
    let mut found = vec![0.0; taxels];
    for (index, press) in unscored(session).enumerate() {
        let image = raster.volts(press, SYNTHETIC_FRAME);
        support(image, SUPPORT_THRESHOLD, &mut truth);
        let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
        for (level, noise) in SYNTHETIC_NOISE.into_iter().enumerate() {
            // the same windows for every setting
            let mut rng = Streams::new(1).rng(&session.object, (2 * index + level) as u64);
            let rows: Vec<f64> = (0..m * taxels).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
            let y: Vec<f64> = rows
                .chunks_exact(taxels)
                .map(|row| {
                    let clean: f64 = row.iter().zip(image).map(|(w, x)| w * x).sum();
                    let normal: f64 = StandardNormal.sample(&mut rng);
                    clean + noise * length * normal
                })
                .collect();
            let problem = Problem::new(MatrixView::new(m, taxels, &rows).unwrap(), &y).unwrap();
            method.recover(&problem, &mut work).unwrap().scatter(&mut found);
            support(&found, SUPPORT_THRESHOLD, &mut mask);
            mean.add(SupportScore::new(&mask, &truth));
        }
    }
    mean.mean().unwrap().iou
}

/// Presses that are not scored.
fn unscored(session: &ScoredSession) -> impl Iterator<Item = usize> {
    let raster = session.raster.as_ref().unwrap();
    let scored = session.raster_protocol.presses_of(raster);
    (0..raster.blocks().len()).filter(move |press| !scored.contains(press))
}

/// Raster images of the presses that are not scored.
fn images<'a>(sessions: impl Iterator<Item = &'a ScoredSession>) -> Matrix {
    let mut columns: Vec<&[f64]> = Vec::new();
    for session in sessions {
        let raster = session.raster.as_ref().unwrap();
        for press in unscored(session) {
            columns.extend(FRAMES.iter().map(|&frame| raster.volts(press, frame)));
        }
    }
    Matrix::from_column_slices(columns[0].len(), &columns)
}
