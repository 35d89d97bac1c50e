//! The evidence classifier on compressive sessions, learned from raster presses that are not scored.

use super::decode::{Decode, Projected};
use super::protocol::{Protocol, Truth};
use super::session::Session;
use crate::calibrate::PLATEAU;
use rayon::prelude::*;
use serde::Serialize;
use spts_recon::classify::{
    Evidence, EvidenceClassifier, EvidenceError, Library, LibraryError, Posterior, Preparation, TemplateModel,
    VoteScore, calibration_error, vote_groups,
};
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::{AmplitudeRange, Matrix};

/// Amplitudes of a press that count as possible, V at the strongest taxel: sessions of one object differ by .50–1.38, objects by
/// .4–1.7.
const AMPLITUDES_V: [f64; 2] = [0.2, 6.0];

/// Prior probability of an object that is in no class.
const UNKNOWN_PRIOR: f64 = 0.01;

/// Bins of the calibration error.
const BINS: usize = 10;

/// Why no evidence classifier could be learned.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceLearnError {
    /// No session has a press to learn from.
    #[error("templates: {0}")]
    Library(#[from] LibraryError),
    /// The templates make no classifier.
    #[error("evidence: {0}")]
    Evidence(#[from] EvidenceError),
    /// The range of amplitudes is not one.
    #[error("amplitude: {0}")]
    Amplitude(#[from] spts_recon::RangeError),
}

/// One template an object: the mean of the plateau frames of its raster presses that are not scored.
///
/// # Errors
/// [`LibraryError`] when no template is different from zero.
pub fn templates(sessions: &[Session], protocol: &Protocol) -> Result<Library, LibraryError> {
    let (mut images, mut labels) = (Vec::new(), Vec::new());
    for session in sessions {
        let scored = protocol.presses_of(&session.raster);
        let presses = (0..session.raster.blocks().len()).filter(|p| !scored.contains(p));
        let mut image = vec![0.0; session.raster.taxels()];
        for press in presses {
            for frame in PLATEAU.filter(|f| *f < session.raster.frames()) {
                let volts = session.raster.volts(press, frame);
                image.iter_mut().zip(volts).for_each(|(sum, v)| *sum += v.max(0.0));
            }
        }
        images.push(image);
        labels.push(session.label);
    }
    let taxels = sessions.first().map_or(0, |s| s.raster.taxels());
    let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
    Library::new(&Matrix::from_column_slices(taxels, &slices), &labels)
}

/// Classifier by the templates of `sessions`, like every other decoder's for these classes only; with `unknown`, anything else is
/// an outcome too, which costs a few per cent of the presses that differ most from their templates.
///
/// # Errors
/// [`EvidenceLearnError`] when there is nothing to learn from, or the images do not fill a grid of `cols` columns.
pub fn learn_evidence(
    sessions: &[Session],
    protocol: &Protocol,
    cols: usize,
    unknown: bool,
) -> Result<EvidenceClassifier, EvidenceLearnError> {
    let (library, model) = (templates(sessions, protocol)?, TemplateModel::new(cols));
    let mut components = model.classes(&library)?;
    if unknown {
        components.push(model.unknown(&library)?);
    }
    let amplitude = AmplitudeRange::new(AMPLITUDES_V[0], AMPLITUDES_V[1])?;
    Ok(EvidenceClassifier::new(&components, amplitude, UNKNOWN_PRIOR)?)
}

/// Scores of the evidence classifier on one object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EvidenceRow {
    /// Object.
    pub object: String,
    /// Number of measurements, M.
    pub m: usize,
    /// Support accuracy of the posterior mean image.
    pub support: f64,
    /// Intersection over union of the supports.
    pub iou: f64,
    /// F1 of the supports.
    pub f1: f64,
    /// Share of single windows classified correctly.
    pub class_single: f64,
    /// Share of votes of `vote` windows classified correctly.
    pub class_vote20: f64,
    /// The same with the evidence of these windows added up.
    pub class_evidence: f64,
    /// Share of single windows taken for unknown.
    pub unknown: f64,
    /// Expected calibration error of the single windows.
    pub calibration_error: f64,
}

/// What one press contributes.
#[derive(Default)]
struct Partial {
    support: Vec<SupportScore>,
    decisions: Vec<(Option<usize>, f64)>,
    summed: Vec<Option<usize>>,
}

/// Scores every press of the session at every M of `measurements`, with the windows of the other decoders. Presses run in parallel;
/// the result does not depend on the number of threads.
#[must_use]
pub fn score_evidence(
    session: &Session,
    classifier: &EvidenceClassifier,
    protocol: &Protocol,
    measurements: &[usize],
) -> Vec<EvidenceRow> {
    let Some(recording) = &session.compressive else {
        return Vec::new();
    };
    let truth = Truth::new(&session.raster, protocol);
    let presses: Vec<Vec<Partial>> = protocol
        .presses_of(recording)
        .into_par_iter()
        .map(|block| {
            let projected = Projected::press(recording, block, protocol, classifier.bank());
            let mut run = Run::new(&projected, classifier);
            let per_frame = recording.measurements_per_frame();
            let score = |&m: &usize| run.score(m, protocol, per_frame, &truth);
            measurements.iter().map(score).collect()
        })
        .collect();
    let rows = measurements.iter().enumerate();
    rows.filter_map(|(i, &m)| {
        let partials: Vec<&Partial> = presses.iter().map(|p| &p[i]).collect();
        join(session, m, &partials, protocol.vote)
    })
    .collect()
}

/// Joins the presses of a row; `None` without a window.
fn join(session: &Session, m: usize, presses: &[&Partial], vote: usize) -> Option<EvidenceRow> {
    let mut mean = MeanScore::default();
    let [mut single, mut voted, mut summed, mut unknown] = [VoteScore::default(); 4];
    let mut sure = Vec::new();
    for press in presses {
        press.support.iter().for_each(|s| mean.add(*s));
        let labels: Vec<Option<usize>> = press.decisions.iter().map(|d| d.0).collect();
        single.add(&labels, session.label);
        voted.add(&vote_groups(&labels, vote, false), session.label);
        summed.add(&press.summed, session.label);
        let taken: Vec<Option<usize>> = labels.iter().map(|l| Some(usize::from(l.is_none()))).collect();
        unknown.add(&taken, 1);
        sure.extend(press.decisions.iter().map(|(l, p)| (*p, *l == Some(session.label))));
    }
    let support = mean.mean()?;
    Some(EvidenceRow {
        object: session.object.clone(),
        m,
        support: support.accuracy,
        iou: support.iou,
        f1: support.f1,
        class_single: single.share()?,
        class_vote20: voted.share()?,
        class_evidence: summed.share()?,
        unknown: unknown.share()?,
        calibration_error: calibration_error(&sure, BINS)?,
    })
}

/// A projected press and the classifier's state, reused from window to window.
struct Run<'a> {
    projected: &'a Projected,
    classifier: &'a EvidenceClassifier,
    preparation: Preparation,
    evidence: Evidence,
    posterior: Posterior,
    row: Vec<f64>,
}

