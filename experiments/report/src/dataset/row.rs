//! What a preview shows of a row.

use serde_json::Value;

/// Columns of a data set that [`PreviewRow::of`] looks at. A data set need not have all of them.
pub const PREVIEW_COLUMNS: &[&str] = &[
    "index",
    "split",
    "pressure_pa",
    "support",
    "image_v",
    "y_v",
    "y_code",
    "object",
    "force_n",
    "contact_force_n",
    "object_2",
    "force_n_2",
    "object_3",
    "force_n_3",
];

const KPA_PER_PA: f64 = 1e-3;
/// Most taxels along a side of a map that are kept, a pixel of the picture or two each; of a larger skin, means over
/// blocks of taxels are.
const MOST_SIDE: usize = 128;

/// A row as it is drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct PreviewRow {
    /// Number of the row and its split.
    pub(super) heading: String,
    /// Name of every object, and the force on it with its unit.
    pub(super) objects: Vec<(String, String)>,
    /// Rows and columns of the maps.
    pub(super) size: (usize, usize),
    /// Pressure, kPa.
    pub(super) pressure_kpa: Vec<f64>,
    /// Support of the conductance; empty where it is not a column.
    pub(super) support: Vec<bool>,
    /// Raster image, V, where it is recorded.
    pub(super) image_v: Option<Vec<f64>>,
    /// Samples, and their unit: V, or empty for codes.
    pub(super) samples: (Vec<f64>, &'static str),
}

/// A row that lacks a column of the needed length.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("row {row}: `{column}` has {found} values; {needed} are needed")]
pub struct PreviewRowError {
    /// Number of the row.
    pub row: u64,
    /// Name of the column.
    pub column: &'static str,
    /// Values that it has.
    pub found: usize,
    /// Values that it should have.
    pub needed: usize,
}

impl PreviewRow {
    /// The row `row`, an object of its columns as `spts_dataset` reads it, of a skin of `rows` × `cols` taxels.
    ///
    /// # Errors
    /// [`PreviewRowError`] when a map does not fill the skin.
    pub fn of(row: &Value, (rows, cols): (usize, usize)) -> Result<Self, PreviewRowError> {
        let index = row["index"].as_u64().unwrap_or_default();
        let map = |column: &'static str| {
            let values = numbers(&row[column]);
            let (found, needed) = (values.len(), rows * cols);
            if found == needed {
                return Ok(values);
            }
            Err(PreviewRowError {
                row: index,
                column,
                found,
                needed,
            })
        };
        let image_v = if row["image_v"].is_array() {
            Some(map("image_v")?)
        } else {
            None
        };
        let samples = if row["y_code"].is_array() {
            (numbers(&row["y_code"]), "")
        } else {
            (numbers(&row["y_v"]), "V")
        };
        let step = rows.max(cols).div_ceil(MOST_SIDE);
        let small = |values: &[f64]| blocks(values, (rows, cols), step);
        let pressure_kpa: Vec<f64> = map("pressure_pa")?.iter().map(|p| p * KPA_PER_PA).collect();
        let support = if row["support"].is_array() {
            small(&map("support")?).iter().map(|share| *share >= 0.5).collect()
        } else {
            Vec::new()
        };
        Ok(Self {
            heading: format!("row {} · {}", grouped(index), row["split"].as_str().unwrap_or_default()),
            objects: objects(row),
            size: (rows.div_ceil(step), cols.div_ceil(step)),
            pressure_kpa: small(&pressure_kpa),
            support,
            image_v: image_v.map(|image| small(&image)),
            samples,
        })
    }
}

/// The name of every object of a row, and the force on it with its unit: of one object that of the moment.
fn objects(row: &Value) -> Vec<(String, String)> {
    let now_n = row["contact_force_n"].as_f64().filter(|_| row["object_2"].is_null());
    let of = |suffix: &str| {
        let name = row[&format!("object{suffix}")].as_str()?;
        let force_n = now_n.or(row[&format!("force_n{suffix}")].as_f64())?;
        Some((name.to_owned(), format!("{force_n:.1} N")))
    };
    ["", "_2", "_3"].into_iter().filter_map(of).collect()
}

/// The numbers of a list; true counts as 1, and what is no number as NaN.
fn numbers(list: &Value) -> Vec<f64> {
    let number = |value: &Value| match value {
        Value::Bool(value) => f64::from(u8::from(*value)),
        value => value.as_f64().unwrap_or(f64::NAN),
    };
    list.as_array().into_iter().flatten().map(number).collect()
}

/// Means over blocks of `step` × `step` values.
fn blocks(values: &[f64], (rows, cols): (usize, usize), step: usize) -> Vec<f64> {
    let block = |top: usize, left: usize| {
        let within =
            (top..rows.min(top + step)).flat_map(|row| (left..cols.min(left + step)).map(move |col| (row, col)));
        let (sum, count) = within.fold((0.0, 0.0), |(sum, count), (row, col)| {
            (sum + values[row * cols + col], count + 1.0)
        });
        sum / count
    };
    let tops = (0..rows).step_by(step);
    tops.flat_map(|top| (0..cols).step_by(step).map(move |left| (top, left)))
        .map(|(top, left)| block(top, left))
        .collect()
}

/// A whole number with commas between thousands.
pub(super) fn grouped(number: u64) -> String {
    let digits = number.to_string();
    let mut text = String::new();
    for (k, digit) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}
