//! The committed images are those of the committed sources.

use crate::build::{compiler, copy, make, sources};

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
        assert!(
            built == committed,
            "{file} is not what the sources give: run `make firmware`"
        );
    }
}
