//! Fidelity levels of the contact: the measured cost and error of each, and the choice of one for a given tolerance.

use crate::mechanics::{Mechanics, Task};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use spts_contact::{Holder, Load, PosedMesh, TaxelBins, build_contact};
use spts_input::Refusal;
use spts_models::{PressureMap, SkinLayout, in_interval};
use std::fmt;
use std::str::FromStr;
use std::sync::OnceLock;

/// A fidelity level: a contact model, with or without dynamics.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FidelityLevel {
    /// Name in the table.
    pub name: &'static str,
    /// Name in figures and printed tables.
    pub label: &'static str,
    /// Contact model, as `contact.model` in a scene.
    pub model: &'static str,
    /// Whether an elastic contact field is solved at every time step (`true`) or for frames only (`false`).
    pub coupled: Option<bool>,
    /// Whether MuJoCo simulates the dynamics; only then are there a time step and bounces.
    pub dynamic: bool,
    /// What it leaves out.
    pub leaves_out: &'static str,
}

/// Every fidelity level, the cheapest first. The last but one is the reference.
pub const LEVELS: &[FidelityLevel] = &[
    FidelityLevel {
        name: "footprint",
        label: "columns, at rest",
        model: "footprint",
        coupled: None,
        dynamic: false,
        leaves_out: "the arm's motion, and that the foam is pulled down beside a load",
    },
    FidelityLevel {
        name: "winkler",
        label: "columns",
        model: "winkler",
        coupled: None,
        dynamic: true,
        leaves_out: "that the foam is pulled down beside a load",
    },
    FidelityLevel {
        name: "layer_after",
        label: "layer, frames only",
        model: "layer",
        coupled: Some(false),
        dynamic: true,
        leaves_out: "that the foam is pulled down beside a load, in the motion; frames have it",
    },
    FidelityLevel {
        name: "layer",
        label: "layer",
        model: "layer",
        coupled: Some(true),
        dynamic: true,
        leaves_out: "nothing but finer cells",
    },
    FidelityLevel {
        name: "half_space",
        label: "half-space",
        model: "half_space",
        coupled: Some(true),
        dynamic: true,
        leaves_out: "the base under the foam",
    },
];

/// Name of the level with which the others are compared.
pub const REFERENCE: &str = "layer";

impl FidelityLevel {
    /// The level called `name`.
    pub fn named(name: &str) -> Option<&'static Self> {
        LEVELS.iter().find(|level| level.name == name)
    }

    /// Writes this level, with the given resolution, into the `[contact]` section of a scene. Other parameters of the
    /// section are kept if the level has them.
    pub fn apply(&self, contact: &mut toml::Table, cells_per_taxel: usize) {
        change_model(contact, self.model);
        let cells = i64::try_from(cells_per_taxel).unwrap_or(i64::MAX);
        contact.insert("cells_per_taxel".to_owned(), cells.into());
        if let Some(coupled) = self.coupled {
            contact.insert("coupled".to_owned(), coupled.into());
        }
    }
}

/// Parameters that only an elastic field takes.
const ELASTIC_ONLY: [&str; 4] = ["poisson", "tolerance", "coupled", "densification"];
/// Those of them that every elastic field chooses by itself.
const OWN_CHOICE: [&str; 2] = ["coupled", "densification"];

/// Changes the contact model in the `[contact]` section of a scene, and removes the parameters of the earlier model. A
/// saved scene, which contains all defaults, can then be run on any level. Parameters that no model has are kept, so
/// that they are reported as errors.
pub fn change_model(contact: &mut toml::Table, model: &str) {
    let before = contact.insert("model".to_owned(), model.into());
    let before = before.as_ref().and_then(toml::Value::as_str).unwrap_or("winkler");
    let elastic = LEVELS.iter().any(|level| level.model == model && level.coupled.is_some());
    let gone: &[&str] = match (elastic, before == model) {
        (true, true) => &[],
        (true, false) => &OWN_CHOICE,
        (false, _) => &ELASTIC_ONLY,
    };
    for key in gone {
        contact.remove(*key);
    }
}

