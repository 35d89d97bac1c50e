//! `spts record`: reads a device into a session.

use crate::context::{Common, note, progress};
use crate::device::DeviceMode;
use crate::error::CliError;
use crate::options::{whole, within};
use clap::Args;
use serde::Serialize;
use serial2::SerialPort;
use spts::device::Host;
use spts::session::{Event, Recorded, SESSION_FILE};
use spts::{Block, Mode, Recording, Session};
use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// Records a device, real or virtual, into a session.
///
/// Wakes the device on the port, reads blocks of 1,000 frames of 100 codes, and writes them as a session, which every
/// other command takes. A folder that already holds the session's recording in the other mode gets this one added. The
/// device does not say what it is; --mode and --readout do.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts record --port /dev/ttyACM0 --object cup --mode raster --out out/cup
  spts record --port /dev/ttyACM0 --object cup --mode binary --out out/cup --blocks 20
  spts decode out/cup
  spts device --pty                            a device without the hardware, in another terminal

--json prints {\"session\", \"mode\", \"blocks\", \"measurements\", \"signal_v\"}; `signal_v` is the root mean square of a frame
of the hold about the mean of the idle part, V, block by block.")]
pub(super) struct RecordCommand {
    /// Serial port of the device
    #[arg(long, value_name = "PATH")]
    port: PathBuf,
    /// Folder of the session
    #[arg(long, value_name = "DIR", default_value = "out/recorded")]
    out: PathBuf,
    /// Name of the object that is pressed: the class of the session
    #[arg(long, value_name = "NAME", default_value = "unknown")]
    object: String,
    /// What the device measures at each clock edge
    #[arg(long, value_enum, default_value_t = DeviceMode::Binary)]
    mode: DeviceMode,
    /// Readout profile of the device: clock, converter and seeds of the cells
    #[arg(long, value_name = "PROFILE", default_value = "as_built")]
    readout: String,
    /// Number of blocks to read, a press each; [1, 10000]
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole::<u64>(1..=10_000))]
    blocks: u64,
    /// Number of blocks at the beginning that only condition the skin and are not scored; [0, 10000]
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=10_000))]
    conditioning: u64,
    /// Number of frames at the start of every block in which nothing touches the skin; [0, 1000]
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = whole::<u64>(0..=1000))]
    idle: u64,
    /// First frame of every block in which the object is held, and the frame after the last; each [0, 999]
    #[arg(long, value_name = "FIRST,END", default_value = "500,700", value_delimiter = ',', num_args = 1, value_parser = whole::<u32>(0..=999))]
    hold: Vec<u32>,
    /// Speed of the port, baud; devices on USB ignore it; [50, 4000000]
    #[arg(long, value_name = "BAUD", default_value_t = 115_200, value_parser = whole::<u32>(50..=4_000_000))]
    baud: u32,
    /// Longest silence of the device before the recording fails, s; [0.1, 86400]
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = within(0.1, 86_400.0, "[0.1, 86400]"))]
    timeout: f64,
    #[command(flatten)]
    common: Common,
}

/// Frames of a block.
const FRAMES: usize = 1000;

/// What the command reports.
#[derive(Serialize)]
struct Report {
    session: PathBuf,
    mode: Mode,
    blocks: usize,
    measurements: usize,
    signal_v: Vec<f64>,
}

