//! Classification with designed rows: seventeen objects at their usual places, on skins without any recording.

use super::error::SensingError;
use super::rows_for::{RowsFor, rows_for};
use super::study::{RANDOM, SensingStudy};
use crate::touches::{Band, Touch, TouchObjects, TouchScene, TouchWire, band};
use rand::RngExt as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::Profile;
use spts_contact::objects::OBJECTS;
use spts_eval::algorithm::Class;
use spts_eval::decoders::{TrainedDecoder, find};
use spts_eval::training::{LearnError, TrainingData, simulated_gain_sd};
use spts_eval::{Press, PressRows, Scorer};
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::TemplateModel;
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{DESIGNERS, Expected, RowTask};
use std::sync::Arc;

/// Skins that templates are learned from; none is a scored one.
const LEARNED: u64 = 12;
/// Presses of an object on a scored skin.
const PRESSES: usize = 6;
/// The classifier.
const DECODER: &str = "evidence";

/// Share of the windows that are classified correctly with one designer's rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ClassRow {
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Measurements M.
    pub m: usize,
    /// Share of the windows whose object, of seventeen, is classified correctly.
    pub classified: Band,
}

impl SensingStudy {
    /// Classifies the seventeen objects, pressed at their usual places, with every designer of the table that was asked
    /// for, and with those that tell classes apart.
    pub(super) fn classes(&self, progress: &dyn Progress) -> Result<Vec<ClassRow>, SensingError> {
        let streams = Streams::new(self.seed);
        progress.stage("classifying", Some(self.readouts.len() * self.skins));
        let mut all = Vec::new();
        for readout in &self.readouts {
            let profile = Profile::named(readout)?;
            let data = self.templates(&profile.on(&self.layout)?, streams)?;
            let Some(spec) = find(DECODER) else { continue };
            let decoder = TrainedDecoder::new(spec, &data)?;
            let classes = TemplateModel::new(data.shape[1])
                .classes(&data.templates)
                .map_err(LearnError::from)?;
            let expected = Expected::like(&*data.prior(ImagePrior::UNSEEN)?, data.shape, self.tolerances)?;
            let task = RowTask {
                classes: &classes,
                largest_sum: self.largest_sum,
                seed: self.seed,
                ..RowTask::new(self.measurements.iter().copied().max().unwrap_or(1), &expected)
            };
            let asked = |name: &str| self.designers.iter().any(|d| d.name == name);
            let shown = DESIGNERS.iter().filter(|d| asked(d.name) || d.name == "classes");
            let fixed: Vec<RowsFor> = shown
                .collect::<Vec<_>>()
                .into_par_iter()
                .map(|d| rows_for(d, &task))
                .collect::<Result<_, _>>()?;
            let one = |repetition: u64| {
                let found = self.classified(&fixed, &task, &profile, &decoder, streams, repetition);
                progress.step();
                found
            };
            let shares: Vec<Vec<f64>> = (0..self.skins as u64)
                .into_par_iter()
                .map(one)
                .collect::<Result<_, _>>()?;
            let keys = fixed
                .iter()
                .flat_map(|d| self.measurements.iter().map(move |m| (d.designer, *m)));
            for (k, (designer, m)) in keys.enumerate() {
                let own: Vec<f64> = shares.iter().map(|shares| shares[k]).collect();
                all.extend(band(&own).map(|classified| ClassRow {
                    readout: readout.clone(),
                    designer,
                    m,
                    classified,
                }));
            }
        }
        progress.end();
        Ok(all)
    }

    /// Images of the objects on other skins, V.
    fn templates(&self, profile: &Profile, streams: Streams) -> Result<TrainingData, SensingError> {
        let volts = profile.volts_per_siemens();
        let mut images = Vec::new();
        for skin in 0..LEARNED {
            let seed = streams.rng("sensing/learned", skin).random();
            for touch in self.presses(seed, 1)? {
                images.push(
                    touch
                        .conductance_s
                        .values()
                        .iter()
                        .map(|g| g * volts)
                        .collect::<Vec<f64>>(),
                );
            }
        }
        let labels: Vec<usize> = (0..images.len()).map(|k| k % OBJECTS.len()).collect();
        let slices: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
        let images = Matrix::from_column_slices(self.layout.taxels(), &slices);
        let mut data = TrainingData::of_images(images, &labels, self.layout.cols(), streams)?;
        data.gain_sd = vec![simulated_gain_sd(); data.templates.images().nrows()];
        Ok(data)
    }

    /// Every object `times` times at its usual place, one after the other, on the specimen of `seed`.
    fn presses(&self, seed: u64, times: usize) -> Result<Vec<Touch>, SensingError> {
        let scene = TouchScene {
            placed: true,
            ..TouchScene::new(self.layout, TouchObjects::Objects, times * OBJECTS.len(), seed)
        };
        Ok(scene.draw()?)
    }

    /// Share of the windows classified, designer by designer and M by M.
    fn classified(
        &self,
        fixed: &[RowsFor],
        task: &RowTask<'_>,
        profile: &Profile,
        decoder: &TrainedDecoder,
        streams: Streams,
        repetition: u64,
    ) -> Result<Vec<f64>, SensingError> {
        let seed: u64 = streams.rng("sensing/classes", repetition).random();
        let device = Streams::new(seed);
        let touches = self.presses(seed, PRESSES)?;
        let random = DESIGNERS.iter().find(|d| d.name == RANDOM);
        let own_task = RowTask {
            seed: device.rng("sensing/rows", 0).random(),
            ..*task
        };
        let own = random.map(|d| rows_for(d, &own_task)).transpose()?;
        let mut scorer = Scorer::new(decoder);
        let mut shares = Vec::new();
        for rows in fixed {
            let rows = own.as_ref().filter(|own| own.designer == rows.designer).unwrap_or(rows);
            for &m in &self.measurements {
                let mut wire = TouchWire::new(profile, &rows.first(m)?, &self.layout, device)?;
                let shared = Arc::new(PressRows::of_matrix(&rows.matrix(m)));
                let presses = (0..).zip(&touches).map(|(number, touch)| {
                    let volts = wire.measure(touch, number, number * m as u64, m)?;
                    Ok(Press::on(Arc::clone(&shared), volts, 0.0))
                });
                let presses = presses.collect::<Result<Vec<_>, SensingError>>()?;
                let windows: Vec<_> = presses.iter().filter_map(|press| press.window(0, m)).collect();
                let answers = scorer.answers(&windows)?;
                let right = answers
                    .iter()
                    .enumerate()
                    .filter(|(k, answer)| answer.class.and_then(Class::label) == Some(k % OBJECTS.len()));
                shares.push(right.count() as f64 / answers.len().max(1) as f64);
            }
        }
        Ok(shares)
    }
}
