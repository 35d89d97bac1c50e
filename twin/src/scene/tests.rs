//! Good scenes survive a round trip, bad ones end in an error that says what is wrong.

use super::{Assignment, Scene, SceneConfig};
use std::path::Path;

fn read(text: &str) -> Result<Scene, String> {
    Scene::from_toml(text, Path::new(".")).map_err(|e| e.to_string())
}

#[test]
fn round_trip() {
    for text in [
        "[drop]\nheight_m = 0.3",
        "seed = 3\n[press]\nobject = \"tape\"\nforce_n = 12.5",
        "transducer = \"velostat\"\n[transducer_parameters]\nexponent = 0.6\n[transducer_parameters.creep]\ninstant = 0.4\n[drop]",
        "transducer = \"linear\"\nreadout = \"ideal\"\nweights = \"firmware\"\n[contact]\nfriction = 0.2\n[drop]",
        "name = \"mine\"\n[[faults]]\nname = \"dead\"\ntaxel = 44\n[[faults]]\nname = \"drifting\"\ntaxel = 3\n[drop]",
    ] {
        let scene = read(text).unwrap();
        let again = read(&scene.to_toml().unwrap()).unwrap();
        assert_eq!(scene.config(), again.config());
        assert_eq!(scene.hash().unwrap(), again.hash().unwrap());
    }
}

#[test]
fn defaults_are_those_of_an_empty_section() {
    let empty = |text| read(text).unwrap().config().clone();
    assert_eq!(*Scene::press("T").unwrap().config(), empty("[press]\nobject = \"T\""));
    assert_eq!(*Scene::bounce().unwrap().config(), empty("[drop]"));
}

#[test]
fn the_hash_sees_every_change() {
    let base = Scene::press("T").unwrap().hash().unwrap();
    for text in [
        "seed = 1\n[press]\nobject = \"T\"",
        "weights = \"firmware\"\n[press]\nobject = \"T\"",
        "[press]\nobject = \"X\"",
        "[press]\nobject = \"T\"\nrow = 4.0",
        "[contact]\ndamping_s = 1e-3\n[press]\nobject = \"T\"",
        "[transducer_parameters]\nexponent = 0.6\n[press]\nobject = \"T\"",
        "[[faults]]\nname = \"dead\"\ntaxel = 44\n[press]\nobject = \"T\"",
    ] {
        assert_ne!(read(text).unwrap().hash().unwrap(), base, "{text}");
    }
}

/// The cases of a table: a line each, of the scene's lines with ` ; ` between them, and the facts in its error.
fn cases(table: &'static str) -> impl Iterator<Item = (String, Vec<&'static str>)> {
    table.lines().filter(|line| !line.is_empty()).map(|line| {
        let (scene, facts) = line.split_once(" | ").unwrap();
        (scene.replace(" ; ", "\n"), facts.split(" | ").collect())
    })
}

/// Every stage is checked when the scene is made, and the error names the field as the scene writes it.
#[test]
fn errors_name_the_field_of_every_stage() {
    const STAGES: &str = r#"
transducer = "foil" ; [drop] | `transducer` = "foil" | velostat
[transducer_parameters] ; spread_log_sd = -1.0 ; [drop] | `transducer_parameters.spread_log_sd` = -1 | is outside
transducer = "linear" ; [transducer_parameters] ; slope_s_per_pa = nan ; [drop] | `transducer_parameters.slope_s_per_pa` = NaN
[transducer_parameters] ; spred = 1.0 ; [drop] | `transducer_parameters` | spred
readout = "perfect" ; [drop] | `readout` = "perfect" | as_built
weights = "magic" ; [drop] | `weights` = "magic" | model, firmware
[[faults]] ; name = "dead" ; taxel = 1 ; [[faults]] ; name = "dead" ; taxel = 100 ; [drop] | `faults[1].taxel` = 100 | [0, 99]
[[faults]] ; name = "dead" ; taxel = 1 ; [[faults]] ; name = "lame" ; taxel = 2 ; [drop] | `faults[1].name` = "lame" | dead, stuck
"#;
    for (text, facts) in cases(STAGES) {
        let error = read(&text).unwrap_err();
        for fact in facts {
            assert!(error.contains(fact), "{text}: {error}");
        }
        assert_eq!(error.lines().count(), 1, "{error}");
    }
}

