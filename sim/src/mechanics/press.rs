//! The sections `[press]` and `[drop]`: their fields, the places and times that these give, and their checks.

use super::timestep::BLOCK_S;
use serde::{Deserialize, Serialize};
use spts_contact::PreparedMesh;
use spts_contact::mesh::{MeshOptions, MeshReport, Repair, TriMesh, load};
use spts_contact::objects::{BALL_STIFFNESS_PA_PER_M, ObjectSpec, Placement, pressable};
use spts_input::Refusal;
use spts_models::{SkinLayout, in_interval, in_range, within};
use std::path::Path;

/// A place as a scene writes it; at most one of the three ways is used.
#[derive(Debug)]
struct Place<'a> {
    /// `press`, `drop`, or an entry of `press.objects`.
    section: &'a str,
    /// Row and column, taxels.
    row: &'a mut Option<f64>,
    col: &'a mut Option<f64>,
    /// (x, y) relative to the middle of the sheet, m: x towards large columns, y towards small rows.
    position_m: &'a mut Option<[f64; 2]>,
    /// The same relative to the sheet's width and height.
    position_share: &'a mut Option<[f64; 2]>,
    /// Whether it has to lie on the sheet.
    on_sheet: bool,
}

/// How far beside the centres of the outer taxels something may be placed, m, and never less than [`REACH_TAXELS`].
const REACH_M: f64 = 75e-3;
/// The same in taxels.
const REACH_TAXELS: f64 = 5.0;

impl Place<'_> {
    /// Turns whatever was written into a row and a column; where nothing was, these are `usual`.
    ///
    /// # Errors
    /// [`Refusal`] for two ways at once, and for a place out of reach of the sheet.
    fn resolve(mut self, skin: &SkinLayout, usual: [f64; 2]) -> Result<(), Refusal> {
        let in_taxels = self.row.is_some() || self.col.is_some();
        let found = [in_taxels, self.position_m.is_some(), self.position_share.is_some()];
        let found = found.into_iter().filter(|given| *given).count();
        if found > 1 {
            let section = self.section;
            return Err(Refusal::new(format!(
                "give at most one of `{section}.row` with `{section}.col`, `{section}.position_m` and \
                 `{section}.position_share`; found {found}"
            )));
        }
        let most_px = if self.on_sheet { 0.5 } else { reach(skin) };
        let [width_m, height_m] = skin.extent_m();
        let most_m = |extent_m: f64| 0.5 * (extent_m - skin.pitch_m()) + most_px * skin.pitch_m();
        let limit = if self.on_sheet { "its edge" } else { "75 mm or 5 taxels beyond the outer taxels" };
        // as far as a row or a column may be, and its rounding; NaN is not within
        let check = |field: String, value: f64, most: f64, unit: &str| {
            let shown = (1e4 * most).round() / 1e4;
            let range = format!("[-{shown}, {shown}]{unit}; the limit on this sheet is {limit}");
            let within = value.abs() <= most * (1.0 + 1e-12);
            within.then_some(()).ok_or_else(|| Refusal::range(&field, value, range))
        };
        if let Some(share) = self.position_share.take() {
            for (axis, (s, extent_m)) in ["x", "y"].into_iter().zip(share.into_iter().zip([width_m, height_m])) {
                let most = (most_m(extent_m) / extent_m).min(1.0);
                check(format!("{}.position_share ({axis})", self.section), s, most, "")?;
            }
            self.set(skin, [share[0] * width_m, share[1] * height_m], most_px);
        } else if let Some(position_m) = self.position_m.take() {
            for (axis, (p, extent_m)) in ["x", "y"].into_iter().zip(position_m.into_iter().zip([width_m, height_m])) {
                check(format!("{}.position_m ({axis})", self.section), p, most_m(extent_m), " m")?;
            }
            self.set(skin, position_m, most_px);
        }
        let (row, col) = (*self.row, *self.col);
        self.row.get_or_insert(usual[0]);
        self.col.get_or_insert(usual[1]);
        // a usual place far beside a small sheet ends in an error that says that nothing is touched
        check_place(&format!("{}.", self.section), [row, col], skin)
    }

    /// Sets row and column, at most `most_px` taxels beyond the outer ones.
    fn set(&mut self, skin: &SkinLayout, [x, y]: [f64; 2], most_px: f64) {
        let [last_row, last_col] = last(skin);
        *self.row = Some((0.5 * last_row - y / skin.pitch_m()).clamp(-most_px, last_row + most_px));
        *self.col = Some((0.5 * last_col + x / skin.pitch_m()).clamp(-most_px, last_col + most_px));
    }
}

