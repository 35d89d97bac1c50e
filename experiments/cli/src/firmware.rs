//! `spts firmware`: the cell's firmware on emulated controllers.

use crate::context::{Bars, Common, print};
use crate::error::CliError;
use crate::options::{number, whole, within};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand, ValueEnum};
use spts::output::{NpyFile, check_replaceable};
use spts_circuit::{Seeding, WeightMode};
use spts_firmware::attiny412::TraceRecord;
use spts_firmware::{Clock, PATTERN_BITS};
use spts_studies::firmware::{CellTask, DESIGN_EDGE_HZ, EmulatedCells, image, verification_text};
use std::io::Read as _;
use std::path::{Path, PathBuf};

/// Runs the firmware of the skin's cells on emulated ATtiny412 microcontrollers.
///
/// A cell is the microcontroller behind one taxel: at every edge of the clock line it puts out the next weight of its
/// taxel, as a code of its DAC. The emulation runs the instructions of every cell, with its clock pin, its I2C address
/// and its DAC.
///
/// Two firmware images ship. `shipped` sets the DAC at the edge and computes the next weight afterwards. `plain`
/// computes first, as the published device does, and is interrupted by a timer every millisecond, so that its DAC is
/// sometimes late. A scene with `weights = "firmware"` takes its weights from cells like these.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts firmware verify --cells 20
  spts firmware weights --mode analog --out weights.npy
  spts firmware trace --taxel 3")]
pub(super) struct FirmwareCommand {
    #[command(subcommand)]
    command: FirmwareAction,
}

#[derive(Debug, Subcommand)]
enum FirmwareAction {
    Verify(VerifyCommand),
    Weights(WeightsCommand),
    Trace(TraceCommand),
}

/// Checks that emulated cells put out exactly the weights that the twin computes by formula.
///
/// After every clock edge, the DAC codes of all cells are read at the time of the converter's sample and compared with
/// the formula. The cells' replies over the I2C bus are checked as well. The exit status is 1 when a code or a reply
/// differs.
///
/// A code that comes after the sample counts as different. At the default clock the image `plain` is sometimes that
/// late; with a slower clock and a later sample, as in the third example, it is not.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts firmware verify
  spts firmware verify --cells 100 --edges 1000000 --json
  spts firmware verify --image plain --edge-hz 50000 --sample-us 19
  spts firmware verify --image my_cell.hex --seeding mixed --cells 112 --mode analog --mode binary
  spts firmware verify --mode pattern --period 13,20,25 --edges 1000000")]
struct VerifyCommand {
    /// Clock edges to check in every mode; [1, 1000000000]
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = whole::<u64>(1..=1_000_000_000))]
    edges: u64,
    /// Mode of the cells to check; may be given several times [default: all four]
    #[arg(long = "mode", value_name = "MODE")]
    modes: Vec<ModeName>,
    /// Lengths of the patterns of mode `pattern`, in bits, one run for each; [1, 64]
    #[arg(long = "period", value_name = "BITS,...", value_delimiter = ',', default_value = "7,20,64", value_parser = bits())]
    periods: Vec<usize>,
    #[command(flatten)]
    cells: CellOptions,
    #[command(flatten)]
    common: Common,
}

/// Writes the weights that emulated cells put out, as a NumPy array of doubles with one row an edge and one column a
/// cell.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts firmware weights --out weights.npy
  spts firmware weights --mode analog --edges 2000 --seeding mixed --out analog.npy

In Python, for an image x with one value a cell: y = numpy.load(\"weights.npy\") @ x")]
struct WeightsCommand {
    /// NumPy file to write
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Clock edges: rows of the array; [1, 1000000]
    #[arg(long, value_name = "N", default_value_t = 10_000, value_parser = whole::<usize>(1..=1_000_000))]
    edges: usize,
    /// Mode of the cells
    #[arg(long, value_name = "MODE", default_value = "binary")]
    mode: ModeName,
    /// Length of the pattern of mode `pattern`, in bits; [1, 64]
    #[arg(long, value_name = "BITS", default_value_t = 20, value_parser = bits())]
    period: usize,
    #[command(flatten)]
    cells: CellOptions,
    #[command(flatten)]
    common: Common,
}

