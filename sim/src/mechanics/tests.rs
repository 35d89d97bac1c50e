//! Good scenes survive a round trip, bad ones end in an error that says what is wrong.

use super::{LONGEST_STEP_S, Mechanics, Timestep};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::path::Path;

fn read(text: &str) -> Result<Mechanics, Refusal> {
    Mechanics::from_toml(text, Path::new("."))
}

#[test]
fn round_trip() {
    let mut texts = vec!["[drop]\nheight_m = 0.3".to_owned()];
    for object in spts_contact::objects::OBJECTS {
        texts.push(format!("seed = 3\n[press]\nobject = \"{}\"\nforce_n = 12.5", object.name));
    }
    texts.push("[contact]\nfriction = 0.2\n[drop]".to_owned());
    for text in texts {
        let scene = read(&text).unwrap();
        let again = read(&scene.to_toml().unwrap()).unwrap();
        assert_eq!(scene, again);
    }
}

#[test]
fn defaults_are_those_of_an_empty_section() {
    assert_eq!(Mechanics::press("T").unwrap(), read("[press]\nobject = \"T\"").unwrap());
    assert_eq!(Mechanics::bounce().unwrap(), read("[drop]").unwrap());
}

/// The default course holds its force within frames 500–655 of the 1000 of a block, as recorded.
#[test]
fn plateau_of_the_default_course() {
    let [start_s, end_s] = super::PressConfig::default().plateau_s();
    assert!(0.78 < start_s && start_s + 0.15 < end_s && end_s < 1.02, "{start_s} {end_s}");
}

/// A bad scene a line, its own lines apart by ` ; `, and behind the arrow the words that its error has to have: the
/// field and the valid range. The last of a drop: 2 g on 1e9 Pa/m with 20 ms of damping have no step of a microsecond.
const BAD_SCENES: &str = r#"
 => [press] and [drop]
[press] ; object = "T" ; [drop] => [press] and [drop] | found 2
[press] => press.object | press.mesh
[press] ; object = "Q" => press.object | "Q" | tennis
[press] ; object = "T" ; force = 3.0 => unknown field `force` | force_n
typo = 1 ; [drop] => unknown field `typo`
[press] ; object = "T" ; force_n = -1.0 => press.force_n | -1 | [0.5, 100] N
[press] ; object = "T" ; force_n = nan => press.force_n | NaN
[press] ; object = "T" ; force_n = "x" => `press.force_n` = "x": a number is needed
[press] ; object = "T" ; presses = 0 => press.presses | [1, 100000]
[press] ; object = "T" ; lift_s = 0.5 => no plateau | `press.onset_s` = 0.35 | `press.onset_spread_s` = 0.015 |
    `press.rise_s` = 0.205 | from 0.786 s | `press.lift_s` = 0.5 | `press.lift_spread_s` = 0.04 | until 0.430 s
[press] ; object = "T" ; lift_s = 2.0 => press.lift_s | [0, duration_s]
[press] ; object = "T" ; lift_s = nan => press.lift_s | NaN
[press] ; object = "T" ; row = 40.0 => press.row | [-5, rows + 4]
[press] ; object = "T" ; row = -4.9 ; col = -4.9 => `press.force_n` = 20 | beside the skin
[contact] ; stiffness_pa_per_m = 1e4 ; [press] ; object = "brain" ; force_n = 100.0 ; stiffness_pa_per_m = 1e5 =>
    `press.force_n` = 100 | carries at most | 1.2500e2 N are needed