/// Indices of the last row and column.
fn last(skin: &SkinLayout) -> [f64; 2] {
    [skin.rows() as f64 - 1.0, skin.cols() as f64 - 1.0]
}

fn reach(skin: &SkinLayout) -> f64 {
    // a rounding of the quotient must not cost the whole number
    (REACH_M / skin.pitch_m() * (1.0 + 1e-12)).max(REACH_TAXELS)
}

/// Whether a row and a column are within reach of `skin`; `before` goes before their names in the error.
fn check_place(before: &str, place: [Option<f64>; 2], skin: &SkinLayout) -> Result<(), Refusal> {
    let names = [
        ("row", "[-5, rows + 4], or 75 mm beside the outer rows"),
        ("col", "[-5, cols + 4], or 75 mm beside the outer columns"),
    ];
    let reach = reach(skin);
    for (((name, range), at), last) in names.into_iter().zip(place).zip(last(skin)) {
        let Some(at) = at else { continue };
        in_range(&format!("{before}{name}"), at, (-reach..=last + reach).contains(&at), range)?;
    }
    Ok(())
}

/// Row and column of the place on `skin` that is as far from the middle, in metres, as `place` is on the published
/// skin.
fn of_published([row, col]: [f64; 2], skin: &SkinLayout) -> [f64; 2] {
    let published = SkinLayout::default();
    let same = (skin.rows(), skin.cols()) == (published.rows(), published.cols());
    if same && skin.pitch_m().to_bits() == published.pitch_m().to_bits() {
        // to the bit
        return [row, col];
    }
    let scale = published.pitch_m() / skin.pitch_m();
    let ([last_row, last_col], [row_0, col_0]) = (last(skin), last(&published));
    [0.5 * last_row + (row - 0.5 * row_0) * scale, 0.5 * last_col + (col - 0.5 * col_0) * scale]
}

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
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PressConfig {
    /// Name of one of the seventeen objects, or `finger` for a fingertip. Either this or `mesh`.
    pub object: Option<String>,
    /// Objects that are pressed together, in place of `object` and `mesh`; see [`PressedObject`]. They hang from one
    /// plate, touch at the same time and share the force. `row` and `col` are then those of the sheet's middle, and
    /// move all of them.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub objects: Vec<PressedObject>,
    /// Mesh file (`.obj`, `.glb` or `.stl`), relative to the scene file. Either this or `object`.
    pub mesh: Option<String>,
    /// Number of metres in a unit of the mesh file; (0, 1000], default 1, as in GLB. It is never guessed: an object 40
    /// units wide may be 40 mm, 40 cm or 40 inches wide.
    pub scale: Option<f64>,
    /// What is done with a mesh that is not closed. `strict` (the default): it is closed where that changes nothing
    /// that touches, pressed as it is where its holes do not show from below, and refused otherwise. `near_side`: it is
    /// pressed as it is, as a shell without thickness.
    pub repair: Option<Repair>,
    /// Whether the mesh is moved so that its origin, which is held over the place, is the middle of its footprint.
    /// Default: false.
    pub centre: Option<bool>,
    /// Row of the object's origin, in taxels. Default: for an object its own place, at the same distance in metres from
    /// the middle of the sheet as on the published skin; for a mesh the middle.
    pub row: Option<f64>,
    /// Column of the object's origin, in taxels. Default: as for `row`.
    pub col: Option<f64>,
    /// Replaces `row` and `col`: position (x, y) of the object's origin relative to the middle of the sheet, m; x
    /// towards large columns, y towards small rows; at most 75 mm or 5 taxels beyond the outer taxels.
    pub position_m: Option<[f64; 2]>,
    /// Replaces `row` and `col`: the position relative to the sheet's width and height; each [−1, 1], with the edges at
    /// ±0.5.
    pub position_share: Option<[f64; 2]>,
    /// Replaces `row` and `col`: [row, col] of each press in turn, in taxels; the list repeats.
    pub places: Option<Vec<[f64; 2]>>,
    /// Rotation about the skin's normal, counter-clockwise seen from above, degrees; [−360, 360].
    pub rotation_deg: Option<f64>,
    /// Tilt about the skin's x and y axes, degrees; each [−60, 60]. A mesh that opens upwards may be tilted by
    /// [`MAX_LIDDED_TILT_DEG`](super::MAX_LIDDED_TILT_DEG) in all.
    pub tilt_deg: Option<[f64; 2]>,
    /// Stiffness of the object's surface in series with the skin, Pa/m; [1e5, 1e12]. Default: the object's own value
    /// (tennis ball, eraser pad); other objects are rigid.
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
            objects: Vec::new(),
            mesh: None,
            scale: None,
            repair: None,
            centre: None,
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
            duration_s: BLOCK_S,
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
    pub fn ramp_s(inner_s: f64) -> f64 {
        ramp_s(inner_s)
    }

    /// Shortest time from touch to lift, s, with which a press of this `rise_s` and without spread has a plateau.
    pub fn shortest_hold_s(rise_s: f64) -> f64 {
        ramp_s(rise_s) + SETTLE_S + MARGIN_S
    }

    /// Span [start, end] in which the force is steady for any drawn onset and lift, s from the start of the press:
    ///
    /// start = `onset_s` + `onset_spread_s` + `rise_s`/0.68 + 0.12 s, end = `lift_s` − `lift_spread_s` − 0.03 s.
    ///
    /// In a valid scene start < end. A `position_sd_m` far above its default delays the touch, and with it the start,
    /// by up to 3 `position_sd_m` / (5 mm/s).
    pub fn plateau_s(&self) -> [f64; 2] {
        [
            self.onset_s + self.onset_spread_s + ramp_s(self.rise_s) + SETTLE_S,
            self.lift_s - self.lift_spread_s - MARGIN_S,
        ]
    }

    /// Where press `index` is.
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

/// Largest tilt of a mesh that opens upwards, degrees. Such a mesh was closed by vertical walls and a lid, which are
/// not part of the object. At a tilt θ and a depth d they reach d tan θ beyond the rim, which is less than 0.5 mm for 5
/// mm of foam.
pub const MAX_LIDDED_TILT_DEG: f64 = 5.0;

impl PressConfig {
    /// Fills what depends on the object, checks every value and loads the mesh, unless it is `given`; with the report
    /// on a mesh from a file.
    pub(in crate::mechanics) fn resolve(
        &mut self,
        skin: &SkinLayout,
        folder: &Path,
        given: Option<PreparedMesh>,
    ) -> Result<(PreparedMesh, Option<MeshReport>), Refusal> {
        if let Some(scale) = self.scale {
            // at most that of a file in kilometres
            in_interval("press.scale", scale, "(0, 1000]")?;
        }
        let (mesh, report, place) = match (&self.object, &self.mesh, given) {
            (None, None, None) if !self.objects.is_empty() => (self.together(skin)?, None, middle(skin)),
            (None, None, Some(mesh)) => (mesh, None, middle(skin)),
            (Some(name), None, None) => {
                let given = [
                    ("scale", self.scale.is_some()),
                    ("repair", self.repair.is_some()),
                    ("centre", self.centre.is_some()),
                ];
                if let Some((field, _)) = given.into_iter().find(|(_, given)| *given) {
                    return Err(Refusal::new(format!(
                        "`press.{field}` is for a mesh, and `press.object` = \"{name}\" has its own size and place; leave it out"
                    )));
                }
                let object = named("press.object", name)?;
                self.stiffness_pa_per_m = self.stiffness_pa_per_m.or(object.stiffness_pa_per_m);
                let [row, col] = of_published([object.placement.row, object.placement.col], skin);
                let placement = Placement { row, col, ..object.placement };
                ((object.build)().into(), None, placement)
            }
            (None, Some(file), None) => {
                let options = MeshOptions {
                    scale: *self.scale.get_or_insert(1.0),
                    repair: self.repair.unwrap_or_default(),
                    centre: self.centre.unwrap_or_default(),
                };
                let (mesh, report) = load(&folder.join(file), options)
                    .map_err(|error| Refusal::new(format!("`press.mesh`: {error}")))?;
                (mesh.into(), Some(report), middle(skin))
            }
            (object, mesh, given) => {
                let found = [object.is_some(), mesh.is_some(), given.is_some()];
                let found = found.into_iter().filter(|named| *named).count();
                let choices = "`press.object` and `press.mesh`, or `press.objects`,";
                return Err(Refusal::new(format!("exactly one of {choices} is needed, found {found}")));
            }
        };
        let of_mesh = self.scale.is_some() || self.repair.is_some() || self.centre.is_some();
        if !self.objects.is_empty() && (self.object.is_some() || self.mesh.is_some() || of_mesh) {
            return Err(Refusal::new(
                "`press.objects` has all that is pressed: leave out `press.object`, `press.mesh` and what belongs to a mesh",
            ));
        }
        for [row, col] in self.places.iter().flatten() {
            check_place("press.places: ", [Some(*row), Some(*col)], skin)?;
        }
        self.resolve_places()?;
        let written = Place {
            section: "press",
            row: &mut self.row,
            col: &mut self.col,
            position_m: &mut self.position_m,
            position_share: &mut self.position_share,
            on_sheet: false,
        };
        written.resolve(skin, [place.row, place.col])?;
        self.rotation_deg.get_or_insert(place.rotation_rad.to_degrees());
        self.tilt_deg.get_or_insert([place.tilt_x_rad.to_degrees(), place.tilt_y_rad.to_degrees()]);
        self.check()?;
        if let Some(report) = report {
            let as_is = report.open_edges > 0 && self.repair != Some(Repair::NearSide);
            match report.lids {
                0 if as_is => self.check_tilt("is not closed where its underside does not show it".to_owned())?,
                0 => {}
                lids => self.check_tilt(format!("opens upwards ({lids} holes were closed there)"))?,
            }
        }
        let [start_s, end_s] = self.plateau_s();
        if start_s >= end_s {
            return Err(Refusal::new(format!(
                "no plateau: with `press.onset_s` = {}, `press.onset_spread_s` = {} and `press.rise_s` = {} the force is \
                 steady from {start_s:.3} s, but with `press.lift_s` = {} and `press.lift_spread_s` = {} only until \
                 {end_s:.3} s",
                self.onset_s, self.onset_spread_s, self.rise_s, self.lift_s, self.lift_spread_s
            )));
        }
        Ok((mesh, report))
    }

    /// All of `objects` as one body whose origin is over the middle of the sheet.
    fn together(&mut self, skin: &SkinLayout) -> Result<PreparedMesh, Refusal> {
        if self.objects.len() > MOST_OBJECTS {
            let found = self.objects.len();
            return Err(Refusal::new(format!("`press.objects` has {found} entries; valid: [1, {MOST_OBJECTS}]")));
        }
        let (mut all, mut stiffnesses) = (TriMesh::default(), Vec::new());
        for (index, entry) in self.objects.iter_mut().enumerate() {
            let section = format!("press.objects[{index}]");
            let object = named(&format!("{section}.object"), &entry.object)?;
            stiffnesses.push(object.stiffness_pa_per_m);
            let written = Place {
                section: &section,
                row: &mut entry.row,
                col: &mut entry.col,
                position_m: &mut entry.position_m,
                position_share: &mut entry.position_share,
                on_sheet: false,
            };
            written.resolve(skin, of_published([object.placement.row, object.placement.col], skin))?;
            let rotation_deg = *entry.rotation_deg.get_or_insert(object.placement.rotation_rad.to_degrees());
            in_interval(&format!("{section}.rotation_deg"), rotation_deg, "[-360, 360]")?;
            let placement = Placement { rotation_rad: rotation_deg.to_radians(), ..object.placement };
            let [x, y] = skin.position_m(entry.row.unwrap_or_default(), entry.col.unwrap_or_default());
            let mesh = (object.build)().rotated(placement.matrix()).grounded();
            all = all.merged(&mesh.translated([x, y, 0.0]));
        }
        let same = stiffnesses.windows(2).all(|pair| pair[0] == pair[1]);
        if self.stiffness_pa_per_m.is_none() && !same {
            return Err(Refusal::new(
                "`press.objects` have different stiffnesses of their own: give `press.stiffness_pa_per_m` for all of them",
            ));
        }
        self.stiffness_pa_per_m = self.stiffness_pa_per_m.or(stiffnesses[0]);
        Ok(all.into())
    }

    /// Makes the first of `places` the place that is written as `row` and `col`; a saved scene has both.
    fn resolve_places(&mut self) -> Result<(), Refusal> {
        let Some(places) = &self.places else { return Ok(()) };
        let Some(&[row, col]) = places.first() else {
            return Err(Refusal::new("`press.places` = [] is empty; valid: one [row, col] or more"));
        };
        let same = |written: Option<f64>, first: f64| written.is_none_or(|at| at.to_bits() == first.to_bits());
        let elsewhere = self.position_m.is_some() || self.position_share.is_some();
        if elsewhere || !same(self.row, row) || !same(self.col, col) {
            return Err(Refusal::new(
                "`press.places` gives the place of every press: remove `press.row`, `press.col`, `press.position_m` and \
                 `press.position_share`",
            ));
        }
        (self.row, self.col) = (Some(row), Some(col));
        Ok(())
    }

    /// Refuses a tilt that would press with the walls and the lid that close a mesh from above, or with a hole that is
    /// not seen from below. The scatter counts with three times its standard deviation.
    fn check_tilt(&self, why: String) -> Result<(), Refusal> {
        let [_, _, up] = self.placement().matrix();
        let leaning_deg = up[2].clamp(-1.0, 1.0).acos().to_degrees() + 3.0 * self.rotation_sd_deg;
        if leaning_deg <= MAX_LIDDED_TILT_DEG {
            return Ok(());
        }
        let [tilt_x_deg, tilt_y_deg] = self.tilt_deg.unwrap_or_default();
        let (mesh, sd_deg) = (self.mesh.as_deref().unwrap_or_default(), self.rotation_sd_deg);
        Err(Refusal::new(format!(
            "`press.mesh` = \"{mesh}\" {why}: `press.tilt_deg` = [{tilt_x_deg}, {tilt_y_deg}] and three times \
             `press.rotation_sd_deg` = {sd_deg} tilt it by {leaning_deg:.1}°, outside [0, {MAX_LIDDED_TILT_DEG}]°, so that \
             its holes would touch the skin; close the mesh, or tilt it in its file"
        )))
    }

    /// The error of a mesh that does not meet the skin: where it is.
    pub(in crate::mechanics) fn beside(&self, report: &MeshReport) -> Refusal {
        let mm = |m: f64| (1e7 * m).round() / 1e4;
        let [x, y] = [0, 1].map(|k| {
            let half_m = 0.5 * report.extent_m[k];
            format!("[{}, {}]", mm(report.middle_m[k] - half_m), mm(report.middle_m[k] + half_m))
        });
        let (row, col) = (self.row.unwrap_or_default(), self.col.unwrap_or_default());
        let off = (0..2).any(|k| report.middle_m[k].abs() > 0.5 * report.extent_m[k]);
        let way = if off {
            "`--centre` (`press.centre = true`) puts the middle of its footprint there"
        } else {
            "nothing of it is over the skin there: choose another `--row` and `--col`"
        };
        Refusal::new(format!(
            "`press.mesh`: the mesh lies beside the skin: its box is x = {x}, y = {y} mm from its origin, which is held \
             over row {row}, column {col}; {way}"
        ))
    }

    fn check(&self) -> Result<(), Refusal> {
        let check = |field: &str, value, range| in_interval(&format!("press.{field}"), value, range);
        check("rotation_deg", self.rotation_deg.unwrap_or_default(), "[-360, 360]")?;
        for tilt_deg in self.tilt_deg.unwrap_or_default() {
            check("tilt_deg", tilt_deg, "[-60, 60]")?;
        }
        if let Some(stiffness) = self.stiffness_pa_per_m {
            check("stiffness_pa_per_m", stiffness, "[1e5, 1e12] Pa/m")?;
        }
        check("force_n", self.force_n, "[0.5, 100] N")?;
        check("presses", self.presses as f64, "[1, 100000]")?;
        check("mass_kg", self.mass_kg, "[1e-3, 4] kg")?;
        check("duration_s", self.duration_s, "[0.5, 60] s")?;
        check("onset_spread_s", self.onset_spread_s, "[0, 1] s")?;
        let earliest_s = self.onset_s - self.onset_spread_s;
        let range = "[0.25 + onset_spread_s, 30] s";
        within("press.onset_s", earliest_s, 0.25, 30.0, range)?;
        check("rise_s", self.rise_s, "[0.1, 10] s")?;
        check("fall_s", self.fall_s, "[0.05, 10] s")?;
        check("lift_spread_s", self.lift_spread_s, "[0, 1] s")?;
        within("press.lift_s", self.lift_s, 0.0, self.duration_s, "[0, duration_s]")?;
        check("position_sd_m", self.position_sd_m, "[0, 0.01] m")?;
        check("rotation_sd_deg", self.rotation_sd_deg, "[0, 5]")
    }
}

/// One of several objects that are pressed together: an entry of `[[press.objects]]`.
///
/// ```
/// use spts_sim::Mechanics;
///
/// let two = "[press]\n[[press.objects]]\nobject = \"T\"\nposition_m = [-0.03, 0.0]\n\
///            [[press.objects]]\nobject = \"rec\"\nposition_m = [0.03, 0.0]\n";
/// let scene = Mechanics::from_toml(two, ".".as_ref())?;
/// assert!(scene.mesh().bounds().is_some_and(|(low, high)| high[0] - low[0] > 0.06));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct PressedObject {
    /// Name of one of the seventeen objects, or `finger`. Meshes that are pressed together go into one file.
    pub object: String,
    /// Row of the object's origin, in taxels. Default: as for [`PressConfig::row`].
    pub row: Option<f64>,
    /// Column of the object's origin, in taxels. Default: as for [`PressConfig::col`].
    pub col: Option<f64>,
    /// Replaces `row` and `col`: position (x, y) relative to the middle of the sheet, m.
    pub position_m: Option<[f64; 2]>,
    /// Replaces `row` and `col`: the position relative to the sheet's width and height.
    pub position_share: Option<[f64; 2]>,
    /// Rotation about the skin's normal, degrees; [−360, 360]. Default: that of its published place.
    pub rotation_deg: Option<f64>,
}

