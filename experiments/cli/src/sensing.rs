//! `spts sensing`: rows of the sensing matrix that are designed.

use crate::context::{Bars, Common, note, open_folder};
use crate::error::CliError;
use crate::options::{seed, whole, within};
use clap::builder::PossibleValuesParser;
use clap::{Args, Subcommand};
use spts::SkinLayout;
use spts::progress::Progress as _;
use spts_recon::rows::{DESIGNERS, RowTask, Tolerances, designer};
use spts_report::sensing::write;
use spts_studies::sensing::{DesignImages, RowDesign};
use std::path::PathBuf;

/// Designs the rows of the sensing matrix.
///
/// A row is one weight a taxel: a sample is the sum of all taxels, each times its weight. The published cells draw
/// their weights at random.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts sensing design
  spts sensing design --designer cosine_signs --rows 20")]
pub(super) struct SensingCommand {
    #[command(subcommand)]
    command: SensingAction,
}

#[derive(Debug, Subcommand)]
enum SensingAction {
    Design(Box<DesignCommand>),
}

impl SensingCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.command {
            SensingAction::Design(command) => command.run(),
        }
    }
}

/// Most rows and columns of a skin.
const MOST: usize = 1024;
/// Rows × taxels² beyond which a design is said to take long: with 1,024 rows for 16 × 32 taxels, some ten seconds.
const LONG: usize = 1 << 28;

/// Rows and columns of a skin.
fn skin(text: &str) -> Result<[usize; 2], String> {
    let side = |word: &str| word.parse().ok().filter(|n| (1..=MOST).contains(n));
    let found = text.split_once(['x', '×']).and_then(|(r, c)| Some([side(r)?, side(c)?]));
    found.ok_or_else(|| "is not ROWSxCOLS with both in [1, 1024]".to_owned())
}

/// A skin of so many rows and columns, with the published pitch.
fn layout([rows, cols]: [usize; 2]) -> Result<SkinLayout, CliError> {
    let published = SkinLayout::default();
    SkinLayout::new(rows, cols, published.pitch_m(), published.electrode_m())
        .map_err(|e| CliError::usage(format!("`--skin`: {e}")))
}

/// Designs M rows of the sensing matrix for a skin, and writes them in the forms that a scene, a session and the cells
/// need.
///
/// A row is one weight a taxel. Designed rows show more of what is expected on the skin than random ones. Some
/// designers need to know what is expected, a prior: they learn it from simulated random shapes anywhere on the skin,
/// unless --smooth or --recordings is given. docs/rows.md says which designer is good for what.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts sensing design
  spts sensing design --designer cosine_signs --rows 25 --skin 12x16
  spts sensing design --designer classes --recordings recordings/ --rows 10
  spts sensing design --worst-kind --json
  spts sensing design --largest-sum 1.5 --shift 2 --gains 0.3 --fewest-flips --json
  spts simulate press/T --set rows.patterns_file=out/sensing/rows.txt --weights firmware

Designers:
  random              pseudorandom rows
  cosine_signs        needs nothing but the rows and columns of the skin
  greedy, separable   need a prior of images; separable is for large skins
  classes             needs templates of objects from --recordings; its rows tell the objects apart

Files in DIR:
  rows.txt            one line a row: + or - for each taxel; for patterns_file under [rows] of a scene
  weights.json        the same rows as info.weights of a session: see docs/session.md
  bus.csv             what the master writes to each cell to load its pattern; up to 112 cells
  seeds.txt           seeds whose generators begin with these rows; up to 24 rows of ±1
  design.json         what the rows are like
  figures/rows.png    every row as a picture of the skin; rows.svg the same")]
struct DesignCommand {
    /// Way to choose the rows; see below
    #[arg(
        long,
        value_name = "NAME",
        default_value = "greedy",
        value_parser = PossibleValuesParser::new(DESIGNERS.iter().map(|d| d.name))
    )]
    designer: String,
    /// Number of rows M; [1, 1024]
    #[arg(long, value_name = "M", default_value_t = 20, value_parser = whole::<usize>(1..=1024))]
    rows: usize,
    /// Taxels of the skin, rows and columns, each [1, 1024]
    #[arg(long, value_name = "ROWSxCOLS", default_value = "10x10", value_parser = skin, conflicts_with = "recordings")]
    skin: [usize; 2],
    /// Prior: images are smooth over about this distance, in taxels, and nothing else is known of them; [0.01, 1000]
    /// [default: random shapes]
    #[arg(long, value_name = "TAXELS", conflicts_with = "recordings", value_parser = within(0.01, 1000.0, "[0.01, 1000] taxels"))]
    smooth: Option<f64>,
    /// Prior: images and templates of the raster presses in this folder, without those that are scored [default: random
    /// shapes]
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Standard deviation of a sample's noise that the design assumes, relative to the root mean square of a random
    /// row's samples; [1e-6, 1000]
    #[arg(long, value_name = "SHARE", default_value_t = RowTask::NOISE, value_parser = within(1e-6, 1e3, "[1e-6, 1000]"))]
    noise: f64,
    /// Largest root mean square of a designed row's samples, as a multiple of a random row's, so that the amplifier
    /// does not clip; [0.05, 1000] [default: no limit]
    #[arg(long, value_name = "TIMES", value_parser = within(0.05, 1e3, "[0.05, 1000]"))]
    largest_sum: Option<f64>,
    /// Spread of the taxels' gains that the design assumes: standard deviation of their natural logarithm; [0, 3]
    #[arg(long, value_name = "SD", default_value_t = 0.0, value_parser = within(0.0, 3.0, "[0, 3]"))]
    gains: f64,
    /// Largest shift of the images that the design allows for, in whole taxels; [0, 64]
    #[arg(long, value_name = "TAXELS", default_value_t = 0, value_parser = whole::<usize>(0..=64))]
    shift: usize,
    /// See the worst kind of images as well as can be, in place of the mean of all: each row is the one that most
    /// lowers the largest share of a kind's variance that is left. Kinds are the outlines of the random shapes, or the
    /// objects of --recordings. Only for the designer greedy, and not with --smooth
    #[arg(long)]
    worst_kind: bool,
    /// Write the rows in the order in which the fewest weights change from row to row, in place of the best rows first
    #[arg(long)]
    fewest_flips: bool,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/sensing")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

impl DesignCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out)?;
        let design = RowDesign {
            layout: layout(self.skin)?,
            designer: designer(&self.designer).unwrap_or(&DESIGNERS[0]),
            rows: self.rows,
            images: match (self.recordings, self.smooth) {
                (Some(path), _) => DesignImages::Recordings(path),
                (None, Some(length)) => DesignImages::Smooth(length),
                (None, None) => DesignImages::Shapes,
            },
            noise: self.noise,
            largest_sum: self.largest_sum,
            tolerances: Tolerances { gain_log_sd: self.gains, shift: self.shift },
            worst_kind: self.worst_kind,
            fewest_flips: self.fewest_flips,
            seed: self.seed,
        };
        let (taxels, rows) = (design.layout.taxels(), design.rows);
        if taxels.saturating_mul(taxels).saturating_mul(rows) > LONG {
            note(&format!(
                "note: {rows} rows for {taxels} taxels may take minutes or hours; fewer of either take less"
            ));
        }
        let bars = Bars::default();
        let report = design.run(&bars)?;
        bars.end();
        write(&report, out)?;
        let text = || format!("{}rows and pictures: {}", report.text(), self.out.display());
        self.common.print(&report, text)
    }
}
