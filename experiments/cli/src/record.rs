//! `spts record`: reads a device into a session.

use crate::context::{Common, TICK, check_room, note, progress};
use crate::device::DeviceMode;
use crate::error::CliError;
use crate::options::{whole, within};
use clap::Args;
use rustix::fs::FlockOperation;
use rustix::io::Errno;
use serde::Serialize;
use serial2::SerialPort;
use spts::cleanup::Deferred;
use spts::device::{Heard, Host};
use spts::output::OutputFolder;
use spts::session::{Event, Recorded, SESSION_FILE, SessionWriter};
use spts::{Block, Mode, Recording, Session};
use spts_input::Refusal;
use std::io;
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Records a device, real or virtual, into a session.
///
/// Wakes the device on the port, reads blocks of 1,000 frames of 100 codes, and writes them as a session, which every
/// other command takes. A folder that already holds the session's recording in the other mode gets this one added. The
/// device does not say what it is; --mode and --readout do.
///
/// Every block is written as it comes: when the device goes away or falls silent, the disk is full, or Ctrl-C ends the
/// recording, the blocks before are a session. A code that cannot be read is a missing sample, and is named.
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
    /// Number of blocks to read, a press each; [1, 5000]
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = whole::<u64>(1..=MOST_BLOCKS))]
    blocks: u64,
    /// Number of blocks at the beginning that only condition the skin and are not scored; fewer than --blocks
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = whole::<u64>(0..=MOST_BLOCKS))]
    conditioning: u64,
    /// Number of frames at the start of every block in which nothing touches the skin; [0, 1000], and not beyond the
    /// first frame of --hold
    #[arg(long, value_name = "N", default_value_t = 150, value_parser = whole::<u64>(0..=1000))]
    idle: u64,
    /// First frame of every block in which the object is held, and the frame after the last; each [0, 999]
    #[arg(long, value_name = "FIRST,END", default_value = "500,700", value_delimiter = ',', num_args = 1, value_parser = whole::<u32>(0..=999))]
    hold: Vec<u32>,
    /// Speed of the port, baud; devices on USB ignore it; [50, 4000000]
    #[arg(long, value_name = "BAUD", default_value_t = 115_200, value_parser = whole::<u32>(50..=4_000_000))]
    baud: u32,
    /// Longest silence of the device, and longest time until it has greeted, s; [0.1, 86400]
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, value_parser = within(0.1, 86_400.0, "[0.1, 86400]"))]
    timeout: f64,
    #[command(flatten)]
    common: Common,
}

/// Frames of a block.
const FRAMES: usize = 1000;
/// Most blocks of a recording: their codes, of two bytes, are a file of 1 GB, and sessions of more are not read.
const MOST_BLOCKS: u64 = 5000;

/// What the command reports.
#[derive(Serialize)]
struct Report {
    session: PathBuf,
    mode: Mode,
    blocks: usize,
    measurements: usize,
    /// Nothing for a block without samples of its idle part or its hold.
    signal_v: Vec<Option<f64>>,
}

