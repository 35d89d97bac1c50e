//! Fidelity levels of the contact: the measured cost and error of each, and the choice of one for a given tolerance.

use serde::{Deserialize, Serialize};
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
}

/// Every fidelity level, the cheapest first. The last but one is the reference.
pub const LEVELS: &[FidelityLevel] = &[
    level("footprint", "columns, at rest", "footprint", None, false),
    level("winkler", "columns", "winkler", None, true),
    level("layer_after", "layer, frames only", "layer", Some(false), true),
    level("layer", "layer", "layer", Some(true), true),
    level("half_space", "half-space", "half_space", Some(true), true),
];

const fn level(
    name: &'static str,
    label: &'static str,
    model: &'static str,
    coupled: Option<bool>,
    dynamic: bool,
) -> FidelityLevel {
    FidelityLevel { name, label, model, coupled, dynamic }
}

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

/// The cheapest contact model, grid and time step that meet a wanted error, from the table that `spts fidelity`
/// measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FidelityChoice {
    /// The fidelity level.
    pub level: &'static FidelityLevel,
    /// Grid squares along one side of a taxel.
    pub cells_per_taxel: usize,
    /// Time step of the dynamics, s.
    pub timestep_s: f64,
    /// Largest error of the taxels' pressures over the scenes of this task.
    pub taxel_rms_rel: f64,
    /// Mean cost over the scenes of this task, in seconds a simulated second.
    pub cost_s_per_s: f64,
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

/// The cheapest level, resolution and time step in `table` whose largest error of the taxels' pressures over all scenes
/// of `task` ("press" or "drop") is at most `tolerance`; `None` if there is none.
///
/// ```
/// use spts_sim::fidelity::{cheapest, measured};
///
/// let rough = cheapest(measured(), "press", 0.5).expect("a level meets 50 %");
/// let exact = cheapest(measured(), "press", 0.05).expect("a level meets 5 %");
/// assert!(rough.cost_s_per_s <= exact.cost_s_per_s && exact.taxel_rms_rel <= 0.05);
/// ```
pub fn cheapest(table: &[MeasuredSetting], task: &str, tolerance: f64) -> Option<FidelityChoice> {
    let rows: Vec<&MeasuredSetting> = table.iter().filter(|row| row.task == task).collect();
    let mut scenes: Vec<&str> = rows.iter().map(|row| row.scene.as_str()).collect();
    scenes.sort_unstable();
    scenes.dedup();
    let mut best: Option<FidelityChoice> = None;
    for row in &rows {
        let alike: Vec<&&MeasuredSetting> = rows.iter().filter(|other| same_setting(other, row)).collect();
        let Some(level) = FidelityLevel::named(&row.level) else {
            continue;
        };
        let choice = FidelityChoice {
            level,
            cells_per_taxel: row.cells_per_taxel,
            timestep_s: row.timestep_s,
            taxel_rms_rel: alike.iter().map(|r| r.taxel_rms_rel).fold(0.0, f64::max),
            cost_s_per_s: alike.iter().map(|r| r.cost_s_per_s).sum::<f64>() / alike.len() as f64,
        };
        // a setting that some scene refused was not measured to meet anything
        let complete = alike.len() == scenes.len();
        let cheaper = best.is_none_or(|b| choice.cost_s_per_s < b.cost_s_per_s);
        if complete && choice.taxel_rms_rel <= tolerance && cheaper {
            best = Some(choice);
        }
    }
    best
}

fn same_setting(a: &MeasuredSetting, b: &MeasuredSetting) -> bool {
    a.level == b.level
        && a.cells_per_taxel == b.cells_per_taxel
        && (a.timestep_s - b.timestep_s).abs() <= 1e-9 * b.timestep_s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row(scene: &str, level: &str, cells_per_taxel: usize, cost: f64, error: f64) -> MeasuredSetting {
        MeasuredSetting {
            scene: scene.to_owned(),
            level: level.to_owned(),
            cells_per_taxel,
            timestep_s: 5e-4,
            cost_s_per_s: cost,
            taxel_rms_rel: error,
            ..measured().iter().find(|row| row.task == "press").unwrap().clone()
        }
    }

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

    /// By hand: the cheap level is good on one scene only, the finer one on both, the reference costs most.
    #[test]
    fn the_cheapest_that_meets_it_on_every_scene() {
        let table = [
            row("T", "winkler", 2, 0.01, 0.01),
            row("tape", "winkler", 2, 0.01, 0.30),
            row("T", "winkler", 6, 0.02, 0.04),
            row("tape", "winkler", 6, 0.04, 0.05),
            row("T", "layer", 12, 1.0, 0.0),
            row("tape", "layer", 12, 2.0, 0.0),
            row("T", "layer", 6, 0.02, 0.0),
        ];
        let choice = |tolerance| cheapest(&table, "press", tolerance).map(|c| (c.level.name, c.cells_per_taxel));
        assert_eq!(choice(0.5), Some(("winkler", 2)));
        assert_eq!(choice(0.05), Some(("winkler", 6)));
        assert_eq!(choice(0.01), Some(("layer", 12)), "the incomplete setting is not chosen");
        assert_eq!(choice(f64::NAN), None);
        assert_eq!(cheapest(&table, "drop", 0.5), None);
    }
}
