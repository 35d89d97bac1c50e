//! Records the revision of the sources that the program is built from.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-env-changed=SPTS_GIT_REVISION");
    // a file that is not there would count as changed at every build
    if let Some(folder) = git(&["rev-parse", "--absolute-git-dir"]) {
        for file in ["HEAD", "index", "logs/HEAD"] {
            println!("cargo:rerun-if-changed={folder}/{file}");
        }
    }
    let revision = std::env::var("SPTS_GIT_REVISION").ok().or_else(revision);
    println!("cargo:rustc-env=SPTS_BUILT_FROM={}", revision.as_deref().unwrap_or("unknown"));
}

/// The commit, with "-dirty" where tracked files differ from it.
fn revision() -> Option<String> {
    let commit = git(&["rev-parse", "HEAD"])?;
    // without locks, because git would else write its index anew, and Cargo build everything once more
    let changed = git(&["--no-optional-locks", "status", "--porcelain", "--untracked-files=no"])?;
    Some(if changed.is_empty() { commit } else { format!("{commit}-dirty") })
}

/// What git answers; `None` without git or outside a repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).output().ok()?;
    let text = output.status.success().then_some(output.stdout)?;
    Some(String::from_utf8_lossy(&text).trim().to_owned())
}
