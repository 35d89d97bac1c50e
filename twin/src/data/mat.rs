//! One variable of a MATLAB v5 file.

use super::error::DataError;
use super::inflate::{HEADER, inflate};
use super::mat_elements::{MatElement, mat_elements};
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

/// Largest file taken for a recording, bytes: the published ones are below 4 MB.
const MAX_BYTES: u64 = 1 << 28;
/// Most values of an array: 16 times the longest published recording. Whatever their type in the file, each takes
/// 8 bytes here, several times over.
const MAX_VALUES: usize = 1 << 25;

/// Reads variable `name` of the file at `path`.
///
/// # Errors
/// [`DataError`] when the file cannot be read, is not MATLAB v5, or has no such numeric variable.
pub fn read_mat(path: &Path, name: &'static str) -> Result<MatVariable, DataError> {
    let bytes = spts_input::read(path, MAX_BYTES).map_err(|error| DataError::Io {
        path: path.to_owned(),
        source: error.into(),
    })?;
    parse_mat(bytes, name, path)
}

/// Reads variable `name` from the content `bytes` of a MATLAB v5 file. Errors name the file `path`.
///
/// # Errors
/// As [`read_mat`].
pub fn parse_mat(bytes: Vec<u8>, name: &'static str, path: &Path) -> Result<MatVariable, DataError> {
    let not_mat = |reason: String| DataError::NotMat {
        path: path.to_owned(),
        reason,
    };
    let plain = inflate(&bytes).map_err(not_mat)?;
    drop(bytes);
    let (header, elements) = plain.split_at(HEADER);
    let found = mat_elements(elements);
    let Some(element) = found.iter().find(|element| element.name == name) else {
        return Err(DataError::NoVariable {
            path: path.to_owned(),
            name,
            found: listed(&found),
        });
    };
    if !element.numeric {
        return Err(DataError::NotNumeric {
            path: path.to_owned(),
            name,
            class: element.class,
        });
    }
    if element.values > MAX_VALUES {
        return Err(not_mat(format!(
            "`{name}` holds {} values, outside [0, {MAX_VALUES}]",
            element.values
        )));
    }
    let one = [header, element.bytes].concat();
    drop(plain);
    let file = parse(&one).map_err(not_mat)?;
    drop(one);
    let array = file
        .find_by_name(name)
        .ok_or_else(|| not_mat(format!("`{name}` is damaged")))?;
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

/// The parsed file. The parser slices without looking on some damaged headers: a panic in it is an unreadable file.
fn parse(plain: &[u8]) -> Result<MatFile, String> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let parsed = catch_unwind(AssertUnwindSafe(|| MatFile::parse(plain)));
    std::panic::set_hook(hook);
    match parsed {
        Ok(Ok(file)) => Ok(file),
        // the parser's messages quote the input; their beginning says what is wrong
        Ok(Err(error)) => Err(format!("{error:?}").chars().take(80).collect()),
        Err(_) => Err("damaged header".to_owned()),
    }
}

/// Names and classes of the variables, as an error lists them.
fn listed(found: &[MatElement<'_>]) -> String {
    const MOST: usize = 10;
    if found.is_empty() {
        return "no variable".to_owned();
    }
    let names = found.iter().take(MOST).map(|e| format!("{} ({})", e.name, e.class));
    let names: Vec<String> = names.collect();
    let more = found.len().saturating_sub(MOST);
    let more = if more > 0 {
        format!(" and {more} more")
    } else {
        String::new()
    };
    names.join(", ") + &more
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