/// Prints what one emulated cell does, instruction by instruction.
///
/// One line is one instruction: tick of the 20 MHz oscillator, byte address, instruction, changed registers. The cell
/// is first seeded over the bus and then clocked. With --from-reset it is neither seeded nor clocked. Use --from-reset
/// for an image that fails before it answers on the bus.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts firmware trace
  spts firmware trace --taxel 56 --mode raster --edges 2 --image plain
  spts firmware trace --from-reset 5000 --image my_cell.hex")]
struct TraceCommand {
    /// Taxel of the cell, counted from 0; the cell's bus address is 8 more
    #[arg(long, value_name = "K", default_value_t = 0, value_parser = whole::<usize>(0..=111))]
    taxel: usize,
    /// Trace this many ticks of 50 ns from power-on, without bus and clock; [1, 100000000] [default: trace the --edges
    /// clock edges after seeding]
    #[arg(long, value_name = "TICKS", conflicts_with_all = ["edges", "mode"], value_parser = whole::<u64>(1..=100_000_000))]
    from_reset: Option<u64>,
    /// Clock edges; [1, 10000]
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = whole::<u64>(1..=10_000))]
    edges: u64,
    /// Mode of the cells
    #[arg(long, value_name = "MODE", default_value = "binary")]
    mode: ModeName,
    /// Length of the pattern of mode `pattern`, in bits; [1, 64]
    #[arg(long, value_name = "BITS", default_value_t = 20, value_parser = bits())]
    period: usize,
    #[command(flatten)]
    cells: CellOptions,
}

/// Which cells are run, and how.
#[derive(Debug, Args)]
struct CellOptions {
    /// Cells on the bus, addresses 8 and up; [1, 112]
    #[arg(long, value_name = "N", default_value_t = 100, value_parser = whole::<u8>(1..=112))]
    cells: u8,
    /// Firmware image: shipped or plain (`spts firmware --help` describes them), or a file in Intel's hex format
    #[arg(long, value_name = "IMAGE", default_value = "shipped")]
    image: String,
    /// Seeds of the cells' random generators: address is the cell's bus address in one byte, as published; mixed is a
    /// 32-bit hash of it
    #[arg(long, value_name = "SEEDING", default_value = "address", value_parser = seeding())]
    seeding: Seeding,
    /// Clock edges a second, rising and falling; every edge is a measurement; [1, 1000000]
    #[arg(long, value_name = "HZ", default_value_t = DESIGN_EDGE_HZ, value_parser = within(1.0, 1e6, "[1, 1000000] Hz"))]
    edge_hz: f64,
    /// Time from a clock edge to the sample, µs; [0, 1000000/HZ) for --edge-hz HZ [default: 11 µs up to 64300 Hz, as
    /// on the real skin; at a faster clock the same share of a period, such as 9.8 µs at 72000 Hz]
    #[arg(long, value_name = "US", value_parser = number)]
    sample_us: Option<f64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum ModeName {
    Raster,
    Analog,
    Binary,
    Pattern,
}

impl ModeName {
    fn task(self, period: usize) -> CellTask {
        let (mode, period) = match self {
            Self::Raster => (WeightMode::Raster, None),
            Self::Analog => (WeightMode::Analog, None),
            Self::Binary => (WeightMode::Binary, None),
            Self::Pattern => (WeightMode::Binary, Some(period)),
        };
        CellTask { mode, period }
    }
}

/// Parser of the kind of seeds.
fn seeding() -> impl TypedValueParser<Value = Seeding> {
    PossibleValuesParser::new(["address", "mixed"]).map(|name| match name.as_str() {
        "mixed" => Seeding::Mixed,
        _ => Seeding::Address,
    })
}

/// Parser of a number of bits of a pattern.
fn bits() -> impl TypedValueParser<Value = usize> {
    whole::<usize>(1..=PATTERN_BITS)
}

impl CellOptions {
    fn emulated(&self, edges: u64, tasks: Vec<CellTask>) -> Result<EmulatedCells, CliError> {
        Ok(EmulatedCells {
            image_name: self.image.clone(),
            image: image(&self.image)?,
            cells: usize::from(self.cells),
            edges,
            tasks,
            seeding: self.seeding,
            clock: self.clock()?,
        })
    }

