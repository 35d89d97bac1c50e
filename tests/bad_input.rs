//! Bad input ends in one line that names file, field, value and range, with status 2, and damages nothing.

use crate::command::{SPTS, files, spts, succeeds};
use std::path::Path;
use std::process::{Command, Output};

/// Status of every refusal.
const REFUSED: i32 = 2;

/// Expects one error line with every one of `facts` in it.
#[track_caller]
fn assert_refused(output: &Output, facts: &[&str]) {
    let said = String::from_utf8_lossy(&output.stderr);
    // a note of an earlier run may come first
    let said: String = said
        .lines()
        .filter(|line| !line.starts_with("note: "))
        .collect::<Vec<_>>()
        .join("\n");
    assert_eq!(output.status.code(), Some(REFUSED), "status of: {said}");
    assert_eq!(said.lines().count(), 1, "more than one line: {said}");
    assert!(said.starts_with("error: "), "{said}");
    for fact in facts {
        assert!(said.contains(fact), "`{fact}` is not in: {said}");
    }
    assert!(output.stdout.is_empty(), "something was printed all the same");
}

/// Simulates what is not valid, and expects nothing to be written.
#[track_caller]
fn refused(dir: &Path, arguments: &[&str], facts: &[&str]) {
    let arguments = [&["simulate"], arguments].concat();
    assert_refused(&spts(dir, &arguments), facts);
    assert!(!dir.join("out").exists(), "a refused scene left a folder");
}

/// One scene for every way into an error; what each field refuses is tested where the field is.
#[test]
fn scenes_that_are_not_valid() {
    let dir = tempfile::tempdir().unwrap();
    let press = "[press]\nobject = \"T\"\n";
    for (text, facts) in [
        ("sed = 3\n".to_owned() + press, &["line 1", "sed", "seed"][..]),
        (press.to_owned() + "forec_n = 3.0", &["line 3", "forec_n", "force_n"]),
        (
            press.to_owned() + "force_n = -3.0",
            &["press.force_n", "-3", "[0.5, 100] N"],
        ),
        (press.to_owned() + "force_n = \"much\"", &["line 3", "force_n", "much"]),
        (press.to_owned() + "[contact]\nstifness = 1e7", &["stifness"]),
        ("seed = -1\n".to_owned() + press, &["line 1", "seed", "-1"]),
        ("transducer = \"foil\"\n".to_owned() + press, &["foil", "velostat"]),
        ("readout = \"perfect\"\n".to_owned() + press, &["perfect", "as_built"]),
        (
            "readout = \"gone.toml\"\n".to_owned() + press,
            &["gone.toml", "No such file"],
        ),
        ("[press\n".to_owned(), &["line 1"]),
    ] {
        std::fs::write(dir.path().join("mine.toml"), &text).unwrap();
        let output = spts(dir.path(), &["simulate", "mine.toml"]);
        assert_refused(&output, facts);
        let said = String::from_utf8_lossy(&output.stderr);
        // the two that are known by name are checked after the scene, but they are in it too
        assert!(
            said.contains(".toml") || text.starts_with("transducer") || text.starts_with("readout"),
            "the file is not named: {said}"
        );
        assert!(
            !dir.path().join("out").exists(),
            "a refused scene left a folder: {text}"
        );
    }
    std::fs::write(dir.path().join("mine.toml"), [0xff, 0xfe, 0x00]).unwrap();
    refused(dir.path(), &["mine.toml"], &["mine.toml", "utf-8"]);
    refused(dir.path(), &["none.toml"], &["none.toml", "No such file"]);
    refused(dir.path(), &["."], &["SCENE", "press/NAME"]);
}

