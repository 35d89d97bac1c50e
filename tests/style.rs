//! What keeps the sources readable: comments of a width that fits a screen, and examples in the documentation.

use std::path::{Path, PathBuf};

/// Largest width of a comment, columns; that of code is rustfmt's.
const WIDTH: usize = 120;
/// Every library crate that users build on, and the least number of examples in its documentation.
const EXAMPLES: [(&str, usize); 10] = [
    ("circuit", 25),
    ("contact", 25),
    ("dataset", 5),
    ("experiments/eval", 8),
    ("experiments/studies", 12),
    ("firmware", 6),
    ("models", 10),
    ("recon", 40),
    ("sim", 4),
    ("twin", 20),
];
/// Folders of what is built, fetched or made.
const NOT_SOURCES: [&str; 4] = ["target", "third_party", "out", "node_modules"];

/// The sources below `folder` whose names end in one of `endings`.
fn sources(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut files = Vec::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let entry = entry.unwrap();
            let name = entry.file_name().into_string().unwrap_or_default();
            if entry.file_type().unwrap().is_dir() {
                // hidden folders hold environments and version control
                if !name.starts_with('.') && !NOT_SOURCES.contains(&name.as_str()) {
                    folders.push(entry.path());
                }
            } else if endings.iter().any(|ending| name.ends_with(ending)) {
                files.push(entry.path());
            }
        }
    }
    files.sort();
    files
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

#[test]
fn comments_fit_into_their_width() {
    let mut files = sources(&root(), &[".rs", ".py", ".sh", ".js", ".css", "Makefile"]);
    files.extend(sources(&root().join(".github"), &[".yml"]));
    assert!(files.len() > 500, "{} sources", files.len());
    let mut wide = Vec::new();
    for file in files {
        let sign = match file.extension().and_then(|e| e.to_str()) {
            Some("rs" | "js") => "//",
            Some("css") => "/*",
            _ => "#",
        };
        let text = std::fs::read_to_string(&file).unwrap();
        for (number, line) in (1..).zip(text.lines()) {
            if line.trim_start().starts_with(sign) && line.chars().count() > WIDTH {
                wide.push(format!("{}:{number}", file.display()));
            }
        }
    }
    assert!(wide.is_empty(), "comments of more than {WIDTH} columns: {wide:#?}");
}

#[test]
fn the_main_crates_have_examples() {
    for (package, least) in EXAMPLES {
        let mut examples = 0;
        for file in sources(&root().join(package).join("src"), &[".rs"]) {
            let text = std::fs::read_to_string(file).unwrap();
            let fences = text.lines().map(str::trim_start).filter(|line| {
                let comment = line.strip_prefix("///").or_else(|| line.strip_prefix("//!"));
                comment.is_some_and(|comment| comment.trim_start().starts_with("```"))
            });
            examples += fences.count() / 2;
        }
        assert!(examples >= least, "{package}: {examples} examples, {least} are expected");
    }
}
