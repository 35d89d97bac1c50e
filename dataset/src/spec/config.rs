//! A specification as written in TOML: every section and its defaults.

use super::draw::Draw;
use serde::Deserialize;
use spts::chain::RowsConfig;
use spts_contact::mesh::Repair;
use spts_models::SkinLayout;
use spts_sim::mechanics::DropConfig as BallConfig;

/// The specification of a data set, as written in TOML.
///
/// A field documented as a draw may be a number or a distribution ([`Draw`]). Draws in `[object]` are made
/// once for every shape; those in `[transducer]`, in `[faults]` and of `skin.seed` once for every skin; all others once
/// for every press.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SpecConfig {
    /// Name of the data set: letters, digits, `-` and `_`. Default "touches".
    pub name: String,
    /// Description in a sentence or two, for the data set's card. Default: none.
    pub description: String,
    /// Number of rows; [1, 10^12]. Default 1000; of frames one for every press and window.
    pub rows: u64,
    /// Number of rows in a file; [1, 10^6], a whole number of presses. Default: a sixteenth of all rows, but at least
    /// 100 and at most 10,000.
    pub rows_per_shard: Option<u64>,
    /// Root of every random number; [0, 2^63). Default 0.
    pub seed: u64,
    /// Readout profile: a name, or a file that ends in `.toml`, relative to the specification. Default "as_built".
    pub readout: String,
    /// Division into training, validation and tests.
    pub split: SplitConfig,
    /// The objects.
    pub object: ObjectConfig,
    /// Where the objects lie, and at which angles.
    pub pose: PoseConfig,
    /// Force and duration of presses.
    pub press: PressConfig,
    /// The ball and its fall; only if `record.what` is "drop".
    pub drop: Option<DropConfig>,
    /// Contact model: its name, `model`, and its parameters. Default: `footprint`, and `winkler` for drops.
    pub contact: toml::Table,
    /// The skin.
    pub skin: SkinConfig,
    /// Transducer: `model` and its parameters; a parameter may be a draw. Default: `velostat`.
    pub transducer: toml::Table,
    /// Rows of the sensing matrix, as in a scene's `[rows]`.
    pub weights: RowsConfig,
    /// Faulty cells.
    pub faults: FaultsConfig,
    /// What is recorded.
    pub record: RecordConfig,
}

/// Section `[split]`: shares of the data for validation and tests.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SplitConfig {
    /// What is never divided between two splits: a shape or a press. Default: a shape for procedural shapes and mesh
    /// files, a press for the seventeen objects.
    pub by: Option<SplitBy>,
    /// Share for validation; [0, 1]. Default 0.1.
    pub validation: f64,
    /// Share for tests; [0, 1]. Default 0.1.
    pub test: f64,
}

/// What is never divided between two splits.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitBy {
    /// All touches of one shape: tests use shapes that are not in the training data.
    Object,
    /// All windows of one press.
    Press,
}

impl Default for SpecConfig {
    fn default() -> Self {
        Self {
            name: "touches".to_owned(),
            description: String::new(),
            rows: 1000,
            rows_per_shard: None,
            seed: 0,
            readout: spts::chain::DEFAULT_READOUT.to_owned(),
            split: SplitConfig::default(),
            object: ObjectConfig::default(),
            pose: PoseConfig::default(),
            press: PressConfig::default(),
            drop: None,
            contact: toml::Table::new(),
            skin: SkinConfig::default(),
            transducer: toml::Table::new(),
            weights: RowsConfig::default(),
            faults: FaultsConfig::default(),
            record: RecordConfig::default(),
        }
    }
}

impl Default for SplitConfig {
    fn default() -> Self {
        Self { by: None, validation: 0.1, test: 0.1 }
    }
}