/// One line of the measured table: a scene with a level, a resolution and a time step. Errors are relative to the
/// reference level at its finest resolution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MeasuredSetting {
    /// Scene of the study.
    pub scene: String,
    /// Task of the scene: "press" or "drop".
    pub task: String,
    /// Name of the fidelity level; the column is called `rung`.
    #[serde(rename = "rung")]
    pub level: String,
    /// Squares of the grid over the whole skin, as "60x60".
    pub cells: String,
    /// Grid squares along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Time step of the dynamics, s; the time between frames for a level without dynamics.
    pub timestep_s: f64,
    /// Wall time of a time step, µs.
    pub cost_us_per_step: f64,
    /// Wall time of a simulated second, s.
    pub cost_s_per_s: f64,
    /// Wall time of one press or drop over the whole chain, s: contact, transducer, readout and decoding.
    pub chain_s: f64,
    /// Error of the fine pressure: its root mean square relative to that of the reference.
    pub pressure_rms_rel: f64,
    /// Error of the taxels' pressures over the whole scene, in the same measure.
    pub taxel_rms_rel: f64,
    /// Support accuracy after the whole chain, minus that of the reference.
    pub support_delta: f64,
    /// Intersection over union of the support, minus that of the reference.
    pub iou_delta: f64,
    /// Share of correctly classified windows, minus that of the reference.
    pub class_delta: f64,
}

/// The shipped table, measured by `spts fidelity`: default skin and foam, 20 N.
pub fn measured() -> &'static [MeasuredSetting] {
    static TABLE: OnceLock<Vec<MeasuredSetting>> = OnceLock::new();
    TABLE.get_or_init(|| {
        let mut reader = csv::Reader::from_reader(include_str!("../assets/fidelity.csv").as_bytes());
        // a damaged line would be a line less to choose from; the tests read every one
        reader.deserialize().filter_map(Result::ok).collect()
    })
}

// A tolerance: what a scene may err by.

/// The error that a scene may have, against the finest level.
///
/// In a scene: `tolerance = 0.05`, `tolerance = { iou = 0.02 }` or `tolerance = { class = 0.01 }`.
///
/// ```
/// use spts_sim::fidelity::Tolerance;
///
/// assert_eq!("0.05".parse(), Ok(Tolerance::Pressure(0.05)));
/// assert_eq!("iou=0.02".parse(), Ok(Tolerance::Iou(0.02)));
/// // a change of IoU by 0.02 is met by pressures with about this error, in every row of the shipped table
/// let error = Tolerance::Iou(0.02).pressure("press").expect("in the table");
/// assert!(error > 0.005 && error < 0.2);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Tolerance {
    /// Relative root mean square error of the taxels' pressures over the scene.
    Pressure(f64),
    /// Change of the mean intersection over union of supports.
    Iou(f64),
    /// Change of the share of windows that are classified correctly.
    Class(f64),
}

/// What can be written for a tolerance.
const WANTED: &str = "a number, { iou = number } or { class = number }";

impl Tolerance {
    /// Name of the score if it is of one, value, and the range that it may have.
    fn parts(self) -> (Option<&'static str>, f64, &'static str) {
        match self {
            // the margin, the course of the force and frames between two forces come to half of the least
            Self::Pressure(most) => (None, most, "[0.03, 1]"),
            Self::Iou(most) => (Some("iou"), most, "[0.005, 0.5]"),
            Self::Class(most) => (Some("class"), most, "[0.005, 0.5]"),
        }
    }

    /// Itself when it is in its range; `key` is its name in a scene, for the error.
    ///
    /// # Errors
    /// [`Refusal`] outside the range.
    pub fn checked(self, key: &str) -> Result<Self, Refusal> {
        let (score, most, range) = self.parts();
        in_interval(&score.map_or(key.to_owned(), |score| format!("{key}.{score}")), most, range)?;
        Ok(self)
    }

    /// Error of the pressures that meets it: for a score the largest in the shipped table up to which every row of
    /// `task` ("press" or "drop") keeps to it; `None` if no row does.
    pub fn pressure(self, task: &str) -> Option<f64> {
        let delta = |row: &MeasuredSetting| match self {
            Self::Pressure(_) => 0.0,
            Self::Iou(_) => row.iou_delta.abs(),
            Self::Class(_) => row.class_delta.abs(),
        };
        let (_, most, _) = self.parts();
        if let Self::Pressure(_) = self {
            return Some(most);
        }
        let rows = || measured().iter().filter(|row| row.task == task);
        let misses = rows().filter(|row| delta(row) > most).map(|row| row.taxel_rms_rel);
        let first = misses.fold(f64::INFINITY, f64::min);
        let met = rows().map(|row| row.taxel_rms_rel).filter(|error| *error < first);
        met.max_by(f64::total_cmp)
    }