    fn clock(&self) -> Result<Clock, CliError> {
        let mut clock = Clock::at(self.edge_hz);
        if let Some(sample_us) = self.sample_us {
            clock.sample_delay_s = sample_us * 1e-6;
        }
        clock.check()?;
        Ok(clock)
    }
}

impl FirmwareCommand {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), CliError> {
        match self.command {
            FirmwareAction::Verify(command) => command.run(),
            FirmwareAction::Weights(command) => command.run(),
            FirmwareAction::Trace(command) => command.run(),
        }
    }
}

impl VerifyCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let modes: &[ModeName] = match self.modes.as_slice() {
            [] => ModeName::value_variants(),
            modes => modes,
        };
        let mut tasks: Vec<CellTask> = Vec::new();
        for mode in modes {
            for &period in &self.periods {
                let task = mode.task(period);
                if !tasks.contains(&task) {
                    tasks.push(task);
                }
            }
        }
        let cells = self.cells.emulated(self.edges, tasks)?;
        let verification = cells.verify(&Bars::default())?;
        self.common.print(&verification, || verification_text(&verification))?;
        if verification.mismatches > 0 {
            return Err(CliError::Differs(format!(
                "image {}: {} codes or read-backs are not the twin's",
                verification.image, verification.mismatches
            )));
        }
        Ok(())
    }
}

impl WeightsCommand {
    fn run(self) -> Result<(), CliError> {
        self.common.start()?;
        let task = self.mode.task(self.period);
        check_array(&self.out)?;
        let cells = self.cells.emulated(self.edges as u64, vec![task])?;
        let mut file = NpyFile::create(&self.out, &[self.edges, cells.cells])?;
        cells.weights(task, &Bars::default(), &mut |levels| file.push(levels.iter().copied()))?;
        file.finish()?;
        let written = serde_json::json!({
            "file": self.out, "shape": [cells.edges, cells.cells], "mode": task.mode(), "period": task.period,
            "image": cells.image_name,
        });
        let (file, name) = (self.out.display(), task.name());
        let text = || format!("{file}: {} edges × {} cells, {name}", cells.edges, cells.cells);
        self.common.print(&written, text)
    }
}

impl TraceCommand {
    fn run(&self) -> Result<(), CliError> {
        let task = self.mode.task(self.period);
        let cells = self.cells.emulated(self.edges, vec![task])?;
        let mut printed = Ok(());
        let mut line = |record: &TraceRecord| {
            if printed.is_ok() {
                printed = print(record.to_string().trim_end());
            }
        };
        match self.from_reset {
            Some(ticks) => cells.trace_from_reset(self.taxel, ticks, &mut line)?,
            None => cells.trace(task, self.taxel, &mut line)?,
        }
        printed
    }
}

/// Refuses to write an array where one cannot be written, and in place of a file that is no array.
fn check_array(path: &Path) -> Result<(), CliError> {
    let is_array = |path: &Path| {
        let mut start = [0; MAGIC.len()];
        let found = spts_input::open(path, u64::MAX).is_ok_and(|(mut file, _)| file.read_exact(&mut start).is_ok());
        found && start == *MAGIC
    };
    Ok(check_replaceable(path, is_array)?)
}

/// First bytes of every NumPy array.
const MAGIC: &[u8; 6] = b"\x93NUMPY";
