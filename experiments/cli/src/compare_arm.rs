//! `spts compare --arm`: the bent skin of the twin against a recording of touches on one.

use super::context::Common;
use super::error::CliError;
use super::progress::Bars;
use spts::output::OutputFolder;
use spts_studies::arm::ArmStudy;
use std::path::Path;

/// Simulated skins when none are asked for.
const SKINS: u64 = 8;

/// Compares, writes the table into `out` and prints it.
pub(super) fn run(
    recordings: &Path,
    skins: Option<u64>,
    seed: u64,
    out: OutputFolder,
    common: &Common,
) -> Result<(), CliError> {
    let study = ArmStudy {
        recordings,
        skins: skins.unwrap_or(SKINS),
        seed,
    };
    let report = study.run(&Bars::default())?;
    spts_report::compare::write_arm(&report, out)?;
    common.print(&report, || report.text())
}