[press] ; object = "T" ; mass_kg = 0.0 => press.mass_kg | [1e-3, 4] kg
[press] ; mesh = "nowhere.obj" => press.mesh | nowhere.obj
[press] ; mesh = "nowhere.obj" ; scale = 0.0 => press.scale | (0, 1000]
[press] ; object = "T" ; scale = nan => `press.scale` = NaN | (0, 1000]
[press] ; object = "T" ; scale = 2.0 => press.scale | is for a mesh | "T"
chosen_for_tolerance = nan ; [drop] => `chosen_for_tolerance` = NaN | [0.03, 1]
seed = 9223372036854775809 ; [drop] => 9223372036854775809
skin.pitch_m = 1e308 ; [press] ; object = "T" => `skin.pitch_m` = 1e308 | [1e-6, 1] m
[press] ; object = "T" ; position_m = [0.0, 9.0] => `press.position_m (y)` = 9 is outside [-0.1425, 0.1425] m
[drop] ; position_m = [nan, 0.0] => `drop.position_m (x)` = NaN is outside [-0.075, 0.075] m
[drop] ; position_share = [0.0, 2] => `drop.position_share (y)` = 2  | [-0.5, 0.5]
[drop] ; height_m = -0.1 => drop.height_m | [0.001, 5] m
[drop] ; mass_kg = inf => drop.mass_kg | [1e-3, 50] kg
[drop] ; mass_kg = 10.0 ; height_m = 5.0 => `drop.mass_kg` = 10 | `drop.height_m` = 5 | absorbs at most |
    4.9033e2 J are needed
timestep_s = "auto" ; [contact] ; stiffness_pa_per_m = 1e9 ; damping_s = 0.02 ; [drop] ; mass_kg = 2e-3 ;
    height_m = 5.0 ; stiffness_pa_per_m = 1e12 => no valid `timestep_s` | 0.002 kg | allows at most | 1e-6 s |
    contact.damping_s
