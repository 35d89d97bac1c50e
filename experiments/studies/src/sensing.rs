//! Rows of the sensing matrix, designed for a skin.

use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::{Patterns, WeightMode, Weights, seeds_of_first_window};
use spts_eval::Source;
use spts_eval::training::{Kinds, TrainingData};
use spts_firmware::{FIRST_ADDRESS, LAST_BUS_ADDRESS, PATTERN_BITS, Pattern};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;
use spts_recon::classify::{Component, TemplateModel};
use spts_recon::recover::ImagePrior;
use spts_recon::rows::{
    DesignRows as _, Designer, Expected, Random, RowTask, Tolerances, fewest_flips, largest_sum, posterior_trace,
};
use std::path::PathBuf;

/// Bit times of a start, a stop, and of a byte with its acknowledgement, and bits a second of the bus.
const BUS: [f64; 3] = [2.0, 9.0, 400e3];
/// Cells on a bus.
const BUS_CELLS: usize = (LAST_BUS_ADDRESS - FIRST_ADDRESS) as usize + 1;
/// The designer that weighs kinds of images.
const WEIGHS_KINDS: &str = "greedy";
/// Random designs that a design is compared with.
const RANDOM: u64 = 16;

/// Images that rows are designed to see: the prior of a designer.
#[derive(Debug, Clone, PartialEq)]
pub enum DesignImages {
    /// Smooth images, whose pixels are similar up to about this distance, taxels.
    Smooth(f64),
    /// Random shapes anywhere on the skin.
    Shapes,
    /// Those of the recordings in this folder, shifted; their templates are for designers that distinguish classes.
    Recordings(PathBuf),
}

/// Settings of `spts sensing design`, which designs rows of the sensing matrix for a skin.
#[derive(Clone)]
pub struct RowDesign {
    /// The skin. Recordings define their own.
    pub layout: SkinLayout,
    /// The designer.
    pub designer: &'static Designer,
    /// Number of rows.
    pub rows: usize,
    /// Images for which rows are designed.
    pub images: DesignImages,
    /// Noise of a measurement, as of [`RowTask`].
    pub noise: f64,
    /// Limit of the sums, as of [`RowTask`].
    pub largest_sum: Option<f64>,
    /// Differences that images may have from the expected ones.
    pub tolerances: Tolerances,
    /// Whether the kind of images of which most is left counts, in place of the mean of all images.
    pub worst_kind: bool,
    /// Whether rows are ordered so that cells change least.
    pub fewest_flips: bool,
    /// Seed of all random numbers.
    pub seed: u64,
}

/// How well rows see one kind of the expected images.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KindLeft {
    /// Outline of the random shapes, or object of the recordings.
    pub kind: String,
    /// Share of the kind's variance that remains after the M measurements.
    pub variance_left: f64,
    /// The same share after as many rows that were designed for the mean of all images.
    pub variance_left_for_mean: f64,
}

/// Results of `spts sensing design`: the rows, with what they are like.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RowDesignReport {
    /// Designer.
    pub designer: &'static str,
    /// Name of the designer in figures.
    #[serde(skip)]
    pub label: &'static str,
    /// Rows and columns of the skin.
    pub skin: [usize; 2],
    /// Number of rows M.
    pub m: usize,
    /// "binary": ±1.
    pub levels: &'static str,
    /// Share of the expected images' variance that remains after the M measurements.
    pub variance_left: f64,
    /// The same share for random signs; mean of sixteen.
    pub variance_left_random: f64,
    /// What is left of every kind; empty where the mean of all images counts.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub kinds: Vec<KindLeft>,
    /// Largest root mean square of a row's sum over the expected images, relative to a random row's.
    pub largest_sum: f64,
    /// Mean share of the cells whose level changes from one row to the next and from the last to the first.
    pub flips: f64,
    /// Number of rows on which all taxels have the same level: they measure nothing but the total.
    pub constant_rows: usize,
    /// Bytes written to a cell as a pattern; `None` if cells cannot store it.
    pub bytes_a_cell: Option<usize>,
    /// Time to load all cells over one bus of 400 kHz for each 112 cells, s; `None` if cells cannot store the pattern.
    pub load_s: Option<f64>,
    /// Whether there are seeds of the cells' generators that begin with these rows.
    pub seeds_found: bool,
    /// The rows, in order of output.
    #[serde(skip)]
    pub patterns: Patterns,
    /// The rows as weights.
    #[serde(skip)]
    pub weights: Weights,
    /// Seeds, one for each cell, that begin with the rows.
    #[serde(skip)]
    pub seeds: Option<Vec<u32>>,
}

