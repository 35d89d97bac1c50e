//! LeRobot v3.0: a press is an episode, a row is a frame.
//!
//! Layout, as read by LeRobot 0.4 and later: `meta/info.json`, `meta/stats.json`, `meta/tasks.parquet`,
//! `meta/episodes/chunk-000/file-000.parquet` with the statistics of every episode, and
//! `data/chunk-000/file-000.parquet` with the frames, one row group an episode.

mod arrays;
mod episode;
mod features;
mod meta;
mod series;
mod stats;
mod table;

use super::rows::each_row;
use super::{ExportOptions, SPLITS, WriteExport, Written};
use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::spec::Spec;
use arrow_array::RecordBatch;
use arrow_schema::{Field, Schema, SchemaRef};
use episode::{Episode, Place};
use features::{Feature, features};
use meta::Totals;
use series::Series;
use spts::output::OutputFolder;
use spts::progress::Progress;
use stats::{FeatureStats, MergedStats, NAMES};
use std::collections::HashMap;
use std::sync::Arc;
use table::EpisodeTable;

/// Most bytes of an episode and its statistics, which are in memory as a whole.
const MAX_EPISODE_BYTES: u128 = 1 << 30;
/// Bytes that a value of an episode takes in memory, as a double and in the file's type; those of a statistic, as JSON.
const VALUE_BYTES: u128 = 16;
const STATISTIC_BYTES: u128 = 48;
/// Largest frame rate, and how far from a whole number it may be: seconds with seven digits mean a whole rate.
const MAX_FPS: f64 = 1e6;
const FPS_TOLERANCE: f64 = 1e-6;

/// Prepares a folder for LeRobot.
pub(super) fn prepare<'a>(dataset: &'a Dataset, options: &ExportOptions) -> Result<WriteExport<'a>, DatasetError> {
    if let Some(rows) = options.rows_per_tar {
        let problem = format!("`rows_per_tar` = {rows}: valid for the format webdataset only");
        return Err(DatasetError::Export(problem));
    }
    let spec = dataset.spec();
    let fps = fps(spec)?;
    let features = features(spec);
    let values: usize = features.iter().map(Feature::values).sum();
    let frames = u128::from(spec.windows()) * VALUE_BYTES;
    let bytes = (frames + NAMES.len() as u128 * STATISTIC_BYTES) * values as u128;
    if bytes > MAX_EPISODE_BYTES {
        return Err(DatasetError::Export(format!(
            "`record.windows` = {}: an episode of so many windows of {values} values takes {bytes} bytes of memory; \
             valid: up to {MAX_EPISODE_BYTES} bytes",
            spec.windows()
        )));
    }
    Ok(Box::new(move |out, progress| {
        write(dataset, fps, &features, out, progress)
    }))
}

/// Frames a second, which LeRobot needs as a whole number.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "within the limits above"
)]
fn fps(spec: &Spec) -> Result<u32, DatasetError> {
    let Some(interval_s) = spec.interval_s() else {
        return Err(DatasetError::Export(
            "`record.interval_s` is not set: LeRobot needs a whole number of frames a second; set it in the spec and \
             make the data set anew, for example `interval_s = 0.02` for 50"
                .to_owned(),
        ));
    };
    let rate = 1.0 / interval_s;
    if (1.0..=MAX_FPS).contains(&rate.round()) && (rate - rate.round()).abs() <= FPS_TOLERANCE {
        return Ok(rate.round() as u32);
    }
    Err(DatasetError::Export(format!(
        "`record.interval_s` = {interval_s}: LeRobot needs a whole number of frames a second; valid: 1/n s for n = 1 to \
         10^6, for example 0.02"
    )))
}

/// An export that is being written.
struct Recorder<'a> {
    features: &'a [Feature],
    fps: u32,
    data: Series<'a>,
    schema: SchemaRef,
    /// Bytes of a frame.
    frame_bytes: u64,
    table: EpisodeTable<'a>,
    stats: Vec<MergedStats>,
    /// Tasks in order of first use, with their numbers.
    tasks: Vec<String>,
    task_numbers: HashMap<String, usize>,
    episodes: u64,
    frames: u64,
}

