//! One file of rows: how it is written, checked and read.

use crate::columns::{Column, Kind, Store, columns, put, schema, stores};
use crate::make::Maker;
use crate::spec::Spec;
use arrow_array::cast::AsArray as _;
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use arrow_array::{Array as _, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::{ParquetRecordBatchReaderBuilder, RowSelection};
use parquet::arrow::{ArrowWriter, ProjectionMask};
use parquet::basic::{Compression, ZstdLevel};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, RowGroupMetaData};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader as _, SerializedFileReader};
use parquet::schema::types::ColumnPath;
use serde_json::Value;
use spts::Refusal;
use spts::output::AtomicFile;
use std::error::Error;
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;
use std::sync::{Arc, OnceLock};

/// Keys of the facts in a file's footer.
const IDENTITY_KEY: &str = "spts.spec_sha256";
const SHARD_KEY: &str = "spts.shard";
const VERSION_KEY: &str = "spts.version";
const RECORDING_KEY: &str = "spts.recording";

/// Bytes of a group of rows before compression: what a writer keeps in memory.
const GROUP_BYTES: usize = 16 << 20;
/// Most rows of a group, and of the pieces in which they reach it.
const GROUP_ROWS: usize = 10_000;
const PIECE_ROWS: usize = 256;
/// Most rows that are read together, and their bytes, so that large rows take no more memory than small ones.
const BATCH_ROWS: usize = 256;
const BATCH_BYTES: usize = 16 << 20;

/// The refusal of a file or folder with this problem.
pub(crate) fn refused(path: impl AsRef<Path>, problem: impl Display) -> Refusal {
    Refusal::new(problem.to_string()).at(path.as_ref().display())
}

/// What makes an error of a file or folder its refusal.
pub(crate) fn failed<E: Error + Send + Sync + 'static>(path: &Path) -> impl Fn(E) -> Refusal {
    move |error| Refusal::from_error(error).at(path.display())
}

/// Name of file number `shard` of `shards`.
pub(crate) fn shard_name(shard: u64, shards: u64) -> String {
    let width = shards.saturating_sub(1).to_string().len().max(5);
    format!("part-{shard:0width$}.parquet")
}

/// Rows of file number `shard`.
///
/// ```
/// use spts_dataset::{Spec, shard_rows};
///
/// let size = toml::from_str("rows = 2500\nrows_per_shard = 1000").expect("TOML");
/// let spec = Spec::load("random-shapes", &size)?;
/// assert_eq!(shard_rows(&spec, 2), 2000..2500);
/// # Ok::<(), spts::Refusal>(())
/// ```
pub fn shard_rows(spec: &Spec, shard: u64) -> Range<u64> {
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
/// [`Refusal`] if a row cannot be made, or the file cannot be written.
pub(crate) fn write_shard(spec: &Spec, shard: u64, path: &Path, done: &dyn Fn()) -> Result<(), Refusal> {
    let row_bytes = |column: &Column| column.kind.bytes() * column.length.unwrap_or(1);
    let row_bytes: usize = columns(spec).iter().map(row_bytes).sum();
    let mut stores = stores(spec);
    let schema = schema(spec);
    let group = (GROUP_BYTES / row_bytes.max(1)).clamp(1, GROUP_ROWS);
    let pieces = PIECE_ROWS.min(group);
    let mut file = AtomicFile::create(path)?;
    let properties = properties(spec, shard, group).map_err(failed(path))?;
    let mut writer = ArrowWriter::try_new(&mut file, Arc::clone(&schema), Some(properties)).map_err(failed(path))?;
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
            writer.write(&batch.map_err(failed(path))?).map_err(failed(path))?;
            waiting = 0;
        }
    }
    writer.close().map_err(failed(path))?;
    file.finish()
}

