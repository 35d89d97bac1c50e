//! `spts compare`: the twin against recordings of its skin.

use super::context::{Common, note, print, progress, spinner};
use super::error::CliError;
use crate::calibrate::read;
use crate::compare::{Compared, Curve, Curves, Statistic, compare_all, curve_steps, curves, draw, statistics};
use crate::data::DataError;
use crate::output::{OutputFolder, write_table};
use crate::real::load;
use clap::Args;
use serde::Serialize;
use spts_models::Streams;
use std::path::{Path, PathBuf};

/// Compares the twin with recordings of the skin it is the twin of.
///
/// Calibrates the readout on the odd presses of every compressive session in RECORDINGS (see `spts validate --help` for the layout),
/// sends the skin's own images of the even ones, measured by least squares, through the twin's readout at the same rows of weights,
/// and runs the same estimators on both. Then scores both on presses 6-15, with the published dictionary and library and the skin's
/// own raster images as the truth, and compares the curves.
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
}

impl Compare {
    /// Runs the command.
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        OutputFolder::check(&self.out)?;
        let reading = spinner("reading recordings");
        let pairs = read(&self.recordings)?;
        drop(reading);
        let bar = progress(pairs.len(), "replaying sessions");
        let compared = compare_all(&pairs, Streams::new(self.seed), &|| bar.inc(1))
            .map_err(|e| CliError::Usage(format!("{}: {e}", self.recordings.display())))?;
        bar.finish_and_clear();
        let scored = if self.no_curves { None } else { self.score(&compared)? };
        let report = Report {
            statistics: statistics(&compared),
            curves: scored.as_ref().map_or_else(Vec::new, |c| c.curves.clone()),
        };
        write(&self.out, &compared, scored.as_ref(), &report)?;
        if self.common.json {
            let text = serde_json::to_string_pretty(&report).map_err(|e| CliError::Usage(e.to_string()))?;
            print(&text);
        } else {
            print(&table(&report));
            print(&format!("figures: {}", self.out.join("figures").display()));
        }
        Ok(())
    }

    /// Score curves; `None`, with a note, when what they need is not published with the recordings.
    fn score(&self, compared: &[Compared]) -> Result<Option<Curves>, CliError> {
        let real = match load(&self.recordings) {
            Err(e @ DataError::Missing { .. }) => {
                note(&format!("no score curves: {e}"));
                return Ok(None);
            }
            real => real?,
        };
        let bar = progress(curve_steps(compared, &real), "scoring presses");
        let scored = curves(compared, &real, &|| bar.inc(1));
        bar.finish_and_clear();
        Ok(Some(scored))
    }
}

fn write(out: &Path, compared: &[Compared], scored: Option<&Curves>, report: &Report) -> Result<(), CliError> {
    let staged = OutputFolder::create(out)?.stage()?;
    write_table(&staged.path("compare.csv"), &report.statistics)?;
    write_table(&staged.path("curves.csv"), &report.curves)?;
    draw(compared, scored, &staged.folder("figures")?)?;
    staged.commit()?;
    Ok(())
}

fn verdict(ok: bool) -> &'static str {
    if ok { "ok" } else { "DIFFERS" }
}

fn table(report: &Report) -> String {
    let mut out = format!(
        "{:<8} {:<14} {:>20} {:>20}  {}\n",
        "session", "statistic", "real", "twin", "tolerance"
    );
    for s in &report.statistics {
        let show = |value: f64, error: f64| format!("{value:.5} ± {error:.5}");
        out.push_str(&format!(
            "{:<8} {:<14} {:>20} {:>20}  {:<18} {}\n",
            s.session,
            s.name,
            show(s.real, s.real_standard_error),
            show(s.twin, s.twin_standard_error),
            s.tolerance,
            verdict(s.ok)
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
