//! `scripts/setup.sh` on libraries that are as they should be and that are not.

use crate::command::SPTS;
use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

const LIBRARY: &str = "libmujoco.so.3.17.0";

/// A copy of the project with the script and its library alone. Every system package counts as installed, and a
/// fetch ends as it does without a network.
struct Project(tempfile::TempDir);

impl Project {
    fn new() -> Self {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
        let project = Self(tempfile::tempdir().unwrap());
        for folder in ["scripts", "tools", "third_party/mujoco/lib"] {
            fs::create_dir_all(project.0.path().join(folder)).unwrap();
        }
        fs::copy(root.join("scripts/setup.sh"), project.0.path().join("scripts/setup.sh")).unwrap();
        fs::copy(root.join("third_party/mujoco/lib").join(LIBRARY), project.library()).unwrap();
        for (name, text) in [
            ("dpkg-query", "echo installed"),
            ("cargo", "exit 0"),
            ("python3", "[ \"$3\" = --version ] && exit 0; echo 'no network' >&2; exit 1"),
        ] {
            let tool = project.0.path().join("tools").join(name);
            fs::write(&tool, format!("#!/bin/sh\n{text}\n")).unwrap();
            fs::set_permissions(&tool, fs::Permissions::from_mode(0o755)).unwrap();
        }
        project
    }

    fn library(&self) -> PathBuf {
        self.0.path().join("third_party/mujoco/lib").join(LIBRARY)
    }

    fn set_up(&self) -> Output {
        let tools = format!("{}:{}", self.0.path().join("tools").display(), env!("PATH"));
        let mut script = Command::new(self.0.path().join("scripts/setup.sh"));
        script.env("PATH", tools).output().unwrap()
    }

    /// Set-up fails, and says so with the words.
    fn is_refused(&self, words: &[&str]) {
        let output = self.set_up();
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(!output.status.success(), "{said}");
        for word in [words, &["could not be fetched"]].concat() {
            assert!(said.contains(word), "{said}\nlacks {word:?}");
        }
    }
}

#[test]
fn a_library_with_the_right_bytes_is_kept() {
    let project = Project::new();
    let output = project.set_up();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("ready (MuJoCo 3.17.0)"));
}

#[test]
fn one_flipped_bit_is_found() {
    let project = Project::new();
    let mut bytes = fs::read(project.library()).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(project.library(), bytes).unwrap();
    project.is_refused(&[LIBRARY, "is not MuJoCo 3.17.0", "SHA-256"]);
}

#[test]
fn a_missing_library_is_fetched() {
    let project = Project::new();
    fs::remove_file(project.library()).unwrap();
    project.is_refused(&["is missing"]);
}

/// Runs a program that lies alone in a folder, with a MuJoCo that `SPTS_MUJOCO` names, or none.
fn alone(arguments: &[&str], mujoco: Option<&Path>) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let program = folder.path().join("spts");
    fs::copy(SPTS, &program).unwrap();
    let mut command = Command::new(program);
    command.args(arguments).current_dir(folder.path()).env_remove("SPTS_MUJOCO");
    if let Some(file) = mujoco {
        command.env("SPTS_MUJOCO", file);
    }
    command.output().unwrap()
}

/// Without MuJoCo a program starts and does all but scenes, of which it says in one line what they need.
#[test]
fn scenes_alone_need_mujoco() {
    let made = alone(&["dataset", "make", "random-shapes", "--rows", "20"], None);
    assert!(made.status.success(), "{}", String::from_utf8_lossy(&made.stderr));
    let folder = tempfile::tempdir().unwrap();
    let [text, missing] = ["text", "missing"].map(|name| folder.path().join(name));
    fs::write(&text, "no library").unwrap();
    // of the C library's files, one that is a library and has none of MuJoCo's functions
    let other = PathBuf::from("/lib/x86_64-linux-gnu/libm.so.6");
    let cases: [(Option<&Path>, &str); 4] = [
        (None, "it is not found"),
        (Some(&text), "cannot be opened"),
        (Some(&missing), "is no file"),
        (Some(&other), "is no MuJoCo"),
    ];
    let scenes: [&[&str]; 4] = [
        &["simulate", "press/T"],
        &["score", "--twin", "press/T", "--quick"],
        &["dataset", "make", "drops", "--rows", "20"],
        &["simulate", "press/T", "--tolerance", "0.1"],
    ];
    for (library, words) in cases {
        for arguments in scenes {
            let output = alone(arguments, library);
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(2), "{arguments:?} {said}");
            assert_eq!(said.lines().count(), 1, "{arguments:?} {said}");
            assert!(said.contains(words), "{arguments:?} {said}");
        }
    }
}
