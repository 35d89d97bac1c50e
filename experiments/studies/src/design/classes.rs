//! Classification of the seventeen objects.

use crate::touches::Touch;
use rayon::prelude::*;
use spts_input::Refusal;
use spts_recon::classify::{EvidenceClassifier, Library, Posterior, TemplateModel};
use spts_recon::{AmplitudeRange, Matrix};
use std::sync::Arc;

/// Amplitudes that count as possible, V at the strongest taxel: all that the range of an amplifier holds.
const AMPLITUDES_V: [f64; 2] = [0.01, 20.0];
/// Prior probability of an object that is in no class; not used, because every touch is of one.
const UNKNOWN_PRIOR: f64 = 0.01;
/// Relative standard deviation of the gains of a specimen that was never seen.
const GAIN_SD: f64 = 0.3;
/// Eigenvectors of a class for such gains.
const RANK: usize = 20;

/// Gaussian classes of the objects at their places, learned from touches of other specimens.
pub(super) struct Classes {
    classifier: EvidenceClassifier,
    names: Vec<Arc<str>>,
}

impl Classes {
    /// Classes from mean images of `touches` on a skin of `cols` columns.
    pub(super) fn new(touches: &[&Touch], cols: usize) -> Result<Self, Refusal> {
        let mut names: Vec<Arc<str>> = touches.iter().map(|t| Arc::clone(&t.name)).collect();
        names.sort_unstable();
        names.dedup();
        let mean_of = |name: &Arc<str>| {
            let own: Vec<&&Touch> = touches.iter().filter(|t| t.name == *name).collect();
            let mut mean = vec![0.0; own[0].conductance_s.values().len()];
            for touch in &own {
                let values = touch.conductance_s.values();
                let largest = values.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(*v));
                mean.iter_mut()
                    .zip(values)
                    .for_each(|(m, v)| *m += v / largest / own.len() as f64);
            }
            mean
        };
        let means: Vec<Vec<f64>> = names.iter().map(mean_of).collect();
        let slices: Vec<&[f64]> = means.iter().map(Vec::as_slice).collect();
        let taxels = slices.first().map_or(0, |m| m.len());
        let labels: Vec<usize> = (0..names.len()).collect();
        let templates =
            Library::new(&Matrix::from_column_slices(taxels, &slices), &labels).map_err(Refusal::from_error)?;
        let model = TemplateModel {
            gains: vec![GAIN_SD; taxels],
            rank: RANK,
            ..TemplateModel::new(cols)
        };
        let amplitude = AmplitudeRange::new(AMPLITUDES_V[0], AMPLITUDES_V[1]).map_err(Refusal::from_error)?;
        let classifier = EvidenceClassifier::new(
            &model.classes(&templates).map_err(Refusal::from_error)?,
            amplitude,
            UNKNOWN_PRIOR,
        )
        .map_err(Refusal::from_error)?;
        Ok(Self { classifier, names })
    }

    /// The sums of `rows` (one value a taxel, row after row) over everything that the classes hold.
    pub(super) fn rows(&self, rows: &[f64]) -> Vec<Vec<f64>> {
        let bank = self.classifier.bank();
        let project = |row: &[f64]| {
            let mut out = vec![0.0; bank.ncols()];
            bank.accumulate_row(row, &mut out);
            out
        };
        rows.par_chunks_exact(bank.nrows()).map(project).collect()
    }

    /// Whether the most probable class of the samples `volts` is the object called `name`.
    pub(super) fn is_right(&self, rows: &[Vec<f64>], volts: &[f64], name: &str) -> Result<bool, Refusal> {
        let mut preparation = self.classifier.preparation();
        let mut evidence = self.classifier.evidence();
        for (row, v) in rows.iter().zip(volts) {
            preparation.push(row).map_err(Refusal::from_error)?;
            evidence.observe(&preparation, *v).map_err(Refusal::from_error)?;
        }
        let decision = self
            .classifier
            .decide(&preparation, &evidence, &mut Posterior::default());
        Ok(decision.label.is_some_and(|label| &*self.names[label] == name))
    }
}
