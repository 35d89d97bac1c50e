//! Builds images from source, changed or not.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use spts_firmware::Image;
use tempfile::TempDir;

/// A text of one source file and what takes its place.
pub(crate) struct Substitution {
    pub(crate) file: &'static str,
    pub(crate) from: &'static str,
    pub(crate) to: &'static str,
}

/// Folder of sources and committed images.
pub(crate) fn sources() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("cell")
}

/// Version of the AVR compiler; `None`, said aloud, where it is not installed. A machine that checks changes (`CI` is
/// `true`) has to have it.
pub(crate) fn compiler() -> Option<String> {
    let output = Command::new("avr-gcc").arg("-dumpversion").output();
    match output {
        Ok(output) if output.status.success() => Some(String::from_utf8(output.stdout).unwrap().trim().to_owned()),
        _ => {
            assert!(
                std::env::var("CI").as_deref() != Ok("true"),
                "avr-gcc is not installed: run scripts/setup.sh"
            );
            eprintln!("NOT CHECKED: avr-gcc is not installed (scripts/setup.sh does)");
            None
        }
    }
}

/// Copy of the sources, with `change` made in the one place where its text stands.
pub(crate) fn copy(change: Option<&Substitution>) -> TempDir {
    let dir = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(sources()).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let is_source = name == "Makefile" || [".c", ".h", ".S"].iter().any(|end| name.ends_with(end));
        if is_source {
            let text = std::fs::read_to_string(&path).unwrap();
            let text = match change {
                Some(change) if change.file == name => substitute(&text, change),
                _ => text,
            };
            std::fs::write(dir.path().join(name), text).unwrap();
        }
    }
    dir
}

fn substitute(text: &str, change: &Substitution) -> String {
    let Substitution { file, from, to } = change;
    let places = text.matches(from).count();
    assert_eq!(places, 1, "{from:?} stands in {places} places of {file}");
    text.replace(from, to)
}

/// Makes `target` in `dir`.
pub(crate) fn make(dir: &Path, target: &str) {
    let output = Command::new("make")
        .args(["--silent", "--directory"])
        .arg(dir)
        .arg(target)
        // those of a `make test` around this one
        .env_remove("MAKEFLAGS")
        .env_remove("MAKELEVEL")
        .stdin(Stdio::null())
        .output()
        .unwrap();
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "make {target}: {errors}");
}

/// Image `name` of the changed sources.
pub(crate) fn changed(name: &str, change: &Substitution) -> Image {
    let dir = copy(Some(change));
    let hex = format!("./{name}.hex");
    make(dir.path(), &hex);
    Image::read(&dir.path().join(hex)).unwrap()
}