#[test]
fn options_that_are_not_valid() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    refused(here, &["press/anvil"], &["press.object", "anvil", "tape"]);
    refused(here, &["press"], &["press/NAME", "bounce"]);
    refused(here, &["push/T"], &["push/T", "press/NAME"]);
    refused(here, &["press/T", "--force", "-5"], &["force_n", "-5", "[0.5, 100] N"]);
    refused(
        here,
        &["press/T", "--force", "NaN"],
        &["force_n", "NaN", "[0.5, 100] N"],
    );
    refused(here, &["press/T", "--row", "99"], &["press.row", "99", "rows + 4"]);
    refused(here, &["press/T", "--presses", "0"], &["presses", "0", "[1, 100000]"]);
    let large =
        "press/T --cells 1 --set skin.rows=1000 --set skin.cols=1000 --set skin.pitch_m=0.001 --set rows.seeding=mixed";
    refused(
        here,
        &large.split(' ').collect::<Vec<_>>(),
        &["presses × frames × taxels"],
    );
    refused(here, &["press/T", "--height", "1"], &["--height", "1", "only a ball"]);
    refused(
        here,
        &["bounce", "--height", "1e9"],
        &["drop.height_m", "1000000000", "[0.001, 5] m"],
    );
    refused(here, &["bounce", "--force", "5"], &["--force", "5"]);
    refused(here, &["press/T", "--mesh", "a.obj"], &["--mesh", "press/T"]);
    refused(here, &["press/T", "--transducer", "foil"], &["foil", "velostat"]);
    refused(
        here,
        &["press/T", "--readout", "gone.toml"],
        &["gone.toml", "No such file"],
    );
}

#[test]
fn faults_that_cannot_be() {
    let dir = tempfile::tempdir().unwrap();
    for (fault, facts) in [
        (
            "lame:3",
            &["`faults[0].name` = \"lame\"", "dead, stuck, mis_seeded"][..],
        ),
        ("dead:100", &["`faults[0].taxel` = 100", "[0, 99]", "fault `dead`"]),
    ] {
        refused(dir.path(), &["press/T", "--fault", fault], facts);
    }
    let text = "[[faults]]\nname = \"stuck\"\ntaxel = 3\nlevel = 2.0\n[press]\nobject = \"T\"\n";
    std::fs::write(dir.path().join("stuck.toml"), text).unwrap();
    refused(
        dir.path(),
        &["stuck.toml"],
        &["`faults[0].level` = 2", "[−1, 1]", "fault `stuck` of taxel 3"],
    );
}

#[test]
fn readout_profiles_that_are_not_valid() {
    let dir = tempfile::tempdir().unwrap();
    let ideal = spts_circuit::PROFILES
        .iter()
        .find(|(name, _)| *name == "ideal")
        .unwrap()
        .1;
    for (text, facts) in [
        (
            ideal.to_owned() + "\n[raster]\nmagic = {}\n",
            &["wire.toml", "magic"][..],
        ),
        (
            ideal.replace("drive_v = ", "drive_v = -"),
            &["wire.toml", "drive_v", "-4.3", "[1e-3, 1e3]"],
        ),
        (
            ideal.replace("sample_rate_hz = ", "sample_rate_hz = 1e9 # "),
            &["presses × measurements"],
        ),
        ("weights = \"binary\"\n".to_owned(), &["wire.toml", "sample_rate_hz"]),
    ] {
        std::fs::write(dir.path().join("wire.toml"), &text).unwrap();
        refused(dir.path(), &["press/T", "--readout", "wire.toml"], facts);
    }
}

/// A tetrahedron of edge about 30 mm; the files below are this one, damaged.
const TETRAHEDRON: &str = "v 0 0 0\nv 0.03 0 0\nv 0 0.03 0\nv 0 0 0.03\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

