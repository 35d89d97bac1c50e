//! Values that are out of range, wherever a user writes them: one line with file or option, field, value and range.

use crate::command::{SPTS, spts, words};
use std::path::Path;
use std::process::Command;

/// Expects one line of error with all of `facts`, status 2, and no folder of results.
#[track_caller]
fn refused(dir: &Path, arguments: &[&str], facts: &[&str]) {
    crate::command::refused(dir, arguments, facts);
    assert!(!dir.join("out").exists(), "{arguments:?} left a folder");
}

/// Every numeric option of every command: a command line, and what its error says.
const OPTIONS: &str = r#"
simulate press/T --threads 0 | `--threads` = 0 is outside the whole numbers in [1, 1024]
simulate press/T --threads -1 | `--threads` = -1 is outside the whole numbers in [1, 1024]
simulate press/T --presses 1e3 | `--presses` = 1e3 is outside the whole numbers in [1, 100000]
simulate press/T --presses 99999999999 | `--presses` = 99999999999 is outside the whole numbers in [1, 100000]
simulate press/T --cells 65 | `--cells` = 65 is outside the whole numbers in [1, 64]
simulate press --mesh a.obj --scale big | `--scale` = big is not a number
simulate press/T --row far | `--row` = far is not a number
simulate press/T --col 1,5 | `--col` = 1,5 is not a number
simulate press/T --force much | `--force` = much is not a number
simulate bounce --height high | `--height` = high is not a number
simulate press/T --rotation-deg 1rad | `--rotation-deg` = 1rad is not a number
simulate press/T --rotation-deg 361 | `press.rotation_deg` = 361 is outside [-360, 360]
simulate press/T --tilt-deg 3 | `--tilt-deg` = 3: two numbers with a comma between them are needed
simulate press/T --seed 9223372036854775809 | `--seed` = 9223372036854775809 is outside the whole numbers in [0, 2^63)
simulate press/T --seed -1 | `--seed` = -1 is outside the whole numbers in [0, 2^63)
simulate press/T --tolerance 1e-9 | `tolerance` = 1e-9 is outside [0.03, 1]
simulate press/T --timestep fast | `--timestep` = fast: a number of seconds or "auto" is needed
simulate press/T --contact footprint --timestep 1 | `timestep_s` = 1 is outside [1e-6, 2e-3] s
simulate press/T --fault dead:-1 | `--fault` = dead:-1: the name of a fault, a colon and a taxel are needed
decode d --measurements 0 | `--measurements` = 0 is outside the whole numbers in [1, 1000000]
decode d --windows 0 | `--windows` = 0 is outside the whole numbers in [1, 100000]
decode d --seed x | `--seed` = x is outside the whole numbers in [0, 2^63)
validate d --measurements 1001 | `--measurements` = 1001 is outside the whole numbers in [1, 1000]
score d --measurements 10001 | `--measurements` = 10001 is outside the whole numbers in [1, 10000]
score d --against b --tolerance 2 | `--tolerance` = 2 is outside [0, 1]
score d --against b --tolerance -0.1 | `--tolerance` = -0.1 is outside [0, 1]
score d --seed 18446744073709551615 | `--seed` = 18446744073709551615 is outside the whole numbers in [0, 2^63)
score d --quick | `--quick`: recordings have the presses they have
budget --measurements 0 | `--measurements` = 0 is outside the whole numbers in [1, 1000]
budget --taxels 99 | `--taxels` = 99 is outside the square numbers in [100, 1600]
circuit --taxels 0 | `--taxels` = 0 is outside the whole numbers in [1, 1000000000]
circuit --pressed 2 | `--pressed` = 2 is outside [0, 1]
circuit --pressed nan | `--pressed` = nan is outside [0, 1]
circuit --pressed-us -1 | `--pressed-us` = -1 is outside [0, 1e6] µS
circuit --idle-us -1 | `--idle-us` = -1 is outside [0, 1e6] µS
circuit --drive-v 0 | `--drive-v` = 0 is outside [1e-3, 1e3] V
circuit --feedback-ohm 0 | `--feedback-ohm` = 0 is outside [1e-9, 1e9] ohm
circuit --feedback-pf -1 | `--feedback-pf` = -1 is outside [0, 1e6]
circuit --bus-pf -1 | `--bus-pf` = -1 is outside [0, 1e6]
circuit --taxel-pf -1 | `--taxel-pf` = -1 is outside [0, 1e6]
circuit --rate-hz fast | `--rate-hz` = fast is not a number
circuit --sub-array 1 | `--sub-array` = 1 is outside the whole numbers in [2, 1000000]
design --area 0.1 --resolution 5mm --latency 5ms | `--area` = 0.1 is not WIDTHxHEIGHT with both in [0.001, 10] m
design --area 0.1x0.1 --resolution 2m --latency 5ms | `--resolution` = 2m is not a length in [0.1mm, 1m]
design --area 0.1x0.1 --resolution 5mm --latency -1 | `--latency` = -1 is not a time in [1us, 10s]
design --area 0.1x0.1 --resolution 5mm --latency 5ms --iou 1 | `--iou` = 1 is outside [0.01, 0.99]
design --area 0.1x0.1 --resolution 5mm --latency 5ms --wires 257 | `--wires` = 257 is outside the whole numbers in [1, 256]
design --area 0.1x0.1 --resolution 5mm --latency 5ms --seed -1 | `--seed` = -1 is outside
design check d --seed x | `--seed` = x is outside
explore --taxels 65 | `--taxels` = 65 is outside the square numbers in [64, 1000000]
explore --scenes 0 | `--scenes` = 0 is outside the whole numbers in [1, 1000]
explore --seed -1 | `--seed` = -1 is outside
fidelity --cells 25 | `--cells` = 25 is outside the whole numbers in [1, 24]
fidelity --seed 9223372036854775809 | `--seed` = 9223372036854775809 is outside
firmware verify --edges 0 | `--edges` = 0 is outside the whole numbers in [1, 1000000000]
firmware verify --cells 113 | `--cells` = 113 is outside the whole numbers in [1, 112]
firmware verify --cells 300 | `--cells` = 300 is outside the whole numbers in [1, 112]
firmware verify --edge-hz 0 | `--edge-hz` = 0 is outside [1, 1000000] Hz
firmware verify --sample-us late | `--sample-us` = late is not a number
firmware weights --out w.npy --edges 1000001 | `--edges` = 1000001 is outside the whole numbers in [1, 1000000]
firmware trace --taxel 112 | `--taxel` = 112 is outside the whole numbers in [0, 111]
firmware trace --from-reset 0 | `--from-reset` = 0 is outside the whole numbers in [1, 100000000]
phase --n 19 | `--n` = 19 is outside the whole numbers in [20, 2000]
phase --trials 0 | `--trials` = 0 is outside the whole numbers in [1, 100000]
seeds --taxels 5 | `--taxels` = 5 is outside the square numbers in [16, 1024]
seeds --rows 0 | `--rows` = 0 is outside the whole numbers in [1, 1000]
seeds --noise -1 | `--noise` = -1 is outside [0, 10]
seeds --budget -1 | `--budget` = -1 is outside the whole numbers in [0, 1000000]
seeds --windows 0 | `--windows` = 0 is outside the whole numbers in [1, 10000]
seeds --images 1 | `--images` = 1 is outside the whole numbers in [2, 100000]
reproduce --seed x | `--seed` = x is outside
compare d --seed x | `--seed` = x is outside
calibrate d --presses 3 | `--presses` = 3: 
"#;