/// Section `[object]`: what is pressed.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectConfig {
    /// Source of the objects. Default: procedural shapes.
    pub from: ObjectSource,
    /// Names of the objects, families, mesh files or objects of frames to use. Default: all of the source; mesh files
    /// in order of name.
    pub names: Option<Vec<String>>,
    /// Folder with mesh files (`.obj`, `.glb`, `.stl`), or with sessions of frames, relative to the specification. Only
    /// for `from = "meshes"` and `"frames"`.
    pub folder: Option<String>,
    /// Pressure that the largest value of frames in codes or relative units is taken for, Pa; [100, 10^6]. Only for
    /// `from = "frames"`. Default 30,000.
    pub peak_pa: Option<f64>,
    /// Metres per unit of the mesh files; (0, 1000]. Default 1.
    pub scale: f64,
    /// What is done with mesh files that are not closed: "strict" (default), which refuses some, or "near_side".
    pub repair: Option<Repair>,
    /// Whether the origin of a mesh file becomes the middle of its footprint. Default: no.
    pub centre: Option<bool>,
    /// Number of consecutive rows with the same shape; a whole number of presses. Default about 100; of frames one
    /// press.
    pub rows_per_shape: Option<u64>,
    /// Number of simultaneous objects; a draw of whole numbers in [1, 10], once for every press. Default 1.
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
    /// Presses of sessions of frames, in turn: anybody's array or simulator, as `spts import` reads it.
    Frames,
}

/// Section `[pose]`: where and how the object is pressed. Each value may be a [`Draw`]. The pose is `about`, moved and
/// turned by the other fields; along x it is moved by `x_share` times the sheet's width plus `x_m`, along y likewise
/// with the height.
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
            peak_pa: None,
            scale: 1.0,
            repair: None,
            centre: None,
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
        Self { count: Draw::Fixed(0.0), names: None }
    }
}

/// Section `[record]`: which windows are recorded, and what is stored of them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct RecordConfig {
    /// When windows are recorded. Default: "hold".
    pub what: RecordKind,
    /// Number of windows of a press or drop, one a row; [1, 10000]. Default: 1 for "hold", the whole press for
    /// "course", 16 for "drop".
    pub windows: Option<u64>,
    /// Time from the start of one window to the start of the next, s; at least the duration of a window, at most 10.
    /// Default: 0.02 for "course", 0.001 for "drop"; the windows of a "hold" follow each other without a gap.
    pub interval_s: Option<f64>,
    /// Whether `interval_s` has to make a whole number of windows a second, which LeRobot's layout needs. Default true.
    pub whole_rate: bool,
    /// Time from the start of the first window to the touch, s; [0, 10]. Not for "hold". Default: 0.1 for "course",
    /// 0.004 for "drop".
    pub before_s: Option<f64>,
    /// M, number of measurements in a window; [1, 10^6]. Default 20.
    pub measurements: usize,
    /// Ground truth of every taxel, one column each. Default: all three; fewer give smaller files.
    pub labels: Vec<Label>,
    /// Whether the raster scan of the press is recorded. Default true.
    pub raster: bool,
    /// Whether the rows of Φ are stored, in addition to generator, seeds and first row. Default false.
    pub phi: bool,
    /// Whether samples are stored as codes of the converter instead of volts. Default false.
    pub codes: bool,
}

/// A ground truth of every taxel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Label {
    /// Mean pressure over the taxel's area: `pressure_pa`.
    Pressure,
    /// Its conductance: `conductance_s`.
    Conductance,
    /// Whether the taxel is touched: `support`.
    Support,
}

impl Label {
    /// All.
    pub const ALL: [Self; 3] = [Self::Pressure, Self::Conductance, Self::Support];
}

/// When windows are recorded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RecordKind {
    /// While the object is held: from `press.hold_s` after the touch on; of frames from the begin of their hold on.
    Hold,
    /// During the whole press: from before the touch, through rise, plateau and fall of the force.
    Course,
    /// During the fall of a ball: from before its touch on.
    Drop,
}

impl Default for RecordConfig {
    fn default() -> Self {
        Self {
            what: RecordKind::Hold,
            windows: None,
            interval_s: None,
            whole_rate: true,
            before_s: None,
            measurements: 20,
            labels: Label::ALL.to_vec(),
            raster: true,
            phi: false,
            codes: false,
        }
    }
}
