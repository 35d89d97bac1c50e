//! One file of a data set.

use crate::columns::{columns, put, stores};
use crate::error::DatasetError;
use crate::make::Maker;
use crate::spec::Spec;
use crate::store::{Store, field};
use arrow_array::RecordBatch;
use arrow_schema::{Schema, SchemaRef};
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::schema::types::ColumnPath;
use spts::output::AtomicFile;
use std::collections::HashMap;
use std::fs::File;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Keys of the facts in a file's footer.
pub(crate) const IDENTITY_KEY: &str = "spts.spec_sha256";
pub(crate) const SHARD_KEY: &str = "spts.shard";
pub(crate) const VERSION_KEY: &str = "spts.version";
const RECORDING_KEY: &str = "spts.recording";

/// Bytes of a group of rows before compression: what a writer keeps in memory.
const GROUP_BYTES: usize = 16 << 20;
/// Most rows of a group, and of the pieces in which they reach it.
const GROUP_ROWS: usize = 10_000;
const PIECE_ROWS: usize = 256;

/// Arrow schema of the files of `spec`.
#[must_use]
pub fn schema(spec: &Spec) -> SchemaRef {
    let fields = columns(spec).into_iter().map(|column| {
        let metadata = [("unit", column.unit), ("description", column.description)];
        let metadata = metadata.into_iter().filter(|(_, text)| !text.is_empty());
        let metadata: HashMap<String, String> = metadata.map(|(key, text)| (key.to_owned(), text.to_owned())).collect();
        field(&column.name, column.kind, column.length).with_metadata(metadata)
    });
    Arc::new(Schema::new(fields.collect::<Vec<_>>()))
}

/// Name of file number `shard` of `shards`.
///
/// ```
/// use spts_dataset::{Spec, shard_name, shard_rows};
///
/// let size = toml::from_str("rows = 2500\nrows_per_shard = 1000").expect("TOML");
/// let spec = Spec::load("random-shapes", &size)?;
/// assert_eq!(shard_rows(&spec, 2), 2000..2500);
/// assert_eq!(shard_name(2, spec.shards()), "part-00002.parquet");
/// # Ok::<(), spts_dataset::SpecError>(())
/// ```
#[must_use]
pub fn shard_name(shard: u64, shards: u64) -> String {
    let width = shards.saturating_sub(1).to_string().len().max(5);
    format!("part-{shard:0width$}.parquet")
}

/// Rows of file number `shard`.
#[must_use]
pub fn shard_rows(spec: &Spec, shard: u64) -> std::ops::Range<u64> {
    let first = shard * spec.rows_per_shard();
    first..(first + spec.rows_per_shard()).min(spec.config().rows)
}

/// Version of the library that makes the rows: its revision, too.
pub(crate) fn version() -> &'static str {
    static VERSION: OnceLock<String> = OnceLock::new();
    VERSION.get_or_init(|| {
        let made = spts::provenance::Provenance::new(0, String::new());
        format!("{} ({})", made.version, made.git_revision)
    })
}