[drop] ; row = 12.0 => drop.row | [-0.5, rows - 0.5]
timestep_s = 0.0 ; [drop] => `timestep_s` = 0  | [1e-6, stable limit] s
timestep_s = "fast" ; [drop] => timestep_s | "fast" | "auto"
timestep_s = true ; [drop] => timestep_s | true | "auto"
timestep_s = -1e-4 ; [drop] => `timestep_s` = -0.0001  | [1e-6, stable limit] s
timestep_s = inf ; [drop] => `timestep_s` = inf  | [1e-6, stable limit] s
timestep_s = nan ; [drop] => `timestep_s` = NaN | [1e-6, stable limit] s
timestep_s = 4e-3 ; [drop] => `timestep_s` = 0.004  | [1e-6,
timestep_s = 1 ; contact = { model = "footprint" } ; [press] ; object = "T" => `timestep_s` = 1  | [1e-6, 2e-3] s
timestep_s = "auto" ; frame_interval_s = 0.0 ; [press] ; object = "T" => `frame_interval_s` = 0  |
    [timestep_s, 0.1] s for a press
timestep_s = "auto" ; frame_interval_s = nan ; [drop] => `frame_interval_s` = NaN  | [timestep_s, 2e-4] s for a drop
timestep_s = 5e-3 ; [press] ; object = "T" => `timestep_s` = 0.005  | [1e-6, 2.00e-3]
frame_interval_s = 1e-4 ; [press] ; object = "T" => `frame_interval_s` = 0.0001  |
    [timestep_s, 0.1] s for a press, [timestep_s, 2e-4] s for a drop
[contact] ; model = "hertz" ; [drop] => contact.model | "hertz" | "winkler"
[contact] ; stiffness_pa_per_m = 0.0 ; [drop] => contact.stiffness_pa_per_m | [1e4, 1e9] Pa/m
[contact] ; stiffness = 1.0 ; [drop] => unknown field `stiffness`
[contact] ; cells_per_taxel = 0 ; [drop] => contact.cells_per_taxel | [1, 64]
[skin] ; rows = 0 ; [drop] => rows
[skin] ; pitch_m = -1.0 ; [drop] => pitch_m
not toml => line 1: 
[contact] ; model = "footprint" ; [drop] =>
    "footprint" needs a force and cannot stop a ball: use [press] instead of [drop]
[press] ; object = "T" ; position_share = [0.0, nan] => `press.position_share (y)` = NaN is outside [-0.95, 0.95]
[press] ; object = "T" ; position_m = [0.0, 0.0] ; row = 3.0 => `press.position_m` and `press.position_share`; found 2
[drop] ; position_share = [0.6, 0.0] => `drop.position_share (x)` = 0.6 is outside [-0.5, 0.5]
[drop] ; position_m = [0.0, 0.2] => `drop.position_m (y)` = 0.2 | [-0.075, 0.075] m
[press] ; object = "T" ; places = [] => `press.places` = [] is empty
skin = { rows = 500, cols = 500 } ; contact.cells_per_taxel = 64 ; [drop] => cells_per_taxel | 2^24
skin = { pitch_m = 1e-4, electrode_m = 5e-5 } ; contact.cells_per_taxel = 1 ; [press] ; object = "rec" ; force_n = 100.0 =>
    press.force_n | carries at most
[drop] ; mass_kg = 50 => `drop.mass_kg` = 50 from `drop.height_m` = 0.5 | flattened by | radius of 33.4 mm
[drop] ; radius_m = 0.005 ; mass_kg = 0.3 => `drop.mass_kg` = 0.3 | flattened
tolerance = 0 ; [press] ; object = "T" => `tolerance` = 0 is outside [0.03, 1]
tolerance = nan ; [press] ; object = "T" => `tolerance` = NaN is outside [0.03, 1]
tolerance = 2 ; [press] ; object = "T" => `tolerance` = 2 is outside [0.03, 1]
tolerance = { iou = 0.9 } ; [press] ; object = "T" => `tolerance.iou` = 0.9 is outside [0.005, 0.5]
tolerance = { f1 = 0.1 } ; [press] ; object = "T" => tolerance | f1 | iou = number
tolerance = { iou = 0.1, class = 0.1 } ; [press] ; object = "T" => tolerance | iou = number
tolerance = "fine" ; [press] ; object = "T" => tolerance | fine | a number
tolerance = 0.03 ; [bend] ; [press] ; object = "X" => `tolerance` = 0.03 | a bent skin takes columns alone
tolerance = 0.1 ; timestep_s = 1e-4 ; [press] ; object = "T" => `tolerance` chooses | leave out `timestep_s`
tolerance = 0.1 ; contact = { model = "winkler" } ; [press] ; object = "T" => leave out `contact.model`
tolerance = 0.1 ; contact = { cells_per_taxel = 3 } ; [press] ; object = "T" => leave out `contact.cells_per_taxel`
[press] ; object = "T" ; places = [[1.0, 2.0]] ; row = 3.0 => gives the place of every press
"#;

#[test]
fn bad_scenes() {
    let lines = BAD_SCENES.replace("\n    ", " ");
    for line in lines.lines().filter(|line| !line.is_empty()) {
        let (text, words) = line.split_once("=> ").unwrap();
        let error = read(&text.replace(" ; ", "\n")).expect_err(text).to_string();
        for word in words.split(" | ") {
            assert!(error.contains(word), "{text}\n→ {error}\nlacks {word:?}");
        }
    }
}

/// `auto` is the time between frames over the smallest whole number that gives a stable step; what is saved is the
/// number, and it gives the same scene. A soft press takes the longest step there is, four times the default.
#[test]
fn auto_is_the_longest_stable_step_that_divides_the_time_between_frames() {
    let stiff =
        "[contact]\nstiffness_pa_per_m = 1e9\ndamping_s = 2e-3\n[drop]\nmass_kg = 0.02\nstiffness_pa_per_m = 1e12";
    let hard = "[contact]\nstiffness_pa_per_m = 1e9\n[press]\nobject = \"rec\"";
    let limit_of = |text: &str| read(&format!("timestep_s = \"auto\"\n{text}")).unwrap().step_limit_s();
    for (text, between_frames_s, limit_s) in [
        ("[press]\nobject = \"T\"", 2e-3, LONGEST_STEP_S),
        ("frame_interval_s = 5e-3\n[press]\nobject = \"T\"", 5e-3, LONGEST_STEP_S),
        ("frame_interval_s = 1e-4\n[press]\nobject = \"T\"", 1e-4, LONGEST_STEP_S),
        (hard, 2e-3, limit_of(hard)),
        ("[drop]", 1e-4, 1e-4),
        (stiff, 1e-4, limit_of(stiff)),
    ] {
        let scene = read(&format!("timestep_s = \"auto\"\n{text}")).unwrap();
        let parts = between_frames_s / scene.timestep_s();
        // a quotient of two rounded numbers
        assert!((parts - parts.round()).abs() < 1e-12 * parts, "{text}: {parts}");
        assert!(
            scene.timestep_s() <= limit_s && between_frames_s / (parts.round() - 1.0) > limit_s,
            "{text}: {} of {limit_s}",
            scene.timestep_s()
        );
        assert_eq!(scene.frame_interval_s().to_bits(), f64::to_bits(between_frames_s));
        assert_eq!(scene.config().timestep_s, Some(Timestep::Seconds(scene.timestep_s())));
        assert_eq!(read(&scene.to_toml().unwrap()).unwrap(), scene);
    }
    assert_eq!(read("timestep_s = \"auto\"\n[drop]").unwrap(), Mechanics::bounce().unwrap());
}

#[test]
fn timestep_from_text() {
    assert_eq!("auto".parse(), Ok(Timestep::Auto));
    assert_eq!("1e-4".parse(), Ok(Timestep::Seconds(1e-4)));
    for text in ["", "Auto", "1 ms", "fast"] {
        let error = text.parse::<Timestep>().unwrap_err();
        assert!(error.contains("\"auto\""), "{error}");
    }
}

/// A fast body meets the damped layer as if it were deeper by τ v: with τ v beyond the foam, the limit must fall with
/// the height of the drop even where the static curve hardly changes. A rigid 2 g ball at 0.44 m/s on K = 1e9 Pa/m with
/// τ = 20 ms was thrown back at four times its speed with the step that the static curve alone allows, 3.8 µs.
#[test]
fn limit_counts_the_damping_of_the_impact() {
    let at = |step: &str| {
        read(&format!(
            "timestep_s = {step}\n[contact]\nstiffness_pa_per_m = 1e9\ndamping_s = 0.02\n[drop]\nmass_kg = 2e-3\n\
             height_m = 0.01\nstiffness_pa_per_m = 1e12"
        ))
    };
    assert!(at("3.8e-6").is_err());
    // of a contact that no step resolves there is no scene either
    let limit_s = at("\"auto\"").map_or(0.0, |scene| scene.step_limit_s());
    assert!(limit_s < 1.9e-6, "{limit_s}");
}

/// A published object keeps its metres from the middle on any sheet, to the bit on the published one; metres and shares
/// of the sheet are the same place; and a saved scene has it as row and column.
#[test]
fn places_are_kept_in_metres() {
    let read = |text: &str| Mechanics::from_toml(text, std::path::Path::new("")).map_err(|e| e.to_string());
    let place_m = |text: &str| {
        let scene = read(text).unwrap();
        let press = scene.config().press.as_ref().unwrap();
        assert_eq!((press.position_m, press.position_share), (None, None));
        scene.skin().position_m(press.row.unwrap(), press.col.unwrap())
    };
    let skins =
        ["", "[skin]\nrows = 12\ncols = 20\npitch_m = 0.012\n", "[skin]\nrows = 32\ncols = 30\npitch_m = 0.005\n"];
    let published = spts_contact::objects::by_name("comb").unwrap().placement;
    let expected_m = SkinLayout::default().position_m(published.row, published.col);
    let press = "[press]\nobject = \"comb\"\n";
    let first = read(press).unwrap();
    let first = first.config().press.as_ref().unwrap();
    assert_eq!((first.row, first.col), (Some(published.row), Some(published.col)));
    // a few roundings of lengths of 0.3 m
    let same = |a: [f64; 2], b: [f64; 2]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
    for skin in skins {
        let found_m = place_m(&format!("{skin}{press}"));
        assert!(same(found_m, expected_m), "{skin}: {found_m:?}, expected {expected_m:?}");
        let found_m = place_m(&format!("{skin}{press}position_m = [0.02, -0.01]"));
        assert!(same(found_m, [0.02, -0.01]), "{skin}: {found_m:?}");
        let [width_m, height_m] = read(&format!("{skin}{press}")).unwrap().skin().extent_m();
        let found_m = place_m(&format!("{skin}{press}position_share = [-0.25, 0.1]"));
        assert!(same(found_m, [-0.25 * width_m, 0.1 * height_m]), "{skin}: {found_m:?}");
    }
}
