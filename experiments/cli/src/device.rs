//! `spts device`: the skin on a pseudo-terminal, for host software.

use crate::context::{note, notes, print};
use crate::error::CliError;
use crate::options::{number, pressed, seed, whole};
use clap::Args;
use rustix::fs::{Mode as Access, OFlags, open};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use serde::Serialize;
use spts::chain::RowsConfig;
use spts::circuit::CompressiveWeights;
use spts::data::SessionSet;
use spts::device::{BlockSource, Played, Pressed, PressedConfig, VirtualDevice};
use spts::{Chain, ChainConfig, Mode, Session, SkinLayout, WeightMode};
use spts_contact::objects::ObjectSpec;
use std::fs::File;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

/// What the device measures, as it is compiled into it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum DeviceMode {
    /// One taxel after the other
    Raster,
    /// All taxels at once, each with a weight of 256 levels
    Analog,
    /// All taxels at once, each with the weight +1 or −1
    Binary,
}

impl DeviceMode {
    /// Which readout it is.
    pub(super) fn readout(self) -> Mode {
        match self {
            Self::Raster => Mode::Raster,
            Self::Analog | Self::Binary => Mode::Compressive,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Analog => "analog",
            Self::Binary => "binary",
        }
    }

    /// The chain of a device with this mode and the readout profile `readout`.
    pub(super) fn chain(self, readout: &str, seed: u64) -> Result<Chain, CliError> {
        let config = ChainConfig {
            readout: Some(readout.to_owned()),
            rows: RowsConfig {
                levels: match self {
                    Self::Raster => None,
                    Self::Analog => Some(CompressiveWeights::Analog),
                    Self::Binary => Some(CompressiveWeights::Binary),
                },
                ..RowsConfig::default()
            },
            ..ChainConfig::default()
        };
        let chain = Chain::new(&config, &SkinLayout::default(), seed, Path::new(""));
        chain.map_err(CliError::from)
    }
}

/// Stands in for the skin's hardware: host software reads this virtual device as it reads the skin.
///
/// The command opens a pseudo-terminal, prints its name, and speaks the published device's protocol on it: it waits for
/// `*`, answers `Sending.`, loads the seeds into its cells, answers `Sent!.`, and sends block after block of 1,000
/// frames of 100 codes of the converter.
///
/// Without SESSION, an object is pressed on a simulated skin again and again, a press a block; only the contact is
/// simulated, not the arm, and the force rises and falls in about a quarter of a second. With SESSION, the device sends
/// that recording, of the twin or of the real skin.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts device --pty                            T is pressed; the first line printed is the port, such as /dev/pts/5
  spts device --pty --mode raster --object tape --force 30 --fast
  spts device out/T --pty                      a session, as `spts simulate press/T --out out/T` leaves one
  spts record --port /dev/pts/5 --out out/rec  reads it, in another terminal

--json prints {\"port\", \"mode\", \"taxels\", \"blocks\"} on one line, and then serves.")]
pub(super) struct DeviceCommand {
    /// Session that the device sends, a folder with session.json [default: an object is pressed]
    session: Option<PathBuf>,
    /// Open a pseudo-terminal, the port of the device; it has to be given, as there is no other kind of port
    #[arg(long, required = true)]
    pty: bool,
    /// What the device measures at each clock edge
    #[arg(long, value_enum, default_value_t = DeviceMode::Binary)]
    mode: DeviceMode,
    /// Object that is pressed: one of the seventeen that `spts simulate --list` shows, or finger
    #[arg(long, value_name = "NAME", default_value = "T", value_parser = pressed, conflicts_with = "session")]
    object: &'static ObjectSpec,
    /// Force while the object is held, N; [0.1, 1000]
    #[arg(long, value_name = "N", default_value = "20", value_parser = number, allow_hyphen_values = true, conflicts_with = "session")]
    force: f64,
    /// Readout profile of the device: as_built, as_published, as_designed, ideal, or FILE.toml
    #[arg(long, value_name = "PROFILE", default_value = "as_built", conflicts_with = "session")]
    readout: String,
    /// Stop after so many blocks; [1, 1000000] [default: those of SESSION, or no end]
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..=1_000_000))]
    blocks: Option<u64>,
    /// Send as fast as the host reads, in place of real time
    #[arg(long)]
    fast: bool,
    /// Seed of the skin and its noise
    #[arg(long, value_name = "SEED", default_value_t = 0, value_parser = seed)]
    seed: u64,
    /// Print the port as JSON
    #[arg(long)]
    json: bool,
}

