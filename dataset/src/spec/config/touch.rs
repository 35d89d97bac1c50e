//! What touches the skin: objects, their poses, presses and drops.

use crate::spec::Draw;
use serde::Deserialize;
use spts_sim::mechanics::DropConfig as BallConfig;

/// Section `[object]`: what is pressed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectConfig {
    /// Source of the objects. Default: procedural shapes.
    pub from: ObjectSource,
    /// Names of the objects, families or mesh files to use. Default: all of the source; mesh files in order of name.
    pub names: Option<Vec<String>>,
    /// Folder with mesh files (`.obj`, `.glb`, `.stl`), relative to the specification. Only for `from = "meshes"`.
    pub folder: Option<String>,
    /// Metres per unit of the mesh files; (0, 1000]. Default 1.
    pub scale: f64,
    /// Number of consecutive rows with the same shape; a whole number of presses. Default about 100.
    pub rows_per_shape: Option<u64>,
    /// Number of simultaneous objects; a draw of whole numbers in [1, 3], once for every press. Default 1.
    pub count: Draw,
    /// Smallest and largest extent of a procedural shape, m. Default 20 to 90 mm.
    pub size_m: Option<[f64; 2]>,
    /// Smallest and largest relief of its underside, m. Default 0 to 0.6 mm.
    pub relief_m: Option<[f64; 2]>,
    /// Smallest and largest radius of its edges, m. Default 0 to 3 mm.
    pub edge_m: Option<[f64; 2]>,
}

/// Source of the objects.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ObjectSource {
    /// Procedural shapes ([`spts_contact::shapes::SHAPE_FAMILIES`]); each shape number gives a different one.
    Shapes,
    /// The seventeen objects of the published recordings, in turn.
    Objects,
    /// Mesh files, in turn.
    Meshes,
    /// A ball, for drops only.
    Ball,
}

/// Section `[pose]`. All values are draws, and they add up.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PoseConfig {
    /// Pose to which the values are relative. Default: the middle of the sheet.
    pub about: PoseOrigin,
    /// Position of the object's origin along x, towards large columns, relative to the sheet's width; [−1, 1], with the
    /// edges at ±0.5. Default 0.
    pub x_share: Draw,
    /// Position along y, towards small rows, relative to the sheet's height; [−1, 1]. Default 0.
    pub y_share: Draw,
    /// Position along x, m; [−10, 10]. Default 0.
    pub x_m: Draw,
    /// Position along y, m; [−10, 10]. Default 0.
    pub y_m: Draw,
    /// Rotation about the skin's normal, counter-clockwise seen from above, degrees; [−360, 360]. Default 0.
    pub rotation_deg: Draw,
    /// Tilt about the skin's x axis, degrees; [−60, 60]. Default 0.
    pub tilt_x_deg: Draw,
    /// Tilt about the skin's y axis, degrees; [−60, 60]. Default 0.
    pub tilt_y_deg: Draw,
}

/// Pose to which the values of `[pose]` are relative.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseOrigin {
    /// The middle of the sheet, upright.
    Middle,
    /// The pose fitted to the published recordings. Only for the seventeen objects.
    Placement,
}

/// Section `[press]`: how hard and how long an object is pressed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PressConfig {
    /// Normal force on every object, N; a draw in [0.01, 1000], or in [0.5, 100] if the press is simulated in time.
    /// Default 20.
    pub force_n: Draw,
    /// Time from the touch to the first sample (`record.what = "hold"`) or to the lift ("course"), s; a draw in [0,
    /// 3600]. Default 0.6, the middle of a published press.
    pub hold_s: Draw,
    /// Time for the rise from 10 to 90 % of the force if the press is simulated in time, s; a draw in [0.1, 10].
    /// Default 0.205, as in the published recordings.
    pub rise_s: Draw,
    /// Time for the fall from 90 to 10 % of the force if `record.what = "course"`, s; a draw in [0.05, 10]. Default
    /// 0.14, as in the published recordings.
    pub fall_s: Draw,
    /// Tilt stiffness of the holder, N m/rad; [1, 10^9]. Default 8000; the simulated arm has 6800 to 9800 about the two
    /// axes of the skin.
    pub tilt_stiffness_nm_per_rad: f64,
    /// Stiffness of a shape's or mesh's surface in series with the skin, Pa/m; a draw in [10^5, 10^12]. Default: rigid.
    /// The seventeen objects have values of their own.
    pub stiffness_pa_per_m: Option<Draw>,
}

/// Section `[drop]`. All values are draws, made once for every drop. Defaults: a tennis ball from half a metre.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct DropConfig {
    /// Height of the ball's lowest point above the skin at release, m; [0.001, 5]. Default 0.5.
    pub height_m: Draw,
    /// Mass, kg; [0.001, 50]. Default 0.0577.
    pub mass_kg: Draw,
    /// Radius, m; [0.005, 0.2]. Default 0.0334.
    pub radius_m: Draw,
    /// Stiffness of the ball's surface in series with the skin, Pa/m; [1e5, 1e12]. Default: a tennis ball's.
    pub stiffness_pa_per_m: Draw,
}

impl Default for ObjectConfig {
    fn default() -> Self {
        Self {
            from: ObjectSource::Shapes,
            names: None,
            folder: None,
            scale: 1.0,
            rows_per_shape: None,
            count: Draw::Fixed(1.0),
            size_m: None,
            relief_m: None,
            edge_m: None,
        }
    }
}

impl Default for PoseConfig {
    fn default() -> Self {
        let zero = Draw::Fixed(0.0);
        Self {
            about: PoseOrigin::Middle,
            x_share: zero.clone(),
            y_share: zero.clone(),
            x_m: zero.clone(),
            y_m: zero.clone(),
            rotation_deg: zero.clone(),
            tilt_x_deg: zero.clone(),
            tilt_y_deg: zero,
        }
    }
}

impl Default for PressConfig {
    fn default() -> Self {
        Self {
            force_n: Draw::Fixed(20.0),
            hold_s: Draw::Fixed(0.6),
            rise_s: Draw::Fixed(0.205),
            fall_s: Draw::Fixed(0.14),
            tilt_stiffness_nm_per_rad: 8000.0,
            stiffness_pa_per_m: None,
        }
    }
}

impl Default for DropConfig {
    fn default() -> Self {
        let ball = BallConfig::default();
        Self {
            height_m: Draw::Fixed(ball.height_m),
            mass_kg: Draw::Fixed(ball.mass_kg),
            radius_m: Draw::Fixed(ball.radius_m),
            stiffness_pa_per_m: Draw::Fixed(ball.stiffness_pa_per_m),
        }
    }
}