#[test]
fn meshes_that_are_not_usable() {
    let dir = tempfile::tempdir().unwrap();
    for (name, content, facts) in [
        (
            "nan.obj",
            TETRAHEDRON.replace("v 0 0 0.03", "v 0 0 nan"),
            &["vertex 3", "z = NaN"][..],
        ),
        (
            "far.obj",
            TETRAHEDRON.replace("0.03", "30"),
            &["30", "[0.001, 2] m", "scale = 0.001"],
        ),
        (
            "open.obj",
            // the underside is missing; the face with one vertex on top would be closed above it
            TETRAHEDRON.replace("f 1 3 2\n", ""),
            &["not closed", "3 of 6", "at (", "downward"],
        ),
        ("text.glb", "not a GLB".to_owned(), &["malformed"]),
        ("short.stl", "not an STL".to_owned(), &["malformed", "10 bytes"]),
        ("solid.step", "ISO-10303-21;".to_owned(), &["step", "obj, glb, stl"]),
    ] {
        std::fs::write(dir.path().join(name), content).unwrap();
        refused(dir.path(), &["press", "--mesh", name], &[&[name], facts].concat());
    }
    refused(
        dir.path(),
        &["press", "--mesh", "none.obj"],
        &["none.obj", "No such file"],
    );
    std::fs::write(dir.path().join("good.obj"), TETRAHEDRON).unwrap();
    for scale in ["0", "-1", "nan", "inf"] {
        refused(
            dir.path(),
            &["press", "--mesh", "good.obj", "--scale", scale],
            &["scale", "(0, "],
        );
    }
    // the same mesh inside out is turned, with a note
    let turned = TETRAHEDRON.replace("f 1 3 2", "f 1 2 3").replace("f 1 2 4", "f 1 4 2");
    let turned = turned.replace("f 1 4 3", "f 1 3 4").replace("f 2 3 4", "f 2 4 3");
    std::fs::write(dir.path().join("turned.obj"), turned).unwrap();
    let output = succeeds(
        dir.path(),
        &["simulate", "press", "--mesh", "turned.obj", "--force", "2"],
    );
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.starts_with("note: ") && said.contains("inside out"), "{said}");
}

/// Each repair has its line, and the summary has them in numbers.
#[test]
fn meshes_that_are_mended_say_so() {
    let dir = tempfile::tempdir().unwrap();
    // a corner given twice, a triangle given twice, one turned over, the top open, in millimetres, beside its origin
    let damaged = TETRAHEDRON
        .replace("0.03", "30")
        .replace("v 0 ", "v 10 ")
        .replace("v 30 ", "v 40 ")
        .replace("f 1 4 3", "f 1 3 4")
        .replace("f 2 3 4", "v 40 0 0\nf 5 2 1\nf 1 3 5");
    std::fs::write(dir.path().join("cup.obj"), damaged).unwrap();
    let output = succeeds(
        dir.path(),
        &[
            "simulate", "press", "--mesh", "cup.obj", "--scale", "0.001", "--force", "2",
        ],
    );
    let said = String::from_utf8(output.stderr).unwrap();
    for fact in [
        "1 vertex of the mesh coincided",
        "without area was dropped",
        "1 triangle of the mesh was there before",
        "1 triangle of the mesh was turned",
        "opens upward and was closed",
        "(25.0, 15.0) mm",
    ] {
        assert!(
            said.lines().any(|l| l.starts_with("note: ") && l.contains(fact)),
            "`{fact}` is not in: {said}"
        );
    }
    let summary = std::fs::read_to_string(dir.path().join("out/cup/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    for (key, count) in [
        ("joined_vertices", 1),
        ("duplicate_triangles", 1),
        ("turned_triangles", 1),
        ("dropped_triangles", 1),
        ("lids", 1),
    ] {
        assert_eq!(summary["mesh"][key], count, "{key}");
    }
    assert!(summary["mesh"]["decimation_error_m"].is_null());
}

#[test]
fn recordings_that_are_not_usable() {
    // a MATLAB v5 header, and a matrix that claims 1000 bytes and has 16
    let mut truncated = b"MATLAB 5.0 MAT-file".to_vec();
    truncated.resize(124, b' ');
    truncated.extend([0x00, 0x01, b'I', b'M', 14, 0, 0, 0, 0xe8, 3, 0, 0]);
    truncated.extend([0; 16]);
    let mut hdf5 = b"MATLAB 7.3 MAT-file".to_vec();
    hdf5.resize(512, b' ');
    hdf5.extend(b"\x89HDF\r\n\x1a\n");
    for content in [Vec::new(), truncated, hdf5, b"a,b\n1,2\n".to_vec()] {
        let dir = tempfile::tempdir().unwrap();
        let folder = dir.path().join("presses/T");
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("T_raster.mat"), &content).unwrap();
        assert_refused(&spts(dir.path(), &["validate", "."]), &["T_raster.mat"]);
    }
    let dir = tempfile::tempdir().unwrap();
    assert_refused(&spts(dir.path(), &["validate", "nowhere"]), &["nowhere"]);
    assert_refused(&spts(dir.path(), &["validate", "."]), &["no recordings found"]);
}

