//! Records the revision of the sources that the program is built from.

use std::process::Command;

fn main() {
    println!("cargo:rerun-if-env-changed=SPTS_GIT_REVISION");
    for file in ["../.git/HEAD", "../.git/index", "../.git/logs/HEAD"] {
        println!("cargo:rerun-if-changed={file}");
    }
    let described = Command::new("git")
        .args(["describe", "--always", "--dirty", "--abbrev=40", "--exclude=*"])
        .output();
    let revision = std::env::var("SPTS_GIT_REVISION").ok().or_else(|| {
        let output = described.ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    });
    println!(
        "cargo:rustc-env=SPTS_BUILT_FROM={}",
        revision.as_deref().unwrap_or("unknown")
    );
}
