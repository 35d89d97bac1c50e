//! Benefit of designed rows over random ones on a simulated skin, and their cost.

use super::classes::ClassRow;
use super::cost::{CostRow, costs};
use super::error::SensingError;
use super::rows_for::{RowsFor, rows_for};
use crate::touches::{Band, Touch, TouchObjects, TouchScene, TouchScore, TouchWire, band};
use rand::RngExt as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::Profile;
use spts_eval::decoders::{DecoderSpec, TrainedDecoder};
use spts_eval::training::TrainingData;
use spts_eval::{Press, PressRows, Scorer};
use spts_models::{SkinLayout, Streams};
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{DESIGNERS, Designer, Expected, RowNeeds, RowTask, Tolerances};
use std::collections::BTreeMap;
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

/// IoU and place error for one kind of touches with one designer and M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensingRow {
    /// Kind of touches: "shapes" or "objects".
    pub touches: &'static str,
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Measurements M.
    pub m: usize,
    /// Intersection over union of the supports.
    pub iou: Band,
    /// IoU minus that with random rows in the same repetition.
    pub gain: Band,
    /// Mean distance of the centres, taxels.
    pub place_px: Option<Band>,
    /// Share of the samples at an end of the range.
    pub clipped: f64,
}

/// IoU of one object, or of one family of shapes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NamedRow {
    /// Kind of touches: "shapes" or "objects".
    pub touches: &'static str,
    /// Object, or family of the shapes.
    pub name: String,
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Measurements M.
    pub m: usize,
    /// Number of touches.
    pub count: usize,
    /// Intersection over union of the supports, mean over the touches of all repetitions.
    pub iou: f64,
}

/// The number of random rows with the same IoU as one designer's rows.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Equal {
    /// Kind of touches: "shapes" or "objects".
    pub touches: &'static str,
    /// Readout profile.
    pub readout: String,
    /// Designer of the rows.
    pub designer: &'static str,
    /// Number of its measurements.
    pub m: usize,
    /// Number of measurements with random rows that gives the same IoU, interpolated; `None` if even the largest number
    /// does not.
    pub random_m: Option<f64>,
}

/// Results of `spts sensing study`: scores of designed and random rows, and what the rows cost.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SensingReport {
    /// Rows and columns of the skin.
    pub skin: [usize; 2],
    /// Decoder.
    pub decoder: &'static str,
    /// Number of repetitions.
    pub skins: usize,
    /// Number of touches in a repetition and kind.
    pub touches: usize,
    /// Scores.
    pub rows: Vec<SensingRow>,
    /// Equivalent numbers of random rows.
    pub equal: Vec<Equal>,
    /// Shares of the seventeen objects that are classified.
    pub classes: Vec<ClassRow>,
    /// Errors of the samples by cause, and sizes of the sums.
    pub costs: Vec<CostRow>,
    /// Scores of single objects and families.
    pub named: Vec<NamedRow>,
}

/// Kinds of touches, and their names.
const KINDS: [(TouchObjects, &str); 2] = [(TouchObjects::Shapes, "shapes"), (TouchObjects::Objects, "objects")];

/// The designer that all others are compared with.
pub(super) const RANDOM: &str = "random";

/// Name of what is touched, and the score of its image.
type NamedScore = (Arc<str>, TouchScore);

/// Scores of one repetition, in the order of the keys.
struct Repetition {
    /// Name and score of every touch.
    scores: Vec<Vec<NamedScore>>,
    /// Share of clipped samples.
    clipped: Vec<f64>,
    /// Errors by designer and cause.
    costs: Vec<CostRow>,
}

