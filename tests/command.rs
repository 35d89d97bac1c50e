//! Starting the command line.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// The `spts` of this build.
pub(crate) const SPTS: &str = env!("CARGO_BIN_EXE_spts-under-test");

/// The words of `text`: arguments without spaces, file names.
pub(crate) fn words(text: &str) -> Vec<&str> {
    text.split_whitespace().collect()
}

/// Runs `spts` with `arguments` in the folder `dir`.
pub(crate) fn spts(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(SPTS).args(arguments).current_dir(dir).output().expect("spts can be started")
}

/// Runs `spts` and expects it to succeed.
pub(crate) fn succeeds(dir: &Path, arguments: &[&str]) -> Output {
    let output = spts(dir, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    output
}

/// What `spts` prints as JSON.
pub(crate) fn json(dir: &Path, arguments: &[&str]) -> serde_json::Value {
    serde_json::from_slice(&succeeds(dir, arguments).stdout).expect("it is JSON")
}

/// Sessions of a T and a comb on a simulated skin, `presses` each, in `dir/all`. Of 16 presses ten are scored, and the
/// others are learned from.
pub(crate) fn sessions(dir: &Path, presses: usize) -> PathBuf {
    for object in ["T", "comb"] {
        let scene = format!("simulate press/{object} --contact footprint --presses {presses} --out all/{object}");
        succeeds(dir, &words(&scene));
    }
    dir.join("all")
}

/// Runs `spts` and expects status 2 and one line with all of `facts` in it.
#[track_caller]
pub(crate) fn refused(dir: &Path, arguments: &[&str], facts: &[&str]) {
    let output = spts(dir, arguments);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {said}");
    assert_eq!(said.lines().count(), 1, "{arguments:?}: {said}");
    assert!(said.starts_with("error: "), "{arguments:?}: {said}");
    for fact in facts {
        assert!(said.contains(fact), "{arguments:?}: `{fact}` is not in: {said}");
    }
}

/// Every file and folder below `dir`, by its path from there; a folder's name ends in a slash.
pub(crate) fn files(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(dir).expect("the folder can be listed") {
        let entry = entry.expect("the folder can be listed");
        let name = entry.file_name().into_string().expect("every name is plain text");
        if entry.path().is_dir() {
            let below = files(&entry.path());
            found.extend(below.into_iter().map(|(path, bytes)| (format!("{name}/{path}"), bytes)));
            found.insert(name + "/", Vec::new());
        } else {
            found.insert(name, std::fs::read(entry.path()).expect("the file can be read"));
        }
    }
    found
}
