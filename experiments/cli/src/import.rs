//! `spts import`: frames of any skin or simulator become a session.

use crate::context::{Common, notes, open_folder};
use crate::error::CliError;
use crate::options::{length, whole, with_unit};
use clap::Args;
use serde::Serialize;
use spts::data::{FrameArray, FrameOptions, Frames};
use spts::{FrameUnit, SkinLayout};
use std::path::{Path, PathBuf};

/// Reads frames of any skin or simulator, and writes them as a session that every other command takes.
///
/// A frame is what all taxels show at one time. FILE is .npy, .npz, .csv (or .tsv, .txt), .mat (version 5 to 7) or
/// .parquet. An array has the shape (presses, frames, rows, cols), (frames, rows, cols) or (frames, rows * cols); rows
/// and cols may also come first. In a text file, each line is either one frame, with the taxels row by row, or one row
/// of taxels. A header line and a column of times are recognised. NaN is a missing value.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts import glove.npy --rows 16 --cols 16 --rate 100 --out out/glove
  spts import sole.csv --rows 10 --cols 8 --unit pressure --pitch 12mm --idle first:20
  spts import cups.npz --rows 16 --cols 16 --unit codes --object cup --cut
  spts wire out/glove --out out/glove_wire && spts decode out/glove_wire

The session has the frames, unchanged, as its raster recording. Notes on standard error say what was found or assumed:
idle frames, the span in which the contact is steady, taxels that never change or are high without a touch.
--json prints {\"session\", \"presses\", \"frames\", \"rows\", \"cols\", \"rate_hz\", \"unit\", \"idle_frames\", \"hold_s\",
\"notes\"}.")]
pub(super) struct ImportCommand {
    /// File of frames
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Rows of taxels; [1, 1024]
    #[arg(long, value_name = "R", value_parser = whole::<usize>(1..=1024))]
    rows: usize,
    /// Columns of taxels; [1, 1024]
    #[arg(long, value_name = "C", value_parser = whole::<usize>(1..=1024))]
    cols: usize,
    /// Distance of neighbouring taxels, as 5mm or, in metres, 0.005; [0.0001, 1] m [default: 15mm, said in a note]
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    pitch: Option<f64>,
    /// Frames a second, as 100 or 100Hz; [0.001, 1000000] Hz [default: that of the file's times]
    #[arg(long, value_name = "HZ", value_parser = rate)]
    rate: Option<f64>,
    /// What the values are: pressure in Pa, conductance in S, codes of a converter, or relative ones; all grow with the
    /// load
    #[arg(long, value_name = "pressure|conductance|codes|relative", default_value = "relative", value_parser = unit)]
    unit: FrameUnit,
    /// Frames at the start of every press in which nothing touches the skin, as first:N; first:0 for none [default:
    /// those before the sum of the taxels rises]
    #[arg(long, value_name = "first:N", value_parser = idle)]
    idle: Option<usize>,
    /// Span of a press in which the contact is steady, s [default: where the sum of the taxels stays at its largest]
    #[arg(long, value_name = "START:END", value_parser = span)]
    hold: Option<[f64; 2]>,
    /// Number of frames of each press, for a file that has one press after another [default: from the shape of the
    /// array, else all frames are one press]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=100_000_000))]
    press_frames: Option<usize>,
    /// Split the frames into presses, one for each contact, all of the same length. A press starts some idle frames
    /// before the contact. Contacts whose start was not recorded are left out, and so are those shorter than half the
    /// median length. Use it for one long run, or for presses that do not start at the same time
    #[arg(long, conflicts_with = "press_frames")]
    cut: bool,
    /// Array of an .npz or .mat with several [default: the only one, or frames, pressure, data]
    #[arg(long, value_name = "NAME")]
    variable: Option<String>,
    /// Name of the session [default: that of FILE]
    #[arg(long, value_name = "NAME")]
    name: Option<String>,
    /// What was pressed: its class [default: the name of the session]
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Folder of the session [default: out/NAME]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    common: Common,
}

fn unit(text: &str) -> Result<FrameUnit, String> {
    let known = FrameUnit::ALL.into_iter().find(|(name, _)| *name == text);
    known.map(|(_, unit)| unit).ok_or_else(|| {
        let names = FrameUnit::ALL.map(|(name, _)| name).join(", ");
        format!("is not one of {names}")
    })
}

