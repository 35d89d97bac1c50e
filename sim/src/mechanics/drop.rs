//! Section `[drop]`: a free ball falls onto the skin.

use super::MechanicsError;
use super::place::Place;
use serde::{Deserialize, Serialize};
use spts_contact::objects::BALL_STIFFNESS_PA_PER_M;
use spts_models::{ConfigError, SkinLayout, in_range};

/// Section `[drop]`. Defaults: an ITF tennis ball from half a metre.
///
/// There is no table beside the skin: a ball that misses it or rolls off keeps falling until `duration_s`, and its
/// frames are empty.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DropConfig {
    /// Height of the ball's lowest point above the skin at release, m; [0.001, 5].
    pub height_m: f64,
    /// Row of the landing point, in taxels; inside the skin. Default: the middle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row: Option<f64>,
    /// Column of the landing point, in taxels; inside the skin. Default: the middle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub col: Option<f64>,
    /// Replaces `row` and `col`: landing point (x, y) relative to the middle of the sheet, m; x towards large columns,
    /// y towards small rows; inside the skin.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 2]>,
    /// Replaces `row` and `col`: landing point relative to the sheet's width and height; each [−0.5, 0.5].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_share: Option<[f64; 2]>,
    /// Mass, kg; [1e-3, 50].
    pub mass_kg: f64,
    /// Radius, m; [5e-3, 0.2].
    pub radius_m: f64,
    /// Stiffness of the ball's surface in series with the skin, Pa/m; [1e5, 1e12].
    pub stiffness_pa_per_m: f64,
    /// Number of drops; [1, 100000].
    pub drops: usize,
    /// Duration of a drop, s; [0.05, 60].
    pub duration_s: f64,
    /// Mean time of release, s; [0, 10].
    pub release_s: f64,
    /// The release varies uniformly within ± this, s; [0, `release_s`].
    pub release_spread_s: f64,
    /// Standard deviation of the landing point along each axis, m; [0, 0.05].
    pub position_sd_m: f64,
}

impl Default for DropConfig {
    /// ITF Rules of Tennis, appendix I: 56.0–59.4 g, 65.4–68.6 mm.
    fn default() -> Self {
        Self {
            height_m: 0.5,
            row: None,
            col: None,
            position_m: None,
            position_share: None,
            mass_kg: 57.7e-3,
            radius_m: 33.4e-3,
            stiffness_pa_per_m: BALL_STIFFNESS_PA_PER_M,
            drops: 10,
            duration_s: super::timestep::BLOCK_S,
            release_s: 0.10,
            release_spread_s: 0.05,
            position_sd_m: 1e-3,
        }
    }
}

impl DropConfig {
    /// Fills what depends on the skin and checks every value.
    pub(super) fn resolve(&mut self, skin: &SkinLayout) -> Result<(), MechanicsError> {
        let (last_row, last_col) = (skin.rows() as f64 - 1.0, skin.cols() as f64 - 1.0);
        let written = Place {
            section: "drop",
            row: &mut self.row,
            col: &mut self.col,
            position_m: &mut self.position_m,
            position_share: &mut self.position_share,
        };
        written.resolve(skin, [0.5 * last_row, 0.5 * last_col])?;
        Ok(self.check([last_row, last_col])?)
    }

    fn check(&self, [last_row, last_col]: [f64; 2]) -> Result<(), ConfigError> {
        let (row, col) = (self.row.unwrap_or_default(), self.col.unwrap_or_default());
        let within = |field: &str, value: f64, low: f64, high: f64, text| {
            in_range(&format!("drop.{field}"), value, (low..=high).contains(&value), text).map(drop)
        };
        within("height_m", self.height_m, 1e-3, 5.0, "[0.001, 5] m")?;
        within("row", row, -0.5, last_row + 0.5, "[-0.5, rows - 0.5]")?;
        within("col", col, -0.5, last_col + 0.5, "[-0.5, cols - 0.5]")?;
        within("mass_kg", self.mass_kg, 1e-3, 50.0, "[1e-3, 50] kg")?;
        within("radius_m", self.radius_m, 5e-3, 0.2, "[5e-3, 0.2] m")?;
        within(
            "stiffness_pa_per_m",
            self.stiffness_pa_per_m,
            1e5,
            1e12,
            "[1e5, 1e12] Pa/m",
        )?;
        within("drops", self.drops as f64, 1.0, 1e5, "[1, 100000]")?;
        within("duration_s", self.duration_s, 0.05, 60.0, "[0.05, 60] s")?;
        within("release_s", self.release_s, 0.0, 10.0, "[0, 10] s")?;
        within(
            "release_spread_s",
            self.release_spread_s,
            0.0,
            self.release_s,
            "[0, release_s]",
        )?;
        within("position_sd_m", self.position_sd_m, 0.0, 0.05, "[0, 0.05] m")
    }
}