impl RowDesign {
    /// Designs the rows.
    ///
    /// # Errors
    /// [`Refusal`] for a task out of range, recordings that cannot be read, or images from which no prior can be
    /// made; with `worst_kind` for another designer than `greedy`, or images of fewer than two kinds.
    pub fn run(&self, progress: &dyn Progress) -> Result<RowDesignReport, Refusal> {
        if self.worst_kind && self.designer.name != WEIGHS_KINDS {
            return Err(Refusal::new(format!(
                "`--worst-kind` with `--designer` = {}; valid: {WEIGHS_KINDS}, which alone weighs kinds of images",
                self.designer.name
            )));
        }
        progress.stage("expected images", None);
        let (expected, kinds, classes) = self.expected()?;
        progress.stage("designing rows", Some(self.rows * (1 + usize::from(self.worst_kind))));
        let row_found = || progress.step();
        let task = RowTask {
            row_found: &row_found,
            kinds: &kinds.expected,
            classes: &classes,
            noise: self.noise,
            largest_sum: self.largest_sum,
            seed: self.seed,
            ..RowTask::new(self.rows, &expected)
        };
        let rows = (self.designer.build)().design(&task)?;
        // figures from here on are of all images, or of one kind
        let task = RowTask { kinds: &[], ..task };
        let for_mean = if self.worst_kind { Some((self.designer.build)().design(&task)?) } else { None };
        progress.stage("comparing with random rows", None);
        let taxels = rows.ncols();
        let order =
            if self.fewest_flips { fewest_flips(rows.view(), &vec![1.0; taxels]) } else { (0..rows.nrows()).collect() };
        let mode = WeightMode::Binary;
        let levels: Vec<f64> = order.iter().flat_map(|&r| rows.row(r)).copied().collect();
        let patterns = Patterns::of_levels(order.len(), &levels)?;
        let weights = Weights::with_patterns(mode, patterns.clone())?;
        let seeds = seeds_of_first_window(&patterns).ok();
        let random = |seed: u64| {
            let task = RowTask { seed: self.seed.wrapping_add(seed), largest_sum: None, ..task };
            Random.design(&task).and_then(|rows| posterior_trace(&task, &rows))
        };
        let random = (0..RANDOM).map(random).collect::<Result<Vec<f64>, _>>()?;
        let message = (rows.nrows() <= PATTERN_BITS)
            .then(|| Pattern::new(rows.nrows(), 0).ok().map(|pattern| pattern.message().len()))
            .flatten();
        let kinds = kinds.names.into_iter().zip(&kinds.expected).zip(for_mean.iter().cycle());
        let kinds = kinds.map(|((kind, expected), for_mean)| {
            let left = |rows: &Matrix| posterior_trace(&RowTask { expected, ..task }, rows);
            Ok(KindLeft { kind, variance_left: left(&rows)?, variance_left_for_mean: left(for_mean)? })
        });
        Ok(RowDesignReport {
            kinds: kinds.collect::<Result<_, Refusal>>()?,
            designer: self.designer.name,
            label: self.designer.label,
            skin: expected.shape(),
            m: rows.nrows(),
            levels: mode.name(),
            variance_left: posterior_trace(&task, &rows)?,
            variance_left_random: random.iter().sum::<f64>() / random.len() as f64,
            largest_sum: largest_sum(&expected, &rows),
            flips: flips(&patterns),
            constant_rows: (0..rows.nrows()).filter(|&r| constant(rows.row(r))).count(),
            bytes_a_cell: message,
            load_s: message.map(|bytes| load_s(bytes, taxels)),
            seeds_found: seeds.is_some(),
            weights,
            patterns,
            seeds,
        })
    }

