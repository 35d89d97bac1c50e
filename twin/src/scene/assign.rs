//! Changes to a scene before it is built, and the fields that give way to them.

use super::config::SceneConfig;
use crate::assign::Assignment;
use spts_input::Refusal;
use spts_models::SkinLayout;
use spts_sim::Mechanics;
use spts_sim::fidelity::change_model;
use std::path::Path;
use toml::{Table, Value};

impl Assignment {
    /// Applies `assignments` to `scene`, in order. If several set one field, the last counts.
    ///
    /// # Errors
    /// [`Refusal`], as [`Assignment::apply`], and for two assignments that set the same quantity in two ways, such
    /// as a row and a position in metres.
    pub(crate) fn apply_all(assignments: &[Self], scene: &mut Table) -> Result<(), Refusal> {
        for (number, later) in assignments.iter().enumerate() {
            let of = |a: &Self| a.key(scene).to_owned();
            let earlier = assignments[..number].iter().find(|a| conflict(&of(a), &of(later)));
            if let Some(earlier) = earlier {
                return Err(later.refused(format!("`{earlier}` says the same in another way; leave out one of them")));
            }
        }
        assignments.iter().try_for_each(|assignment| assignment.apply(scene))
    }

    /// The key that counts for `scene`.
    fn key(&self, scene: &Table) -> &str {
        let has = |key: &&String| scene.contains_key(section(key));
        self.keys.iter().find(has).unwrap_or(&self.keys[0])
    }

    /// Puts the value into `scene`, the table of a scene file. Fields that contradict the new value are removed: a mesh
    /// replaces the object, a tolerance replaces contact and time step, and another contact model drops the parameters
    /// of the earlier one.
    ///
    /// # Errors
    /// [`Refusal`] for a key that scenes do not have (the error lists the valid ones), a value of the wrong type, a
    /// field of presses in a drop, or a field of drops in a press.
    pub fn apply(&self, scene: &mut Table) -> Result<(), Refusal> {
        let key = self.key(scene);
        match section(key) {
            "drop" if scene.contains_key("press") => return Err(self.refused("only a ball drops")),
            "press" if scene.contains_key("drop") => return Err(self.refused("nothing is pressed in a drop")),
            _ => {}
        }
        let mut changed = scene.clone();
        make_room(&mut changed, key, &self.value);
        self.put(&mut changed, key)?;
        if let Err(error) = SceneConfig::from_table(changed.clone()) {
            return Err(self.refused(error.to_string()));
        }
        *scene = changed;
        Ok(())
    }
}

/// First part of a key.
fn section(key: &str) -> &str {
    key.split('.').next().unwrap_or(key)
}

/// Parameters of a contact that a tolerance chooses.
const OF_TOLERANCE: [&str; 4] = ["model", "cells_per_taxel", "coupled", "densification"];