#[test]
fn errors_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let load = || Scene::load(&path).map(|s| s.name().to_owned()).map_err(|e| e.to_string());
    assert!(load().unwrap_err().contains("mine.toml: cannot be read"));
    for (text, facts) in [
        ("[drop]\nheight_m = 9.0", ["mine.toml", "drop.height_m"]),
        ("[drop]\nheigt_m = 0.5", ["mine.toml: line 2", "heigt_m"]),
        ("readout = \"gone.toml\"\n[drop]", ["mine.toml", "gone.toml"]),
        ("readout = \"own.toml\"\n[drop]", ["own.toml", "`readout.compressive.adc.bits` = 40"]),
    ] {
        let ideal = spts_circuit::PROFILES[0].1;
        let adc = "[compressive.adc]\nbits = 40\nreference_v = 3.3\ndivider = 1.0\noffset_v = 0.0";
        std::fs::write(folder.path().join("own.toml"), format!("{ideal}\n{adc}")).unwrap();
        std::fs::write(&path, text).unwrap();
        let error = load().unwrap_err();
        for fact in facts {
            assert!(error.contains(fact), "{text}: {error}");
        }
    }
    std::fs::write(folder.path().join("own.toml"), spts_circuit::PROFILES[0].1).unwrap();
    std::fs::write(&path, "readout = \"own.toml\"\n[drop]").unwrap();
    assert_eq!(load().unwrap(), "mine");
}

/// Where a file lies and what it is called does not change the scene.
#[test]
fn the_hash_does_not_know_the_names_of_files() {
    let folder = tempfile::tempdir().unwrap();
    let hash = |name: &str, text: &str| {
        std::fs::write(folder.path().join(name), text).unwrap();
        let config = SceneConfig { readout: Some(name.to_owned()), ..Scene::press("T").unwrap().config().clone() };
        Scene::new(config, folder.path()).unwrap().hash().unwrap()
    };
    let text = spts_circuit::PROFILES[0].1;
    assert_eq!(hash("a.toml", text), hash("b.toml", text));
    assert_ne!(hash("a.toml", text), hash("c.toml", &format!("{text}# another\n")));
}

/// Every way to say where the rows come from takes the place of the profile's, survives a saved scene, and is part of
/// the hash.
#[test]
fn rows_of_a_scene_take_the_place_of_the_profile_s() {
    use spts_circuit::{Mode, Patterns, Seeding, WeightMode, Weights};
    let folder = tempfile::tempdir().unwrap();
    let text: String = (0..16).map(|k| format!("{}\n", 1000 + 7 * k)).collect();
    std::fs::write(folder.path().join("own.txt"), &text).unwrap();
    let seeds: Vec<u32> = (0..16).map(|k| 1000 + 7 * k).collect();
    std::fs::write(folder.path().join("own.json"), format!("{seeds:?}")).unwrap();
    let (_, ideal) = spts_circuit::PROFILES[0];
    let of_profile = format!("seeds = {:?}\n{ideal}", [5; 16]);
    std::fs::write(folder.path().join("seeded.toml"), of_profile).unwrap();
    let scene = |rows: &str| {
        let text = format!(
            "readout = \"seeded.toml\"\n[skin]\nrows = 4\ncols = 4\n[rows]\n{rows}\n[press]\nobject = \"eraser\""
        );
        Scene::from_toml(&text, folder.path()).unwrap()
    };
    let weights = |scene: &Scene| scene.chain().profile().weights(Mode::Compressive, 16).unwrap();
    let listed = Weights::with_seeds(WeightMode::Binary, seeds.clone()).unwrap();
    let codes: Vec<u8> = (0..48).map(|k| if (k * k) % 7 < 3 { 255 } else { 0 }).collect();
    let patterns = Patterns::new(3, codes.clone()).unwrap();
    std::fs::write(folder.path().join("rows.txt"), patterns.to_text()).unwrap();
    let repeated = Weights::with_patterns(WeightMode::Binary, patterns).unwrap();
    let cases = [
        ("", Weights::with_seeds(WeightMode::Binary, vec![5; 16]).unwrap()),
        ("seeding = \"mixed\"", Weights::new(WeightMode::Binary, Seeding::Mixed, 16)),
        ("seeding = \"address\"", Weights::new(WeightMode::Binary, Seeding::Address, 16)),
        ("seeds_file = \"own.txt\"", listed.clone()),
        ("seeds_file = \"own.json\"", listed.clone()),
        (&format!("seeds = {seeds:?}"), listed),
        ("levels = \"analog\"", Weights::with_seeds(WeightMode::Analog, vec![5; 16]).unwrap()),
        ("kind = \"generator\"", Weights::with_seeds(WeightMode::Binary, vec![5; 16]).unwrap()),
        ("patterns_file = \"rows.txt\"", repeated.clone()),
        ("kind = \"pattern\"\npatterns_file = \"rows.txt\"", repeated.clone()),
        (&format!("kind = \"pattern\"\npatterns = {{ period = 3, codes = {codes:?} }}"), repeated),
    ];
    let mut hashes = Vec::new();
    for (rows, expected) in cases {
        let scene = scene(rows);
        assert_eq!(weights(&scene), expected, "{rows}");
        let again = Scene::from_toml(&scene.to_toml().unwrap(), folder.path()).unwrap();
        assert_eq!((weights(&again), again.hash().unwrap()), (expected, scene.hash().unwrap()));
        hashes.push(scene.hash().unwrap());
    }
    // all of them differ
    hashes.sort();
    assert!(hashes.windows(2).all(|pair| pair[0] != pair[1]), "{hashes:?}");
}

