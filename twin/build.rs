//! Records the revision of the sources that the program is built from, and where its tests find MuJoCo.

#[path = "../scripts/library_path.rs"]
mod library_path;

use std::process::Command;

fn main() {
    library_path::main();
    println!("cargo:rerun-if-env-changed=SPTS_GIT_REVISION");
    // a file that is not there would count as changed at every build
    if let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) {
        for file in ["HEAD", "index", "logs/HEAD"] {
            println!("cargo:rerun-if-changed={folder}/{file}");
        }
    }
    let described = ["describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"];
    let revision = std::env::var("SPTS_GIT_REVISION").ok().or_else(|| git(&described));
    println!(
        "cargo:rustc-env=SPTS_BUILT_FROM={}",
        revision.as_deref().unwrap_or("unknown")
    );
}

/// What git answers; `None` without git or outside a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = output.status.success().then_some(output.stdout)?;
    Some(String::from_utf8_lossy(&text).trim().to_owned())
}