/// What the command prints first.
#[derive(Serialize)]
struct Opened<'a> {
    port: &'a str,
    mode: &'a str,
    taxels: usize,
    blocks: Option<u64>,
}

impl DeviceCommand {
    pub(super) fn run(&self) -> Result<(), CliError> {
        match &self.session {
            None => {
                let config = PressedConfig {
                    object: self.object,
                    force_n: self.force,
                    mode: self.mode.readout(),
                    blocks: self.blocks,
                    session: 0,
                };
                let chain = self.mode.chain(&self.readout, self.seed)?;
                let taxels = chain.skin().taxels();
                self.serve(&mut Pressed::new(&chain, config)?, taxels, self.blocks)
            }
            Some(path) => {
                let set = SessionSet::open(path)?;
                notes(&set.note);
                let recording = self.recording(path, &set)?;
                let asked = self.blocks.and_then(|asked| usize::try_from(asked).ok());
                let blocks = recording.blocks().iter().take(asked.unwrap_or(usize::MAX));
                let sent = spts::Recording::new(recording.info().clone(), blocks.cloned().collect())?;
                let blocks = sent.blocks().len() as u64;
                self.serve(&mut Played::new(&sent)?, sent.taxels(), Some(blocks))
            }
        }
    }

    /// The recording of this mode of the only session of `set`.
    fn recording<'a>(&self, path: &Path, set: &'a SessionSet) -> Result<&'a spts::Recording, CliError> {
        let refuse = |reason: String| CliError::usage(format!("{}: {reason}", path.display()));
        let [session] = set.sessions.as_slice() else {
            let names: Vec<&str> = set.sessions.iter().map(|s| s.name.as_str()).collect();
            return Err(refuse(format!("holds several sessions: {}; name the folder of one", names.join(", "))));
        };
        let found = match self.mode.readout() {
            Mode::Raster => Session::raster(session),
            Mode::Compressive => Session::compressive(session),
        };
        let found = found.ok_or_else(|| refuse(format!("has no recording for `--mode` = {}", self.mode.name())))?;
        if found.weights().wire_count() > 1 {
            return Err(refuse("is of several wires; a device has one".to_owned()));
        }
        let measured = match found.weights().mode() {
            WeightMode::Raster => DeviceMode::Raster,
            WeightMode::Analog => DeviceMode::Analog,
            WeightMode::Binary => DeviceMode::Binary,
        };
        if measured != self.mode {
            let (wanted, measured) = (self.mode.name(), measured.name());
            return Err(refuse(format!(
                "`--mode` = {wanted}: the recording is {measured}; `--mode {measured}` sends it"
            )));
        }
        Ok(found)
    }

    fn serve(&self, source: &mut dyn BlockSource, taxels: usize, blocks: Option<u64>) -> Result<(), CliError> {
        let terminal = Terminal::open().map_err(|e| CliError::usage(format!("`--pty`: {e}")))?;
        let opened = Opened { port: &terminal.name, mode: self.mode.name(), taxels, blocks };
        if self.json {
            let line = serde_json::to_string(&opened)?;
            print(&line)?;
        } else {
            print(&terminal.name)?;
            note("waits for a host; Ctrl-C ends it");
        }
        let mut device = VirtualDevice::new(terminal.device, !self.fast);
        let count = device.serve(source, |count| note(&format!("block {count} sent")))?;
        note(&format!("all {count} blocks sent; waits until the host has read them"));
        // what is left in the terminal goes with it
        let _ = rustix::termios::tcdrain(&terminal.host);
        std::thread::sleep(std::time::Duration::from_millis(200));
        Ok(())
    }
}

/// A pseudo-terminal: the device's end, and the host's, which is kept open so that hosts may come and go.
struct Terminal {
    device: File,
    host: OwnedFd,
    name: String,
}

impl Terminal {
    fn open() -> rustix::io::Result<Self> {
        let device = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&device)?;
        unlockpt(&device)?;
        let name = ptsname(&device, Vec::new())?;
        let host = open(name.as_c_str(), OFlags::RDWR | OFlags::NOCTTY, Access::empty())?;
        // bytes go through as they are
        let mut settings = tcgetattr(&host)?;
        settings.make_raw();
        tcsetattr(&host, OptionalActions::Now, &settings)?;
        Ok(Self { device: File::from(device), host, name: name.to_string_lossy().into_owned() })
    }
}