    /// Images, their kinds if the worst one counts, and classes where there are some.
    fn expected(&self) -> Result<(Expected, Kinds, Vec<Component>), Refusal> {
        let shape = [self.layout.rows(), self.layout.cols()];
        let streams = Streams::new(self.seed);
        let (data, classes) = match &self.images {
            DesignImages::Smooth(_) if self.worst_kind => {
                return Err(Refusal::new(
                    "`--worst-kind` with `--smooth`: smooth images have no kinds; valid: random shapes (without \
                     `--smooth`) or `--recordings`",
                ));
            }
            DesignImages::Smooth(length) => {
                let expected = Expected::smooth(shape, *length)?;
                return Ok((expected, Kinds::default(), Vec::new()));
            }
            DesignImages::Shapes => {
                let data = TrainingData::for_layout(&self.layout, streams)?;
                (data, Vec::new())
            }
            DesignImages::Recordings(path) => {
                let source = Source::open(path)?;
                let (data, _) = source.training(streams)?;
                // refuses a skin of too many taxels, before anything is formed for it
                data.prior(ImagePrior::UNSEEN)?;
                let classes = TemplateModel::new(data.shape[1]).classes(&data.templates);
                (data, classes?)
            }
        };
        let (expected, kinds) = data.expected(ImagePrior::UNSEEN, self.tolerances, self.worst_kind)?;
        Ok((expected, kinds, classes))
    }
}

/// Time in which `cells` cells take `bytes` bytes each, s: address and bytes with their acknowledgements, start and
/// stop; buses load side by side.
pub(crate) fn load_s(bytes: usize, cells: usize) -> f64 {
    let [ends, byte, rate_hz] = BUS;
    cells.min(BUS_CELLS) as f64 * (ends + byte * (bytes + 1) as f64) / rate_hz
}

/// Mean share of the cells whose code changes from one row of a pattern to the next, the first behind the last.
fn flips(patterns: &Patterns) -> f64 {
    let period = patterns.period() as u64;
    let changes = |row: u64| {
        let pairs = patterns.row(row).iter().zip(patterns.row(row + 1));
        pairs.filter(|(a, b)| a != b).count()
    };
    (0..period).map(changes).sum::<usize>() as f64 / (period as f64 * patterns.taxels() as f64)
}

/// Whether all taxels have the same level.
fn constant(row: &[f64]) -> bool {
    row.iter().all(|level| level.to_bits() == row[0].to_bits())
}