/// A rate, Hz.
fn rate(text: &str) -> Result<f64, String> {
    let found = with_unit(text, &[("kHz", 1e3), ("Hz", 1.0)]);
    found.filter(|hz| (1e-3..=1e6).contains(hz)).ok_or_else(|| "is outside [0.001, 1000000] Hz".to_owned())
}

fn idle(text: &str) -> Result<usize, String> {
    let number = text.strip_prefix("first:").and_then(|number| number.parse().ok());
    number.ok_or_else(|| "is not first:N with a whole number N".to_owned())
}

fn span(text: &str) -> Result<[f64; 2], String> {
    let ends = text.split_once(':').and_then(|(start, end)| Some([start.parse().ok()?, end.parse().ok()?]));
    ends.filter(|[start, end]: &[f64; 2]| 0.0 <= *start && start < end)
        .ok_or_else(|| "is not START:END, in seconds".to_owned())
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report {
    session: PathBuf,
    presses: usize,
    frames: usize,
    rows: usize,
    cols: usize,
    rate_hz: f64,
    unit: FrameUnit,
    idle_frames: Option<usize>,
    hold_s: Option<[f64; 2]>,
    notes: Vec<String>,
}

/// Pitch of a skin of which nothing is said: the published one's, m.
const PITCH_M: f64 = 0.015;

impl ImportCommand {
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let mut assumed = Vec::new();
        let pitch_m = self.pitch.unwrap_or_else(|| {
            assumed.push("pitch: 15 mm is assumed; --pitch says otherwise".to_owned());
            PITCH_M
        });
        let layout = SkinLayout::with_pitch(self.rows, self.cols, pitch_m)?;
        let array = self.read(layout.taxels())?;
        let in_file = |refusal: spts_input::Refusal| refusal.at(self.file.display());
        let frames = Frames::new(array, [self.rows, self.cols], self.press_frames);
        let frames = frames.and_then(|frames| if self.cut { frames.cut() } else { Ok(frames) }).map_err(in_file)?;
        let stem = self.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = self.name.clone().unwrap_or(stem);
        let options = FrameOptions {
            object: self.object.clone().unwrap_or_else(|| name.clone()),
            rate_hz: self.rate,
            idle: self.idle,
            hold_s: self.hold,
            ..FrameOptions::new(&name, layout, self.unit)
        };
        let (session, found) = frames.session(&options).map_err(in_file)?;
        assumed.extend(found);
        let out = self.out.clone().unwrap_or_else(|| Path::new("out").join(&name));
        let folder = open_folder(&out)?;
        session.write_files(&folder.path("")).map_err(|error| folder.unstaged(error))?;
        if let Some(times_s) = frames.times_s() {
            spts::output::write_npy(&folder.path("frame_time_s.npy"), &[times_s.len()], times_s)?;
        }
        folder.commit()?;
        notes(&assumed);
        let [presses, count, rows, cols] = frames.shape();
        let raster = session.raster();
        let report = Report {
            presses,
            frames: count,
            rows,
            cols,
            rate_hz: raster.map_or(f64::NAN, |r| r.sample_rate_hz() / r.measurements_per_frame() as f64),
            unit: self.unit,
            idle_frames: raster.and_then(|r| r.blocks().first()).and_then(|block| block.idle_frames),
            hold_s: session.hold_s,
            session: out,
            notes: assumed,
        };
        self.common.print(&report, || {
            format!(
                "{presses} presses of {count} frames of {rows} × {cols} taxels, {:.4} frames a second\nsession: {}",
                report.rate_hz,
                report.session.display()
            )
        })
    }

    fn read(&self, taxels: usize) -> Result<FrameArray, CliError> {
        if self.file.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
            let (columns, other) = spts_dataset::numbers_of(&self.file)?;
            let mut array = FrameArray::of_columns(columns);
            if !other.is_empty() {
                array.notes.push(format!("columns without numbers are left out: {}", other.join(", ")));
            }
            return Ok(array);
        }
        Ok(FrameArray::read(&self.file, self.variable.as_deref(), taxels)?)
    }
}
