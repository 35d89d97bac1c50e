//! The files that describe an export: `info.json`, `stats.json`, `tasks.parquet` and the card.

use super::features::{Feature, Scalar};
use super::series::{CHUNK_FILES, FILE_MB, Series};
use super::stats::{FeatureStats, NAMES};
use crate::error::DatasetError;
use crate::spec::Spec;
use arrow_array::{Int64Array, RecordBatch, StringArray};
use arrow_schema::{DataType, Field, Schema};
use parquet::arrow::ArrowWriter;
use serde::{Serialize, Serializer};
use serde_json::{Value, json};
use spts::output::{AtomicFile, OutputFolder, write_bytes, write_json};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::sync::Arc;

/// What an export holds.
pub(super) struct Totals<'a> {
    pub(super) spec: &'a Spec,
    pub(super) features: &'a [Feature],
    pub(super) fps: u32,
    pub(super) episodes: u64,
    pub(super) frames: u64,
    pub(super) tasks: &'a [String],
    /// Splits that have episodes, and the episodes of each.
    pub(super) splits: Vec<(&'static str, std::ops::Range<u64>)>,
}

/// `meta/info.json`; serialisation keeps the order of features and splits.
#[derive(Serialize)]
struct Info<'a> {
    codebase_version: &'static str,
    robot_type: &'static str,
    total_episodes: u64,
    total_frames: u64,
    total_tasks: usize,
    chunks_size: u64,
    data_files_size_in_mb: u64,
    video_files_size_in_mb: u64,
    fps: u32,
    splits: InOrder<String>,
    data_path: &'static str,
    video_path: Option<&'static str>,
    features: InOrder<FeatureInfo<'a>>,
}

/// A feature in `meta/info.json`.
#[derive(Serialize)]
struct FeatureInfo<'a> {
    dtype: &'static str,
    shape: &'a [usize],
    names: Option<&'static [&'static str]>,
}

/// A JSON object whose keys keep their order.
struct InOrder<T>(Vec<(&'static str, T)>);

impl<T: Serialize> Serialize for InOrder<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(key, value)| (key, value)))
    }
}

/// Writes all files that describe the export.
pub(super) fn write(out: &OutputFolder, totals: &Totals<'_>, stats: &[FeatureStats]) -> Result<(), DatasetError> {
    let meta = out.folder("meta")?;
    let splits = totals.splits.iter();
    let splits = splits.map(|(name, range)| (*name, format!("{}:{}", range.start, range.end)));
    let features = totals.features.iter().map(|feature| {
        let info = FeatureInfo {
            dtype: feature.scalar.name(),
            shape: &feature.shape,
            names: feature.names,
        };
        (feature.key, info)
    });
    let info = Info {
        codebase_version: "v3.0",
        robot_type: "spts_skin",
        total_episodes: totals.episodes,
        total_frames: totals.frames,
        total_tasks: totals.tasks.len(),
        chunks_size: CHUNK_FILES,
        data_files_size_in_mb: FILE_MB,
        // LeRobot's default; there are no videos
        video_files_size_in_mb: 200,
        fps: totals.fps,
        splits: InOrder(splits.collect()),
        data_path: "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        video_path: None,
        features: InOrder(features.collect()),
    };
    write_json(&meta.join("info.json"), &info)?;
    let stats = totals.features.iter().zip(stats);
    let stats = stats.map(|(feature, stats)| (feature.key, statistics(feature, stats)));
    write_json(&meta.join("stats.json"), &InOrder(stats.collect()))?;
    write_tasks(out, totals.tasks)?;
    Ok(write_bytes(&out.path("README.md"), card(totals).as_bytes())?)
}