#[test]
fn options_out_of_range() {
    let dir = tempfile::tempdir().unwrap();
    for line in OPTIONS.lines().filter(|line| !line.is_empty()) {
        let (command, fact) = line.split_once(" | ").unwrap();
        refused(dir.path(), &words(command), &[fact]);
    }
}

/// Other command lines that cannot be used are one line, too; help and version are what they were.
#[test]
fn command_lines_that_cannot_be_used() {
    let dir = tempfile::tempdir().unwrap();
    for (command, facts) in [
        ("simulate", &["required", "<SCENE>"][..]),
        ("simulate press/T --frce 3", &["--frce", "--force"]),
        ("simulat press/T", &["simulat", "simulate"]),
        ("score d --twin press/T", &["RECORDINGS", "--twin"]),
    ] {
        refused(dir.path(), &words(command), facts);
    }
    for command in ["--help", "simulate --help", "--version", "help"] {
        let output = spts(dir.path(), &words(command));
        assert!(output.status.success() && !output.stdout.is_empty(), "{command}");
    }
    let output = spts(dir.path(), &[]);
    assert!(
        String::from_utf8_lossy(&output.stderr).contains("Usage: "),
        "help without a command"
    );
}

/// Fields of a scene file: the file, the field in its section, the value, and what is valid.
const FIELDS: &[(&str, &str)] = &[
    (
        "[transducer_parameters]\ntemperature_c = 900",
        "`transducer_parameters.temperature_c` = 900 is outside [-45, 65]",
    ),
    (
        "[transducer_parameters]\ntemperature_c = \"hot\"",
        "`transducer_parameters.temperature_c` = \"hot\": a number is needed",
    ),
    (
        "[transducer_parameters.creep]\nstart_s = true",
        "`transducer_parameters.creep.start_s` = true: a number is needed",
    ),
    (
        "[[faults]]\nname = \"lame\"\ntaxel = 3",
        "`faults[0].name` = \"lame\" is not a fault; known: dead",
    ),
    (
        "[[faults]]\nname = \"dead\"\ntaxel = 100",
        "`faults[0].taxel` = 100 is outside [0, 99]",
    ),
    (
        "[[faults]]\nname = \"dead\"\ntaxel = -1",
        "`faults[0].taxel` = -1: a whole number in [0, 2^32) is needed",
    ),
    (
        "[[faults]]\nname = \"stuck\"\ntaxel = 1\nlevel = \"up\"",
        "`faults[0].level` = \"up\": a number is needed",
    ),
    (
        "weights = \"wood\"",
        "`weights` = \"wood\" is not a source of weights; known: model, firmware",
    ),
    (
        "readout = \"perfect\"",
        "`readout` = \"perfect\" is not a readout profile; known: ideal",
    ),
    (
        "transducer = \"foil\"",
        "`transducer` = \"foil\" is not a transducer; known: linear, velostat",
    ),
    ("skin.pitch_m = 1e308", "`skin.pitch_m` = 1e308 is outside [1e-6, 1] m"),
    ("skin.pitch_m = nan", "`skin.pitch_m` = NaN is outside [1e-6, 1] m"),
    (
        "skin.rows = 1.5",
        "`skin.rows` = 1.5: a whole number from 0 on is needed",
    ),
    ("skin = \"large\"", "`skin` = \"large\": a table is needed"),
    (
        "contact.cells_per_taxel = 1.5",
        "`contact.cells_per_taxel` = 1.5: a whole number from 0 on is needed",
    ),
    (
        "contact.friction = \"some\"",
        "`contact.friction` = \"some\": a number is needed",
    ),
    ("seed = -1", "`seed` = -1: a whole number from 0 on is needed"),
    ("rows.seeds = [-1]", "a whole number in [0, 2^32) is needed"),
    ("timestep_s = true", "`timestep_s` = true: "),
    (
        "chosen_for_tolerance = nan",
        "`chosen_for_tolerance` = NaN is outside (0, 1]",
    ),
    (
        "frame_interval_s = inf",
        "`frame_interval_s` = inf is outside [timestep_s, 0.1] s",
    ),
];

