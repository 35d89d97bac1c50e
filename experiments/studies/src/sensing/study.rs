//! Benefit of designed rows over random ones, measured on simulated skins, and their cost.

use super::cost::{CostRow, costs};
use super::error::SensingError;
use super::report::SensingReport;
use super::rows_for::{RowsFor, rows_for};
use crate::touches::{Touch, TouchObjects, TouchScene, TouchScore, TouchWire};
use rand::RngExt as _;
use rayon::prelude::*;
use spts::progress::Progress;
use spts_circuit::Profile;
use spts_eval::decoders::{DecoderSpec, TrainedDecoder};
use spts_eval::training::TrainingData;
use spts_eval::{Press, PressRows, Scorer};
use spts_models::{SkinLayout, Streams};
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{DESIGNERS, Designer, Expected, RowNeeds, RowTask, Tolerances};
use std::sync::Arc;

/// Settings of `spts sensing study`, which measures what designed rows of the sensing matrix are worth against random
/// ones.
#[derive(Clone)]
pub struct SensingStudy {
    /// The skin.
    pub layout: SkinLayout,
    /// Designers for images.
    pub designers: Vec<&'static Designer>,
    /// Numbers of measurements M.
    pub measurements: Vec<usize>,
    /// Names of readout profiles.
    pub readouts: Vec<String>,
    /// Decoder of the board's table, used with all rows.
    pub decoder: &'static DecoderSpec,
    /// Number of repetitions, each with its own specimen of the skin, touches, noise and random rows.
    pub skins: usize,
    /// Number of touches in a repetition, of shapes and of objects.
    pub touches: usize,
    /// Limit of the sums, as of [`RowTask`].
    pub largest_sum: Option<f64>,
    /// Differences that images may have from those for which rows are designed.
    pub tolerances: Tolerances,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// Kinds of touches, and their names.
pub(super) const KINDS: [(TouchObjects, &str); 2] =
    [(TouchObjects::Shapes, "shapes"), (TouchObjects::Objects, "objects")];

/// The designer that all others are compared with.
pub(super) const RANDOM: &str = "random";

/// Name of what is touched, and the score of its image.
pub(super) type NamedScore = (Arc<str>, TouchScore);

/// Scores of one repetition, in the order of the report's columns.
pub(super) struct Repetition {
    /// Name and score of every touch.
    pub(super) scores: Vec<Vec<NamedScore>>,
    /// Share of clipped samples.
    pub(super) clipped: Vec<f64>,
    /// Errors by designer and cause.
    pub(super) costs: Vec<CostRow>,
}

impl SensingStudy {
    /// Designers of the table that need no classes.
    pub fn designers() -> impl Iterator<Item = &'static Designer> {
        DESIGNERS.iter().filter(|d| d.needs != RowNeeds::Classes)
    }

    /// Compares. The result depends only on the settings, not on the number of threads.
    ///
    /// # Errors
    /// [`SensingError`] for a skin without a prior, rows that cannot be designed, or touches that cannot be measured.
    pub fn run(&self, progress: &dyn Progress) -> Result<SensingReport, SensingError> {
        let streams = Streams::new(self.seed);
        let data = TrainingData::for_layout(&self.layout, streams)?;
        let decoder = TrainedDecoder::new(self.decoder, &data)?;
        let prior = data.prior(ImagePrior::UNSEEN)?;
        let expected = Expected::like(&prior, data.shape, self.tolerances)?;
        let task = RowTask {
            largest_sum: self.largest_sum,
            seed: self.seed,
            ..RowTask::new(self.measurements.iter().copied().max().unwrap_or(1), &expected)
        };
        let profiles: Vec<Profile> = self
            .readouts
            .iter()
            .map(|name| Ok(Profile::named(name)?))
            .collect::<Result<_, SensingError>>()?;
        progress.stage("designing", None);
        let fixed: Vec<Option<RowsFor>> = self
            .designers
            .par_iter()
            .map(|d| (d.name != RANDOM).then(|| rows_for(d, &task)).transpose())
            .collect::<Result<_, _>>()?;
        progress.stage("touching", Some(self.skins));
        let one = |repetition: u64| {
            let random_task = RowTask {
                seed: streams.rng("sensing/rows", repetition).random(),
                ..task
            };
            let rows: Vec<RowsFor> = self
                .designers
                .iter()
                .zip(&fixed)
                .map(|(d, fixed)| fixed.clone().map_or_else(|| rows_for(d, &random_task), Ok))
                .collect::<Result<_, _>>()?;
            let found = self.repetition(&rows, &profiles, &decoder, streams, repetition);
            progress.step();
            found
        };
        let repetitions: Vec<Repetition> = (0..self.skins as u64)
            .into_par_iter()
            .map(one)
            .collect::<Result<_, _>>()?;
        progress.end();
        let classes = self.classes(progress)?;
        Ok(SensingReport::new(self, &repetitions, classes))
    }

