//! `spts seeds`: how good a set of seeds is, better ones, and what they are worth.

use super::context::{Common, open_folder};
use super::error::CliError;
use super::options::{Side, parse_measurements, seed, sorted, square, whole, within};
use super::progress::Bars;
use clap::{Args, ValueEnum};
use spts_circuit::{Seeding, WeightMode};
use spts_report::seeds::write;
use spts_studies::seeds::{SeedSet, SeedStudy};
use std::path::{Path, PathBuf};

/// Judges the sensing matrix that a set of seeds gives, proposes better seeds, and shows what they are worth in IoU.
///
/// Windows of M consecutive rows are judged independently of any decoder: rank, condition, coherence of columns and of
/// rows, and a lower bound of the restricted isometry constant, from random and greedy supports.
///
/// The set is compared with three others: mixed addresses (a 32-bit hash of each cell's address), seeds from a search
/// that lowers the mean square coherence of rows, and random bytes, which the published firmware can load.
///
/// Then the same images and noise are measured with the rows of every set, and the decoded images are compared. The
/// images are synthetic contacts, decoded with a dictionary that K-SVD learned from others. With --recordings, raster
/// images of presses that are not scored are decoded as well, with the published dictionary.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts seeds
  spts seeds --recordings recordings/ --rows 5,7,10,13,20
  spts seeds --seeds my_seeds.txt --json
  spts seeds --seeds out/seeds/bytes_seeds.txt --mode analog
  spts seeds --taxels 400 --quick

A seed FILE holds whole numbers in [0, 4294967295], decimal or with 0x, with spaces, commas or line ends between them
and # before comments: one a taxel, row by row, of a square skin. A LIST is the same on the command line, with commas.

Files in DIR:
  facts.csv                 period, rows until a taxel repeats another's weights, constant rows, rank of the first N
                            rows; one line a set
  windows.csv               one line a set and M: rank, condition, coherence, isometry
  worth.csv                 one line a kind of images, noise, decoder, M and set: IoU, its gain over the given set,
                            standard errors
  seeds.json                all of them, and the seeds
  NAME_seeds.txt            seeds of the sets mixed, searched and bytes, for --seeds and for seeds_file under [rows] of
                            a scene
  NAME_bus.csv              bytes that the bus master sends each cell to load its seed: the mode and one byte, or the
                            mode with bit 0x80 set and four bytes; up to 112 cells
  readout_mixed.toml        the profile as_built with mixed addresses, for --readout
  figures/seeds.png         coherence and IoU over M; matrices.png the first rows; .svg the same

The searched seeds are proposed if they beat the mixed addresses by two standard errors on windows that the search did
not see. Otherwise the mixed addresses are proposed.")]
pub(super) struct SeedsCommand {
    /// Set to judge: address, mixed, a FILE or a LIST
    #[arg(long, value_name = "SET", default_value = "address", allow_hyphen_values = true)]
    seeds: String,
    /// Taxels of the skin with address or mixed, N: a square number in [16, 1024]
    #[arg(long, value_name = "N", default_value = "100", value_parser = square(4..=32))]
    taxels: Side,
    /// Numbers of rows M in a window; each [1, 1000]
    #[arg(long, value_delimiter = ',', value_name = "M,…", default_value = "5,7,10,13,20",
          value_parser = parse_measurements)]
    rows: Vec<usize>,
    /// Weights that the cells put out: binary (±1) or analog (eight bits)
    #[arg(long, value_enum, default_value = "binary")]
    mode: ModeArg,
    /// Folder of recordings, whose raster images are decoded too [default: synthetic images alone]
    #[arg(long, value_name = "DIR")]
    recordings: Option<PathBuf>,
    /// Standard deviation of the noise of a sample, as a share of the image's Euclidean norm; [0, 10]
    #[arg(long, value_name = "SHARE", default_value_t = 0.06, value_parser = within(0.0, 10.0, "[0, 10]"))]
    noise: f64,
    /// Number of sets that the search for better seeds tries; [0, 1000000] [default: 2000, with --quick 200]
    #[arg(long, value_name = "COUNT", value_parser = whole::<u32>(0..=1_000_000))]
    budget: Option<u32>,
    /// Number of windows that are judged; [1, 10000] [default: 64, with --quick 16]
    #[arg(long, value_name = "COUNT", value_parser = whole::<u32>(1..=10_000))]
    windows: Option<u32>,
    /// Number of synthetic images; [2, 100000] [default: 400, with --quick 60]
    #[arg(long, value_name = "COUNT", value_parser = whole::<u32>(2..=100_000))]
    images: Option<u32>,
    /// A short run of a few seconds: fewer windows and images, a short search
    #[arg(long)]
    quick: bool,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    /// Folder of the results
    #[arg(long, value_name = "DIR", default_value = "out/seeds")]
    out: PathBuf,
    #[command(flatten)]
    common: Common,
}

/// Weights on the command line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum ModeArg {
    /// ±1
    Binary,
    /// Eight bits
    Analog,
}

impl SeedsCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let out = open_folder(&self.out, spts_report::seeds::FILES)?;
        let or = |asked: Option<u32>, default: u32, quick: u32| {
            asked.unwrap_or(if self.quick { quick } else { default }) as usize
        };
        let study = SeedStudy {
            given: set(&self.seeds, self.taxels.0)?,
            mode: match self.mode {
                ModeArg::Binary => WeightMode::Binary,
                ModeArg::Analog => WeightMode::Analog,
            },
            rows: sorted(self.rows.clone()),
            windows: or(self.windows, 64, 16),
            budget: or(self.budget, 2000, 200),
            images: or(self.images, 400, 60),
            noise: self.noise,
            recordings: self.recordings.clone(),
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        write(&report, out)?;
        let text = || {
            format!(
                "{}\ntables and pictures: {}",
                report.text().trim_end(),
                self.out.display()
            )
        };
        self.common.print(&report, text)
    }
}

/// The set called `text`: a rule of the circuit, a list, or a file.
fn set(text: &str, side: usize) -> Result<SeedSet, CliError> {
    match text {
        "address" => Ok(SeedSet::of(Seeding::Address, side)),
        "mixed" => Ok(SeedSet::of(Seeding::Mixed, side)),
        list if list.contains(',') => Ok(SeedSet::parse("list", "`--seeds`", list)?),
        file if Path::new(file).exists() => Ok(SeedSet::read(Path::new(file))?),
        other => Err(CliError::Usage(format!(
            "`--seeds` = {other}: is not address, mixed, a file, or a list of whole numbers in [0, 4294967295] with commas between them"
        ))),
    }
}
