//! `tolerance`: a scene states the acceptable error, and uses the cheapest fidelity level that meets it.

use super::{MechanicsConfig, MechanicsError};
use crate::fidelity::{FidelityChoice, cheapest, measured};
use spts_models::{SkinLayout, in_range};

/// Smallest tolerance: what taxels feel on the reference itself changed by 3 % when its cells were halved, from 120 to
/// 240 along the skin.
const SMALLEST_TOLERANCE: f64 = 0.03;

/// What a tolerance chooses; a scene that has one must not say it too.
const CHOSEN: [&str; 3] = ["model", "cells_per_taxel", "coupled"];

impl MechanicsConfig {
    /// Replaces `tolerance`, when there is one, by the fidelity level, resolution and time step that the shipped table
    /// chooses for it. The study's cells are those of the default skin: a larger pitch gets as many more. What is
    /// returned has no `tolerance`, so that it stays the same scene when the table is measured anew.
    pub(super) fn with_level_chosen(mut self) -> Result<(Self, Option<FidelityChoice>), MechanicsError> {
        if let Some(chosen) = self.chosen_for_tolerance {
            in_range("chosen_for_tolerance", chosen, chosen > 0.0 && chosen <= 1.0, "(0, 1]")?;
        }
        let Some(tolerance) = self.tolerance.take() else {
            return Ok((self, None));
        };
        let valid = (SMALLEST_TOLERANCE..=1.0).contains(&tolerance);
        in_range("tolerance", tolerance, valid, "[0.03, 1]")?;
        if let Some(key) = CHOSEN.iter().find(|key| self.contact.contains_key(**key)) {
            return Err(MechanicsError::Tolerance {
                key: format!("contact.{key}"),
            });
        }
        if self.timestep_s.is_some() {
            return Err(MechanicsError::Tolerance {
                key: "timestep_s".to_owned(),
            });
        }
        let task = if self.drop.is_some() { "drop" } else { "press" };
        let pitch_m = self.skin.pitch_m();
        let choice = cheapest(measured(), task, tolerance);
        let cells = choice.and_then(|c| cells(c.cells_per_taxel, pitch_m / SkinLayout::default().pitch_m()));
        let (Some(choice), Some(cells)) = (choice, cells) else {
            return Err(MechanicsError::NoLevel {
                tolerance,
                task,
                pitch_m,
            });
        };
        choice.level.apply(&mut self.contact, cells);
        self.timestep_s = Some(choice.timestep_s.into());
        self.chosen_for_tolerance = Some(tolerance);
        Ok((self, Some(choice)))
    }
}

/// Most cells along one side of a taxel.
const MOST_CELLS: f64 = 64.0;

/// Cells that are no larger than those of the study on a skin whose pitch is `relative` times as large; `None` when a
/// taxel cannot have so many.
#[expect(clippy::cast_possible_truncation, reason = "between 1 and the most cells")]
fn cells(measured: usize, relative: f64) -> Option<usize> {
    let cells = (measured as f64 * relative - 1e-9).ceil().max(1.0);
    (cells <= MOST_CELLS).then_some(cells as usize)
}

#[cfg(test)]
mod tests {
    use crate::fidelity::{FidelityLevel, cheapest, measured};
    use crate::mechanics::{Mechanics, MechanicsConfig};
    use std::path::Path;

    fn scene(text: &str) -> Result<Mechanics, String> {
        Mechanics::from_toml(text, Path::new("")).map_err(|e| e.to_string())
    }

    /// The scene is that of the cheapest row of the shipped table, explicit, and the same when it is read again.
    #[test]
    fn a_scene_takes_the_cheapest_level_that_meets_it() {
        for (task, text) in [("press", "[press]\nobject = \"T\""), ("drop", "[drop]")] {
            for tolerance in [0.3, 0.1] {
                let choice = cheapest(measured(), task, tolerance).unwrap();
                assert!(choice.taxel_rms_rel <= tolerance);
                let scene = scene(&format!("tolerance = {tolerance}\n{text}")).unwrap();
                let config = scene.config();
                assert_eq!(config.contact["model"].as_str(), Some(choice.level.model));
                assert_eq!(
                    config.contact["cells_per_taxel"].as_integer(),
                    i64::try_from(choice.cells_per_taxel).ok()
                );
                assert_eq!(config.tolerance, None);
                let again = Mechanics::from_toml(&scene.to_toml().unwrap(), Path::new("")).unwrap();
                assert_eq!(again.config(), config);
            }
        }
    }

    #[test]
    fn wrong_tolerances_are_refused_with_the_reason() {
        let press = "[press]\nobject = \"T\"";
        for (text, words) in [
            ("tolerance = 0", "[0.03, 1]"),
            ("tolerance = 1e-9", "[0.03, 1]"),
            ("tolerance = nan", "[0.03, 1]"),
            ("tolerance = -0.1", "[0.03, 1]"),
            ("tolerance = 2", "[0.03, 1]"),
            ("tolerance = 0.1\ntimestep_s = 1e-4", "timestep_s"),
            ("tolerance = 0.1\ncontact = { model = \"winkler\" }", "contact.model"),
            (
                "tolerance = 0.1\ncontact = { cells_per_taxel = 3 }",
                "contact.cells_per_taxel",
            ),
        ] {
            let error = scene(&format!("{text}\n{press}")).unwrap_err();
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    /// Every line of the shipped table reads, and names a level; the reference is in it for both kinds of scene.
    #[test]
    fn the_shipped_table_is_whole() {
        let lines = include_str!("../../assets/fidelity.csv").lines().count();
        assert_eq!(measured().len(), lines - 1);
        assert!(measured().iter().all(|row| FidelityLevel::named(&row.level).is_some()));
        for task in ["press", "drop"] {
            assert!(cheapest(measured(), task, 1e-9).is_some());
        }
    }

    #[test]
    fn a_larger_pitch_gets_more_cells() {
        let text = "tolerance = 0.3\n[skin]\npitch_m = 0.03\nelectrode_m = 0.02\n[press]\nobject = \"T\"";
        let wide: MechanicsConfig = toml::from_str(text).unwrap();
        let usual = cheapest(measured(), "press", 0.3).unwrap().cells_per_taxel;
        let scene = Mechanics::new(wide, Path::new("")).unwrap();
        let cells = scene.config().contact["cells_per_taxel"].as_integer();
        assert_eq!(cells, i64::try_from(2 * usual).ok());
        let vast = "tolerance = 0.03\n[skin]\npitch_m = 0.1\nelectrode_m = 0.05\n[press]\nobject = \"T\"";
        let error = self::scene(vast).unwrap_err();
        assert!(error.contains("pitch"), "{error}");
    }
}