impl<'a> Run<'a> {
    fn new(projected: &'a Projected, classifier: &'a EvidenceClassifier) -> Self {
        Self {
            projected,
            classifier,
            preparation: classifier.preparation(),
            evidence: classifier.evidence(),
            posterior: Posterior::default(),
            row: Vec::new(),
        }
    }

    /// Takes the window `start..start + m` into the evidence. `None` when it reaches beyond the press or holds a lost sample.
    fn observe(&mut self, start: usize, m: usize) -> Option<()> {
        if start + m > self.projected.len() {
            return None;
        }
        let (rows, y) = self.projected.window(Decode::Matched, start, m);
        self.preparation.clear();
        for (row, &y) in rows.values().chunks_exact(rows.ncols()).zip(y) {
            // Φ − ½ → ±1
            self.row.clear();
            self.row.extend(row.iter().map(|v| 2.0 * v));
            self.preparation.push(&self.row).ok()?;
            self.evidence.observe(&self.preparation, y).ok()?;
        }
        Some(())
    }

    fn score(&mut self, m: usize, protocol: &Protocol, per_frame: usize, truth: &Truth) -> Partial {
        let mut partial = Partial::default();
        let (mut image, mut mask) = (vec![0.0; truth.image.len()], Vec::new());
        for start in (0..self.projected.len()).step_by(protocol.support_stride * per_frame) {
            self.evidence.clear();
            if self.observe(start, m).is_some() {
                let classifier = self.classifier;
                classifier.decide(&self.preparation, &self.evidence, &mut self.posterior);
                classifier.image(&self.preparation, &self.evidence, &self.posterior, &mut image);
                support(&image, SUPPORT_THRESHOLD, &mut mask);
                partial.support.push(SupportScore::new(&mask, &truth.support));
            }
        }
        let windows = protocol.windows(m, per_frame);
        for window in 0..windows {
            self.evidence.clear();
            if self.observe(window * m, m).is_some() {
                let decision = self
                    .classifier
                    .decide(&self.preparation, &self.evidence, &mut self.posterior);
                partial.decisions.push((decision.label, decision.probability));
            }
        }
        let groups = 0..windows / protocol.vote.max(1);
        partial.summed = groups
            .filter_map(|g| self.sum(g * protocol.vote, protocol.vote, m))
            .collect();
        partial
    }

    /// Decision on the added evidence of `count` windows from `first` on.
    fn sum(&mut self, first: usize, count: usize, m: usize) -> Option<Option<usize>> {
        self.evidence.clear();
        for window in first..first + count {
            self.observe(window * m, m)?;
            self.classifier
                .next_window(&self.preparation, &mut self.evidence, &mut self.posterior);
        }
        let decision = self
            .classifier
            .decide(&self.preparation, &self.evidence, &mut self.posterior);
        Some(decision.label)
    }
}