/// Most objects that are pressed together.
const MOST_OBJECTS: usize = 100;

/// The object that `field` names.
fn named(field: &str, name: &str) -> Result<&'static ObjectSpec, Refusal> {
    pressable().find(|object| object.name == name).ok_or_else(|| {
        let known: Vec<_> = pressable().map(|object| object.name).collect();
        Refusal::new(format!("`{field}` = \"{name}\" is not one of {}", known.join(", ")))
    })
}

/// Upright in the middle of the sheet.
fn middle(skin: &SkinLayout) -> Placement {
    Placement {
        row: 0.5 * (skin.rows() as f64 - 1.0),
        col: 0.5 * (skin.cols() as f64 - 1.0),
        rotation_rad: 0.0,
        tilt_x_rad: 0.0,
        tilt_y_rad: 0.0,
    }
}

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
    pub row: Option<f64>,
    /// Column of the landing point, in taxels; inside the skin. Default: the middle.
    pub col: Option<f64>,
    /// Replaces `row` and `col`: landing point (x, y) relative to the middle of the sheet, m; x towards large columns,
    /// y towards small rows; inside the skin.
    pub position_m: Option<[f64; 2]>,
    /// Replaces `row` and `col`: landing point relative to the sheet's width and height; each [−0.5, 0.5].
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
            duration_s: BLOCK_S,
            release_s: 0.10,
            release_spread_s: 0.05,
            position_sd_m: 1e-3,
        }
    }
}