    /// As TOML.
    pub fn to_toml(self) -> toml::Value {
        let (score, most, _) = self.parts();
        match score {
            None => most.into(),
            Some(score) => toml::Table::from_iter([(score.to_owned(), most.into())]).into(),
        }
    }

    fn of(score: &str, most: f64) -> Option<Self> {
        match score {
            "iou" => Some(Self::Iou(most)),
            "class" => Some(Self::Class(most)),
            _ => None,
        }
    }
}

impl fmt::Display for Tolerance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Pressure(most) => write!(f, "{most}"),
            Self::Iou(most) => write!(f, "{most} of IoU"),
            Self::Class(most) => write!(f, "{most} of the classification"),
        }
    }
}

impl FromStr for Tolerance {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number =
            |text: &str| text.trim().parse().map_err(|_| "a number, iou=number or class=number is needed".to_owned());
        match text.split_once('=') {
            None => number(text).map(Self::Pressure),
            Some((score, most)) => {
                let score = score.trim();
                let of = Self::of(score, f64::NAN).map(|_| ());
                of.ok_or_else(|| format!("`{score}` is not one of iou, class"))?;
                Ok(Self::of(score, number(most)?).unwrap_or(Self::Pressure(f64::NAN)))
            }
        }
    }
}

impl Serialize for Tolerance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        self.to_toml().serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Tolerance {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        use serde::de::Error;
        let value = toml::Value::deserialize(deserializer)?;
        let number = |value: &toml::Value| value.as_float().or_else(|| value.as_integer().map(|i| i as f64));
        let found = match &value {
            toml::Value::Table(table) if table.len() == 1 => {
                table.iter().find_map(|(score, most)| Self::of(score, number(most)?))
            }
            value => number(value).map(Self::Pressure),
        };
        found.ok_or_else(|| D::Error::custom(format!("`tolerance` = {value} is not {WANTED}")))
    }
}

// The choice: every level is tried on the scene's own contact.

/// The cheapest contact model and grid that meet a tolerance on a scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FidelityChoice {
    /// The fidelity level.
    pub level: &'static FidelityLevel,
    /// Grid squares along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Expected error of the taxels' pressures.
    pub error: f64,
    /// What the finest level itself may be off by: how far its pressures moved when its cells were halved.
    pub finest_error: f64,
    /// Times that the finest level takes as long, by the means of the shipped table.
    pub saves: f64,
}

/// Resolutions that are tried on skins of the usual pitch or less, those of the shipped table. A larger pitch gets as
/// many more.
const CELLS: [usize; 5] = [2, 3, 6, 12, 24];
/// Resolution of the finest level there, and the most that a taxel can have.
const FINEST: usize = 24;
const MOST_CELLS: usize = 64;
/// Most grid squares of an elastic field.
const MOST_SQUARES: f64 = (1_u64 << 20) as f64;
/// What columns under the dynamics are off by in the course of the force, against a field that is solved at every step:
/// twice the largest error of `layer_after` at its finest over the presses of the shipped table. It stands for drops,
/// and for bent skins, which no other field can have. Of other presses the course is measured on the scene, with few
/// cells.
const COURSE: f64 = 0.015;

/// Courses of the first press that are compared, with so many cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Courses {
    /// Pressures of a press at rest against the same columns under the arm's dynamics.
    AtRest(usize),
    /// Force of columns under the dynamics against the layer.
    Columns(usize),
}
/// Share of the tolerance that a held pose may take: other presses of the scene stand a little differently.
const MARGIN: f64 = 0.9;
/// What is tried: shares of the scene's own force or depth, with the weights of their errors, and how far the body is
/// moved along rows and columns, in taxels. A small body in the middle of one taxel or of four presses them alike on
/// every level: the last pose is off every symmetry.
const POSES: [(f64, f64, [f64; 2]); 3] = [(1.0, 1.0, [0.0, 0.0]), (0.25, 0.5, [0.0, 0.0]), (1.0, 1.0, [0.3, 0.2])];