/// Writes file number `shard` to `path`, with a temporary name until it is complete. Calls `done` after every row.
///
/// # Errors
/// [`DatasetError`] if a row cannot be made, or the file cannot be written.
pub fn write_shard(spec: &Spec, shard: u64, path: &Path, done: &dyn Fn()) -> Result<(), DatasetError> {
    let failed = |problem: &dyn std::fmt::Display| DatasetError::file(path, problem.to_string());
    let columns = columns(spec);
    let row_bytes: usize = columns.iter().map(|c| c.kind.bytes() * c.length.unwrap_or(1)).sum();
    let mut stores = stores(spec);
    let schema = schema(spec);
    let group = (GROUP_BYTES / row_bytes.max(1)).clamp(1, GROUP_ROWS);
    let pieces = PIECE_ROWS.min(group);
    let mut file = AtomicFile::create(path)?;
    let recording = serde_json::to_string(spec.recording()).map_err(|e| failed(&e))?;
    let properties = properties(spec, shard, group, &recording).map_err(|e| failed(&e))?;
    let mut writer = ArrowWriter::try_new(&mut file, Arc::clone(&schema), Some(properties)).map_err(|e| failed(&e))?;
    let mut maker = Maker::new(spec);
    let mut waiting = 0;
    let mut rows = shard_rows(spec, shard).peekable();
    while let Some(index) = rows.next() {
        put(&maker.row(index)?, &mut stores);
        waiting += 1;
        done();
        if waiting == pieces || rows.peek().is_none() {
            let arrays = stores.iter_mut().map(Store::take).collect::<Result<Vec<_>, _>>();
            let batch = arrays.and_then(|arrays| RecordBatch::try_new(Arc::clone(&schema), arrays));
            writer.write(&batch.map_err(|e| failed(&e))?).map_err(|e| failed(&e))?;
            waiting = 0;
        }
    }
    writer.close().map_err(|e| failed(&e))?;
    Ok(file.finish()?)
}

fn properties(
    spec: &Spec,
    shard: u64,
    group: usize,
    recording: &str,
) -> Result<WriterProperties, parquet::errors::ParquetError> {
    let fact = |key: &str, value: String| KeyValue::new(key.to_owned(), value);
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("spts {}", version()))
        .set_key_value_metadata(Some(vec![
            fact(IDENTITY_KEY, spec.identity().to_owned()),
            fact(SHARD_KEY, shard.to_string()),
            fact(VERSION_KEY, version().to_owned()),
            fact(RECORDING_KEY, recording.to_owned()),
        ]))
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(1)?))
        .set_max_row_group_row_count(Some(group))
        .set_dictionary_enabled(false);
    for column in columns(spec) {
        let path = match column.length {
            None => ColumnPath::new(vec![column.name]),
            Some(_) => ColumnPath::new(vec![column.name, "list".to_owned(), "item".to_owned()]),
        };
        if column.length.is_some() {
            // the least and the most of all taxels tell nobody which rows to read
            properties = properties.set_column_statistics_enabled(path, EnabledStatistics::None);
        } else if column.kind == crate::store::Kind::Text {
            properties = properties.set_column_dictionary_enabled(path, true);
        }
    }
    Ok(properties.build())
}

/// Checks that `path` is file number `shard` of `spec` and complete: footer, metadata and number of rows.
///
/// # Errors
/// [`DatasetError`] if it is not, or cannot be read.
pub fn check_shard(spec: &Spec, shard: u64, path: &Path) -> Result<(), DatasetError> {
    let file = File::open(path).map_err(DatasetError::read(path))?;
    let damaged = |e: parquet::errors::ParquetError| {
        DatasetError::file(
            path,
            format!("is not a whole Parquet file ({e}); remove it, and it is made anew"),
        )
    };
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    let metadata = reader.metadata().file_metadata();
    let facts = metadata.key_value_metadata();
    let fact = |key: &str| {
        let found = facts.and_then(|facts| facts.iter().find(|fact| fact.key == key));
        found.and_then(|fact| fact.value.clone()).unwrap_or_default()
    };
    for (key, what, needed) in [
        (IDENTITY_KEY, "spec", spec.identity().to_owned()),
        (SHARD_KEY, "place in the data set", shard.to_string()),
        (VERSION_KEY, "version", version().to_owned()),
    ] {
        let found = fact(key);
        if found != needed {
            let problem = format!(
                "was made for another {what} (\"{}\", here \"{needed}\")",
                found.escape_debug()
            );
            return Err(DatasetError::file(path, problem));
        }
    }
    let (rows, needed) = (metadata.num_rows(), shard_rows(spec, shard));
    if u64::try_from(rows) != Ok(needed.end - needed.start) {
        let needed = needed.end - needed.start;
        return Err(DatasetError::file(
            path,
            format!("has {rows} rows; {needed} are needed"),
        ));
    }
    Ok(())
}
