//! Images by a network that was trained on procedural shapes.

use crate::algorithm::{Algorithm, Answer, Belief, Confidence, DecodeError, Subject, Trained};
use crate::training::TrainingData;
use crate::windows::Window;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use spts_input::Refusal;
use spts_recon::recover::Unrolled;
use spts_recon::{MatrixView, Problem, Workspace};
use std::sync::Arc;

struct Network(Arc<Unrolled>);

/// Most samples of the windows that it was trained on.
const TRAINED: usize = 104;
/// Noise that is added to more samples than these, as a share of their mean magnitude. The network has seen none
/// without noise, and its image of hundreds of them may be all but empty.
const ADDED: f64 = 0.01;
/// Root of its random numbers.
const SEED: u64 = 1;

pub(super) fn train(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    Ok(Box::new(Network(data.network()?)))
}

impl Network {
    fn at_work(&self) -> AtWork<'_> {
        AtWork {
            network: &self.0,
            work: Workspace::default(),
            touched: Vec::new(),
            image: Vec::new(),
            noisy: Vec::new(),
            phi: Vec::new(),
            y: Vec::new(),
        }
    }
}

impl Trained for Network {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(self.at_work())
    }

    fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
        Some((Subject::Image, Box::new(self.at_work())))
    }
}

struct AtWork<'a> {
    network: &'a Unrolled,
    work: Workspace,
    touched: Vec<f64>,
    /// Samples with noise.
    noisy: Vec<f64>,
    /// Image, rows and samples so far of a window that arrives sample by sample.
    image: Vec<f64>,
    phi: Vec<f64>,
    y: Vec<f64>,
}

impl AtWork<'_> {
    /// The image of `y` at the rows `phi`; returned is its expected IoU.
    fn estimate(&mut self, phi: MatrixView<'_>, y: &[f64], image: &mut Vec<f64>) -> Result<f64, Refusal> {
        let many = y.len() > TRAINED;
        if many {
            let mean = y.iter().map(|v| v.abs() / y.len() as f64).sum::<f64>();
            let normal = ChaCha8Rng::seed_from_u64(SEED).sample_iter(StandardNormal);
            self.noisy.clear();
            self.noisy.extend(y.iter().zip(normal).map(|(y, noise): (_, f64)| y + ADDED * mean * noise));
        }
        let problem = Problem::new(phi, if many { &self.noisy } else { y })?;
        Ok(self.network.estimate(&problem, &mut self.work, image, &mut self.touched)?.expected_iou)
    }
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        answer.class = None;
        self.estimate(window.phi, window.y, &mut answer.image)?;
        Ok(())
    }
}

impl Confidence for AtWork<'_> {
    fn begin(&mut self) {
        self.phi.clear();
        self.y.clear();
    }

    fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError> {
        self.phi.extend_from_slice(sample.phi.values());
        self.y.extend_from_slice(sample.y);
        let taxels = sample.phi.ncols();
        let [values, y, mut image] = [&mut self.phi, &mut self.y, &mut self.image].map(std::mem::take);
        // as many numbers as rows times taxels
        let phi = MatrixView::new(y.len(), taxels, &values).unwrap_or(sample.phi);
        let found = self.estimate(phi, &y, &mut image);
        [self.phi, self.y, self.image] = [values, y, image];
        Ok(Belief { confidence: found?, class: None })
    }
}