/// What a column of scores belongs to.
#[derive(Clone, Copy)]
struct Key<'a> {
    kind: usize,
    readout: &'a str,
    designer: &'static Designer,
    m: usize,
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
        Ok(self.report(&repetitions, classes))
    }

    /// All columns of scores.
    fn keys(&self) -> Vec<Key<'_>> {
        let mut keys = Vec::new();
        for kind in 0..KINDS.len() {
            for readout in &self.readouts {
                for &m in &self.measurements {
                    keys.extend(self.designers.iter().map(|&designer| Key {
                        kind,
                        readout,
                        designer,
                        m,
                    }));
                }
            }
        }
        keys
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

    fn report(&self, repetitions: &[Repetition], classes: Vec<ClassRow>) -> SensingReport {
        let keys = self.keys();
        let iou_of = |k: usize| -> Vec<f64> {
            let mean =
                |scores: &Vec<NamedScore>| scores.iter().map(|(_, s)| s.iou).sum::<f64>() / scores.len().max(1) as f64;
            repetitions.iter().map(|r| mean(&r.scores[k])).collect()
        };
        let random = self.designers.iter().position(|d| d.name == RANDOM);
        let width = self.designers.len();
        let (mut rows, mut named) = (Vec::new(), Vec::new());
        for (k, key) in keys.iter().enumerate() {
            let (own, touches) = (iou_of(k), KINDS[key.kind].1);
            let of_random = random.map_or_else(|| own.clone(), |r| iou_of(k - k % width + r));
            let gains: Vec<f64> = own.iter().zip(&of_random).map(|(a, b)| a - b).collect();
            let places: Vec<f64> = repetitions.iter().filter_map(|r| mean_place(&r.scores[k])).collect();
            let (Some(iou), Some(gain)) = (band(&own), band(&gains)) else {
                continue;
            };
            rows.push(SensingRow {
                touches,
                readout: key.readout.to_owned(),
                designer: key.designer.name,
                m: key.m,
                iou,
                gain,
                place_px: band(&places),
                clipped: repetitions.iter().map(|r| r.clipped[k]).sum::<f64>() / repetitions.len() as f64,
            });
            let mut names: BTreeMap<&str, (usize, f64)> = BTreeMap::new();
            for (name, score) in repetitions.iter().flat_map(|r| &r.scores[k]) {
                let entry = names.entry(name).or_default();
                *entry = (entry.0 + 1, entry.1 + score.iou);
            }
            named.extend(names.into_iter().map(|(name, (count, sum))| NamedRow {
                touches,
                name: name.to_owned(),
                readout: key.readout.to_owned(),
                designer: key.designer.name,
                m: key.m,
                count,
                iou: sum / count as f64,
            }));
        }
        let columns: Vec<&[CostRow]> = repetitions.iter().map(|r| &r.costs[..]).collect();
        SensingReport {
            skin: [self.layout.rows(), self.layout.cols()],
            decoder: self.decoder.name,
            skins: self.skins,
            touches: self.touches,
            equal: equals(&rows),
            rows,
            classes,
            costs: CostRow::mean(&columns),
            named,
        }
    }
}

/// Mean distance of the centres of all touches that have one.
fn mean_place(scores: &[NamedScore]) -> Option<f64> {
    let places: Vec<f64> = scores.iter().filter_map(|(_, s)| s.place_px).collect();
    (!places.is_empty()).then(|| places.iter().sum::<f64>() / places.len() as f64)
}

/// How many measurements with random rows each other row of the table is worth: where the random curve, a straight
/// line between the M that were tried, first has its IoU.
fn equals(rows: &[SensingRow]) -> Vec<Equal> {
    let alike = |a: &SensingRow, b: &SensingRow| a.touches == b.touches && a.readout == b.readout;
    let worth = |row: &SensingRow| {
        let mut curve: Vec<(f64, f64)> = rows
            .iter()
            .filter(|r| r.designer == RANDOM && alike(r, row))
            .map(|r| (r.m as f64, r.iou.mean))
            .collect();
        curve.sort_by(|a, b| a.0.total_cmp(&b.0));
        let first = curve
            .first()
            .filter(|first| first.1 >= row.iou.mean)
            .map(|first| first.0);
        let crossing = curve
            .windows(2)
            .find(|w| w[0].1 < row.iou.mean && w[1].1 >= row.iou.mean);
        first.or_else(|| {
            let [(m0, i0), (m1, i1)] = [*crossing?.first()?, *crossing?.last()?];
            Some(m0 + (m1 - m0) * (row.iou.mean - i0) / (i1 - i0))
        })
    };
    let others = rows.iter().filter(|row| row.designer != RANDOM);
    others
        .map(|row| Equal {
            touches: row.touches,
            readout: row.readout.clone(),
            designer: row.designer,
            m: row.m,
            random_m: worth(row),
        })
        .collect()
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

    /// By hand: random has .2, .4, .8 at 5, 10, 20; .5 lies a quarter of the way from 10 to 20.
    #[test]
    fn what_a_row_is_worth_is_interpolated() {
        let row = |designer: &'static str, m: usize, iou: f64| SensingRow {
            touches: "shapes",
            readout: "ideal".to_owned(),
            designer,
            m,
            iou: band(&[iou]).unwrap(),
            gain: band(&[0.0]).unwrap(),
            place_px: None,
            clipped: 0.0,
        };
        let rows = [
            row("random", 20, 0.8),
            row("random", 5, 0.2),
            row("random", 10, 0.4),
            row("greedy", 5, 0.5),
            row("greedy", 10, 0.9),
            row("hadamard", 5, 0.1),
        ];
        let found: Vec<Option<f64>> = equals(&rows).iter().map(|e| e.random_m).collect();
        assert!((found[0].unwrap() - 12.5).abs() < 1e-12);
        assert_eq!((found[1], found[2]), (None, Some(5.0)));
    }
}