fn properties(spec: &Spec, shard: u64, group: usize) -> Result<WriterProperties, ParquetError> {
    let fact = |key: &str, value: String| KeyValue::new(key.to_owned(), value);
    let recording = serde_json::to_string(spec.recording()).map_err(|e| ParquetError::General(e.to_string()))?;
    let mut properties = WriterProperties::builder()
        .set_created_by(format!("spts {}", version()))
        .set_key_value_metadata(Some(vec![
            fact(IDENTITY_KEY, spec.identity().to_owned()),
            fact(SHARD_KEY, shard.to_string()),
            fact(VERSION_KEY, version().to_owned()),
            fact(RECORDING_KEY, recording),
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
        } else if column.kind == Kind::Text {
            properties = properties.set_column_dictionary_enabled(path, true);
        }
    }
    Ok(properties.build())
}

/// Checks that `path` is file number `shard` of `spec` and complete: footer, metadata and number of rows.
///
/// # Errors
/// [`Refusal`] if it is not, or cannot be read.
pub(crate) fn check_shard(spec: &Spec, shard: u64, path: &Path) -> Result<(), Refusal> {
    let (file, _) = spts_input::open(path, u64::MAX).map_err(failed(path))?;
    let damaged =
        |e: ParquetError| refused(path, format!("is not a whole Parquet file ({e}); remove it, and it is made anew"));
    let reader = SerializedFileReader::new(file).map_err(damaged)?;
    let metadata = reader.metadata().file_metadata();
    let facts = metadata.key_value_metadata();
    for (key, what, needed) in [
        (IDENTITY_KEY, "spec", spec.identity().to_owned()),
        (SHARD_KEY, "place in the data set", shard.to_string()),
        (VERSION_KEY, "version", version().to_owned()),
    ] {
        let found = facts.and_then(|facts| facts.iter().find(|fact| fact.key == key));
        let found = found.and_then(|fact| fact.value.as_deref()).unwrap_or_default();
        if found != needed {
            let found = found.escape_debug();
            let problem = format!("was made for another {what} (\"{found}\", here \"{needed}\")");
            return Err(refused(path, problem));
        }
    }
    let (rows, needed) = (metadata.num_rows(), shard_rows(spec, shard));
    let needed = needed.end - needed.start;
    if u64::try_from(rows) == Ok(needed) {
        return Ok(());
    }
    Err(refused(path, format!("has {rows} rows; {needed} are needed")))
}

/// Which rows of a file are read.
pub(crate) enum Wanted<'a> {
    /// All rows.
    All,
    /// Rows at these places in the file, in increasing order, and only the named columns of them; all columns if none
    /// is named.
    Places(Vec<usize>, &'a [&'a str]),
}

/// Calls `each` with the rows of the file `path`, some at a time, until it says that it has had enough.
pub(crate) fn batches(
    path: &Path,
    wanted: Wanted<'_>,
    mut each: impl FnMut(&RecordBatch) -> Result<bool, Refusal>,
) -> Result<(), Refusal> {
    let (file, _) = spts_input::open(path, u64::MAX).map_err(failed(path))?;
    let unreadable = |e: &dyn std::fmt::Display| refused(path, format!("cannot be read: {e}"));
    let mut reader = ParquetRecordBatchReaderBuilder::try_new(file).map_err(|e| unreadable(&e))?;
    let row_bytes = reader.metadata().row_groups().iter().map(row_bytes).max();
    let rows = (BATCH_BYTES / row_bytes.unwrap_or(1)).clamp(1, BATCH_ROWS);
    if let Wanted::Places(places, columns) = wanted {
        let held = usize::try_from(reader.metadata().file_metadata().num_rows()).unwrap_or_default();
        let places = RowSelection::from_consecutive_ranges(places.iter().map(|row| *row..row + 1), held);
        reader = reader.with_row_selection(places);
        if !columns.is_empty() {
            let mask = ProjectionMask::columns(reader.parquet_schema(), columns.iter().copied());
            reader = reader.with_projection(mask);
        }
    }
    for batch in reader.with_batch_size(rows).build().map_err(|e| unreadable(&e))? {
        if !each(&batch.map_err(|e| unreadable(&e))?)? {
            break;
        }
    }
    Ok(())
}

/// Bytes of a row of `group` before compression, at least 1.
fn row_bytes(group: &RowGroupMetaData) -> usize {
    let [bytes, rows] = [group.total_byte_size(), group.num_rows()].map(|n| usize::try_from(n).unwrap_or_default());
    (bytes / rows.max(1)).max(1)
}