/// Tries the levels on the contact of `scene`, a scene of columns, whose other parameters of `[contact]` are `contact`.
/// Of those that keep to the tolerance it takes the cheapest that the scene `can_have`. `apart` says how far two
/// courses are from each other, as a relative root mean square.
///
/// A press is held under its force, and a ball at its deepest. The error of a level is that of the taxels' pressures
/// there, against `layer` with the most cells that the part of the skin under the body can have, up to 24 a taxel.
///
/// # Errors
/// [`Refusal`] if no level that the scene can have meets the tolerance, with the least error there is.
pub(crate) fn choose(
    scene: &Mechanics,
    contact: &toml::Table,
    tolerance: Tolerance,
    can_have: impl Fn(&FidelityLevel, usize) -> bool,
    apart: impl Fn(Courses) -> f64,
) -> Result<FidelityChoice, Refusal> {
    let task = if matches!(scene.task(), Task::Drop(_)) { "drop" } else { "press" };
    let wanted = tolerance.pressure(task).unwrap_or(0.0);
    let trial = Trial::new(scene, contact)?;
    let reference = FidelityLevel::named(REFERENCE).unwrap_or(&LEVELS[0]);
    let finest = trial.pressures(reference, trial.finest)?;
    let half = trial.pressures(reference, (trial.finest / 2).max(1))?;
    let bent = scene.config().bend.is_some();
    let mut candidates: Vec<(f64, &'static FidelityLevel, usize)> = Vec::new();
    for level in LEVELS.iter().filter(|level| trial.takes(level) && !(bent && level.coupled.is_some())) {
        let cells = CELLS.into_iter().map(|cells| (cost(task, level.name, cells), level, on(scene.skin(), cells)));
        candidates.extend(cells.filter(|(.., cells)| *cells <= trial.most_cells(level)));
    }
    candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
    // a press is held by the same force on every level: two levels of one model feel the same
    let mut tried: Vec<(bool, usize, f64)> = vec![(true, trial.finest, 0.0)];
    let mut least = f64::INFINITY;
    // measured once, with the first cells that ask for it
    let (mut at_rest, mut columns) = (None, None);
    for (cost_s_per_s, level, cells_per_taxel) in candidates {
        let elastic = level.coupled.is_some();
        let is_finest = level.name == REFERENCE && cells_per_taxel == trial.finest;
        let same = tried
            .iter()
            .find(|(e, cells, _)| (task == "press" || is_finest) && (*e, *cells) == (elastic, cells_per_taxel));
        let held = match same {
            Some((.., held)) => *held,
            None => difference(&trial.pressures(level, cells_per_taxel)?, &finest),
        };
        tried.push((elastic, cells_per_taxel, held));
        let mut error = held;
        if level.coupled != Some(true) && error <= MARGIN * wanted {
            let measured = task == "press" && !bent;
            let course = || if measured { apart(Courses::Columns(CELLS[0])) } else { COURSE };
            error = error.hypot(*columns.get_or_insert_with(course));
        }
        if !level.dynamic && error <= MARGIN * wanted {
            error = error.hypot(*at_rest.get_or_insert_with(|| apart(Courses::AtRest(cells_per_taxel))));
        }
        least = least.min(error);
        if (is_finest || error <= MARGIN * wanted) && can_have(level, cells_per_taxel) {
            let saves = cost(task, REFERENCE, FINEST) / cost_s_per_s;
            return Ok(FidelityChoice {
                level,
                cells_per_taxel,
                error,
                finest_error: difference(&half, &finest),
                saves,
            });
        }
    }
    Err(Refusal::new(format!(
        "`tolerance` = {tolerance}: pressures with an error of at most {wanted:.3} are needed, and the best level that \
         this scene can have comes to {:.3}{}",
        least / MARGIN,
        if bent { ", since a bent skin takes columns alone" } else { "" }
    )))
}

/// The finest level that the whole skin of `scene` can have, and its cells along a taxel. A bent skin takes columns
/// alone.
pub fn finest(scene: &Mechanics) -> (&'static FidelityLevel, usize) {
    let bent = scene.config().bend.is_some();
    let level = FidelityLevel::named(if bent { "winkler" } else { REFERENCE }).unwrap_or(&LEVELS[0]);
    let cells = on(scene.skin(), FINEST);
    (level, if bent { cells } else { most_cells(scene.skin()).min(cells) })
}

/// Mean cost of a level over the scenes of a task in the shipped table, s for a simulated second, at its longest step.
fn cost(task: &str, level: &str, cells_per_taxel: usize) -> f64 {
    let rows = measured().iter().filter(|row| row.task == task && row.level == level);
    let rows: Vec<_> = rows.filter(|row| row.cells_per_taxel == cells_per_taxel).collect();
    let longest_s = rows.iter().map(|row| row.timestep_s).fold(0.0, f64::max);
    let costs: Vec<f64> = rows.iter().filter(|row| row.timestep_s >= longest_s).map(|row| row.cost_s_per_s).collect();
    costs.iter().sum::<f64>() / costs.len() as f64
}

/// Taxels' pressures of a level in the poses that are tried.
type Held = [Vec<f64>; POSES.len()];

/// The largest relative difference; infinite if there is none.
fn difference(found: &Held, expected: &Held) -> f64 {
    let relative = |k: usize| {
        let off: f64 = found[k].iter().zip(&expected[k]).map(|(p, q)| (p - q).powi(2)).sum();
        let relative = (off / expected[k].iter().map(|q| q * q).sum::<f64>()).sqrt();
        if relative.is_nan() { f64::INFINITY } else { relative }
    };
    (0..).zip(POSES).map(|(k, (_, weight, _))| weight * relative(k)).fold(0.0, f64::max)
}

/// The contact of a scene on the part of the skin that is under the body.
struct Trial<'a> {
    scene: &'a Mechanics,
    contact: &'a toml::Table,
    skin: SkinLayout,
    body: PosedMesh<'a>,
    /// Force, N, and depth, m, of the poses that are tried.
    held: [[f64; 2]; POSES.len()],
    finest: usize,
}

