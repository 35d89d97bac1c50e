//! The documentation says what the program takes: every command line and TOML block of README.md and of the book is
//! parsed, the reference of scenes, profiles and specs has every field, and every command has examples and help.

mod fields;
mod help;
mod pages;

use pages::{Block, blocks, inline_code, pages, root};
use spts::Scene;
use spts_cli::{Cli, refusal};
use std::ffi::OsString;
use std::fs;
use std::path::Path;

/// Commands that a shell separates with these words.
const SEPARATORS: [&str; 8] = ["&&", "||", "|", ";", ">", "2>", "<", "&"];

/// The `spts` commands of one line of a shell, as their words.
fn commands(line: &str) -> Vec<Vec<String>> {
    let words = shlex::split(line).unwrap_or_else(|| panic!("quotes that are not closed: {line}"));
    words
        .split(|word| SEPARATORS.contains(&word.as_str()))
        .filter(|words| words.first().is_some_and(|word| word == "spts" || word.ends_with("/spts")))
        .map(<[String]>::to_vec)
        .collect()
}

/// What the program says of a command line that it does not take.
fn refused(words: &[String]) -> Option<String> {
    Cli::from_arguments(words.iter().map(OsString::from)).err().and_then(|error| refusal(&error))
}

/// Lines of a shell block, those that go on with a backslash joined.
fn lines(block: &Block) -> Vec<String> {
    let joined = block.text.replace("\\\n", " ");
    joined.lines().map(str::to_owned).collect()
}

#[test]
fn every_command_of_a_block_is_one_that_the_program_takes() {
    let mut seen = 0;
    for page in pages() {
        for block in blocks(&page).iter().filter(|block| block.language == "sh") {
            for words in lines(block).iter().flat_map(|line| commands(line)) {
                if let Some(reason) = refused(&words) {
                    panic!("{}:{}: {words:?}: {reason}", page.display(), block.line);
                }
                seen += 1;
            }
        }
    }
    assert!(seen > 60, "{seen} commands");
}

/// Inline code may leave out what a command needs, but has no option that the program does not know.
#[test]
fn every_command_within_a_sentence_is_one_that_the_program_takes() {
    const LEFT_OUT: [&str; 3] =
        ["required arguments were not provided", "requires a subcommand", "a value is required for"];
    let mut seen = 0;
    for page in pages() {
        for code in inline_code(&page) {
            if code.contains('…') {
                continue;
            }
            for words in commands(&code) {
                let reason = refused(&words).filter(|reason| !LEFT_OUT.iter().any(|part| reason.contains(part)));
                assert_eq!(reason, None, "{}: {code}", page.display());
                seen += 1;
            }
        }
    }
    assert!(seen > 40, "{seen} commands");
}

/// A folder with the files that blocks name.
fn folder() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a temporary folder can be made");
    let cube: String =
        (0..8).map(|i| format!("v {} {} {}\n", 20 * (i & 1), 20 * (i >> 1 & 1), 20 * (i >> 2))).collect();
    let faces = "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    let row = "+-".repeat(50);
    for (name, text) in [("cup.obj", cube + faces), ("rows.txt", format!("{row}\n{row}\n"))] {
        fs::write(folder.path().join(name), text).expect("a file can be written");
    }
    folder
}

/// Error of a block of TOML, as what its mark says that it is.
fn toml_error(block: &Block, folder: &Path) -> Option<String> {
    let profile = |text: &str| {
        fs::write(folder.join("profile.toml"), text).expect("a file can be written");
        let scene = "readout = \"profile.toml\"\n[press]\nobject = \"T\"";
        Scene::from_toml(scene, folder).err().map(|error| error.to_string())
    };
    let ideal = || {
        let known = spts::circuit::PROFILES.iter().find(|(name, _)| *name == "ideal");
        known.expect("it ships").1
    };
    match block.mark("toml").unwrap_or("scene") {
        "scene" => Scene::from_toml(&block.text, folder).err().map(|error| error.to_string()),
        "profile" => profile(&block.text),
        "part" => profile(&format!("{}\n{}", ideal(), block.text)),
        "spec" => {
            spts_dataset::Spec::from_toml(&block.text, &toml::Table::new(), folder).err().map(|error| error.to_string())
        }
        other => Some(format!("`{other}` is no kind of TOML")),
    }
}

#[test]
fn every_block_of_toml_is_read() {
    let folder = folder();
    let mut seen = 0;
    for page in pages() {
        for block in blocks(&page).iter().filter(|block| block.language == "toml") {
            if let Some(error) = toml_error(block, folder.path()) {
                panic!("{}:{}: {error}", page.display(), block.line);
            }
            seen += 1;
        }
    }
    assert!(seen > 5, "{seen} blocks");
}

#[test]
fn what_is_wrong_is_noticed() {
    let wrong = commands("spts simulate press/T --no-such && spts decode out/T | grep x");
    assert_eq!(wrong.len(), 2);
    assert!(refused(&wrong[0]).is_some_and(|reason| reason.contains("--no-such")));
    assert_eq!(refused(&wrong[1]), None);
}

/// A path of ARCHITECTURE.md is there; of one with a NAME in it, its folder is. `{a,b}` stands for both.
#[test]
fn every_path_of_the_architecture_exists() {
    let mut seen = 0;
    for code in inline_code(&root().join("ARCHITECTURE.md")) {
        if !code.contains('/') || code.contains(' ') {
            continue;
        }
        let (before, rest) = code.split_once('{').unwrap_or((&code, ""));
        let (names, after) = rest.split_once('}').unwrap_or(("", ""));
        for name in names.split(',') {
            let path = format!("{before}{name}{after}");
            let known = path.split("NAME").next().unwrap_or_default();
            let known = if known == path { known } else { known.rsplit_once('/').map_or("", |(folder, _)| folder) };
            assert!(root().join(known).exists(), "{code}: {path} is not there");
            seen += 1;
        }
    }
    assert!(seen > 40, "{seen} paths");
}

/// What a release changes by hand is changed everywhere (CONTRIBUTING.md).
#[test]
fn the_version_is_everywhere_the_same() {
    let version = env!("CARGO_PKG_VERSION");
    for (file, line) in [
        ("fuzz/Cargo.toml", format!("version = \"{version}\"")),
        ("python/spts/__init__.py", format!("__version__ = \"{version}\"")),
        ("CITATION.cff", format!("version: {version}")),
        ("docs/others.md", format!("| | SPTS twin {version} |")),
    ] {
        let text = fs::read_to_string(root().join(file)).unwrap();
        assert!(text.lines().any(|found| found.starts_with(&line)), "{file} has no line {line}");
    }
    let text = fs::read_to_string(root().join("CHANGELOG.md")).unwrap();
    let newest = text.lines().find_map(|line| line.strip_prefix("## ").filter(|heading| *heading != "Unreleased"));
    assert!(newest.is_some_and(|heading| heading.starts_with(&format!("{version} – "))), "CHANGELOG.md: {newest:?}");
}