impl DropConfig {
    /// Fills what depends on the skin and checks every value.
    pub(super) fn resolve(&mut self, skin: &SkinLayout) -> Result<(), Refusal> {
        let (last_row, last_col) = (skin.rows() as f64 - 1.0, skin.cols() as f64 - 1.0);
        let written = Place {
            section: "drop",
            row: &mut self.row,
            col: &mut self.col,
            position_m: &mut self.position_m,
            position_share: &mut self.position_share,
            on_sheet: true,
        };
        written.resolve(skin, [0.5 * last_row, 0.5 * last_col])?;
        self.check([last_row, last_col])
    }

    fn check(&self, [last_row, last_col]: [f64; 2]) -> Result<(), Refusal> {
        let (row, col) = (self.row.unwrap_or_default(), self.col.unwrap_or_default());
        let check = |field: &str, value, range| in_interval(&format!("drop.{field}"), value, range);
        check("height_m", self.height_m, "[0.001, 5] m")?;
        within("drop.row", row, -0.5, last_row + 0.5, "[-0.5, rows - 0.5]")?;
        within("drop.col", col, -0.5, last_col + 0.5, "[-0.5, cols - 0.5]")?;
        check("mass_kg", self.mass_kg, "[1e-3, 50] kg")?;
        check("radius_m", self.radius_m, "[5e-3, 0.2] m")?;
        check("stiffness_pa_per_m", self.stiffness_pa_per_m, "[1e5, 1e12] Pa/m")?;
        check("drops", self.drops as f64, "[1, 100000]")?;
        check("duration_s", self.duration_s, "[0.05, 60] s")?;
        check("release_s", self.release_s, "[0, 10] s")?;
        let (spread_s, most_s) = (self.release_spread_s, self.release_s);
        within("drop.release_spread_s", spread_s, 0.0, most_s, "[0, release_s]")?;
        check("position_sd_m", self.position_sd_m, "[0, 0.05] m")
    }
}

