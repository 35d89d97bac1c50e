//! Parameter ranges that contact fields share. Errors name the parameter by its key in a scene.

use spts_models::{ConfigError, SkinLayout, in_range, within};

/// Checks that `contact.field` lies in `[low, high]`; `text` is that range with its unit.
///
/// # Errors
/// [`ConfigError`] if `value` is outside the range, or NaN.
pub fn parameter(field: &str, value: f64, [low, high]: [f64; 2], text: &'static str) -> Result<(), ConfigError> {
    within(&format!("contact.{field}"), value, low, high, text)
}

/// Checks the stiffness K, Pa/m, and the thickness h, m.
///
/// # Errors
/// [`ConfigError`] if one of them is outside its range.
pub fn foam(stiffness_pa_per_m: f64, thickness_m: f64) -> Result<(), ConfigError> {
    parameter("stiffness_pa_per_m", stiffness_pa_per_m, [1e4, 1e9], "[1e4, 1e9] Pa/m")?;
    parameter("thickness_m", thickness_m, [1e-4, 10.0], "[1e-4, 10] m")
}

/// An upper limit, and its range as text.
pub type Most = (f64, &'static str);

/// Checks that there is at least one cell along a side of a taxel and at most `side`, and that all cells of `skin` are
/// at most `all`.
///
/// # Errors
/// [`ConfigError`] if a number is outside its range.
pub fn cells(skin: &SkinLayout, cells_per_taxel: usize, side: Most, all: Most) -> Result<(), ConfigError> {
    let cells = cells_per_taxel as f64;
    parameter("cells_per_taxel", cells, [1.0, side.0], side.1)?;
    let count = skin.taxels() as f64 * cells * cells;
    in_range("rows × cols × contact.cells_per_taxel²", count, count <= all.0, all.1).map(drop)
}
