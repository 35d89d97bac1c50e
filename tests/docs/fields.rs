//! The reference has every field. What fields there are the program says itself, when it is given one that it does not
//! know.

use super::folder;
use super::pages::root;
use spts::Scene;
use std::fs;

/// A field that nothing knows.
const UNKNOWN: &str = "no_such_field = 1";
/// Something to press, so that a scene is complete.
const PRESS: &str = "[press]\nobject = \"T\"";

/// The names that an error lists after "expected".
fn expected(error: &str) -> Vec<&str> {
    let (_, list) = error.split_once("expected ").unwrap_or_else(|| panic!("no list of fields: {error}"));
    let list = list.split(" (").next().unwrap_or_default();
    list.split('`').skip(1).step_by(2).collect()
}

/// The part of `page` under `heading`, up to the next heading of any depth.
fn under<'a>(page: &'a str, heading: &str) -> &'a str {
    let start = page.split_once(&format!("\n{heading}\n")).unwrap_or_else(|| panic!("`{heading}` is no heading")).1;
    start.split_once("\n#").map_or(start, |(part, _)| part)
}

/// Fields of `error` that no row of the table under `heading` begins with.
fn missing(page: &str, heading: &str, error: &str) -> Vec<String> {
    let rows: String =
        under(page, heading).lines().filter_map(|line| line.strip_prefix("| ")?.split(" | ").next()).collect();
    let known: Vec<&str> = rows.split('`').skip(1).step_by(2).collect();
    let fields = expected(error).into_iter().filter(|field| !known.contains(field));
    fields.map(|field| format!("{heading}: `{field}`")).collect()
}

fn page(name: &str) -> String {
    fs::read_to_string(root().join("docs").join(name)).expect("the page can be read")
}

fn scene_error(text: &str) -> String {
    let error = Scene::from_toml(text, folder().path()).expect_err("the field is not known");
    error.to_string()
}

#[test]
fn the_reference_has_every_field_of_a_scene() {
    let page = page("scenes.md");
    let parameters = |section: &str| format!("[transducer_parameters.{section}]\n{UNKNOWN}\n{PRESS}");
    let elastic = format!("{PRESS}\n[contact]\nmodel = \"layer\"\n{UNKNOWN}");
    let columns = format!("{PRESS}\n[contact]\n{UNKNOWN}");
    let linear = format!("transducer = \"linear\"\n{PRESS}\n[transducer_parameters]\n{UNKNOWN}");
    let sections = [
        ("## The top of the file", format!("{UNKNOWN}\n{PRESS}")),
        ("## `[press]`", format!("{PRESS}\n{UNKNOWN}")),
        ("## `[drop]`", format!("[drop]\n{UNKNOWN}")),
        ("## `[skin]`", format!("{PRESS}\n[skin]\n{UNKNOWN}")),
        ("## `[bend]`", format!("{PRESS}\n[bend]\n{UNKNOWN}")),
        ("## `[rows]`", format!("{PRESS}\n[rows]\n{UNKNOWN}")),
        ("### `winkler` and `footprint`", columns),
        ("### `layer` and `half_space`", elastic),
        ("### `linear`", linear),
        ("### `velostat`", format!("{PRESS}\n[transducer_parameters]\n{UNKNOWN}")),
        ("#### `hysteresis`", parameters("hysteresis")),
        ("#### `creep`", parameters("creep")),
        ("#### `conditioning`", parameters("conditioning")),
    ];
    let gaps: Vec<String> =
        sections.iter().flat_map(|(heading, text)| missing(&page, heading, &scene_error(text))).collect();
    assert!(gaps.is_empty(), "{gaps:#?}");
    let faults = under(&page, "## `[[faults]]`");
    for (name, _) in spts::circuit::FAULTS {
        assert!(faults.contains(&format!("| `{name}` |")), "fault `{name}`");
    }
}

/// The keys that the rows of the table under `heading` begin with. A cell "`pose.x_m`, `.y_m`" has two of them.
fn keys(page: &str, heading: &str) -> Vec<String> {
    let mut keys = Vec::new();
    for line in under(page, heading).lines() {
        let first = line.strip_prefix("| ").and_then(|row| row.split(" | ").next());
        let mut section = String::new();
        for name in first.unwrap_or_default().split('`').skip(1).step_by(2) {
            let key = if name.starts_with('.') { format!("{section}{name}") } else { name.to_owned() };
            if let Some((before, _)) = key.split_once('.') {
                before.clone_into(&mut section);
            }
            keys.push(key);
        }
    }
    keys
}

#[test]
fn the_reference_has_every_key_of_a_spec_and_no_other() {
    // `contact`, `transducer` and `weights` have the fields that a scene has for them
    const SECTIONS: [&str; 8] = ["split", "object", "pose", "press", "drop", "skin", "faults", "record"];
    let listed = keys(&page("datasets.md"), "### Keys of a spec");
    let folder = folder();
    let valid = |text: &str| -> Vec<String> {
        let spec = spts_dataset::Spec::from_toml(text, &toml::Table::new(), folder.path());
        let error = spec.expect_err("the key is not known").to_string();
        expected(&error).into_iter().map(str::to_owned).collect()
    };
    let mut known = valid(UNKNOWN);
    known.retain(|key| !SECTIONS.contains(&key.as_str()));
    for section in SECTIONS {
        let inner = valid(&format!("[{section}]\n{UNKNOWN}"));
        known.extend(inner.iter().map(|key| format!("{section}.{key}")));
    }
    let gaps: Vec<&String> = known.iter().filter(|key| !listed.contains(key)).collect();
    assert!(gaps.is_empty(), "not on the page: {gaps:#?}");
    let unknown: Vec<&String> = listed.iter().filter(|key| !known.contains(key)).collect();
    assert!(unknown.is_empty(), "on the page alone: {unknown:#?}");
}

#[test]
fn the_reference_has_every_field_of_a_profile() {
    let page = page("profiles.md");
    let folder = folder();
    let ideal = spts::circuit::PROFILES.iter().find(|(name, _)| *name == "ideal");
    let ideal = ideal.expect("it ships").1;
    let error = |text: String| {
        fs::write(folder.path().join("profile.toml"), text).expect("a file can be written");
        let scene = format!("readout = \"profile.toml\"\n{PRESS}");
        Scene::from_toml(&scene, folder.path()).expect_err("the field is not known").to_string()
    };
    let mut gaps = missing(&page, "## The top of the file", &error(format!("{UNKNOWN}\n{ideal}")));
    for (name, _) in spts::circuit::EFFECTS {
        let text = format!("{ideal}\n[compressive.{name}]\n{UNKNOWN}");
        gaps.extend(missing(&page, &format!("### `{name}`"), &error(text)));
    }
    let amplifier = "[compressive.amplifier]\nupdate_s = 8e-6\nsample_s = 13e-6";
    let parts = format!("{ideal}\n{amplifier}\n[compressive.amplifier.op_amp]\n{UNKNOWN}");
    gaps.extend(missing(&page, "#### `op_amp`", &error(parts)));
    assert!(gaps.is_empty(), "{gaps:#?}");
}
