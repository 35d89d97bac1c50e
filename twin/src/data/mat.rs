//! One variable of a MATLAB v5 file.

use super::error::DataError;
use super::inflate::inflate;
use matfile::{MatFile, NumericData};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// A numeric array: `shape` and column-major `values`.
#[derive(Debug, Clone, PartialEq)]
pub struct MatVariable {
    /// Size along each dimension.
    pub shape: Vec<usize>,
    /// Values, first index fastest.
    pub values: Vec<f64>,
}

/// Largest file taken for a recording: the published ones are below 4 MB.
const MAX_BYTES: u64 = 1 << 30;

/// Reads variable `name` of the file at `path`.
///
/// # Errors
/// [`DataError`] when the file cannot be read, is not MATLAB v5, or has no such numeric variable.
pub fn read_mat(path: &Path, name: &'static str) -> Result<MatVariable, DataError> {
    let io = |source| DataError::Io {
        path: path.to_owned(),
        source,
    };
    let not_mat = |reason: String| DataError::NotMat {
        path: path.to_owned(),
        reason,
    };
    let length = std::fs::metadata(path).map_err(io)?.len();
    if length > MAX_BYTES {
        return Err(not_mat(format!("{length} bytes; at most {MAX_BYTES} are read")));
    }
    let bytes = std::fs::read(path).map_err(io)?;
    let plain = inflate(&bytes).map_err(not_mat)?;
    // the parser slices without looking on some damaged headers: a panic in it is an unreadable file
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let parsed = catch_unwind(AssertUnwindSafe(|| MatFile::parse(plain.as_slice())));
    std::panic::set_hook(hook);
    let file = match parsed {
        Ok(Ok(file)) => file,
        Ok(Err(e)) => return Err(not_mat(first_words(&format!("{e:?}")))),
        Err(_) => return Err(not_mat("damaged header".to_owned())),
    };
    let array = file.find_by_name(name).ok_or_else(|| DataError::NoVariable {
        path: path.to_owned(),
        name,
        found: file
            .arrays()
            .iter()
            .map(matfile::Array::name)
            .collect::<Vec<_>>()
            .join(", "),
    })?;
    let values = real_values(array.data());
    let shape = array.size().clone();
    let expected = shape.iter().try_fold(1_usize, |n, &d| n.checked_mul(d));
    if expected != Some(values.len()) {
        return Err(not_mat(format!(
            "`{name}` holds {} values for shape {shape:?}",
            values.len()
        )));
    }
    Ok(MatVariable { shape, values })
}

/// The parser's messages quote the input; their beginning says what is wrong.
fn first_words(message: &str) -> String {
    message.chars().take(80).collect()
}

fn real_values(data: &NumericData) -> Vec<f64> {
    match data {
        NumericData::Double { real, .. } => real.clone(),
        NumericData::Single { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::Int8 { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::UInt8 { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::Int16 { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::UInt16 { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::Int32 { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::UInt32 { real, .. } => real.iter().map(|&v| f64::from(v)).collect(),
        NumericData::Int64 { real, .. } => real.iter().map(|&v| v as f64).collect(),
        NumericData::UInt64 { real, .. } => real.iter().map(|&v| v as f64).collect(),
    }
}
