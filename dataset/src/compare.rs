//! Compares the rows of a data set: with the same rows made again, and with those of another data set.

use crate::columns::{columns, put, stores};
use crate::file::{Wanted, batches, check_shard, numbers, refused, shard_rows};
use crate::folder::Dataset;
use crate::make::Maker;
use crate::spec::Label;
use arrow_array::RecordBatch;
use arrow_array::cast::AsArray as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::Refusal;
use spts::progress::Progress;
use spts::recon::metrics::{SupportScore, pearson};
use std::collections::{BTreeMap, BTreeSet};

/// Which rows of a data set were made again, and which of them differ from the files.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Verified {
    /// Number of rows that were made again.
    pub rows: u64,
    /// Number of files to which they belong.
    pub shards: u64,
    /// Rows that differ, each with the first column that differs.
    pub differ: Vec<(u64, String)>,
}

impl Dataset {
    /// Makes `rows` rows, drawn with `seed`, again, and compares them with the files, bit for bit.
    ///
    /// # Errors
    /// [`Refusal`] if a file is missing, damaged or of another data set, or a row cannot be made.
    pub fn verify(&self, rows: u64, seed: u64, progress: &dyn Progress) -> Result<Verified, Refusal> {
        let all = 0..self.spec().config().rows;
        let sample = self.spec().drawn_rows("verify", &[all], rows, seed);
        let per_shard = self.spec().rows_per_shard();
        let shards: BTreeSet<u64> = sample.iter().map(|row| row / per_shard).collect();
        self.check_whole(0..self.spec().shards())?;
        progress.stage("rows compared", Some(sample.len()));
        let compared = shards.par_iter().map(|&shard| {
            let wanted: Vec<u64> = sample.range(shard_rows(self.spec(), shard)).copied().collect();
            self.compare(shard, &wanted, progress)
        });
        let differ: Result<Vec<_>, _> = compared.collect();
        progress.end();
        Ok(Verified { rows: sample.len() as u64, shards: shards.len() as u64, differ: differ?.concat() })
    }

    fn compare(&self, shard: u64, wanted: &[u64], progress: &dyn Progress) -> Result<Vec<(u64, String)>, Refusal> {
        let path = self.shard_file(shard);
        check_shard(self.spec(), shard, &path)?;
        let columns = columns(self.spec());
        let mut stores = stores(self.spec());
        let mut maker = Maker::new(self.spec());
        let (mut first, mut differ) = (shard_rows(self.spec(), shard).start, Vec::new());
        let mut wanted = wanted.iter().copied().peekable();
        batches(&path, Wanted::All, |batch| {
            let end = first + batch.num_rows() as u64;
            while let Some(index) = wanted.next_if(|index| *index < end) {
                put(&maker.row(index)?, &mut stores);
                let place = usize::try_from(index - first).unwrap_or_default();
                let mut other = None;
                for ((column, store), array) in columns.iter().zip(&mut stores).zip(batch.columns()) {
                    let made = store.take().map_err(|e| refused(&path, e.to_string()))?;
                    if *made != *array.slice(place, 1) {
                        other.get_or_insert_with(|| column.name.clone());
                    }
                }
                differ.extend(other.map(|column| (index, column)));
                progress.step();
            }
            first = end;
            Ok(wanted.peek().is_some())
        })?;
        Ok(differ)
    }
}

/// How far the ground truth of one data set is from that of a reference, over the rows in which both have a touch.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    /// Number of rows compared.
    pub rows: u64,
    /// Number of rows in which only one of the data sets has a pressure.
    pub one_sided: u64,
    /// Differences over all rows.
    pub all: Errors,
    /// Differences by the name of the first object.
    pub objects: BTreeMap<String, Errors>,
}

/// Differences between the rows of a data set and the same rows of the reference. Each is computed row by row; kept are
/// its 10th percentile, median and 90th percentile over the rows, in this order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Errors {
    /// Rows that were compared.
    pub rows: u64,
    /// Relative difference of the pressures: Σ|p − q| / Σq over the taxels, with the pressures p and the reference's q.
    pub pressure: [f64; 3],
    /// The same relative difference for the conductances.
    pub conductance: [f64; 3],
    /// Pearson correlation of the conductances over the taxels: 1 for equal images.
    pub correlation: [f64; 3],
    /// Intersection over union of the supports, the touched taxels: 1 for the same ones.
    pub support_iou: [f64; 3],
}

/// Differences of single rows, in the order of the fields of [`Errors`].
#[derive(Default)]
struct Rows([Vec<f64>; 4]);

