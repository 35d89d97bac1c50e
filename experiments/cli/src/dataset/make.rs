//! `spts dataset make` and `finish`.

use crate::context::{Bars, Common, notes};
use crate::error::CliError;
use crate::options::{seed, whole};
use clap::Args;
use rustix::time::{ClockId, clock_gettime};
use serde::Serialize;
use spts::assign::Assignment;
use spts_dataset::{Dataset, Finished, Part, Spec};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Makes the rows of a data set and writes them as Parquet files. A row is one window of samples of the wire, with the
/// truth beside it.
///
/// Files of this data set that are there and complete are skipped: a run that was stopped goes on with the same
/// command. Without --shard all files are made and the data set is finished, as by `spts dataset finish`.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset make random-shapes --rows 100000 --out out/shapes
  spts dataset make presses-17 --rows 10000 --seed 7 --json
  spts dataset make presses-17 --set contact.model=layer --set record.measurements=50
  spts dataset make random-shapes --set 'press.force_n={ uniform = [1, 100] }'
  spts dataset make my_spec.toml --out DIR --shard 2/8

In a Slurm job array the worker is SLURM_ARRAY_TASK_ID less SLURM_ARRAY_TASK_MIN of SLURM_ARRAY_TASK_COUNT; in a
Kubernetes indexed job it is JOB_COMPLETION_INDEX of --shards. Which files there are does not depend on the number of
workers.

Files in DIR:
  data/part-*.parquet       the rows
  dataset.json spec.toml    what the data set is; written first
  statistics.json README.md croissant.json manifest.json    written by the last step, `finish`")]
pub(super) struct MakeCommand {
    /// Spec, which says what is pressed and recorded: a TOML file, or the name of one that ships (`spts dataset specs`
    /// lists them)
    #[arg(value_name = "SPEC")]
    spec: String,
    /// Folder of the data set [default: out/dataset/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Number of rows; [1, 10^12] [default: the spec's]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000_000_000))]
    rows: Option<u64>,
    /// Root of every random number; [0, 2^63) [default: the spec's]
    #[arg(long, value_name = "SEED", value_parser = seed)]
    seed: Option<u64>,
    /// Changes one key of the spec file for this run: KEY is its dotted path, VALUE is TOML; repeatable.
    /// docs/datasets.md has all keys [default: none]
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = str::parse::<Assignment>)]
    set: Vec<Assignment>,
    /// Make the files of worker i of n only, those whose number k has k mod n = i; count from 0 [default: what the
    /// environment of a Slurm array or Kubernetes indexed job says, or else all files]
    #[arg(long, value_name = "i/n", conflicts_with = "shards")]
    shard: Option<String>,
    /// Number of workers of a Kubernetes indexed job, which its environment does not say; [1, 10^9] [default: none]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000_000))]
    shards: Option<u64>,
    #[command(flatten)]
    common: Common,
}

/// Checks that all files of a data set are there, and writes its statistics, card and manifest. It is for data sets
/// made by several workers; `spts dataset make` without --shard does it by itself.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset finish out/shapes
  spts dataset finish out/shapes --json")]
pub(super) struct FinishCommand {
    /// Folder of the data set
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    common: Common,
}

/// Where the files of a spec are.
#[derive(Debug, Args)]
pub(super) struct Files {
    /// Folder of the meshes, profiles and gain files that the spec names by relative paths
    #[arg(long, value_name = "DIR", default_value = ".")]
    files: PathBuf,
}

impl Files {
    /// The data set in `folder`.
    pub(super) fn open(&self, folder: &Path) -> Result<Dataset, CliError> {
        Ok(Dataset::open(folder, &self.files)?)
    }
}

/// What `make` prints as JSON.
#[derive(Debug, Serialize)]
struct Report {
    /// Rows that were made in this run, and what they took.
    rows: u64,
    cpu_s: f64,
    rows_per_cpu_s: f64,
    wall_s: f64,
    peak_mb: Option<f64>,
    shards: u64,
    skipped: u64,
    folder: PathBuf,
    /// None for a part of a data set.
    finished: Option<Finished>,
}

impl MakeCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let whole = |value: u64| toml::Value::Integer(i64::try_from(value).unwrap_or(i64::MAX));
        let overrides = [("rows", self.rows), ("seed", self.seed)].into_iter();
        let overrides = overrides.filter_map(|(key, value)| value.map(|value| (key.to_owned(), whole(value))));
        let mut overrides: toml::Table = overrides.collect();
        for assignment in &self.set {
            assignment.put_into(&mut overrides).map_err(|e| CliError::usage(format!("`--set` {e}")))?;
        }
        let spec = Spec::load(&self.spec, &overrides)?;
        notes(spec.notes());
        let part = match &self.shard {
            Some(text) => Some(Part::parse(text)?),
            None => Part::from_environment(|name| std::env::var(name).ok(), self.shards)?,
        };
        let out = self.out.unwrap_or_else(|| Path::new("out/dataset").join(&spec.config().name));
        let dataset = Dataset::begin(&out, spec)?;
        let (bars, begin, cpu) = (Bars::default(), Instant::now(), cpu_s());
        let made = dataset.make(part.unwrap_or(Part::WHOLE), &bars)?;
        let (wall_s, cpu_s) = (begin.elapsed().as_secs_f64(), cpu_s() - cpu);
        let finished = if part.is_none() { Some(dataset.finish(&bars)?) } else { None };
        let report = Report {
            rows: made.rows,
            cpu_s,
            rows_per_cpu_s: made.rows as f64 / cpu_s,
            wall_s,
            peak_mb: peak_mb(),
            shards: made.shards,
            skipped: made.skipped,
            folder: out,
            finished,
        };
        self.common.print(&report, || text(&report))
    }
}

fn text(report: &Report) -> String {
    let mut text = format!(
        "{} rows in {} files made in {:.1} s ({:.0} rows a CPU second), {} files were there",
        report.rows, report.shards, report.wall_s, report.rows_per_cpu_s, report.skipped
    );
    match &report.finished {
        Some(finished) => text.push_str(&format!("\n{}", whole_set(finished))),
        None => text.push_str("\nwhen all workers are done: spts dataset finish DIR"),
    }
    text.push_str(&format!("\ndata set: {}", report.folder.display()));
    text
}

fn whole_set(finished: &Finished) -> String {
    let megabytes = finished.bytes as f64 / 1e6;
    format!(
        "whole: {} rows in {} files, {megabytes:.1} MB\ndigest: {}",
        finished.rows, finished.shards, finished.digest
    )
}

impl FinishCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let finished = self.files.open(&self.folder)?.finish(&Bars::default())?;
        self.common.print(&finished, || whole_set(&finished))
    }
}

/// CPU time of this process and all its threads so far, s.
fn cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + 1e-9 * time.tv_nsec as f64
}

/// Most memory that this process had at once, MB; `None` where the system does not say.
fn peak_mb() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes * 1024.0 / 1e6)
}