impl<'a> Trial<'a> {
    fn new(scene: &'a Mechanics, contact: &'a toml::Table) -> Result<Self, Refusal> {
        let (body, _) = scene.contact_body();
        let curve = scene.depth_curve();
        let held = match scene.task() {
            Task::Press(press) => {
                POSES.map(|(share, ..)| [share * press.force_n, curve.depth_m(share * press.force_n)])
            }
            Task::Drop(_) => {
                let deepest_m = curve.depth_m(f64::INFINITY);
                POSES.map(|(share, ..)| [f64::NAN, share * deepest_m])
            }
        };
        let whole = *scene.skin();
        // the taxels that feel anything in the deeper pose, and those beside them
        let mut field = scene.build_contact()?;
        let cells = field.cells_per_taxel();
        let answer = field.respond(&lowered(body, held[0][1]));
        let patch = answer.patch.unwrap_or_default();
        let taxels = |[first, end]: [usize; 2], count: usize| {
            [(first / cells).saturating_sub(1), (end.div_ceil(cells) + 1).min(count)]
        };
        let [rows, cols] = [taxels(patch.rows, whole.rows()), taxels(patch.cols, whole.cols())];
        let skin = SkinLayout::new(rows[1] - rows[0], cols[1] - cols[0], whole.pitch_m(), whole.electrode_m())?;
        let middle = |[first, end]: [usize; 2]| 0.5 * (first + end - 1) as f64;
        let [x, y] = whole.position_m(middle(rows), middle(cols));
        let [body_x, body_y, z] = body.position_m;
        let body = PosedMesh { position_m: [body_x - x, body_y - y, z], ..body };
        let finest = most_cells(&skin).min(on(&skin, FINEST));
        Ok(Self { scene, contact, skin, body, held, finest })
    }

    /// Whether a scene of this task can have the level.
    fn takes(&self, level: &FidelityLevel) -> bool {
        // never the best: a half-space has no base under it
        level.name != "half_space" && (level.dynamic || matches!(self.scene.task(), Task::Press(_)))
    }

