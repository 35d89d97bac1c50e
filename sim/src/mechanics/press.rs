//! Section `[press]`: the arm presses an object. Its fields, and the times and places that they give.

mod resolve;

use serde::{Deserialize, Serialize};
use spts_contact::objects::Placement;

/// Section `[press]`. Times count from the start of one recorded block of 1000 frames × 100 measurements at 64.3 kHz =
/// 1.555 s. Their defaults are those of the recorded presses (onset near frame 230, rise from 10 to 90 % in 0.2–0.3 s,
/// lift near frame 700, fall in 80–100 frames).
///
/// ```
/// use spts_sim::Mechanics;
///
/// let scene = Mechanics::from_toml("[press]\nobject = \"T\"\nforce_n = 12.0", ".".as_ref())?;
/// assert_eq!((scene.repeats(), scene.config().press.as_ref().map(|p| p.force_n)), (10, Some(12.0)));
/// let error = Mechanics::from_toml("[press]\nobject = \"T\"\nforce_n = 500.0", ".".as_ref()).err();
/// assert!(error.expect("too hard").to_string().contains("`press.force_n` = 500 is outside"));
/// # Ok::<(), spts_sim::mechanics::MechanicsError>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PressConfig {
    /// Name of one of the seventeen objects, or `finger` for a fingertip. Either this or `mesh`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// Mesh file (`.obj`, `.glb` or `.stl`), relative to the scene file. Either this or `object`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<String>,
    /// Number of metres in a unit of the mesh file; (0, 1000], default 1, as in GLB. It is never guessed: an object 40
    /// units wide may be 40 mm, 40 cm or 40 inches wide.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scale: Option<f64>,
    /// Row of the object's origin, in taxels. Default: for an object its own place, at the same distance in metres from
    /// the middle of the sheet as on the published skin; for a mesh the middle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub row: Option<f64>,
    /// Column of the object's origin, in taxels. Default: as for `row`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub col: Option<f64>,
    /// Replaces `row` and `col`: position (x, y) of the object's origin relative to the middle of the sheet, m; x
    /// towards large columns, y towards small rows; at most 75 mm or 5 taxels beyond the outer taxels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 2]>,
    /// Replaces `row` and `col`: the position relative to the sheet's width and height; each [−1, 1], with the edges at
    /// ±0.5.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_share: Option<[f64; 2]>,
    /// Replaces `row` and `col`: [row, col] of each press in turn, in taxels; the list repeats.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub places: Option<Vec<[f64; 2]>>,
    /// Rotation about the skin's normal, counter-clockwise seen from above, degrees; [−360, 360].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rotation_deg: Option<f64>,
    /// Tilt about the skin's x and y axes, degrees; each [−60, 60]. A mesh that opens upwards may be tilted by
    /// [`MAX_LIDDED_TILT_DEG`](super::MAX_LIDDED_TILT_DEG) in all.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tilt_deg: Option<[f64; 2]>,
    /// Stiffness of the object's surface in series with the skin, Pa/m; [1e5, 1e12]. Default: the object's own value
    /// (tennis ball, eraser pad); other objects are rigid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness_pa_per_m: Option<f64>,
    /// Force at the plateau, N; [0.5, 100].
    pub force_n: f64,
    /// Number of presses; [1, 100000].
    pub presses: usize,
    /// Mass of the object, kg; [1e-3, 4].
    pub mass_kg: f64,
    /// Duration of a press including idle time, s; [0.5, 60].
    pub duration_s: f64,
    /// Mean time of first touch, s; [0.25, 30].
    pub onset_s: f64,
    /// The first touch varies uniformly within ± this, s; [0, 1].
    pub onset_spread_s: f64,
    /// Time of the rise from 10 to 90 % of the force, s; [0.1, 10].
    pub rise_s: f64,
    /// Mean time at which the arm starts to lift, s; at most `duration_s`, and late enough for a plateau
    /// ([`PressConfig::plateau_s`]).
    pub lift_s: f64,
    /// The lift varies uniformly within ± this, s; [0, 1].
    pub lift_spread_s: f64,
    /// Time of the fall from 90 to 10 % of the force, s; [0.05, 10].
    pub fall_s: f64,
    /// Repeatability of the arm: standard deviation of its position along each axis, m; [0, 0.01].
    pub position_sd_m: f64,
    /// Repeatability of the arm: standard deviation of its orientation about each axis, degrees; [0, 5].
    pub rotation_sd_deg: f64,
}

