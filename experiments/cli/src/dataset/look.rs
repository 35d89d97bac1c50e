//! What looks at a data set and makes nothing: `verify`, `compare`, `info`, `head`, `schema`, `specs`.

use super::make::Files;
use crate::context::{Bars, Common, print, print_json};
use crate::error::CliError;
use crate::options::{seed, whole};
use clap::Args;
use spts_dataset::{Comparison, NAMED_SPECS, Spec, columns};
use std::fmt::Write as _;
use std::path::PathBuf;

/// Checks a data set: makes some of its rows once more and compares them with the files, bit for bit.
///
/// The exit status is 1 when a row differs.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset verify out/shapes
  spts dataset verify out/shapes --rows 10000 --seed 3 --json")]
pub(super) struct VerifyCommand {
    /// Folder of the data set
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of rows to make again and compare, chosen at random; [1, 10^9]
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<u64>(1..=1_000_000_000))]
    rows: u64,
    /// Seed of the random choice of rows
    #[arg(long, value_name = "SEED", default_value_t = 0, value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    common: Common,
}

/// Compares two data sets of the same touches: the true pressure and conductance of every row with those of the same
/// row of a reference.
///
/// It is meant for two data sets that differ in one thing, such as the contact model. Means of pressure and conductance
/// are relative to the reference; rows without a touch are left out.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset make presses-17 --rows 170 --set object.rows_per_shape=1 --out out/footprint
  spts dataset make presses-17 --rows 170 --set object.rows_per_shape=1 --set contact.model=layer --out out/layer
  spts dataset compare out/footprint out/layer")]
pub(super) struct CompareCommand {
    /// Folder of the data set
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder of the reference
    #[arg(value_name = "REFERENCE")]
    reference: PathBuf,
    #[command(flatten)]
    files: Files,
    #[command(flatten)]
    common: Common,
}

/// Says what data set a folder holds, how many of its files are made, and whether it is finished.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset info out/shapes
  spts dataset info out/shapes --json")]
pub(super) struct InfoCommand {
    /// Folder of the data set
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    #[command(flatten)]
    files: Files,
    /// Print the numbers as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Prints the first rows of a data set, one JSON object a line.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset head out/shapes
  spts dataset head out/shapes --rows 1")]
pub(super) struct HeadCommand {
    /// Folder of the data set
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Number of rows to print; [1, 100000]
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = whole::<u64>(1..=100_000))]
    rows: u64,
    #[command(flatten)]
    files: Files,
}

/// Prints the columns of the data set that a spec makes: name, type, unit and meaning, one column a line.
///
/// No row is made. The columns depend on the spec: `record.phi = true` in it adds the column `phi`, for example.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset schema
  spts dataset schema courses
  spts dataset schema my_spec.toml --json")]
pub(super) struct SchemaCommand {
    /// Spec: a TOML file, or the name of one that ships (`spts dataset specs` lists them)
    #[arg(value_name = "SPEC", default_value = "random-shapes")]
    spec: String,
    /// Print the columns as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// Lists the specs that ship, or prints one of them to begin your own with. A spec is a TOML file that describes a data
/// set.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset specs
  spts dataset specs --show random-shapes > my_spec.toml")]
pub(super) struct SpecsCommand {
    /// Spec to print, by its name [default: list all]
    #[arg(long, value_name = "NAME")]
    show: Option<String>,
}

impl VerifyCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let verified = self.files.open(&self.folder)?.verify(self.rows, self.seed, &Bars::default())?;
        self.common.print(&verified, || format!("{} rows of {} files compared", verified.rows, verified.shards))?;
        match verified.differ.first() {
            None => Ok(()),
            Some((row, column)) => {
                let (folder, count) = (self.folder.display(), verified.differ.len());
                let problem =
                    format!("{folder}: {count} rows are not what the spec makes, the first row {row} in `{column}`");
                Err(CliError::Differs(problem))
            }
        }
    }
}

impl CompareCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let reference = self.files.open(&self.reference)?;
        let compared = self.files.open(&self.folder)?.compare_with(&reference, &Bars::default())?;
        self.common.print(&compared, || comparison(&compared))
    }
}

/// A table of differences, an object a line: medians, with the 10th and the 90th percentile.
fn comparison(compared: &Comparison) -> String {
    let mut text = format!(
        "{:14} {:>7}  {:24} {:24} {:24} {}\n",
        "object", "rows", "pressure %", "conductance %", "correlation", "support IoU"
    );
    let whole = ("all".to_owned(), &compared.all);
    let objects = compared.objects.iter().map(|(name, errors)| (name.clone(), errors));
    for (name, e) in objects.chain([whole]) {
        let percent =
            |[low, middle, high]: [f64; 3]| format!("{:.2} ({:.2} to {:.2})", 1e2 * middle, 1e2 * low, 1e2 * high);
        let share = |[low, middle, high]: [f64; 3]| format!("{middle:.4} ({low:.4} to {high:.4})");
        let _ = writeln!(
            text,
            "{name:14} {:>7}  {:24} {:24} {:24} {}",
            e.rows,
            percent(e.pressure),
            percent(e.conductance),
            share(e.correlation),
            share(e.support_iou)
        );
    }
    let _ = write!(
        text,
        "medians over rows (10th to 90th percentile); {} rows have a touch in one of the two only",
        compared.one_sided
    );
    text
}

impl InfoCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let info = self.files.open(&self.folder)?.info();
        if self.json {
            return print_json(&info);
        }
        let state = match &info.digest {
            Some(digest) => format!("finished, digest {digest}"),
            None => "not finished".to_owned(),
        };
        print(&format!(
            "{}: {} rows in {} files of {}\n{} files are there, {:.1} MB; {state}\nspec: SHA-256 {}",
            info.name,
            info.rows,
            info.shards,
            info.rows_per_shard,
            info.made,
            info.bytes as f64 / 1e6,
            info.spec_sha256
        ))
    }
}

impl HeadCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let rows = self.files.open(&self.folder)?.head(self.rows)?;
        let lines: Vec<String> = rows.iter().map(ToString::to_string).collect();
        print(&lines.join("\n"))
    }
}

impl SchemaCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let columns = columns(&Spec::load(&self.spec, &toml::Table::new())?);
        if self.json {
            return print_json(&columns);
        }
        let mut text = String::new();
        for column in &columns {
            let kind = column.type_name();
            let unit = if column.unit.is_empty() { "" } else { column.unit };
            let _ = writeln!(text, "{:18} {kind:14} {unit:4} {}", column.name, column.description);
        }
        print(text.trim_end())
    }
}

impl SpecsCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let Some(name) = &self.show else {
            let mut text = String::new();
            for (name, toml) in NAMED_SPECS {
                // a spec begins with what it is
                let first = toml.lines().next().unwrap_or_default();
                let _ = writeln!(text, "{name:14} {}", first.trim_start_matches(['#', ' ']));
            }
            return print(text.trim_end());
        };
        match NAMED_SPECS.iter().find(|(known, _)| known == name) {
            Some((_, text)) => print(text.trim_end()),
            None => {
                let known: Vec<&str> = NAMED_SPECS.iter().map(|(known, _)| *known).collect();
                Err(CliError::usage(format!("`--show` = {name}: valid: {}", known.join(", "))))
            }
        }
    }
}