/// Row `row` of `array` as JSON.
pub(crate) fn json(array: &ArrayRef, row: usize) -> Value {
    if array.is_null(row) {
        return Value::Null;
    }
    match array.data_type() {
        DataType::Utf8 => array.as_string::<i32>().value(row).into(),
        DataType::Boolean => array.as_boolean().value(row).into(),
        DataType::Int32 => array.as_primitive::<Int32Type>().value(row).into(),
        DataType::Int64 => array.as_primitive::<Int64Type>().value(row).into(),
        DataType::Float32 => {
            // the digits that tell a single from its neighbours
            let digits = array.as_primitive::<Float32Type>().value(row).to_string();
            digits.parse::<f64>().map_or(Value::Null, Value::from)
        }
        DataType::FixedSizeList(..) => {
            let list = array.as_fixed_size_list().value(row);
            (0..list.len()).map(|k| json(&list, k)).collect()
        }
        _ => Value::Null,
    }
}

/// All numbers of a column, lists one after the other; true counts as 1. Texts have none.
pub(crate) fn numbers(array: &ArrayRef, mut each: impl FnMut(f64)) {
    match array.data_type() {
        DataType::Boolean => {
            let flags = array.as_boolean().iter().flatten();
            flags.for_each(|v| each(f64::from(u8::from(v))));
        }
        DataType::Int32 => {
            let values = array.as_primitive::<Int32Type>().iter().flatten();
            values.for_each(|v| each(v.into()));
        }
        DataType::Int64 => {
            let values = array.as_primitive::<Int64Type>().iter().flatten();
            values.for_each(|v| each(v as f64));
        }
        DataType::Float32 => {
            let values = array.as_primitive::<Float32Type>().iter().flatten();
            values.for_each(|v| each(v.into()));
        }
        DataType::FixedSizeList(..) => numbers(array.as_fixed_size_list().values(), each),
        _ => {}
    }
}

/// The values of a column. Values of lists are concatenated.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// Numbers of single precision; NaN where there is no value.
    Floats(Vec<f32>),
    /// Whole numbers; −1 where there is no value.
    Integers(Vec<i64>),
    /// True or false.
    Flags(Vec<bool>),
    /// Texts; empty where there is no value.
    Texts(Vec<String>),
}

impl ColumnValues {
    /// None yet, of the type `kind`.
    pub(crate) fn of(kind: Kind) -> Self {
        match kind {
            Kind::F32 => Self::Floats(Vec::new()),
            Kind::I32 | Kind::I64 => Self::Integers(Vec::new()),
            Kind::Bool => Self::Flags(Vec::new()),
            Kind::Text => Self::Texts(Vec::new()),
        }
    }

    /// Adds all values of `array`.
    pub(crate) fn extend(&mut self, array: &ArrayRef) {
        match (self, array.data_type()) {
            (own, DataType::FixedSizeList(..)) => {
                let lists = array.as_fixed_size_list();
                let length = usize::try_from(lists.value_length()).unwrap_or_default();
                let first = lists.value_offset_at(0);
                own.extend(&lists.values().slice(first, lists.len() * length));
            }
            (Self::Floats(all), DataType::Float32) => {
                let values = array.as_primitive::<Float32Type>().iter();
                all.extend(values.map(|v| v.unwrap_or(f32::NAN)));
            }
            (Self::Integers(all), DataType::Int32) => {
                let values = array.as_primitive::<Int32Type>().iter();
                all.extend(values.map(|v| v.map_or(-1, i64::from)));
            }
            (Self::Integers(all), DataType::Int64) => {
                all.extend(array.as_primitive::<Int64Type>().iter().map(|v| v.unwrap_or(-1)));
            }
            (Self::Flags(all), DataType::Boolean) => {
                all.extend(array.as_boolean().iter().map(Option::unwrap_or_default));
            }
            (Self::Texts(all), DataType::Utf8) => {
                let texts = array.as_string::<i32>().iter();
                all.extend(texts.map(|text| text.unwrap_or_default().to_owned()));
            }
            _ => {}
        }
    }
}
