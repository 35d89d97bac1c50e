//! Starting the command line.

use std::path::Path;
use std::process::{Command, Output};

/// The `spts` of this build.
pub(crate) const SPTS: &str = env!("CARGO_BIN_EXE_spts-under-test");

/// Runs `spts` with `arguments` in the folder `dir`.
pub(crate) fn spts(dir: &Path, arguments: &[&str]) -> Output {
    Command::new(SPTS)
        .args(arguments)
        .current_dir(dir)
        .output()
        .expect("spts can be started")
}

/// Runs `spts` and expects it to succeed.
pub(crate) fn succeeds(dir: &Path, arguments: &[&str]) -> Output {
    let output = spts(dir, arguments);
    assert!(
        output.status.success(),
        "{arguments:?}: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    output
}