impl RecordCommand {
    pub(super) fn run(&self) -> Result<(), CliError> {
        let (first, end) = self.spans()?;
        let chain = self.mode.chain(&self.readout, 0)?;
        let readout = chain.readout(self.mode.readout(), 0)?;
        let info = readout.info().clone();
        if info.weights.wire_count() > 1 {
            return Err(CliError::usage(format!(
                "`--readout` = {:?} has several wires; a device has one",
                self.readout
            )));
        }
        let converter = info
            .converter
            .ok_or_else(|| CliError::usage(format!("`--readout` = {:?} has no converter", self.readout)))?;
        let frame = info.measurements_per_frame;
        let frame_s = frame as f64 / info.sample_rate_hz;
        // what stands in the way of writing is said before anything is read
        let out = OutputFolder::open(&self.out)?;
        let mut session = self.session([f64::from(first) * frame_s, f64::from(end) * frame_s])?;
        let count = usize::try_from(self.blocks).unwrap_or(usize::MAX);
        let bytes = count.saturating_mul(FRAMES * frame * converter.code_bytes()) as u64;
        check_room(&self.out, &format!("`--blocks` = {}", self.blocks), bytes)?;
        if self.slot(&mut session).take().is_some() {
            note(&format!("note: the recording of this mode in {} is replaced", self.out.display()));
        }
        let mut writer = SessionWriter::create(&out.path(""), &session).map_err(|e| out.unstaged(e))?.limited();
        for (mode, recorded) in [(Mode::Raster, &session.raster), (Mode::Compressive, &session.compressive)] {
            if let Some(recorded) = recorded {
                let written = writer.push(mode, recorded, recorded.recording.blocks().len());
                written.map_err(|e| out.unstaged(e))?;
            }
        }
        let signals = Deferred::begin();
        let stop = || signals.signal().is_some();
        let named = |error: Refusal| error.at(format!("serial port {}", self.port.display()));
        let patience = Duration::from_secs_f64(self.timeout);
        let mut host = match Host::greet(self.open()?, patience, &stop).map_err(named)? {
            Some(host) => host,
            None => return Err(stopped(&signals, "nothing was recorded")),
        };
        let bar = progress(count, "blocks");
        let mut signal_v = Vec::new();
        let mut failed = None;
        for block in 0..count {
            let in_block = |error: Refusal| named(error.at(format!("block {block}")));
            let found = match host.block(FRAMES * frame, converter.max_code()) {
                Ok(Heard::Block(found)) => found,
                Ok(Heard::Unusable(problem)) => {
                    note(&format!("block {block} is left out: {problem}"));
                    continue;
                }
                Ok(Heard::Stopped) => break,
                Err(error) => {
                    failed = Some(in_block(error));
                    break;
                }
            };
            if let Some(missing) = &found.missing {
                note(&format!("block {block}: {missing}"));
            }
            let volts = found.codes.iter().map(|code| code.map_or(f64::NAN, |code| converter.volts(code))).collect();
            let idle_frames = Some(usize::try_from(self.idle).unwrap_or_default());
            let read = Block { frame_position: found.frame_position, idle_frames, volts };
            let signal = self.signal_v(&read.volts, frame, first as usize);
            let piece = match Recording::new(info.clone(), vec![read]) {
                Ok(recording) => Recorded {
                    conditioning: usize::try_from(self.conditioning).unwrap_or(count),
                    ..Recorded::new(recording)
                },
                Err(problem) => {
                    note(&format!("block {block} is left out: {problem}"));
                    continue;
                }
            };
            if let Err(error) = writer.push(self.mode.readout(), &piece, count) {
                failed = Some(out.unstaged(error));
                break;
            }
            signal_v.push(signal);
            bar.inc(1);
        }
        bar.finish_and_clear();
        let blocks = signal_v.len();
        if blocks == 0 {
            let nothing = format!("serial port {}: no block was recorded", self.port.display());
            return Err(failed.map_or_else(|| stopped(&signals, &nothing), CliError::Refused));
        }
        writer.finish().map_err(|e| out.unstaged(e))?;
        out.commit()?;
        let report = Report {
            session: self.out.clone(),
            mode: self.mode.readout(),
            blocks,
            measurements: FRAMES * frame,
            signal_v,
        };
        self.common.print(&report, || text(&report))?;
        let kept = format!("of the blocks before, {blocks} are in {}", self.out.display());
        match failed {
            Some(error) => Err(CliError::Refused(error.reworded(|problem| format!("{problem}; {kept}")))),
            None if stop() => Err(stopped(&signals, &kept)),
            None => Ok(()),
        }
    }

    /// The hold, first frame and the one after the last, when it fits the other options.
    fn spans(&self) -> Result<(u32, u32), CliError> {
        let &[first, end] = self.hold.as_slice() else {
            return Err(CliError::usage(format!("`--hold` = {:?}; valid: FIRST,END", self.hold)));
        };
        if first >= end {
            return Err(CliError::usage(format!("`--hold` = {first},{end}: the end is not behind the first frame")));
        }
        if self.idle > u64::from(first) {
            let range = format!("[0, {first}], the frames before `--hold`");
            return Err(Refusal::range("--idle", self.idle, range).into());
        }
        if self.conditioning >= self.blocks {
            let range = format!("[0, {}], as `--blocks` = {}", self.blocks - 1, self.blocks);
            return Err(Refusal::range("--conditioning", self.conditioning, range).into());
        }
        Ok((first, end))
    }

