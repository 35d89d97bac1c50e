//! Images by a network that was trained on procedural shapes.

use crate::algorithm::{Algorithm, Answer, Belief, Confidence, DecodeError, Subject, Trained};
use crate::training::TrainingData;
use crate::windows::Window;
use spts_input::Refusal;
use spts_recon::recover::Unrolled;
use spts_recon::{MatrixView, Problem, Workspace};
use std::sync::Arc;

struct Network(Arc<Unrolled>);

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
    /// Image, rows and samples so far of a window that arrives sample by sample.
    image: Vec<f64>,
    phi: Vec<f64>,
    y: Vec<f64>,
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        let problem = Problem::new(window.phi, window.y)?;
        answer.class = None;
        self.network.estimate(&problem, &mut self.work, &mut answer.image, &mut self.touched)?;
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
        // as many numbers as rows times taxels
        let phi = MatrixView::new(self.y.len(), taxels, &self.phi).unwrap_or(sample.phi);
        let problem = Problem::new(phi, &self.y)?;
        let found = self.network.estimate(&problem, &mut self.work, &mut self.image, &mut self.touched)?;
        Ok(Belief { confidence: found.expected_iou, class: None })
    }
}
