//! `spts sensing`: rows of the sensing matrix that are designed.

mod design;
mod study;

use crate::error::CliError;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use design::DesignCommand;
use spts::SkinLayout;
use spts_recon::rows::{DESIGNERS, Designer, designer};
use study::StudyCommand;

/// Designs the rows of the sensing matrix, and measures how much better than random rows they are.
///
/// A row is one weight a taxel: a sample is the sum of all taxels, each times its weight. The published cells draw
/// their weights at random.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts sensing design --designer cosine_signs --rows 20
  spts sensing study --quick")]
pub(super) struct SensingCommand {
    #[command(subcommand)]
    command: SensingAction,
}

#[derive(Debug, Subcommand)]
enum SensingAction {
    Design(Box<DesignCommand>),
    Study(Box<StudyCommand>),
}

impl SensingCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.command {
            SensingAction::Design(command) => command.run(),
            SensingAction::Study(command) => command.run(),
        }
    }
}

/// A line of the table of designers.
#[derive(Clone)]
struct DesignerArg(&'static Designer);

impl std::fmt::Debug for DesignerArg {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(self.0.name)
    }
}

/// Names of `designers`.
fn named(designers: impl Iterator<Item = &'static Designer>) -> impl TypedValueParser<Value = DesignerArg> {
    let of = |name: String| DesignerArg(designer(&name).unwrap_or(&DESIGNERS[0]));
    PossibleValuesParser::new(designers.map(|d| d.name)).map(of)
}

fn designer_named() -> impl TypedValueParser<Value = DesignerArg> {
    named(DESIGNERS.iter())
}

/// Most rows and columns of a skin.
const MOST: usize = 1024;

/// Rows and columns of a skin.
fn skin(text: &str) -> Result<[usize; 2], String> {
    let side = |word: &str| word.parse().ok().filter(|n| (1..=MOST).contains(n));
    let found = text
        .split_once(['x', '×'])
        .and_then(|(r, c)| Some([side(r)?, side(c)?]));
    found.ok_or_else(|| "is not ROWSxCOLS with both in [1, 1024]".to_owned())
}

/// A skin of so many rows and columns, with the published pitch.
fn layout([rows, cols]: [usize; 2]) -> Result<SkinLayout, CliError> {
    let published = SkinLayout::default();
    SkinLayout::new(rows, cols, published.pitch_m(), published.electrode_m())
        .map_err(|e| CliError::Usage(format!("`--skin`: {e}")))
}