#[test]
fn wrong_rows_are_refused_with_file_and_field() {
    const ROWS: &str = r#"
seeding = "random" | random | `address` or `mixed`
seeds = [1, 2] | `rows.seeds`: number of seeds = 2 | 100, one for each taxel of 10 × 10
seeds = [-1] | line 2: `rows.seeds` = -1 | [0, 2^32)
seeds_file = "gone.txt" | rows.seeds_file | gone.txt
seeds_file = "few.txt" | few.txt: `rows.seeds_file`: number of seeds = 3 | 100
seeds_file = "bad.txt" | bad.txt: `rows.seeds_file`: line 2: seed = `4294967296` | [0, 4294967295]
seeding = "mixed" ; seeds_file = "few.txt" | only one of `rows.seeding` and `rows.seeds_file`
levels = "ternary" | ternary | `binary` or `analog`
kind = "random" | random | `generator` or `pattern`
kind = "pattern" | `rows.kind` = "pattern" | `rows.patterns_file`
kind = "generator" ; patterns_file = "signs.txt" | `rows.patterns_file` does not go with | "generator"
kind = "pattern" ; seeding = "mixed" | `rows.seeding` does not go with | "pattern"
patterns_file = "gone.txt" | rows.patterns_file | gone.txt
patterns_file = "signs.txt" | signs.txt: `rows.patterns_file`: number of taxels of a row = 3 | 100
patterns_file = "bad.txt" | bad.txt: `rows.patterns_file`: line 2: `4294967296` | [0, 255]
patterns = { period = 2, codes = [0, 255] } | `rows.patterns`: number of taxels of a row = 1 | 100
"#;
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("few.txt"), "1 2 3").unwrap();
    std::fs::write(folder.path().join("bad.txt"), "1\n4294967296").unwrap();
    std::fs::write(folder.path().join("signs.txt"), "+-+\n--+\n").unwrap();
    for (rows, facts) in cases(ROWS) {
        let text = format!("[rows]\n{rows}\n[drop]");
        let error = Scene::from_toml(&text, folder.path()).unwrap_err().to_string();
        for fact in facts {
            assert!(error.contains(fact), "{rows}: {error}");
        }
    }
}

/// A saved scene of which the object is changed is that of the new object at its own place and with its own surface;
/// what was chosen stays.
#[test]
fn another_object_has_its_own_place() {
    let saved = Scene::from_toml("[press]\nobject = \"eraser\"\nforce_n = 7.0", Path::new("")).unwrap();
    let mut table: toml::Table = toml::from_str(&saved.to_toml().unwrap()).unwrap();
    let assignment: Assignment = "press.object=rec".parse().unwrap();
    assignment.apply(&mut table).unwrap();
    let changed = Scene::new(SceneConfig::from_table(table).unwrap(), Path::new("")).unwrap();
    let fresh = Scene::from_toml("[press]\nobject = \"rec\"\nforce_n = 7.0", Path::new("")).unwrap();
    assert_eq!(changed.config(), fresh.config());
}
