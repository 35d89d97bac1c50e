//! What the library draws in: a robot's program needs no command line and no pictures, and contact no physics engine.

use std::collections::BTreeSet;
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
