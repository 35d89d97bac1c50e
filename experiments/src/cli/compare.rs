//! `spts compare`: the twin against recordings of its skin.

use super::context::{Common, note, print, print_json};
use super::error::CliError;
use crate::calibrate::read;
use crate::compare::{Comparison, Curve, Statistic, draw};
use crate::data::DataError;
use crate::output::{OutputFolder, Staged, write_table};
use crate::real::{Real, load};
use clap::Args;
use serde::Serialize;
use spts_models::Streams;
use std::path::PathBuf;

/// Compares the twin with recordings of the skin it is the twin of.
///
/// Calibrates the readout on the odd presses of every compressive session in RECORDINGS (see `spts validate --help` for the layout),
/// sends the skin's own images of the even ones, measured by least squares, through the twin's readout at the same rows of weights,
/// and runs the same estimators on both. Then scores both on the even ones of presses 6-15, with the published dictionary and library
/// and the skin's own raster images as the truth, and compares the curves.
///
/// Not modelled, and shown without a verdict: the even/odd pattern with nothing on the skin (idle_parity), which idle_noise is without
/// and idle_sd is with, and outliers that no late update explains.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts compare recordings/
  spts compare recordings/ --no-curves --out out/look
  spts compare recordings/ --json > compare.json

Files in DIR:
  compare.csv curves.csv     what is printed
  figures/residuals.png      histograms of the residuals; quantiles.png quantile against quantile
  figures/scores.png         score curves
Each figure is there as .svg too.")]
pub(super) struct Compare {
    /// Directory of the recordings
    recordings: PathBuf,
    /// Folder of the table and the figures
    #[arg(long, value_name = "DIR", default_value = "out/compare")]
    out: PathBuf,
    /// Leave out the score curves, which take most of the time
    #[arg(long)]
    no_curves: bool,
    /// Root of the twin's random numbers
    #[arg(long, default_value_t = 1, value_name = "SEED")]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// What the command reports.
#[derive(Debug, Serialize)]
struct Report {
    statistics: Vec<Statistic>,
    curves: Vec<Curve>,
    not_modelled: Vec<Statistic>,
}

impl Compare {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        OutputFolder::check(&self.out)?;
        let pairs = read(&self.recordings)?;
        let real = if self.no_curves { None } else { self.scored()? };
        let comparison = Comparison::run(&self.recordings, &pairs, real.as_ref(), Streams::new(self.seed))?;
        let report = Report {
            curves: comparison.curves.as_ref().map_or_else(Vec::new, |c| c.curves.clone()),
            statistics: comparison.statistics.clone(),
            not_modelled: comparison.not_modelled.clone(),
        };
        let staged = OutputFolder::create(&self.out)?.stage()?;
        write(&staged, &comparison, &report).map_err(|error| error.unstaged(&staged))?;
        staged.commit()?;
        if self.common.json {
            print_json(&report)?;
        } else {
            print(&table(&report))?;
            print(&format!("figures: {}", self.out.join("figures").display()))?;
        }
        Ok(())
    }

    /// What the scores need; `None`, with a note, when it is not published with the recordings.
    fn scored(&self) -> Result<Option<Real>, CliError> {
        match load(&self.recordings) {
            Err(e @ DataError::Missing { .. }) => {
                note(&format!("no score curves: {e}"));
                Ok(None)
            }
            real => Ok(Some(real?)),
        }
    }
}

fn write(staged: &Staged, comparison: &Comparison, report: &Report) -> Result<(), CliError> {
    write_table(&staged.path("compare.csv"), &comparison.all_statistics())?;
    write_table(&staged.path("curves.csv"), &report.curves)?;
    draw(
        &comparison.compared,
        comparison.curves.as_ref(),
        &staged.folder("figures")?,
    )?;
    Ok(())
}

fn verdict(ok: bool) -> &'static str {
    if ok { "ok" } else { "DIFFERS" }
}

fn table(report: &Report) -> String {
    let mut out = format!(
        "{:<8} {:<20} {:>20} {:>20}  {}\n",
        "session", "statistic", "real", "twin", "tolerance"
    );
    let show = |value: f64, error: Option<f64>| match error {
        Some(error) => format!("{value:.5} ± {error:.5}"),
        None => format!("{value:.5}"),
    };
    for s in report.statistics.iter().chain(&report.not_modelled) {
        out.push_str(&format!(
            "{:<8} {:<20} {:>20} {:>20}  {:<18} {}\n",
            s.session,
            s.name,
            show(s.real, s.real_standard_error),
            show(s.twin, s.twin_standard_error),
            s.tolerance,
            s.ok.map_or("", verdict)
        ));
    }
    if !report.curves.is_empty() {
        out.push_str("\nmean and largest |twin − real| over M = 7 … 100\n");
    }
    for c in &report.curves {
        out.push_str(&format!(
            "{:<11} {:<13} {:.4}  {:.4}  allowed {:.2}  {}\n",
            c.decode,
            c.metric,
            c.mean_abs_difference,
            c.max_abs_difference,
            c.tolerance,
            verdict(c.ok)
        ));
    }
    out.pop();
    out
}