impl Dataset {
    /// Compares the ground truth of every row with that of the same row of `reference`. The reference must have as many
    /// rows, equally large files and the same skin.
    ///
    /// # Errors
    /// [`Refusal`] if the data sets cannot be compared, or a file is missing or damaged.
    pub fn compare_with(&self, reference: &Self, progress: &dyn Progress) -> Result<Comparison, Refusal> {
        let facts = |of: &Self| {
            let spec = of.spec();
            let shape = [spec.skin().rows(), spec.skin().cols()];
            (spec.config().rows, spec.rows_per_shard(), shape)
        };
        let (own, other) = (facts(self), facts(reference));
        if own != other {
            let problem = format!(
                "has {} rows, {} a file, of {:?} taxels, and the reference {} rows, {} a file, of {:?} taxels: they do not go together",
                own.0, own.1, own.2, other.0, other.1, other.2
            );
            return Err(refused(self.folder(), problem));
        }
        for dataset in [self, reference] {
            let labels = &dataset.spec().config().record.labels;
            if !Label::ALL.iter().all(|label| labels.contains(label)) {
                let problem = "lacks columns that are compared: `record.labels` has to have all of them".to_owned();
                return Err(refused(dataset.folder(), problem));
            }
        }
        let (mut all, mut objects, mut one_sided) = (Rows::default(), BTreeMap::<String, Rows>::new(), 0);
        progress.stage("files compared", usize::try_from(self.spec().shards()).ok());
        for shard in 0..self.spec().shards() {
            let paths = [self.shard_file(shard), reference.shard_file(shard)];
            check_shard(self.spec(), shard, &paths[0])?;
            check_shard(reference.spec(), shard, &paths[1])?;
            let mut others = Vec::new();
            batches(&paths[1], Wanted::All, |batch| {
                others.push(batch.clone());
                Ok(true)
            })?;
            let mut others = others.into_iter();
            batches(&paths[0], Wanted::All, |batch| {
                let Some(other) = others.next() else {
                    return Ok(false);
                };
                for row in 0..batch.num_rows() {
                    let found = Row::of(batch, row)?;
                    let wanted = Row::of(&other, row)?;
                    if found.force() <= 0.0 || wanted.force() <= 0.0 {
                        one_sided += u64::from(found.force() > 0.0 || wanted.force() > 0.0);
                        continue;
                    }
                    all.add(&found, &wanted);
                    objects.entry(found.object.clone()).or_default().add(&found, &wanted);
                }
                Ok(true)
            })?;
            progress.step();
        }
        progress.end();
        Ok(Comparison {
            rows: own.0,
            one_sided,
            all: all.errors(),
            objects: objects.into_iter().map(|(name, rows)| (name, rows.errors())).collect(),
        })
    }
}

/// The truth of one row.
struct Row {
    object: String,
    pressure: Vec<f64>,
    conductance: Vec<f64>,
    support: Vec<bool>,
}

impl Row {
    fn of(batch: &RecordBatch, row: usize) -> Result<Self, Refusal> {
        let missing = |name: &str| Refusal::new(format!("a file has no column `{name}`"));
        let list = |name: &str| {
            let column = batch.column_by_name(name).ok_or_else(|| missing(name))?;
            let mut values = Vec::new();
            numbers(&column.slice(row, 1), |value| values.push(value));
            Ok::<_, Refusal>(values)
        };
        let object = batch.column_by_name("object").ok_or_else(|| missing("object"))?;
        Ok(Self {
            object: object.as_string::<i32>().value(row).to_owned(),
            pressure: list("pressure_pa")?,
            conductance: list("conductance_s")?,
            support: list("support")?.into_iter().map(|v| v > 0.5).collect(),
        })
    }

    fn force(&self) -> f64 {
        self.pressure.iter().sum()
    }
}

impl Rows {
    fn add(&mut self, found: &Row, wanted: &Row) {
        let apart = |a: &[f64], b: &[f64]| {
            let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum();
            apart / b.iter().sum::<f64>()
        };
        let Self([pressure, conductance, correlation, support_iou]) = self;
        pressure.push(apart(&found.pressure, &wanted.pressure));
        conductance.push(apart(&found.conductance, &wanted.conductance));
        correlation.extend(pearson(&found.conductance, &wanted.conductance));
        support_iou.push(SupportScore::new(&found.support, &wanted.support).iou);
    }

    fn errors(&self) -> Errors {
        let [pressure, conductance, correlation, support_iou] = self.0.each_ref().map(|values| spread(values));
        Errors { rows: self.0[0].len() as u64, pressure, conductance, correlation, support_iou }
    }
}

/// 10th percentile, median and 90th percentile: the values at these ranks, rounded; NaN of none.
fn spread(values: &[f64]) -> [f64; 3] {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    [1, 5, 9].map(|tenth| {
        let rank = (tenth * sorted.len().saturating_sub(1) + 5) / 10;
        sorted.get(rank).copied().unwrap_or(f64::NAN)
    })
}