impl RowDesignReport {
    /// A summary in a few lines.
    pub fn text(&self) -> String {
        let [rows, cols] = self.skin;
        let mut out = format!(
            "{} rows of {} for {rows} × {cols} taxels\n\
             of the expected images' variance {:.1} % is left, with random signs {:.1} %\n\
             largest sum: {:.2} times that of a random row (root mean square); {:.0} % of the cells change from row to row\n",
            self.m,
            self.designer,
            100.0 * self.variance_left,
            100.0 * self.variance_left_random,
            self.largest_sum,
            100.0 * self.flips,
        );
        let worst = |left: fn(&KindLeft) -> f64| self.kinds.iter().max_by(|a, b| left(a).total_cmp(&left(b)));
        if let (Some(worst), Some(for_mean)) = (worst(|k| k.variance_left), worst(|k| k.variance_left_for_mean)) {
            out.push_str(&format!(
                "worst of {} kinds: {}, of whose variance {:.1} % is left; of rows for the mean, {} with {:.1} %\n",
                self.kinds.len(),
                worst.kind,
                100.0 * worst.variance_left,
                for_mean.kind,
                100.0 * for_mean.variance_left_for_mean,
            ));
        }
        if self.constant_rows > 0 {
            out.push_str(&format!("{} of the rows are constant: all taxels have the same level\n", self.constant_rows));
        }
        out.push_str(&match (self.bytes_a_cell, self.load_s) {
            (Some(bytes), Some(load_s)) => {
                format!("pattern: {bytes} bytes a cell, {:.1} ms for all at 400 kHz\n", 1e3 * load_s)
            }
            _ => "pattern: no cell holds it (at most 64 rows of ±1)\n".to_owned(),
        });
        out.push_str(if self.seeds_found {
            "seeds: there are some that begin with these rows\n"
        } else {
            "seeds: none (at most 24 rows of ±1)\n"
        });
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_recon::rows::designer;

    fn design(name: &str, images: DesignImages) -> RowDesign {
        RowDesign {
            layout: SkinLayout::new(6, 8, 5e-3, 3e-3).unwrap(),
            designer: designer(name).unwrap(),
            rows: 10,
            images,
            noise: RowTask::NOISE,
            largest_sum: None,
            tolerances: Tolerances::default(),
            worst_kind: false,
            fewest_flips: false,
            seed: 1,
        }
    }

    /// Rows that know the images leave less of them, order changes nothing but the flips, and the seeds begin with the
    /// rows.
    #[test]
    fn a_design_is_what_it_says() {
        for images in [DesignImages::Smooth(1.5), DesignImages::Shapes] {
            let plain = design("greedy", images.clone());
            let report = plain.run(&()).unwrap();
            assert!(report.variance_left < 0.8 * report.variance_left_random, "{report:?}");
            let ordered = RowDesign { fewest_flips: true, ..plain };
            let ordered = ordered.run(&()).unwrap();
            assert!(ordered.flips < report.flips, "{} {}", ordered.flips, report.flips);
            assert!((ordered.variance_left - report.variance_left).abs() < 1e-9);
            let seeded = Weights::with_seeds(WeightMode::Binary, report.seeds.clone().unwrap()).unwrap();
            let mut codes = vec![0; 10 * 48];
            seeded.fill_codes(0, &mut codes);
            let rows = (0..10).flat_map(|row| report.patterns.row(row).to_vec());
            assert!(codes.iter().copied().eq(rows));
            // by hand: address, mode, number of bits and two bytes of ten bits
            assert_eq!((report.bytes_a_cell, report.constant_rows), (Some(4), 0));
            assert!((report.load_s.unwrap() - 48.0 * 47.0 / 400e3).abs() < 1e-12);
        }
    }

    /// Outlines are much alike: the worst is seen as well as with rows for the mean of all, and no outline is lost.
    #[test]
    fn rows_for_the_worst_kind_say_what_is_left_of_each() {
        let report = RowDesign { worst_kind: true, ..design("greedy", DesignImages::Shapes) }.run(&()).unwrap();
        let names: Vec<&str> = report.kinds.iter().map(|k| k.kind.as_str()).collect();
        assert_eq!(names, ["angle", "cross", "ellipse", "plate", "ring"]);
        let worst = |left: fn(&KindLeft) -> f64| report.kinds.iter().map(left).fold(0.0, f64::max);
        let (own, for_mean) = (worst(|k| k.variance_left), worst(|k| k.variance_left_for_mean));
        assert!(own < for_mean + 0.005, "{:?}", report.kinds);
        assert!(report.kinds.iter().all(|k| k.variance_left < k.variance_left_for_mean + 0.05), "{:?}", report.kinds);
        assert!(report.text().contains("worst of 5 kinds: "), "{}", report.text());
        let plain = design("greedy", DesignImages::Shapes).run(&()).unwrap();
        assert!(plain.kinds.is_empty() && !serde_json::to_string(&plain).unwrap().contains("kinds"));
    }

    #[test]
    fn what_cannot_be_designed_is_refused() {
        let worst = |name, images| {
            let refused = RowDesign { worst_kind: true, ..design(name, images) }.run(&());
            refused.unwrap_err().to_string()
        };
        assert!(worst("separable", DesignImages::Shapes).contains("`--designer` = separable; valid: greedy"));
        assert!(worst("greedy", DesignImages::Smooth(1.5)).contains("smooth images have no kinds"));
        let few = RowDesign { rows: 0, ..design("greedy", DesignImages::Shapes) };
        assert!(few.run(&()).is_err());
        assert!(design("classes", DesignImages::Shapes).run(&()).is_err());
        let nowhere = DesignImages::Recordings("nowhere".into());
        assert!(design("greedy", nowhere).run(&()).unwrap_err().to_string().contains("nowhere"));
    }
}