fn write(
    dataset: &Dataset,
    fps: u32,
    features: &[Feature],
    out: &OutputFolder,
    progress: &dyn Progress,
) -> Result<Written, DatasetError> {
    let spec = dataset.spec();
    let fields = features
        .iter()
        .map(|feature| Field::new(feature.key, arrays::column_type(feature), true));
    let schema = Arc::new(Schema::new(fields.collect::<Vec<_>>()));
    let frame_bytes: usize = features.iter().map(|f| f.values() * f.scalar.bytes()).sum();
    let mut recorder = Recorder {
        features,
        fps,
        data: Series::new(out, "data", Arc::clone(&schema)),
        schema,
        frame_bytes: frame_bytes as u64,
        table: EpisodeTable::new(out, features),
        stats: features.iter().map(|f| MergedStats::new(f.values())).collect(),
        tasks: Vec::new(),
        task_numbers: HashMap::new(),
        episodes: 0,
        frames: 0,
    };
    let mut written = Written::default();
    let mut splits = Vec::new();
    for split in SPLITS {
        let (first_episode, first_frame) = (recorder.episodes, recorder.frames);
        let mut open: Option<(f64, Episode)> = None;
        each_row(dataset, split, progress, |row| {
            let press = row.number("press")?;
            #[expect(clippy::float_cmp, reason = "both are whole numbers")]
            if let Some((_, episode)) = open.take_if(|(number, _)| *number != press) {
                recorder.end(episode)?;
            }
            let (_, episode) = match &mut open {
                Some(open) => open,
                None => open.insert((press, Episode::new(spec, features, row)?)),
            };
            episode.add(features, row)
        })?;
        if let Some((_, episode)) = open {
            recorder.end(episode)?;
        }
        if recorder.episodes > first_episode {
            splits.push((split, first_episode..recorder.episodes));
            written.splits.insert(split, recorder.frames - first_frame);
        }
    }
    written.episodes = Some(recorder.episodes);
    recorder.finish(spec, splits, out)?;
    Ok(written)
}

impl Recorder<'_> {
    /// Writes an episode that has all its frames.
    fn end(&mut self, mut episode: Episode) -> Result<(), DatasetError> {
        let next = self.tasks.len();
        let task = *self.task_numbers.entry(episode.task.clone()).or_insert_with(|| {
            self.tasks.push(episode.task.clone());
            next
        });
        let place = Place {
            episode: self.episodes,
            first: self.frames,
            task,
            fps: self.fps,
        };
        episode.complete(self.features, place);
        let pairs = || self.features.iter().zip(&episode.values);
        let stats: Vec<FeatureStats> = pairs().map(|(f, v)| FeatureStats::of(v, f.values())).collect();
        let columns = pairs()
            .map(|(f, v)| arrays::column(f, v))
            .collect::<Result<Vec<_>, _>>();
        let batch = columns.and_then(|columns| RecordBatch::try_new(Arc::clone(&self.schema), columns));
        let batch = batch.map_err(|e| DatasetError::Export(format!("episode {}: {e}", self.episodes)))?;
        let length = episode.length as u64;
        let [chunk, file] = self.data.reserve(length * self.frame_bytes)?;
        self.data.write(&batch)?;
        self.stats.iter_mut().zip(&stats).for_each(|(all, one)| all.add(one));
        let numbers = [self.episodes, length, chunk, file, self.frames, self.frames + length];
        self.table.push(&episode.task, numbers, stats)?;
        self.episodes += 1;
        self.frames += length;
        Ok(())
    }

    /// Ends all files and writes those that describe the export.
    fn finish(
        mut self,
        spec: &Spec,
        splits: Vec<(&'static str, std::ops::Range<u64>)>,
        out: &OutputFolder,
    ) -> Result<(), DatasetError> {
        self.data.close()?;
        self.table.finish()?;
        let stats: Vec<FeatureStats> = self.stats.into_iter().map(MergedStats::total).collect();
        let totals = Totals {
            spec,
            features: self.features,
            fps: self.fps,
            episodes: self.episodes,
            frames: self.frames,
            tasks: &self.tasks,
            splits,
        };
        meta::write(out, &totals, &stats)
    }
}
