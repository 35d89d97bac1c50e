//! `spts dataset export`.

use super::Files;
use crate::context::{Bars, print, print_json};
use crate::error::CliError;
use crate::options::whole;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser};
use spts_dataset::{EXPORTS, ExportOptions};
use std::path::PathBuf;

/// Writes a data set in the layout of another program.
///
/// All files of the data set must be there; they are checked first. OUT holds the whole export in the end, or nothing
/// if the export fails or is stopped.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset export lerobot out/shapes --out out/shapes_lerobot
  spts dataset export webdataset out/shapes --out out/shapes_tar --rows-per-tar 1000 --json

lerobot: the spec needs `record.interval_s`, the time between the windows of a press, with a whole number of windows a
  second.
  In Python: LeRobotDataset(\"local/shapes\", root=\"out/shapes_lerobot\")
webdataset: train-000000.tar and so on; every row is NUMBER.json with its single values, and NUMBER.pressure.npy,
  .conductance.npy, .support.npy, .image.npy, .y.npy and .phi.npy as far as they are recorded.
  In Python: webdataset.WebDataset(\"out/shapes_tar/train-{000000..000009}.tar\").decode()")]
pub(super) struct ExportCommand {
    /// Layout to write
    #[arg(value_name = "FORMAT", value_parser = formats())]
    format: String,
    /// Folder of the data set
    #[arg(value_name = "DIR")]
    folder: PathBuf,
    /// Folder to write the export to; it must be missing or empty
    #[arg(long, value_name = "OUT")]
    out: PathBuf,
    /// Most rows of a tar file, for webdataset only; [1, 10^6] [default: 10000]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    rows_per_tar: Option<u64>,
    #[command(flatten)]
    files: Files,
    /// Print the numbers as JSON on standard output
    #[arg(long)]
    json: bool,
}

/// The formats of the library, with their descriptions.
fn formats() -> PossibleValuesParser {
    EXPORTS
        .iter()
        .map(|(name, description, _)| PossibleValue::new(*name).help(*description))
        .collect::<Vec<_>>()
        .into()
}

impl ExportCommand {
    pub(super) fn run(self) -> Result<(), CliError> {
        let options = ExportOptions {
            rows_per_tar: self.rows_per_tar,
        };
        let dataset = self.files.open(&self.folder)?;
        let exported = dataset.export(&self.format, &self.out, &options, &Bars::default())?;
        if self.json {
            return print_json(&exported);
        }
        let splits = ["train", "validation", "test"].into_iter();
        let splits = splits.filter_map(|split| Some(format!("{split} {}", exported.splits.get(split)?)));
        let splits: Vec<String> = splits.collect();
        let episodes = exported
            .episodes
            .map_or_else(String::new, |n| format!(" of {n} episodes"));
        print(&format!(
            "{} rows{episodes} ({}) in {} files, {:.1} MB\ndigest: {}\n{}: {}",
            exported.rows,
            splits.join(", "),
            exported.files,
            exported.bytes as f64 / 1e6,
            exported.digest,
            exported.format,
            self.out.display()
        ))
    }
}