/// The same for fields of `[press]`.
const PRESS_FIELDS: &[(&str, &str)] = &[
    ("scale = nan", "`press.scale` = NaN is outside (0, 1000]"),
    (
        "scale = 2.0",
        "`press.scale` is for a mesh, and `press.object` = \"T\" has its own size",
    ),
    ("force_n = \"much\"", "`press.force_n` = \"much\": a number is needed"),
    (
        "presses = -1",
        "`press.presses` = -1: a whole number from 0 on is needed",
    ),
    (
        "position_m = [1.0]",
        "`press.position_m` = a list of 1: a list of 2 is needed",
    ),
    (
        "position_m = [9.0, 0.0]",
        "`press.position_m`: x = 9 is outside [-0.1425, 0.1425] m",
    ),
    (
        "position_m = [0.0, nan]",
        "`press.position_m`: y = NaN is outside [-0.1425, 0.1425] m",
    ),
    (
        "position_share = [0.0, 2.0]",
        "`press.position_share (y)` = 2 is outside [-1, 1]",
    ),
];

#[test]
fn fields_of_a_scene_file() {
    let dir = tempfile::tempdir().unwrap();
    let press = |field: &str| format!("[press]\nobject = \"T\"\n{field}\n");
    let fields = FIELDS
        .iter()
        .map(|(field, fact)| (format!("{field}\n{}", press("")), *fact));
    let of_press = PRESS_FIELDS.iter().map(|(field, fact)| (press(field), *fact));
    for (text, fact) in fields.chain(of_press) {
        std::fs::write(dir.path().join("mine.toml"), text).unwrap();
        refused(dir.path(), &["simulate", "mine.toml"], &["mine.toml: ", fact]);
    }
}