#[cfg(test)]
mod tests {
    use crate::mechanics::Mechanics;
    use spts_contact::mesh::{TriMesh, cuboid};

    /// A bowl that opens upward: pressed upright and with a small tilt, refused when it leans by more than 5°, be it by
    /// two tilts that are small each or by the scatter. A closed mesh may lean as it likes.
    #[test]
    fn a_mesh_that_opens_upward_may_hardly_lean() {
        let dir = std::env::temp_dir().join(format!("spts-lids-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let mut bowl = TriMesh { vertices: vec![[0.0; 3]], triangles: Vec::new() };
        for k in 0..24 {
            let (y, x) = (std::f64::consts::TAU * f64::from(k) / 24.0).sin_cos();
            bowl.vertices.push([0.02 * x, 0.02 * y, 0.02]);
            bowl.triangles.push([0, 1 + (k + 1) % 24, 1 + k]);
        }
        std::fs::write(dir.join("bowl.obj"), bowl.to_obj("bowl")).unwrap();
        // the same with a flat top
        bowl.triangles.extend((2..24).map(|k| [1, k, k + 1]));
        std::fs::write(dir.join("cone.obj"), bowl.to_obj("cone")).unwrap();
        let press = |mesh: &str, [x, y]: [f64; 2], sd: f64| {
            let text = format!(
                "[press]\nmesh = \"{mesh}.obj\"\nforce_n = 2.0\ntilt_deg = [{x:?}, {y:?}]\nrotation_sd_deg = {sd:?}\n\
                 [contact]\ncells_per_taxel = 2"
            );
            Mechanics::from_toml(&text, &dir)
        };
        for (tilt_deg, sd) in [([0.0, 0.0], 0.02), ([-4.9, 0.0], 0.02), ([3.5, 3.5], 0.0)] {
            assert_eq!(press("bowl", tilt_deg, sd).unwrap().mesh_report().unwrap().lids, 1);
        }
        // cos 60° cos 60° = cos 75.5°
        for (tilt_deg, sd, lean_deg) in
            [([60.0, 0.0], 0.0, 60.0), ([60.0, 60.0], 0.0, 75.522), ([4.0, -4.0], 0.0, 5.6546), ([0.0, 0.0], 2.0, 6.0)]
        {
            let said = press("bowl", tilt_deg, sd).unwrap_err().to_string();
            assert!(said.contains(&format!("tilt it by {lean_deg:.1}°")), "{said}");
            for fact in ["bowl.obj", "tilt_deg", "[0, 5]°"] {
                assert!(said.contains(fact), "{said}");
            }
            assert!(press("cone", tilt_deg, sd).is_ok());
        }
        std::fs::remove_dir_all(dir).unwrap();
    }

    /// What lies beside the skin is told with its place and the way on; what is open below is pressed if asked.
    #[test]
    fn a_way_on_for_meshes_beside_the_skin_and_open_ones() {
        let dir = std::env::temp_dir().join(format!("spts-way-on-{}", std::process::id()));
        std::fs::create_dir_all(&dir).unwrap();
        let block = cuboid([0.04, 0.06, 0.02]);
        let open = block.triangles.iter().filter(|t| t.iter().any(|i| block.vertices[*i as usize][2] > 0.0));
        let open = TriMesh { vertices: block.vertices.clone(), triangles: open.copied().collect() };
        // narrower than a cell: it presses all the same
        let thin = cuboid([0.04, 0.001, 0.02]);
        for (name, mesh) in [("far", block.clone().translated([0.5, 0.4, 3.0])), ("open", open), ("thin", thin)] {
            std::fs::write(dir.join(format!("{name}.obj")), mesh.to_obj(name)).unwrap();
        }
        let press = |mesh: &str, more: &str| {
            Mechanics::from_toml(&format!("[press]\nmesh = \"{mesh}.obj\"\nforce_n = 2.0\n{more}"), &dir)
        };
        for (mesh, way, words) in [
            ("far", "centre = true", &["x = [480, 520], y = [370, 430] mm", "`--centre`"][..]),
            ("open", "repair = \"near_side\"", &["not closed", "`--as-is`"]),
        ] {
            let said = press(mesh, "").unwrap_err().to_string();
            for word in words {
                assert!(said.contains(word), "{said} lacks {word}");
            }
            assert!(press(mesh, way).is_ok(), "{mesh}: {:?}", press(mesh, way).err());
        }
        assert!(press("thin", "").is_ok());
        // over the place, as if it had been drawn there
        let (low, high) = press("far", "centre = true").unwrap().mesh().bounds().unwrap();
        assert!(low[2].abs() < 1e-9 && (low[0] + high[0]).abs() < 1e-9 && (low[1] + high[1]).abs() < 1e-9);
        let said = Mechanics::from_toml("[press]\nobject = \"T\"\ncentre = true", &dir).unwrap_err().to_string();
        assert!(said.contains("`press.centre` is for a mesh"), "{said}");
        std::fs::remove_dir_all(dir).unwrap();
    }
}
