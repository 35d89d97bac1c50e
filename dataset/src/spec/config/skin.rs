//! The skin, and its faulty cells.

use crate::spec::Draw;
use serde::Deserialize;
use spts_models::SkinLayout;

/// Section `[skin]`: layout of the skin, and how many specimens there are.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SkinConfig {
    /// Number of taxels along y. Default 10.
    pub rows: usize,
    /// Number of taxels along x. Default 10.
    pub cols: usize,
    /// Pitch, m. Default 0.015.
    pub pitch_m: f64,
    /// Side of the square electrodes, m. Default two thirds of the pitch.
    pub electrode_m: Option<f64>,
    /// Number of consecutive rows with the same skin and session; a whole number of presses. Default about 100.
    pub rows_per_skin: Option<u64>,
    /// Seed of the specimen, which determines the spread of its taxels and parts; a draw of whole numbers in [0, 2^53].
    /// Default: another one for every skin.
    pub seed: Option<Draw>,
    /// Number of equal presses before each press, which condition the sheet; a draw of whole numbers in [0, 1000].
    /// Default 0.
    pub presses_before: Draw,
}

/// Section `[faults]`: faulty cells, drawn for every skin.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FaultsConfig {
    /// Number of faulty cells of a skin; a draw of whole numbers from 0 to the number of taxels. Default 0.
    pub count: Draw,
    /// Names of the possible faults, all equally likely ([`spts_circuit::FAULTS`]). Default: all.
    pub names: Option<Vec<String>>,
}

impl Default for SkinConfig {
    fn default() -> Self {
        let skin = SkinLayout::default();
        Self {
            rows: skin.rows(),
            cols: skin.cols(),
            pitch_m: skin.pitch_m(),
            electrode_m: None,
            rows_per_skin: None,
            seed: None,
            presses_before: Draw::Fixed(0.0),
        }
    }
}

impl Default for FaultsConfig {
    fn default() -> Self {
        Self {
            count: Draw::Fixed(0.0),
            names: None,
        }
    }
}