#[test]
fn fields_that_are_set() {
    let dir = tempfile::tempdir().unwrap();
    for (command, fact) in [
        (
            "--set faults.0.taxel=1",
            "`faults` is a list: `0` is the number of none of its entries (none yet); `faults.+` adds one",
        ),
        (
            "--set press.force_n=much",
            "`press.force_n` = \"much\": a number is needed",
        ),
        (
            "--set skin.rows=x",
            "`skin.rows` = \"x\": a whole number from 0 on is needed",
        ),
        (
            "--set transducer_parameters.temperature_c=x",
            "`transducer_parameters.temperature_c` = \"x\": a number is needed",
        ),
        // two ways to say one thing
        (
            "--set press.row=3 --set press.position_m=[0.01,0]",
            "press.position_m=[0.01,0]: `press.row=3` says the same in another way",
        ),
        (
            "--row 3 --set press.position_share=[0,0]",
            "press.position_share=[0,0]: `--row 3.0` says the same in another way",
        ),
        (
            "--tolerance 0.1 --set contact.model=layer",
            "contact.model=layer: `--tolerance 0.1` says the same in another way",
        ),
        (
            "--timestep 1e-4 --set tolerance=0.1",
            "tolerance=0.1: `--timestep 0.0001` says the same in another way",
        ),
        (
            "--set rows.seeds=[1] --set rows.seeding=mixed",
            "rows.seeding=mixed: `rows.seeds=[1]` says the same in another way",
        ),
    ] {
        refused(
            dir.path(),
            &[&["simulate", "press/T"][..], &words(command)].concat(),
            &[fact],
        );
    }
}

/// A field of a readout profile: its file too.
#[test]
fn fields_of_a_profile() {
    let dir = tempfile::tempdir().unwrap();
    let text = spts_circuit::PROFILES
        .iter()
        .find(|(name, _)| *name == "as_built")
        .unwrap()
        .1;
    for (from, to, fact) in [
        (
            "drive_v = ",
            "drive_v = \"high\" # ",
            "`readout.drive_v` = \"high\": a number is needed",
        ),
        ("bits = ", "bits = \"many\" # ", "bits` = \"many\": "),
        (
            "sample_rate_hz = ",
            "sample_rate_hz = -1 # ",
            "`readout.sample_rate_hz` = -1 is outside [1, 1e9]",
        ),
    ] {
        std::fs::write(dir.path().join("wire.toml"), text.replacen(from, to, 1)).unwrap();
        refused(
            dir.path(),
            &["simulate", "press/T", "--readout", "wire.toml"],
            &["wire.toml: ", fact],
        );
    }
}

/// Names with escape sequences: what is printed has none, wherever the name comes from.
#[test]
fn names_do_not_reach_the_terminal_as_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let escape = "a\u{1b}[31mb";
    let in_toml = "a\\u001b[31mb";
    let texts = [
        format!("[press]\nobject = \"{in_toml}\""),
        format!("contact.model = \"{in_toml}\"\n[press]\nobject = \"T\""),
        format!("name = \"{in_toml}\"\n[press]\nobject = \"T\""),
        format!("transducer = \"{in_toml}\"\n[press]\nobject = \"T\""),
        format!("readout = \"{in_toml}\"\n[press]\nobject = \"T\""),
        format!("[[faults]]\nname = \"{in_toml}\"\ntaxel = 1\n[press]\nobject = \"T\""),
        format!("\"{in_toml}\" = 1\n[press]\nobject = \"T\""),
    ];
    let quiet = |arguments: &[&str]| {
        let output = Command::new(SPTS)
            .args(arguments)
            .current_dir(dir.path())
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        let said = [output.stdout, output.stderr].concat();
        assert!(
            !said.contains(&0x1b),
            "{arguments:?}: {}",
            String::from_utf8_lossy(&said).escape_debug()
        );
        assert!(
            String::from_utf8_lossy(&said).contains("u{1b}"),
            "the name is not shown"
        );
    };
    for text in texts {
        std::fs::write(dir.path().join("mine.toml"), text).unwrap();
        quiet(&["simulate", "mine.toml"]);
    }
    for arguments in [
        ["simulate", escape],
        ["decode", escape],
        ["validate", escape],
        ["score", escape],
        ["calibrate", escape],
    ] {
        quiet(&arguments);
    }
    quiet(&["simulate", "press/T", "--set", &format!("press.{escape}=1")]);
    quiet(&["simulate", "press/T", "--fault", &format!("{escape}:1")]);
    quiet(&["simulate", "press/T", "--presses", escape]);
}
