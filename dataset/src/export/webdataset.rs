//! WebDataset: tar files with a JSON file and NumPy arrays for every row.

use super::rows::{RowView, each_row};
use super::tar::Tar;
use super::{ExportOptions, SPLITS, WriteExport, Written};
use crate::columns::{Column, columns};
use crate::error::DatasetError;
use crate::folder::Dataset;
use crate::spec::{Spec, SpecError};
use crate::store::Kind;
use arrow_array::cast::AsArray as _;
use arrow_array::types::{Float32Type, Int32Type, Int64Type};
use npyz::WriterBuilder as _;
use serde_json::Value;
use spts::output::OutputFolder;
use spts::progress::Progress;
use spts_models::in_range;
use std::io;

/// Rows of a tar file by default, and most: a gigabyte or so of small rows, which one worker reads at a time.
const ROWS_PER_TAR: u64 = 10_000;
const MOST_ROWS_PER_TAR: u64 = 1_000_000;
/// Least digits of a row's number in the names of its files, so that names sort as numbers.
const DIGITS: usize = 9;

/// Shape of an array.
type Shape = fn(&Spec) -> Vec<usize>;

const MAP: Shape = |spec| vec![spec.skin().rows(), spec.skin().cols()];
const WINDOW: Shape = |spec| vec![spec.config().record.measurements];
const MATRIX: Shape = |spec| vec![spec.config().record.measurements, spec.skin().taxels()];

/// Column, name of its file without `.npy`, and shape. A list column that is not here has its own name and one
/// dimension.
const ARRAYS: &[(&str, &str, Shape)] = &[
    ("pressure_pa", "pressure", MAP),
    ("conductance_s", "conductance", MAP),
    ("support", "support", MAP),
    ("image_v", "image", MAP),
    ("y_v", "y", WINDOW),
    ("y_code", "y", WINDOW),
    ("phi", "phi", MATRIX),
];

/// A column that becomes a NumPy file.
struct Array {
    column: String,
    file: String,
    kind: Kind,
    /// File header, before the values.
    header: Vec<u8>,
}

/// Prepares tar files.
pub(super) fn prepare<'a>(dataset: &'a Dataset, options: &ExportOptions) -> Result<WriteExport<'a>, DatasetError> {
    let most = options.rows_per_tar.unwrap_or(ROWS_PER_TAR);
    let valid = (1..=MOST_ROWS_PER_TAR).contains(&most);
    in_range("rows_per_tar", most as f64, valid, "[1, 10^6]").map_err(SpecError::from)?;
    let (mut scalars, mut arrays) = (Vec::new(), Vec::new());
    for column in columns(dataset.spec()) {
        match column.length {
            None => scalars.push(column.name),
            Some(length) => arrays.push(array(dataset.spec(), column, length)?),
        }
    }
    Ok(Box::new(move |out, progress| {
        write(dataset, most, &scalars, &arrays, out, progress)
    }))
}

fn array(spec: &Spec, column: Column, length: usize) -> Result<Array, DatasetError> {
    let known = ARRAYS.iter().find(|(name, ..)| *name == column.name);
    let (file, shape) = match known {
        Some((_, file, shape)) => ((*file).to_owned(), shape(spec)),
        None => (column.name.clone(), vec![length]),
    };
    let shape: Vec<u64> = shape.into_iter().map(|side| side as u64).collect();
    let dtype = match column.kind {
        Kind::Bool => "|b1",
        Kind::I32 => "<i4",
        Kind::I64 => "<i8",
        Kind::F32 => "<f4",
        Kind::Text => {
            let problem = format!("column `{}`: lists of texts have no NumPy array", column.name);
            return Err(DatasetError::Export(problem));
        }
    };
    let mut header = Vec::new();
    let dtype = dtype.parse().map_err(io::Error::other);
    let written = dtype.and_then(|dtype| {
        let options = npyz::WriteOptions::new_header_only().dtype(npyz::DType::Plain(dtype));
        options.shape(&shape).writer(&mut header).write_header_only()?;
        Ok(())
    });
    written.map_err(|e| DatasetError::Export(format!("column `{}`: {e}", column.name)))?;
    Ok(Array {
        column: column.name,
        file,
        kind: column.kind,
        header,
    })
}

fn write(
    dataset: &Dataset,
    most: u64,
    scalars: &[String],
    arrays: &[Array],
    out: &OutputFolder,
    progress: &dyn Progress,
) -> Result<Written, DatasetError> {
    let last = dataset.spec().config().rows.saturating_sub(1);
    let digits = last.to_string().len().max(DIGITS);
    let mut written = Written::default();
    for split in SPLITS {
        let (mut rows, mut open): (u64, Option<Tar>) = (0, None);
        let mut content = Vec::new();
        each_row(dataset, split, progress, |row| {
            if rows.is_multiple_of(most) {
                open.take().map_or(Ok(()), Tar::finish)?;
            }
            let tar = match &mut open {
                Some(tar) => tar,
                None => open.insert(Tar::create(&out.path(&format!("{split}-{:06}.tar", rows / most)))?),
            };
            let name = format!("{:0digits$}", row.number("index")?);
            let values = scalars.iter().map(|column| (column.clone(), row.json(column)));
            let mut text = Value::Object(values.collect()).to_string();
            text.push('\n');
            tar.add(&format!("{name}.json"), text.as_bytes())?;
            for array in arrays {
                content.clear();
                content.extend_from_slice(&array.header);
                put(row, array, &mut content)?;
                tar.add(&format!("{name}.{}.npy", array.file), &content)?;
            }
            rows += 1;
            Ok(())
        })?;
        if let Some(tar) = open {
            tar.finish()?;
            written.splits.insert(split, rows);
        }
    }
    Ok(written)
}

/// Adds the values of a row as little-endian bytes.
fn put(row: &RowView<'_>, array: &Array, out: &mut Vec<u8>) -> Result<(), DatasetError> {
    let values = row.values(&array.column)?;
    // the schema has been compared, so every cast succeeds
    match array.kind {
        Kind::Bool => out.extend(values.as_boolean().iter().map(|v| u8::from(v == Some(true)))),
        Kind::I32 => (values.as_primitive::<Int32Type>().values().iter()).for_each(|v| out.extend(v.to_le_bytes())),
        Kind::I64 => (values.as_primitive::<Int64Type>().values().iter()).for_each(|v| out.extend(v.to_le_bytes())),
        Kind::F32 => (values.as_primitive::<Float32Type>().values().iter()).for_each(|v| out.extend(v.to_le_bytes())),
        Kind::Text => {}
    }
    Ok(())
}