/// Statistics of a feature, each with the feature's shape.
fn statistics(feature: &Feature, stats: &FeatureStats) -> InOrder<Value> {
    let number = |value: &f64| match feature.scalar {
        Scalar::F32 => json!(value),
        // whole numbers stay so, as far as they are
        Scalar::I64 if value.fract() == 0.0 => json!(super::episode::integer(*value)),
        Scalar::I64 => json!(value),
    };
    let shaped = |values: &[f64]| -> Value {
        match feature.shape[..] {
            [_, cols] => (values.chunks(cols).map(|row| row.iter().map(number).collect::<Value>())).collect(),
            _ => values.iter().map(number).collect(),
        }
    };
    let values = NAMES.iter().zip(&stats.values);
    let values = values.map(|(name, values)| (*name, shaped(values)));
    InOrder(values.chain([("count", json!([stats.count]))]).collect())
}

/// Writes `meta/tasks.parquet`: as pandas writes a frame whose index is the task.
fn write_tasks(out: &OutputFolder, tasks: &[String]) -> Result<(), DatasetError> {
    let column = |name: &str, field: &str, pandas: &str, numpy: &str| json!({"name": name, "field_name": field, "pandas_type": pandas, "numpy_type": numpy, "metadata": null});
    let pandas = json!({
        "index_columns": ["task"],
        "column_indexes": [],
        "columns": [
            column("task_index", "task_index", "int64", "int64"),
            column("task", "task", "unicode", "object"),
        ],
        "creator": {"library": "spts", "version": env!("CARGO_PKG_VERSION")},
        "pandas_version": "2.0.0",
    });
    let fields = vec![
        Field::new("task_index", DataType::Int64, true),
        Field::new("task", DataType::Utf8, true),
    ];
    let metadata = HashMap::from([("pandas".to_owned(), pandas.to_string())]);
    let schema = Arc::new(Schema::new_with_metadata(fields, metadata));
    let path = out.path("meta/tasks.parquet");
    let failed = |e: &dyn std::fmt::Display| DatasetError::file(&path, e.to_string());
    let numbers = Int64Array::from_iter_values((0..).take(tasks.len()));
    let texts = StringArray::from_iter_values(tasks);
    let batch = RecordBatch::try_new(Arc::clone(&schema), vec![Arc::new(numbers), Arc::new(texts)]);
    let properties = Series::properties(&path)?;
    let file = AtomicFile::create(&path)?;
    let mut writer = ArrowWriter::try_new(file, schema, Some(properties)).map_err(|e| failed(&e))?;
    writer.write(&batch.map_err(|e| failed(&e))?).map_err(|e| failed(&e))?;
    Ok(writer.into_inner().map_err(|e| failed(&e))?.finish()?)
}

/// Card of the export, with the units of its features.
fn card(totals: &Totals<'_>) -> String {
    let config = totals.spec.config();
    let mut text = format!(
        "---\ntags:\n- LeRobot\n- tactile\nconfigs:\n- config_name: default\n  data_files: data/*/*.parquet\n---\n\n# {}\n\n",
        config.name
    );
    if !config.description.is_empty() {
        let _ = writeln!(text, "{}\n", config.description);
    }
    let _ = writeln!(
        text,
        "Synthetic touches of a single-pixel tactile skin in LeRobot's layout v3.0: {} episodes, {} frames, {} frames a second. \
         An episode is a press, a frame is a window of {} samples of the skin's one wire. `spec.toml` is the spec that the data set was made from.\n\n\
         | split | episodes |\n|---|---|",
        totals.episodes, totals.frames, totals.fps, config.record.measurements
    );
    for (name, range) in &totals.splits {
        let _ = writeln!(text, "| {name} | {} to {} |", range.start, range.end - 1);
    }
    let _ = writeln!(text, "\n| feature | type | shape | what it is |\n|---|---|---|---|");
    for feature in totals.features {
        let (dtype, what) = (feature.scalar.name(), feature.description);
        let _ = writeln!(text, "| `{}` | {dtype} | {:?} | {what} |", feature.key, feature.shape);
    }
    text
}