/// Sections, and the ways to say one thing in them: a field that is set drops the fields of the other ways.
type OneOf = (&'static [&'static str], &'static [&'static [&'static str]]);

/// Where a thing is put, and where the seeds come from.
const ONE_OF: [OneOf; 2] = [
    (&["press", "drop"], &[&["row", "col"], &["position_m"], &["position_share"], &["places"]]),
    (&["rows"], &[&["seeding"], &["seeds"], &["seeds_file"], &["patterns"], &["patterns_file"]]),
];

/// Whether two fields, both set by the user, say one thing in two ways.
fn conflict(a: &str, b: &str) -> bool {
    let tolerance = |a: &str, b: &str| {
        let chosen = b.strip_prefix("contact.").is_some_and(|field| OF_TOLERANCE.contains(&field));
        section(a) == "tolerance" && (chosen || b == "timestep_s")
    };
    let object = |a: &str, b: &str| a == "press.mesh" && b == "press.object";
    let ways = |(section_a, a): (&str, &str), (section_b, b): (&str, &str)| {
        let way = |group: OneOf, field: &str| group.1.iter().position(|ways| ways.contains(&field));
        let in_two = |group: &OneOf| {
            let (of_a, of_b) = (way(*group, a), way(*group, b));
            group.0.contains(&section_a) && of_a.is_some() && of_b.is_some() && of_a != of_b
        };
        section_a == section_b && ONE_OF.iter().any(in_two)
    };
    let in_sections = a.split_once('.').zip(b.split_once('.'));
    tolerance(a, b) || tolerance(b, a) || object(a, b) || object(b, a) || in_sections.is_some_and(|(a, b)| ways(a, b))
}

fn in_group(group: OneOf, field: &str) -> bool {
    group.1.iter().any(|ways| ways.contains(&field))
}

/// Removes the electrode from `scene` when it is the one that goes with the pitch: a saved scene has it written out.
fn forget_usual_electrode(scene: &mut Table) {
    let Some(Value::Table(skin)) = scene.get_mut("skin") else {
        return;
    };
    let number = |key: &str| skin.get(key).and_then(Value::as_float);
    let pitch_m = number("pitch_m").unwrap_or(SkinLayout::default().pitch_m());
    if number("electrode_m").map(f64::to_bits) == Some(SkinLayout::usual_electrode_m(pitch_m).to_bits()) {
        skin.remove("electrode_m");
    }
}

/// Removes from `scene` what cannot stand beside the new `value` of `key`.
fn make_room(scene: &mut Table, key: &str, value: &Value) {
    if ["press.object", "press.mesh", "press.objects"].contains(&key) {
        forget_object(scene);
    }
    let mut remove = |section: &str, keys: &[&str]| {
        if let Some(Value::Table(table)) = scene.get_mut(section) {
            for key in keys {
                table.remove(*key);
            }
        }
    };
    match key {
        _ if section(key) == "tolerance" => remove("contact", &OF_TOLERANCE),
        "press.mesh" => remove("press", &["object", "objects"]),
        "press.objects" => remove("press", &["object", "mesh", "scale", "repair", "centre"]),
        "press.object" => remove("press", &["objects", "mesh", "scale", "repair", "centre"]),
        _ => {}
    }
    for group in ONE_OF {
        if let Some((section, field)) = key.split_once('.').filter(|(s, f)| group.0.contains(s) && in_group(group, f)) {
            let others = group.1.iter().copied().filter(|ways| !ways.contains(&field));
            others.for_each(|ways| remove(section, ways));
        }
    }
    if key == "skin.pitch_m" {
        forget_usual_electrode(scene);
    }
    let decides = ["contact", "press", "drop", "skin", "bend", "timestep_s"].contains(&section(key));
    if decides && !["press.presses", "drop.drops"].contains(&key) {
        // what was chosen stays, and nothing is expected of it
        scene.remove("chosen_for_tolerance");
        scene.remove("chosen");
    }
    if let ("contact.model", Some(name)) = (key, value.as_str()) {
        let contact = scene.entry("contact").or_insert_with(|| Value::Table(Table::new()));
        if let Value::Table(contact) = contact {
            change_model(contact, name);
        }
    }
    if section(key) == "tolerance" {
        scene.remove("timestep_s");
        // of one in another measure
        scene.remove("tolerance");
    }
    if ["tolerance", "timestep_s"].contains(&section(key)) && scene.contains_key("drop") {
        // one that a saved scene has written out belongs to the step it had
        scene.remove("frame_interval_s");
    }
}

/// Removes from `scene` what it has of its object alone, as a saved scene has it written out: every field of the press
/// that has the value which it would have without being written, such as the object's place, and its name.
fn forget_object(scene: &mut Table) {
    let press = scene.get("press");
    let written = |key: &'static str| Some((key.to_owned(), press?.get(key)?.clone()));
    let Some(object) = written("object").or_else(|| written("objects")) else {
        return;
    };
    let mut alone: Table =
        [("press".to_owned(), Value::Table([object.clone()].into_iter().collect()))].into_iter().collect();
    alone.extend(scene.get("skin").map(|skin| ("skin".to_owned(), skin.clone())));
    // of an object that does not exist nothing is known
    let Ok(config) = SceneConfig::from_table(alone) else {
        return;
    };
    let Ok(mechanics) = Mechanics::new(config.mechanics(), Path::new("")) else {
        return;
    };
    let Ok(own) = Table::try_from(mechanics.config().press.as_ref()) else {
        return;
    };
    if let Some(Value::Table(press)) = scene.get_mut("press") {
        press.retain(|key, value| *key == object.0 || own.get(key) != Some(value));
    }
    if scene.get("name").and_then(Value::as_str) == Some(&super::default_name(&config)) {
        scene.remove("name");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(scene: &str, assignments: &[&str]) -> Result<SceneConfig, String> {
        let mut table: Table = toml::from_str(scene).unwrap();
        for text in assignments {
            let assignment: Assignment = text.parse().map_err(|e: Refusal| e.to_string())?;
            assignment.apply(&mut table).map_err(|e| e.to_string())?;
        }
        SceneConfig::from_table(table).map_err(|e| e.to_string())
    }

    #[test]
    fn values_are_toml_and_bare_words_are_text() {
        let config = changed(
            "[press]\nobject = \"T\"",
            &[
                "press.force_n=12",
                "readout = my/own.toml",
                "seed=7",
                "press.tilt_deg=[1.0, 2]",
                "transducer_parameters.creep.kind=prony",
                "contact.friction=0.2",
                "timestep_s=auto",
                "skin.rows=12",
            ],
        )
        .unwrap();
        let press = config.press.unwrap();
        assert_eq!((press.force_n.to_bits(), press.tilt_deg), (12.0_f64.to_bits(), Some([1.0, 2.0])));
        assert_eq!((config.readout.as_deref(), config.seed, config.skin.rows()), (Some("my/own.toml"), 7, 12));
        assert_eq!(config.transducer_parameters["creep"]["kind"].as_str(), Some("prony"));
    }

    #[test]
    fn lists_by_number_and_by_plus() {
        let scene = "[[faults]]\nname = \"dead\"\ntaxel = 1\n[drop]";
        let config =
            changed(scene, &["faults.0.taxel=5", "faults.+={ name = \"stuck\", taxel = 7 }", "faults.1.level=0.5"])
                .unwrap();
        assert_eq!(config.faults[0]["taxel"].as_integer(), Some(5));
        assert_eq!(config.faults[1]["level"].as_float(), Some(0.5));
        assert!(changed(scene, &["faults.3.taxel=5"]).unwrap_err().contains("(0 to 0); `faults.+` adds one"));
    }

    #[test]
    fn room_is_made_for_the_new_value() {
        let layer = "timestep_s = 1e-4\nframe_interval_s = 1e-4\n[contact]\nmodel = \"layer\"\ncoupled = true\n[drop]";
        let config = changed(layer, &["contact.model=winkler"]).unwrap();
        assert!(!config.contact.contains_key("coupled"));
        let config = changed(layer, &["tolerance=0.1"]).unwrap();
        assert_eq!((config.contact.len(), config.timestep_s, config.frame_interval_s), (0, None, None));
        let config = changed("[press]\nobject = \"T\"", &["press.mesh=cup.obj"]).unwrap();
        assert_eq!(config.press.unwrap().object, None);
    }

    /// A saved scene has its place, its electrode and its seeds written out: setting another way to say them drops
    /// these.
    #[test]
    fn room_is_made_for_another_way_to_say_it() {
        let place = "[press]\nobject = \"T\"\nrow = 4.5\ncol = 4.25";
        let config = changed(place, &["press.position_m=[0.01, 0]"]).unwrap().press.unwrap();
        assert_eq!((config.row, config.col, config.position_m), (None, None, Some([0.01, 0.0])));
        let config = changed(place, &["press.row=3.0"]).unwrap().press.unwrap();
        assert_eq!((config.row, config.col), (Some(3.0), Some(4.25)));
        let rows = "[rows]\nseeds = [1]\n[drop]";
        let config = changed(rows, &["rows.seeding=mixed"]).unwrap().rows;
        assert_eq!((config.seeding, config.seeds), (Some(spts_circuit::Seeding::Mixed), None));
        // the usual electrode follows the pitch, one that was chosen stays
        for (electrode_m, expected_m) in [("0.01", 0.02), ("0.009", 0.009)] {
            let skin = format!("[skin]\npitch_m = 0.015\nelectrode_m = {electrode_m}\n[drop]");
            let found_m = changed(&skin, &["skin.pitch_m=0.03"]).unwrap().skin.electrode_m();
            assert!((found_m - expected_m).abs() < 1e-15, "{found_m}");
        }
    }

    #[test]
    fn mistakes_name_the_key_and_what_there_is() {
        let press = "[press]\nobject = \"T\"";
        const MISTAKES: &str = r#"
press.forec_n=12 | press.forec_n=12: `press`: unknown field `forec_n` | `force_n`
forec=12 | unknown field `forec` | `readout`
press.force_n=much | `press.force_n` = "much": a number is needed | press.force_n=much
seed.x=1 | seed.x=1
press.force_n | press.force_n | KEY=VALUE
press..force_n=1 | press..force_n=1 | dotted path
press.tilt_deg=[1 | press.tilt_deg=[1 | not TOML
drop.height_m=1 | drop.height_m=1 | only a ball drops
"#;
        for line in MISTAKES.lines().filter(|line| !line.is_empty()) {
            let (text, facts) = line.split_once(" | ").unwrap();
            let error = changed(press, &[text]).unwrap_err();
            for fact in facts.split(" | ") {
                assert!(error.contains(fact), "{text}: {error}");
            }
        }
        assert!(changed("[drop]", &["press.force_n=1"]).unwrap_err().contains("nothing is pressed"));
    }

    #[test]
    fn an_option_finds_the_section_that_the_scene_has() {
        let option = Assignment::of_option("--row", &["press.row", "drop.row"], Value::Float(3.0));
        let mut scene: Table = toml::from_str("[drop]").unwrap();
        option.apply(&mut scene).unwrap();
        assert_eq!(scene["drop"]["row"].as_float(), Some(3.0));
    }
}
