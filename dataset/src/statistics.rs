//! Statistics of a whole data set.

use crate::columns::{Column, columns};
use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::read::{Wanted, batches, numbers};
use crate::store::Kind;
use arrow_array::Array as _;
use arrow_array::cast::AsArray as _;
use serde::Serialize;
use spts::progress::Progress;
use std::collections::BTreeMap;

/// Statistics of a data set, column by column in file order.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of rows.
    pub rows: u64,
    /// Columns.
    pub columns: Vec<ColumnStatistics>,
}

/// Statistics of a column.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ColumnStatistics {
    /// The column.
    #[serde(flatten)]
    pub column: Column,
    /// Number of values; for lists, the number of their entries.
    pub count: u64,
    /// Smallest value; `None` for texts, and without any value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub least: Option<f64>,
    /// Mean; `None` for texts, and without any value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean: Option<f64>,
    /// Largest value; `None` for texts, and without any value.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub most: Option<f64>,
    /// Number of rows with each text.
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    pub texts: BTreeMap<String, u64>,
}

impl Statistics {
    /// Computes the statistics of all files of `dataset`.
    ///
    /// # Errors
    /// [`DatasetError`] if a file cannot be read, or holds a value that is not finite.
    pub fn of(dataset: &Dataset, progress: &dyn Progress) -> Result<Self, DatasetError> {
        let spec = dataset.spec();
        let mut rows = 0;
        let mut sums = vec![0.0; columns(spec).len()];
        let of = |column| ColumnStatistics {
            column,
            count: 0,
            least: None,
            mean: None,
            most: None,
            texts: BTreeMap::new(),
        };
        let mut all: Vec<ColumnStatistics> = columns(spec).into_iter().map(of).collect();
        progress.stage("statistics", usize::try_from(spec.shards()).ok());
        for shard in 0..spec.shards() {
            let path = dataset.shard_file(shard);
            batches(&path, Wanted::All, |batch| {
                rows += batch.num_rows() as u64;
                for ((found, sum), array) in all.iter_mut().zip(&mut sums).zip(batch.columns()) {
                    if found.column.kind == Kind::Text {
                        for text in array.as_string::<i32>().iter().flatten() {
                            *found.texts.entry(text.to_owned()).or_default() += 1;
                        }
                        found.count += (array.len() - array.null_count()) as u64;
                        continue;
                    }
                    let mut finite = true;
                    numbers(array, |value| {
                        finite &= value.is_finite();
                        *sum += value;
                        found.count += 1;
                        found.least = Some(found.least.map_or(value, |least| least.min(value)));
                        found.most = Some(found.most.map_or(value, |most| most.max(value)));
                    });
                    if !finite {
                        let problem = format!("column `{}` holds a value that is not finite", found.column.name);
                        return Err(DatasetError::file(&path, problem));
                    }
                }
                Ok(true)
            })?;
            progress.step();
        }
        progress.end();
        for (found, sum) in all.iter_mut().zip(sums) {
            found.mean = found.least.map(|_| sum / found.count as f64);
        }
        Ok(Self { rows, columns: all })
    }

    /// The column called `name`.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&ColumnStatistics> {
        self.columns.iter().find(|c| c.column.name == name)
    }
}