impl RecordCommand {
    pub(super) fn run(&self) -> Result<(), CliError> {
        let &[first, end] = self.hold.as_slice() else {
            return Err(CliError::usage(format!("`--hold` = {:?}; valid: FIRST,END", self.hold)));
        };
        if first >= end {
            return Err(CliError::usage(format!("`--hold` = {first},{end}: the end is not behind the first frame")));
        }
        let chain = self.mode.chain(&self.readout, 0)?;
        let readout = chain.readout(self.mode.readout(), 0)?;
        let info = readout.info().clone();
        let converter = info
            .converter
            .ok_or_else(|| CliError::usage(format!("`--readout` = {:?} has no converter", self.readout)))?;
        let frame = info.measurements_per_frame;
        let frame_s = frame as f64 / info.sample_rate_hz;
        let mut session = self.session([f64::from(first) * frame_s, f64::from(end) * frame_s])?;
        let mut host = Host::greet(self.open()?)?;
        let bar = progress(usize::try_from(self.blocks).unwrap_or(usize::MAX), "blocks");
        let mut blocks = Vec::new();
        for _ in 0..self.blocks {
            let found = host.block(FRAMES * frame)?;
            if let Some(code) = found.codes.iter().find(|code| **code > converter.max_code()) {
                let most = converter.max_code();
                return Err(CliError::usage(format!("block {}: code {code} is outside [0, {most}]", blocks.len())));
            }
            let volts = found.codes.iter().map(|code| converter.volts(*code));
            // the last one of a block is never sent
            let volts = volts.chain([f64::NAN]).collect();
            blocks.push(Block {
                frame_position: found.frame_position,
                idle_frames: Some(usize::try_from(self.idle).unwrap_or_default()),
                volts,
            });
            bar.inc(1);
        }
        bar.finish_and_clear();
        let signal_v: Vec<f64> =
            blocks.iter().map(|block| self.signal_v(&block.volts, frame, first as usize)).collect();
        let count = blocks.len();
        let recording = Recording::new(info, blocks).map_err(|e| CliError::usage(format!("what was read: {e}")))?;
        let recorded = Recorded {
            conditioning: usize::try_from(self.conditioning).unwrap_or_default().min(count),
            ..Recorded::new(recording)
        };
        *self.slot(&mut session) = Some(recorded);
        session.write(&self.out)?;
        let report = Report {
            session: self.out.clone(),
            mode: self.mode.readout(),
            blocks: count,
            measurements: FRAMES * frame,
            signal_v,
        };
        self.common.print(&report, || text(&report))
    }

    fn open(&self) -> Result<SerialPort, CliError> {
        let failed = |e: io::Error| CliError::usage(format!("`--port` = {}: {e}", self.port.display()));
        let mut port = SerialPort::open(&self.port, self.baud).map_err(failed)?;
        port.set_read_timeout(Duration::from_secs_f64(self.timeout)).map_err(failed)?;
        Ok(port)
    }

    /// The session that is there, without the mode that is recorded now, or a new one.
    fn session(&self, hold_s: [f64; 2]) -> Result<Session, CliError> {
        let new = Session { hold_s: Some(hold_s), ..Session::new(&self.object, Event::Press) };
        if !self.out.join(SESSION_FILE).exists() {
            return Ok(new);
        }
        let mut there = Session::read(&self.out)?;
        if there.object != self.object {
            return Err(CliError::usage(format!(
                "`--object` = {:?}: {} holds a session of {:?}",
                self.object,
                self.out.display(),
                there.object
            )));
        }
        if self.slot(&mut there).is_some() {
            note(&format!("note: the recording of this mode in {} is replaced", self.out.display()));
        }
        Ok(Session { hold_s: Some(hold_s), ..there })
    }

    /// The recording of `session` in this mode.
    fn slot<'a>(&self, session: &'a mut Session) -> &'a mut Option<Recorded> {
        match self.mode.readout() {
            Mode::Raster => &mut session.raster,
            Mode::Compressive => &mut session.compressive,
        }
    }

    /// Root mean square of the first frame of the hold about the mean of the idle part, V.
    fn signal_v(&self, volts: &[f64], frame: usize, first: usize) -> f64 {
        let idle = usize::try_from(self.idle).unwrap_or_default().max(1) * frame;
        let idle = &volts[..idle.min(volts.len() - 1)];
        let mean = idle.iter().sum::<f64>() / idle.len() as f64;
        let hold = &volts[first * frame..][..frame - 1];
        (hold.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / hold.len() as f64).sqrt()
    }
}

fn text(report: &Report) -> String {
    let signals: Vec<String> = report.signal_v.iter().map(|v| format!("{v:.2}")).collect();
    format!(
        "{} blocks of {} measurements\nsignal of the hold, V, block by block: {}\nsession: {}",
        report.blocks,
        report.measurements,
        signals.join(" "),
        report.session.display()
    )
}
