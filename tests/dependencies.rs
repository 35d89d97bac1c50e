//! What the library draws in: a robot's program needs no command line and no pictures, and contact no physics engine.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::process::Command;

/// Names of the packages that `package` is built from, tests aside.
fn packages(package: &str) -> BTreeSet<String> {
    let output = Command::new(env!("CARGO"))
        .args(["tree", "--offline", "--locked", "--edges", "normal", "--prefix", "none"])
        .args(["--package", package])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo can be started");
    let text = String::from_utf8(output.stdout).expect("names of packages are plain text");
    assert!(output.status.success(), "{package}: {}", String::from_utf8_lossy(&output.stderr));
    let names = text.lines().filter_map(|line| line.split_whitespace().next());
    names.map(str::to_owned).collect()
}

#[test]
fn the_library_is_free_of_what_its_users_do_not_need() {
    const TERMINAL: [&str; 3] = ["clap", "indicatif", "plotters"];
    const ENGINE: [&str; 2] = ["mujoco-rs", "spts-sim"];
    let no_engine = [&TERMINAL[..], &ENGINE].concat();
    for (package, without) in [
        ("spts", &TERMINAL[..]),
        ("spts-contact", &no_engine),
        ("spts-recon", &["spts-models", "spts-circuit", "mujoco-rs"]),
    ] {
        let found = packages(package);
        assert!(found.contains(package), "{found:?}");
        for name in without {
            assert!(!found.contains(*name), "{package} needs {name}");
        }
    }
    // the names are right: the library has the engine
    assert!(packages("spts").contains("mujoco-rs"));
}

/// The Python package is built beside the workspace: with other versions it would be built from nothing, and of other
/// parts than what the tests have seen. What the workspace does not need is left out.
#[test]
fn the_python_package_has_the_versions_of_the_workspace() {
    let locked = |file: &str| -> BTreeMap<String, BTreeSet<String>> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
        let lock: toml::Table = toml::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let mut versions: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
        for package in lock["package"].as_array().unwrap() {
            let text = |key: &str| package[key].as_str().unwrap().to_owned();
            versions.entry(text("name")).or_default().insert(text("version"));
        }
        versions
    };
    let (python, workspace) = (locked("../python/Cargo.lock"), locked("../Cargo.lock"));
    for (name, versions) in &python {
        let Some(known) = workspace.get(name) else { continue };
        assert!(versions.is_subset(known), "{name}: {versions:?} in python/Cargo.lock, {known:?} in Cargo.lock");
    }
}
