//! Images by a mixture of Gaussians over procedural shapes, weighted by the evidence given y.

use super::bank::Bank;
use crate::algorithm::{Algorithm, Answer, DecodeError, Trained};
use crate::training::{LearnError, TrainingData, in_parameter, in_range, in_templates};
use crate::windows::Window;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{
    ClusterModel, Clusters, Evidence, EvidenceClassifier, ImageEstimator, Posterior, Preparation,
};
use spts_recon::{AmplitudeRange, Workspace};

/// Thirty clusters; a hundred score no better. Gains scatter as those of the skins in the published recordings.
const MODEL: ClusterModel = ClusterModel {
    clusters: 30,
    gain: 0.3,
    floor: 0.01,
    noise: 0.12,
    rank: 20,
};
/// Weight of the wide component, so that a cluster takes over only where the evidence is clear.
const APART: f64 = 0.99;
/// Components that are solved with non-negative taxels.
const SOLVED: usize = 2;
/// Lengths of an image that count as possible, V.
const LENGTHS_V: [f64; 2] = [0.05, 50.0];
/// Root of the random numbers of the clusters.
const SEED: u64 = 1;

struct Mixture {
    classifier: EvidenceClassifier,
    bank: Bank,
    images: ImageEstimator,
}

pub(super) fn train(data: &TrainingData) -> Result<Box<dyn Trained>, LearnError> {
    let clusters =
        Clusters::with_wide(&MODEL, data.alike(), APART, &mut ChaCha8Rng::seed_from_u64(SEED)).map_err(in_templates)?;
    let amplitude = AmplitudeRange::new(LENGTHS_V[0], LENGTHS_V[1]).map_err(in_range)?;
    // every component has the same label, so that no unknown one is weighed
    let classifier = EvidenceClassifier::new(&clusters.components, amplitude, 0.5).map_err(in_templates)?;
    Ok(Box::new(Mixture {
        bank: Bank::new(classifier.bank()),
        images: ImageEstimator::non_negative(clusters.priors, MODEL.noise, SOLVED).map_err(in_parameter)?,
        classifier,
    }))
}

impl Trained for Mixture {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(AtWork {
            mixture: self,
            preparation: self.classifier.preparation(),
            evidence: self.classifier.evidence(),
            posterior: Posterior::default(),
            rows: Vec::new(),
            work: Workspace::default(),
        })
    }
}

struct AtWork<'a> {
    mixture: &'a Mixture,
    preparation: Preparation,
    evidence: Evidence,
    posterior: Posterior,
    rows: Vec<f64>,
    work: Workspace,
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        let mixture = self.mixture;
        let bank = mixture.classifier.bank();
        mixture.bank.project(bank, window, &mut self.rows);
        let columns = bank.ncols().max(1);
        self.preparation.clear();
        self.evidence.clear();
        for (row, &y) in self.rows.chunks_exact(columns).zip(window.y) {
            self.preparation.push(row)?;
            self.evidence.observe(&self.preparation, y)?;
        }
        mixture
            .classifier
            .decide(&self.preparation, &self.evidence, &mut self.posterior);
        answer.class = None;
        answer.image.resize(window.phi.ncols(), 0.0);
        mixture
            .images
            .estimate(&self.posterior, window.phi, window.y, &mut self.work, &mut answer.image)?;
        Ok(())
    }
}
