//! The regularised decoders on the recordings of the real skin. Learned from raster presses 1–5 and from 16 on; scored on
//! compressive presses 6–15.

use crate::recordings::recordings;
use rayon::prelude::*;
use spts_circuit::{Recording, Seeding, WeightMode, Weights};
use spts_experiments::real::{Real, load};
use spts_experiments::score::{Protocol, Session, Truth, idle_mean};
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::recover::{ImagePrior, NnLasso, NnLmmse, Noise, Penalty};
use spts_recon::{Matrix, MatrixView, Problem, Recover, Workspace};
use std::sync::Arc;

/// Frames of a raster press that a prior is learned from: rise, plateau and lift.
const FRAMES: [usize; 3] = [520, 580, 640];
/// Contact noise and what the model misses, as a share of the root mean square of y.
pub(crate) const NOISE: Noise = Noise::Relative(0.12);

/// Left out: the prior knows every object but the one that is scored. M, least IoU.
const LEFT_OUT: [(usize, f64); 3] = [(7, 0.44), (20, 0.61), (25, 0.66)];
/// With the published dictionary, at M = 20: least support accuracy and IoU.
const CLOSED: (f64, f64) = (0.950, 0.73);

#[test]
#[ignore = "decodes 10,000 windows of the recordings"]
fn unseen_objects_are_recovered_with_the_prior_of_the_others() {
    let Some(root) = recordings() else { return };
    let real = load(&root).unwrap();
    for (m, least) in LEFT_OUT {
        let score = mean_over_objects(&real, |session, truth| {
            let others = real.arm.sessions.iter().filter(|s| s.object != session.object);
            let prior = ImagePrior::UNSEEN.learn(&images(others), real.arm.cols).unwrap();
            let method = NnLmmse::new(Arc::new(prior), NOISE).unwrap();
            score(session, truth, &method, None, m)
        });
        assert!(score.iou >= least, "M = {m}: IoU {:.3}, at least {least}", score.iou);
    }
}

#[test]
#[ignore = "decodes 10,000 windows of the recordings"]
fn the_lasso_beats_the_published_pursuit_on_its_own_dictionary() {
    let Some(root) = recordings() else { return };
    let real = load(&root).unwrap();
    let method = NnLasso::new(Penalty::Relative(0.1)).unwrap().with_normalised_columns();
    let score = mean_over_objects(&real, |session, truth| {
        score(session, truth, &method, Some(&real.arm.learned.dictionary), 20)
    });
    assert!(score.accuracy >= CLOSED.0, "support {:.3}", score.accuracy);
    assert!(score.iou >= CLOSED.1, "IoU {:.3}", score.iou);
}

fn mean_over_objects(real: &Real, score: impl Fn(&Session, &Truth) -> SupportScore + Sync) -> SupportScore {
    let scored: Vec<&Session> = real.arm.sessions.iter().filter(|s| s.compressive.is_some()).collect();
    let scores: Vec<SupportScore> = scored
        .into_par_iter()
        .map(|session| score(session, &Truth::new(&session.raster, &Protocol::default())))
        .collect();
    let mut mean = MeanScore::default();
    scores.into_iter().for_each(|s| mean.add(s));
    mean.mean().unwrap()
}

/// Raster images of the presses that are not scored.
pub(crate) fn images<'a>(sessions: impl Iterator<Item = &'a Session>) -> Matrix {
    let protocol = Protocol::default();
    let mut columns: Vec<&[f64]> = Vec::new();
    for raster in sessions.map(|s| &s.raster) {
        let scored = protocol.presses_of(raster);
        for press in (0..raster.blocks().len()).filter(|p| !scored.contains(p)) {
            columns.extend(FRAMES.iter().map(|&frame| raster.volts(press, frame)));
        }
    }
    Matrix::from_column_slices(columns[0].len(), &columns)
}

/// Mean score of `method` over the support windows of the session: on the taxels themselves, or on the atoms of a
/// dictionary.
pub(crate) fn score(
    session: &Session,
    truth: &Truth,
    method: &dyn Recover,
    dictionary: Option<&Matrix>,
    m: usize,
) -> SupportScore {
    let (protocol, recording) = (Protocol::default(), session.compressive.as_ref().unwrap());
    let (mut mean, mut mask, mut work) = (MeanScore::default(), Vec::new(), Workspace::default());
    let mut image = vec![0.0; recording.taxels()];
    for press in protocol.presses_of(recording) {
        let idle = idle_mean(recording, press, &protocol);
        for frame in (0..protocol.frames).step_by(protocol.support_stride) {
            let (rows, y) = window(recording, press, protocol.first_frame + frame, m, idle);
            if y.iter().any(|v| !v.is_finite()) {
                continue;
            }
            if let Some(dictionary) = dictionary {
                let mut projected = Matrix::zeros(m, dictionary.ncols());
                for (r, row) in rows.chunks_exact(recording.taxels()).enumerate() {
                    dictionary.accumulate_row(row, projected.row_mut(r));
                }
                let problem = Problem::new(projected.view(), &y).unwrap();
                let solution = method.recover(&problem, &mut work).unwrap();
                solution.synthesise(dictionary.view(), &mut image);
            } else {
                let operator = MatrixView::new(m, recording.taxels(), &rows).unwrap();
                let problem = Problem::new(operator, &y).unwrap();
                method.recover(&problem, &mut work).unwrap().scatter(&mut image);
            }
            support(&image, SUPPORT_THRESHOLD, &mut mask);
            mean.add(SupportScore::new(&mask, &truth.support));
        }
    }
    mean.mean().unwrap()
}

/// The first `m` measurements of a frame, less the idle mean, with their rows of ±1.
fn window(recording: &Recording, press: usize, frame: usize, m: usize, idle: f64) -> (Vec<f64>, Vec<f64>) {
    let taxels = recording.taxels();
    let weights = Weights::new(WeightMode::Binary, Seeding::Address, u32::try_from(taxels).unwrap());
    let mut clock = weights.clock(recording.first_row(press, frame));
    let mut rows = vec![0.0; m * taxels];
    rows.chunks_exact_mut(taxels).for_each(|row| clock.next_row(row));
    let start = frame * recording.measurements_per_frame();
    let volts = &recording.blocks()[press].volts[start..start + m];
    (rows, volts.iter().map(|v| v - idle).collect())
}