    /// Most cells a taxel that the whole skin can have.
    fn most_cells(&self, level: &FidelityLevel) -> usize {
        if level.coupled.is_some() { most_cells(self.scene.skin()).min(self.finest) } else { MOST_CELLS }
    }

    /// What the taxels feel of the held poses.
    fn pressures(&self, level: &FidelityLevel, cells_per_taxel: usize) -> Result<Held, Refusal> {
        let mut contact = self.contact.clone();
        level.apply(&mut contact, cells_per_taxel);
        let press = matches!(self.scene.task(), Task::Press(_));
        if press {
            // under a prescribed force
            let model = if level.coupled.is_some() { level.model } else { "footprint" };
            change_model(&mut contact, model);
            if level.coupled.is_some() {
                contact.insert("coupled".to_owned(), false.into());
            }
        }
        let model = contact.remove("model");
        let model = model.as_ref().and_then(toml::Value::as_str).unwrap_or_default();
        let mut field = build_contact(model, contact, &self.skin)?;
        field.expect(self.scene.mesh());
        let bins = TaxelBins::new(&self.skin, cells_per_taxel);
        let mut held = Held::default();
        for ((out, [force_n, depth_m]), (.., moved)) in held.iter_mut().zip(self.held).zip(POSES) {
            let mut body = lowered(self.body, depth_m);
            body.position_m[0] += moved[0] * self.skin.pitch_m();
            body.position_m[1] += moved[1] * self.skin.pitch_m();
            let [x, y, _] = body.position_m;
            let load = Load { force_n, axis_m: [x, y], holder: Holder::Rigid, from: None };
            let [pressure, _] = if let Some(columns) = field.quasi_static() {
                // a force that this level does not carry is an error like another
                columns.carry(&body, &load).map_or_else(
                    |_| [(); 2].map(|()| PressureMap::zeros(self.skin.rows(), self.skin.cols())),
                    |balance| bins.means(balance.response.pressure_pa, balance.response.patch),
                )
            } else {
                let answer = field.respond(&body);
                let (answered_n, answered) = (answer.wrench.force_n[2], bins.means(answer.pressure_pa, answer.patch));
                field
                    .refine(&body, if press { force_n } else { answered_n })
                    .map_or(answered, |fine| bins.means(fine, None))
            };
            *out = pressure.values().to_vec();
        }
        Ok(held)
    }
}

/// `body` at a depth below the touch.
fn lowered(body: PosedMesh<'_>, depth_m: f64) -> PosedMesh<'_> {
    let [lowest_m, _] = body.heights_m();
    let [x, y, _] = body.position_m;
    PosedMesh { position_m: [x, y, -lowest_m - depth_m], ..body }
}

/// Cells along a taxel of `skin` that are no larger than so many of the usual one.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 1 and the most cells")]
fn on(skin: &SkinLayout, cells: usize) -> usize {
    let relative = (skin.pitch_m() / SkinLayout::default().pitch_m()).max(1.0);
    (cells as f64 * relative - 1e-9).ceil().min(MOST_CELLS as f64) as usize
}

/// Most cells along a taxel of `skin` that an elastic field can have.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 2^10")]
fn most_cells(skin: &SkinLayout) -> usize {
    (MOST_SQUARES / skin.taxels() as f64).sqrt() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_scene_runs_on_any_level() {
        use crate::mechanics::Mechanics;
        use std::path::Path;
        let text = "contact = { model = \"layer\", poisson = 0.3 }\n[press]\nobject = \"T\"";
        let saved = Mechanics::from_toml(text, Path::new("")).unwrap();
        for level in LEVELS {
            let mut config = saved.config().clone();
            level.apply(&mut config.contact, 2);
            config.timestep_s = Some(5e-4.into());
            let scene = Mechanics::new(config, Path::new("")).unwrap();
            let poisson = scene.config().contact.get("poisson").and_then(toml::Value::as_float);
            assert_eq!(poisson.is_some(), level.coupled.is_some(), "{}", level.name);
            assert!(poisson.is_none_or(|nu| (nu - 0.3).abs() < 1e-12));
        }
        let mut contact: toml::Table = toml::from_str("stifness = 3").unwrap();
        change_model(&mut contact, "footprint");
        assert!(contact.contains_key("stifness"), "a mistake is not swallowed");
    }
}