#[test]
fn an_output_that_cannot_be_a_folder() {
    let dir = tempfile::tempdir().unwrap();
    let (file, below) = (dir.path().join("file"), dir.path().join("file/below"));
    std::fs::write(&file, "precious").unwrap();
    for out in [&file, &below] {
        let output = spts(dir.path(), &["simulate", "press/T", "--out", out.to_str().unwrap()]);
        assert_refused(&output, &["file", "is a file"]);
    }
    assert_eq!(std::fs::read(&file).unwrap(), b"precious");
    std::fs::create_dir_all(dir.path().join("results/frames.csv")).unwrap();
    let before = files(dir.path());
    let output = spts(dir.path(), &["simulate", "press/T", "--out", "results"]);
    assert_refused(&output, &["results/frames.csv", "not a regular file"]);
    assert_eq!(files(dir.path()), before, "something was written all the same");
}

/// A limit on the size of files makes writes fail half-way, as a full disk does, without any privilege.
#[cfg(unix)]
#[test]
fn a_write_that_fails_half_way_damages_nothing() {
    let dir = tempfile::tempdir().unwrap();
    succeeds(dir.path(), &["simulate", "press/T", "--out", "results"]);
    let before = files(dir.path());
    for blocks in ["1", "64", "800"] {
        let output = Command::new("sh")
            .args([
                "-c",
                "trap '' XFSZ; ulimit -f $1; exec \"$0\" simulate press/X --out results",
            ])
            .args([SPTS, blocks])
            .current_dir(dir.path())
            .output()
            .unwrap();
        assert_refused(&output, &["results/", "cannot be written", "File too large"]);
        assert!(files(dir.path()) == before, "damaged with a limit of {blocks} blocks");
    }
}

/// A disk that is really full, where a file system may be mounted.
#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_named_and_nothing_half_written_stays() {
    const CANNOT_MOUNT: i32 = 77;
    let dir = tempfile::tempdir().unwrap();
    let script = "mount -t tmpfs -o size=256k none \"$1\" || exit 77; \"$0\" simulate press/T --out \"$1/o\"; s=$?; \
                  if [ -e \"$1/o\" ]; then ls -A \"$1\"; fi; exit $s";
    let started = Command::new("unshare")
        .args(["-rm", "sh", "-c", script, SPTS])
        .arg(dir.path())
        .output();
    let output = match started {
        Ok(output) if output.status.code() == Some(REFUSED) => output,
        Ok(output) if output.status.success() => panic!("a full disk went unnoticed"),
        Ok(output) if output.status.code() != Some(CANNOT_MOUNT) && !output.stdout.is_empty() => {
            panic!("{}", String::from_utf8_lossy(&output.stderr))
        }
        _ => {
            eprintln!("skipped: no file system can be mounted here");
            return;
        }
    };
    assert_refused(&output, &["cannot be written", "No space left"]);
}

/// A reader that goes away is no error and no panic.
#[cfg(unix)]
#[test]
fn a_closed_pipe_is_not_an_error() {
    let dir = tempfile::tempdir().unwrap();
    for arguments in ["simulate press/T --json", "simulate press/X", "simulate --help"] {
        let script = format!("{{ \"$0\" {arguments} 2>said; echo $? >status; }} | true");
        let run = Command::new("sh")
            .args(["-c", &script, SPTS])
            .current_dir(dir.path())
            .status();
        assert!(run.unwrap().success());
        let read = |name: &str| std::fs::read_to_string(dir.path().join(name)).unwrap();
        assert_eq!((read("status").trim(), read("said").as_str()), ("0", ""), "{arguments}");
    }
}
