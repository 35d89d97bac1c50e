//! Removes fields of a scene that contradict a field that is set.

use super::SceneConfig;
use spts_models::SkinLayout;
use spts_sim::Mechanics;
use spts_sim::fidelity::change_model;
use std::path::Path;
use toml::{Table, Value};

/// First part of a key.
pub(super) fn section(key: &str) -> &str {
    key.split('.').next().unwrap_or(key)
}

/// Parameters of a contact that a tolerance chooses.
const OF_TOLERANCE: [&str; 4] = ["model", "cells_per_taxel", "coupled", "densification"];

/// Sections, and the ways to say one thing in them: a field that is set drops the fields of the other ways.
type OneOf = (&'static [&'static str], &'static [&'static [&'static str]]);

/// Where a thing is put, and where the seeds come from.
const ONE_OF: [OneOf; 2] = [
    (
        &["press", "drop"],
        &[&["row", "col"], &["position_m"], &["position_share"], &["places"]],
    ),
    (
        &["rows"],
        &[
            &["seeding"],
            &["seeds"],
            &["seeds_file"],
            &["patterns"],
            &["patterns_file"],
        ],
    ),
];

/// Whether two fields, both set by the user, say one thing in two ways.
pub(super) fn conflict(a: &str, b: &str) -> bool {
    let tolerance = |a: &str, b: &str| {
        let chosen = b
            .strip_prefix("contact.")
            .is_some_and(|field| OF_TOLERANCE.contains(&field));
        a == "tolerance" && (chosen || b == "timestep_s")
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
pub(super) fn make_room(scene: &mut Table, key: &str, value: &Value) {
    if ["press.object", "press.mesh"].contains(&key) {
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
        "press.mesh" => remove("press", &["object"]),
        "press.object" => remove("press", &["mesh", "scale"]),
        "tolerance" => remove("contact", &OF_TOLERANCE),
        _ => {}
    }
    for group in ONE_OF {
        if let Some((section, field)) = key
            .split_once('.')
            .filter(|(s, f)| group.0.contains(s) && in_group(group, f))
        {
            let others = group.1.iter().copied().filter(|ways| !ways.contains(&field));
            others.for_each(|ways| remove(section, ways));
        }
    }
    if key == "skin.pitch_m" {
        forget_usual_electrode(scene);
    }
    if key == "timestep_s" || section(key) == "contact" {
        scene.remove("chosen_for_tolerance");
    }
    if let ("contact.model", Some(name)) = (key, value.as_str()) {
        let contact = scene.entry("contact").or_insert_with(|| Value::Table(Table::new()));
        if let Value::Table(contact) = contact {
            change_model(contact, name);
        }
    }
    if key == "tolerance" {
        scene.remove("timestep_s");
    }
    if ["tolerance", "timestep_s"].contains(&key) && scene.contains_key("drop") {
        // one that a saved scene has written out belongs to the step it had
        scene.remove("frame_interval_s");
    }
}

/// Removes from `scene` what it has of its object alone, as a saved scene has it written out: every field of the press
/// that has the value which it would have without being written, such as the object's place, and its name.
fn forget_object(scene: &mut Table) {
    let Some(object) = scene.get("press").and_then(|press| press.get("object")).cloned() else {
        return;
    };
    let mut alone: Table = [(
        "press".to_owned(),
        Value::Table([("object".to_owned(), object.clone())].into_iter().collect()),
    )]
    .into_iter()
    .collect();
    alone.extend(scene.get("skin").map(|skin| ("skin".to_owned(), skin.clone())));
    // of an object that does not exist nothing is known
    let Ok(config) = alone.try_into::<SceneConfig>() else {
        return;
    };
    let Ok(mechanics) = Mechanics::new(config.mechanics(), Path::new("")) else {
        return;
    };
    let Ok(own) = Table::try_from(mechanics.config().press.as_ref()) else {
        return;
    };
    if let Some(Value::Table(press)) = scene.get_mut("press") {
        press.retain(|key, value| key == "object" || own.get(key) != Some(value));
    }
    if scene.get("name") == Some(&object) {
        scene.remove("name");
    }
}