impl Default for PressConfig {
    /// Repeatability ± 0.1 mm is the UR5's; the recordings scatter by at most 0.02 taxels = 0.3 mm.
    fn default() -> Self {
        Self {
            object: None,
            mesh: None,
            scale: None,
            row: None,
            col: None,
            position_m: None,
            position_share: None,
            places: None,
            rotation_deg: None,
            tilt_deg: None,
            stiffness_pa_per_m: None,
            force_n: 20.0,
            presses: 10,
            mass_kg: 0.2,
            duration_s: super::timestep::BLOCK_S,
            onset_s: 0.35,
            onset_spread_s: 0.015,
            rise_s: 0.205,
            lift_s: 1.06,
            lift_spread_s: 0.04,
            fall_s: 0.14,
            position_sd_m: 7e-5,
            rotation_sd_deg: 0.02,
        }
    }
}

/// Share of a ramp's time that is spent on rounding each of its corners.
pub(crate) const RAMP_CORNER: f64 = 0.15;

/// Length of a ramp with rounded corners, s, that takes `inner_s` from 10 to 90 %: 80 % of its height take
/// 0.8 (1 − [`RAMP_CORNER`]) of its time.
pub(crate) fn ramp_s(inner_s: f64) -> f64 {
    inner_s / (0.8 * (1.0 - RAMP_CORNER))
}

/// Time after the ramp until the force is steady, s: three time constants of the arm's force loop (36 ms), which also
/// covers a touch that comes late by the arm's repeatability at its default.
const SETTLE_S: f64 = 0.12;
/// Time before the earliest lift at which the plateau ends, s: more than a frame.
const MARGIN_S: f64 = 0.03;

impl PressConfig {
    /// Duration of a whole ramp, s. The part from 10 to 90 % of the force takes `inner_s`; the corners are rounded.
    #[must_use]
    pub fn ramp_s(inner_s: f64) -> f64 {
        ramp_s(inner_s)
    }

    /// Shortest time from touch to lift, s, with which a press of this `rise_s` and without spread has a plateau.
    #[must_use]
    pub fn shortest_hold_s(rise_s: f64) -> f64 {
        ramp_s(rise_s) + SETTLE_S + MARGIN_S
    }

    /// Span [start, end] in which the force is steady for any drawn onset and lift, s from the start of the press:
    ///
    /// start = `onset_s` + `onset_spread_s` + `rise_s`/0.68 + 0.12 s, end = `lift_s` − `lift_spread_s` − 0.03 s.
    ///
    /// In a valid scene start < end. A `position_sd_m` far above its default delays the touch, and with it the start,
    /// by up to 3 `position_sd_m` / (5 mm/s).
    #[must_use]
    pub fn plateau_s(&self) -> [f64; 2] {
        [
            self.onset_s + self.onset_spread_s + ramp_s(self.rise_s) + SETTLE_S,
            self.lift_s - self.lift_spread_s - MARGIN_S,
        ]
    }

    /// Where press `index` is.
    #[cfg(feature = "engine")]
    pub(crate) fn placement_of(&self, index: u64) -> Placement {
        let place = self.placement();
        let places = self.places.as_deref().filter(|places| !places.is_empty());
        let Some(places) = places else { return place };
        let turn = usize::try_from(index % places.len() as u64).unwrap_or_default();
        let [row, col] = places[turn];
        Placement { row, col, ..place }
    }

    /// Where the object is pressed first.
    pub(crate) fn placement(&self) -> Placement {
        let [tilt_x_deg, tilt_y_deg] = self.tilt_deg.unwrap_or_default();
        Placement {
            row: self.row.unwrap_or_default(),
            col: self.col.unwrap_or_default(),
            rotation_rad: self.rotation_deg.unwrap_or_default().to_radians(),
            tilt_x_rad: tilt_x_deg.to_radians(),
            tilt_y_rad: tilt_y_deg.to_radians(),
        }
    }
}