    fn repetition(
        &self,
        rows: &[RowsFor],
        profiles: &[Profile],
        decoder: &TrainedDecoder,
        streams: Streams,
        repetition: u64,
    ) -> Result<Repetition, SensingError> {
        let seed: u64 = streams.rng("sensing/skin", repetition).random();
        let device = Streams::new(seed);
        let mut touches = Vec::new();
        for (objects, label) in KINDS {
            let scene = TouchScene {
                specimen: Some(seed),
                ..TouchScene::new(
                    self.layout,
                    objects,
                    self.touches,
                    streams.rng(label, repetition).random(),
                )
            };
            touches.push(scene.draw()?);
        }
        let mut scorer = Scorer::new(decoder);
        let mut found = Repetition {
            scores: Vec::new(),
            clipped: Vec::new(),
            costs: costs(rows, &touches[0], &self.layout, device)?,
        };
        for kind in &touches {
            for profile in profiles {
                for &m in &self.measurements {
                    for rows in rows {
                        let (scores, clipped) = self.column(rows, m, kind, profile, &mut scorer, device)?;
                        found.scores.push(scores);
                        found.clipped.push(clipped);
                    }
                }
            }
        }
        Ok(found)
    }

    /// Every touch, measured with the first `m` of the `rows`, decoded and scored; the share of clipped samples.
    fn column(
        &self,
        rows: &RowsFor,
        m: usize,
        touches: &[Touch],
        profile: &Profile,
        scorer: &mut Scorer<'_>,
        device: Streams,
    ) -> Result<(Vec<NamedScore>, f64), SensingError> {
        let weights = rows.first(m)?;
        let mut wire = TouchWire::new(profile, &weights, &self.layout, device)?;
        let shared = Arc::new(PressRows::of_matrix(&rows.matrix(m)));
        let presses = (0..).zip(touches).map(|(number, touch)| {
            let volts = wire.measure(touch, number, number * m as u64, m)?;
            Ok(Press::on(Arc::clone(&shared), volts, 0.0))
        });
        let presses = presses.collect::<Result<Vec<_>, SensingError>>()?;
        let windows: Vec<_> = presses.iter().filter_map(|press| press.window(0, m)).collect();
        let answers = scorer.answers(&windows)?;
        let scores = answers.iter().zip(touches).map(|(answer, touch)| {
            let score = TouchScore::of(&answer.image, touch, &self.layout);
            (Arc::clone(&touch.name), score)
        });
        let share = wire.clipped() as f64 / (m * touches.len()).max(1) as f64;
        Ok((scores.collect(), share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    use spts_eval::decoders::find;
    use spts_recon::rows::designer;

    fn study() -> SensingStudy {
        SensingStudy {
            layout: SkinLayout::new(8, 8, 0.015, 0.01).unwrap(),
            designers: ["random", "cosine_signs", "greedy"]
                .map(|n| designer(n).unwrap())
                .to_vec(),
            measurements: vec![6, 12],
            readouts: vec!["ideal".to_owned(), "as_built".to_owned()],
            decoder: find("nn_lmmse").unwrap(),
            skins: 3,
            touches: 12,
            largest_sum: None,
            tolerances: Tolerances::default(),
            seed: 2,
        }
    }

    #[test]
    fn designed_rows_are_worth_more_for_any_number_of_threads() {
        let run = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| study().run(&())).unwrap()
        };
        let report = run(1);
        assert_eq!(report, run(3));
        assert_eq!(report.rows.len(), 2 * 2 * 2 * 3);
        let of = |designer: &str, m: usize| {
            let rows = report.rows.iter().filter(|r| r.designer == designer && r.m == m);
            rows.map(|r| r.iou.mean).sum::<f64>() / 4.0
        };
        assert!(of("greedy", 12) > of("random", 12) + 0.02, "{:?}", report.rows);
        assert!(of("greedy", 12) > of("greedy", 6));
        let random = report.rows.iter().filter(|r| r.designer == "random");
        assert!(random.clone().all(|r| r.gain.mean.abs() < 1e-15));
        // objects at their usual places are told apart with a few measurements, and best with rows made for that
        let classified = |designer: &str| {
            let rows = report.classes.iter().filter(|r| r.designer == designer && r.m == 6);
            rows.map(|r| r.classified.mean).sum::<f64>() / 2.0
        };
        assert!(classified("classes") > classified("random"), "{:?}", report.classes);
        assert!(classified("random") > 2.0 / 17.0);
        // every touch is somebody's
        let touched: usize = report
            .named
            .iter()
            .filter(|n| n.designer == "greedy" && n.m == 6)
            .map(|n| n.count)
            .sum();
        assert_eq!(touched, 2 * 2 * 3 * 12);
    }
}
