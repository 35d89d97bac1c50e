//! The table of episodes.

use super::arrays::{lists, nested, statistic};
use super::features::Feature;
use super::series::Series;
use super::stats::{FeatureStats, NAMES};
use crate::error::DatasetError;
use arrow_array::builder::{ListBuilder, StringBuilder};
use arrow_array::types::Int64Type;
use arrow_array::{ArrayRef, RecordBatch};
use arrow_schema::{DataType, Field, Schema, SchemaRef};
use spts::output::OutputFolder;
use std::sync::Arc;

/// Bytes of the episodes that wait for the file.
const WAITING_BYTES: u64 = 4 << 20;
/// Columns of an episode that are whole numbers, in the order of [`EpisodeTable::push`].
const NUMBERS: [&str; 8] = [
    "episode_index",
    "length",
    "data/chunk_index",
    "data/file_index",
    "dataset_from_index",
    "dataset_to_index",
    "meta/episodes/chunk_index",
    "meta/episodes/file_index",
];

/// An episode in the table.
struct Line {
    task: String,
    numbers: [u64; NUMBERS.len()],
    stats: Vec<FeatureStats>,
}

/// The table of episodes, on its way into its files.
pub(super) struct EpisodeTable<'a> {
    features: &'a [Feature],
    schema: SchemaRef,
    series: Series<'a>,
    waiting: Vec<Line>,
    waiting_bytes: u64,
    /// Bytes of an episode.
    bytes: u64,
}

impl<'a> EpisodeTable<'a> {
    pub(super) fn new(out: &'a OutputFolder, features: &'a [Feature]) -> Self {
        let numbers = NUMBERS.iter().map(|name| Field::new(*name, DataType::Int64, true));
        let tasks = Field::new("tasks", nested(DataType::Utf8, 1), true);
        let stats = features.iter().flat_map(|feature| {
            let depth = feature.shape.len();
            let field = move |name: &str, kind| Field::new(format!("stats/{}/{name}", feature.key), kind, true);
            let values = NAMES
                .iter()
                .map(move |name| field(name, nested(DataType::Float64, depth)));
            values.chain([field("count", nested(DataType::Int64, 1))])
        });
        let schema = Arc::new(Schema::new(numbers.chain([tasks]).chain(stats).collect::<Vec<Field>>()));
        let values: usize = features.iter().map(|feature| feature.values() * NAMES.len() + 1).sum();
        Self {
            features,
            series: Series::new(out, "meta/episodes", Arc::clone(&schema)),
            schema,
            waiting: Vec::new(),
            waiting_bytes: 0,
            bytes: 8 * (values + NUMBERS.len()) as u64,
        }
    }

    /// Adds an episode: `numbers` are the first six of [`NUMBERS`].
    pub(super) fn push(&mut self, task: &str, numbers: [u64; 6], stats: Vec<FeatureStats>) -> Result<(), DatasetError> {
        if self.series.is_full_for(self.bytes) || self.waiting_bytes >= WAITING_BYTES {
            self.flush()?;
        }
        let [chunk, file] = self.series.reserve(self.bytes)?;
        let [episode, length, data_chunk, data_file, from, to] = numbers;
        self.waiting.push(Line {
            task: task.to_owned(),
            numbers: [episode, length, data_chunk, data_file, from, to, chunk, file],
            stats,
        });
        self.waiting_bytes += self.bytes;
        Ok(())
    }

    fn flush(&mut self) -> Result<(), DatasetError> {
        let lines = std::mem::take(&mut self.waiting);
        self.waiting_bytes = 0;
        if lines.is_empty() {
            return Ok(());
        }
        let whole = |value: u64| i64::try_from(value).unwrap_or(i64::MAX);
        let mut arrays: Vec<ArrayRef> = Vec::with_capacity(self.schema.fields().len());
        for k in 0..NUMBERS.len() {
            arrays.push(lists::<Int64Type>(lines.iter().map(|line| whole(line.numbers[k])), &[]));
        }
        let mut tasks = ListBuilder::new(StringBuilder::new());
        for line in &lines {
            tasks.values().append_value(&line.task);
            tasks.append(true);
        }
        arrays.push(Arc::new(tasks.finish()));
        for (k, feature) in self.features.iter().enumerate() {
            for name in 0..NAMES.len() {
                let values = lines.iter().flat_map(|line| line.stats[k].values[name].iter().copied());
                arrays.push(statistic(feature, values));
            }
            let counts = lines.iter().map(|line| whole(line.stats[k].count));
            arrays.push(lists::<Int64Type>(counts, &[1]));
        }
        let batch = RecordBatch::try_new(Arc::clone(&self.schema), arrays);
        let batch = batch.map_err(|e| DatasetError::Export(format!("meta/episodes: {e}")))?;
        self.series.write(&batch)
    }

    /// Writes what waits and ends the last file.
    pub(super) fn finish(mut self) -> Result<(), DatasetError> {
        self.flush()?;
        self.series.close()
    }
}
