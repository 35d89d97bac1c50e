//! Builds images from source, changed or not; the committed images are those of the committed sources.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use spts_firmware::Image;
use tempfile::TempDir;

/// A text of one source file and what takes its place.
pub(crate) struct Substitution {
    file: &'static str,
    from: String,
    to: String,
}

impl Substitution {
    /// In `file`, `to` in place of `from`, with ⏎ for line ends.
    pub(crate) fn new(file: &'static str, from: &str, to: &str) -> Self {
        let [from, to] = [from, to].map(|text| text.replace('⏎', "\n"));
        Self { file, from, to }
    }
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
            assert!(std::env::var("CI").as_deref() != Ok("true"), "avr-gcc is not installed: run scripts/setup.sh");
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
    let places = text.matches(from.as_str()).count();
    assert_eq!(places, 1, "{from:?} stands in {places} places of {file}");
    text.replace(from.as_str(), to)
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

const FILES: [&str; 3] = ["cell.hex", "cell_plain.hex", "SHA256SUMS"];

/// Version whose output is committed, from the Makefile: another one may place the same code differently.
fn pinned() -> String {
    let makefile = std::fs::read_to_string(sources().join("Makefile")).unwrap();
    let line = makefile.lines().find_map(|line| line.strip_prefix("COMPILER := "));
    line.expect("the Makefile names the compiler").to_owned()
}

#[test]
fn the_committed_images_are_built_from_the_sources_byte_for_byte() {
    let Some(version) = compiler() else { return };
    let dir = copy(None);
    make(dir.path(), "all");
    if version != pinned() {
        let ci = std::env::var("CI").as_deref() == Ok("true");
        let message = format!("the images are those of avr-gcc {}, this is {version}", pinned());
        assert!(!ci, "{message}");
        eprintln!("NOT CHECKED: {message}");
        return;
    }
    for file in FILES {
        let built = std::fs::read(dir.path().join(file)).unwrap();
        let committed = std::fs::read(sources().join(file)).unwrap();
        assert!(built == committed, "{file} is not what the sources give: run `make firmware`");
    }
}
