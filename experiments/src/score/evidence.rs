//! The evidence classifier on compressive sessions.

use super::decode::{Decode, Projected};
use super::evidence_learn::LearnedEvidence;
use super::protocol::{Protocol, Truth};
use super::session::Session;
use rayon::prelude::*;
use serde::Serialize;
use spts_circuit::WeightRows;
use spts_recon::classify::{
    Evidence, EvidenceClassifier, ImageEstimator, Posterior, Preparation, VoteScore, calibration_error, vote_groups,
};
use spts_recon::metrics::{MeanScore, SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::{MatrixView, Workspace};

/// Bins of the calibration error.
const BINS: usize = 10;

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
    learned: &LearnedEvidence,
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
            let projected = Projected::press(recording, block, protocol, learned.classifier.bank());
            let per_frame = recording.measurements_per_frame();
            let first = protocol.first_frame.min(recording.frames()) * per_frame;
            let rows = recording.rows(block, first..first + projected.len());
            let mut run = Run::new(&projected, learned, rows);
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
    images: &'a ImageEstimator,
    rows: WeightRows<'a>,
    preparation: Preparation,
    evidence: Evidence,
    posterior: Posterior,
    row: Vec<f64>,
    phi: Vec<f64>,
    work: Workspace,
}

impl<'a> Run<'a> {
    fn new(projected: &'a Projected, learned: &'a LearnedEvidence, rows: WeightRows<'a>) -> Self {
        Self {
            projected,
            classifier: &learned.classifier,
            images: &learned.images,
            rows,
            preparation: learned.classifier.preparation(),
            evidence: learned.classifier.evidence(),
            posterior: Posterior::default(),
            row: Vec::new(),
            phi: Vec::new(),
            work: Workspace::default(),
        }
    }

    /// Image of the window `start..start + m` that was just decided on.
    fn image(&mut self, start: usize, m: usize, image: &mut [f64]) -> Option<()> {
        self.phi.resize(m * image.len(), 0.0);
        self.rows.slice(start, m).fill(&mut self.phi);
        let phi = MatrixView::new(m, image.len(), &self.phi).ok()?;
        let (_, y) = self.projected.window(Decode::Matched, start, m);
        self.images
            .estimate(&self.posterior, phi, y, &mut self.work, image)
            .ok()
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
                self.classifier
                    .decide(&self.preparation, &self.evidence, &mut self.posterior);
                if self.image(start, m, &mut image).is_some() {
                    support(&image, SUPPORT_THRESHOLD, &mut mask);
                    partial.support.push(SupportScore::new(&mask, &truth.support));
                }
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