    /// The port, which no other recorder reads.
    fn open(&self) -> Result<SerialPort, CliError> {
        let failed = |e: io::Error| CliError::usage(format!("`--port` = {}: {}", self.port.display(), self.reason(&e)));
        let found = self.port.metadata().map_err(failed)?;
        // a pipe would wait for a writer
        if !found.file_type().is_char_device() {
            let problem = format!("`--port` = {}: is not a serial port; {}", self.port.display(), ports());
            return Err(CliError::usage(problem));
        }
        let mut port = SerialPort::open(&self.port, self.baud).map_err(failed)?;
        // a system may have no locks on ports
        if let Err(Errno::WOULDBLOCK) = rustix::fs::flock(&port, FlockOperation::NonBlockingLockExclusive) {
            let problem = format!("`--port` = {}: another program reads this port", self.port.display());
            return Err(CliError::usage(problem));
        }
        // the host asks again and again whether to stop
        port.set_read_timeout(TICK).map_err(failed)?;
        Ok(port)
    }

    /// Why the port cannot be opened, and what helps.
    fn reason(&self, error: &io::Error) -> String {
        match error.kind() {
            io::ErrorKind::NotFound => format!("there is no such port; {}", ports()),
            io::ErrorKind::PermissionDenied => {
                let group = self.port.metadata().ok().and_then(|found| group_name(found.gid()));
                let group = group.unwrap_or_else(|| "dialout".to_owned());
                format!(
                    "{error}; the port is for the group {group}: `sudo usermod -aG {group} $USER`, then log in again"
                )
            }
            _ if error.raw_os_error() == Some(Errno::NOTTY.raw_os_error()) => {
                format!("is not a serial port; {}", ports())
            }
            _ => error.to_string(),
        }
    }

    /// The session that is there, or a new one.
    fn session(&self, hold_s: [f64; 2]) -> Result<Session, CliError> {
        let new = Session { hold_s: Some(hold_s), ..Session::new(&self.object, Event::Press) };
        if !self.out.join(SESSION_FILE).exists() {
            return Ok(new);
        }
        let there = Session::read(&self.out)?;
        if there.object != self.object {
            return Err(CliError::usage(format!(
                "`--object` = {:?}: {} holds a session of {:?}",
                self.object,
                self.out.display(),
                there.object
            )));
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

    /// Root mean square of the first frame of the hold about the mean of the idle part, V, of the samples that are
    /// there.
    fn signal_v(&self, volts: &[f64], frame: usize, first: usize) -> Option<f64> {
        let mean = |values: &mut dyn Iterator<Item = f64>| {
            let (mut sum, mut count) = (0.0, 0.0);
            values.filter(|value| !value.is_nan()).for_each(|value| (sum, count) = (sum + value, count + 1.0));
            (count > 0.0).then(|| sum / count)
        };
        let idle = usize::try_from(self.idle).unwrap_or_default().max(1) * frame;
        let rest_v = mean(&mut volts[..idle.min(volts.len())].iter().copied())?;
        let hold = &volts[first * frame..][..frame];
        mean(&mut hold.iter().map(|v| (v - rest_v).powi(2))).map(f64::sqrt)
    }
}

/// The end by a signal, with what is left.
fn stopped(signals: &Deferred, left: &str) -> CliError {
    match signals.signal() {
        Some(signal) => CliError::Stopped { signal, message: format!("stopped by a signal; {left}") },
        None => CliError::usage(left),
    }
}

/// The serial ports that there are.
fn ports() -> String {
    let mut ports = SerialPort::available_ports().unwrap_or_default();
    ports.sort();
    match ports.as_slice() {
        [] => "no serial port was found: is the device plugged in?".to_owned(),
        found => {
            let shown: Vec<String> = found.iter().take(MOST_PORTS).map(|port| port.display().to_string()).collect();
            format!("ports that are there: {}", shown.join(", "))
        }
    }
}

/// Most ports that an error lists.
const MOST_PORTS: usize = 8;

/// Name of the group with the number `gid`.
fn group_name(gid: u32) -> Option<String> {
    let groups = spts_input::read_text(Path::new("/etc/group"), 1 << 20).ok()?;
    let named = groups.lines().find(|line| line.split(':').nth(2) == Some(gid.to_string().as_str()))?;
    named.split(':').next().map(str::to_owned)
}

fn text(report: &Report) -> String {
    let shown = |v: &Option<f64>| v.map_or_else(|| "?".to_owned(), |v| format!("{v:.2}"));
    let signals: Vec<String> = report.signal_v.iter().map(shown).collect();
    format!(
        "{} blocks of {} measurements\nsignal of the hold, V, block by block: {}\nsession: {}",
        report.blocks,
        report.measurements,
        signals.join(" "),
        report.session.display()
    )
}
