//! `spts dataset`: synthetic data sets of labelled touches.

mod look;
mod make;
mod pictures;

use crate::error::CliError;
use clap::{Args, Subcommand};

/// Makes and checks data sets: labelled touches as rows of Parquet files.
///
/// A spec says what is pressed, where and how hard, on which skin, and what is recorded; every number in it may be a
/// distribution. A row is a function of the spec and its number alone: any number of threads, workers and machines of
/// one type make the same files. A run that was stopped goes on where it was when it is started again.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts dataset make random-shapes --rows 10000 --out out/shapes
  spts dataset make my_spec.toml --out DIR --shard 0/4      worker 0 of 4; then: spts dataset finish DIR
  spts dataset specs                                        the specs that ship; --show NAME prints one to begin with
  spts dataset schema random-shapes                         its columns
  spts dataset head DIR --rows 2
  spts dataset verify DIR
  spts dataset preview my_spec.toml                         a picture of 24 of its rows; of DIR the same
  spts dataset shapes                                       a picture of 100 procedural shapes

LeRobot and WebDataset: python -m spts.export DIR LAYOUT --out OUT
In Python: pandas.read_parquet(\"DIR/data\"), polars.read_parquet(\"DIR/data/*.parquet\"), or
datasets.load_dataset(\"parquet\", data_dir=\"DIR/data\")")]
pub(super) struct DatasetCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    Make(make::MakeCommand),
    Finish(make::FinishCommand),
    Verify(look::VerifyCommand),
    Compare(look::CompareCommand),
    #[command(hide = true)]
    Export {
        #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
        arguments: Vec<std::ffi::OsString>,
    },
    Info(look::InfoCommand),
    Head(look::HeadCommand),
    Schema(look::SchemaCommand),
    Specs(look::SpecsCommand),
    Preview(pictures::PreviewCommand),
    Shapes(pictures::ShapesCommand),
}

impl DatasetCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.action {
            Action::Make(command) => command.run(),
            Action::Finish(command) => command.run(),
            Action::Verify(command) => command.run(),
            Action::Compare(command) => command.run(),
            Action::Export { .. } => Err(CliError::usage(
                "exports are in the Python package: `python -m spts.export DATASET LAYOUT --out DIR`",
            )),
            Action::Info(command) => command.run(),
            Action::Head(command) => command.run(),
            Action::Schema(command) => command.run(),
            Action::Specs(command) => command.run(),
            Action::Preview(command) => command.run(),
            Action::Shapes(command) => command.run(),
        }
    }
}
