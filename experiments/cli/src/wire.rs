//! `spts wire`: what one wire, and a few, would show of frames of any skin.

use crate::context::{Bars, Common, note, notes, open_folder};
use crate::error::CliError;
use crate::options::{parse_measurements, seed, sorted, whole, within};
use clap::Args;
use serde::Serialize;
use spts::chain::{ChainConfig, DEFAULT_READOUT, RowsConfig};
use spts::data::{Courses, SessionSet, WiredFrames, wired};
use spts::session::{Event, Recorded};
use spts::{Chain, Seeding, Session};
use spts_eval::decode::DecodeRequest;
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use spts_models::ConductanceMap;
use spts_report::few_wires::{FewWiresPage, text};
use spts_studies::few_wires::{FewWiresReport, FewWiresStudy, Touched};
use spts_studies::frames::{FramesReport, frames_report};
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Simulates how a skin with one or a few wires would record given frames, and scores the images decoded from them.
///
/// SESSION is a folder that `spts import` or `spts simulate` has written, or a folder of such folders. The results in
/// DIR are a session with two recordings, one by a single wire and one by a scan of all taxels; `spts decode`, `spts
/// score` and `spts calibrate` read it. For several sessions, DIR has a folder for each.
#[derive(Debug, Args)]
#[command(after_help = "Examples:
  spts import glove.npy --rows 16 --cols 16 --rate 100 --out out/glove
  spts wire out/glove --out out/glove_wire
  spts wire out/glove --readout as_designed --wires 1,2 --measurements 20,50 --out out/glove_wire --json
  spts decode out/glove_wire

Files in DIR:
  session.json ...             the session, or a folder each
  wire.html                    the page: images, scores, signals
  figures/wire.svg .png        its picture
  tables/wire.csv              a line for each number of wires, kind of rows and number of measurements
  tables/frames.csv laws.csv   how presses repeat and drift, object by object; how far the transducer's laws hold

Before anything else, the mean of each press's idle frames is subtracted. Pressures then go through the simulated foam's
transducer. Conductances are used unchanged. Codes and relative values are scaled to conductances; --peak sets the
scale. Skins of more than 2048 taxels get no page.
If there are at least three objects, each pressed at least twice, two more decoders are trained on every other press of
each object and scored on the remaining presses. The first is trained without the object that it is scored on (IoU, left
out). The second is trained on all objects and names the object (recognised).
--json prints {\"decoder\", \"scan_s\", \"scan_iou\", \"scan_classes\", \"again_iou\", \"touches\", \"objects\", \"left_out\",
\"rows\": [{\"wires\", \"rows\", \"m_per_wire\", \"m\", \"time_s\", \"iou\", \"worst_iou\", \"worst\", \"left_out_iou\", \"classes\",
\"saturated\", \"used\", \"signal_to_noise\"}], \"frames\": {\"objects\", \"laws\"}}.")]
pub(super) struct WireCommand {
    /// Folder of a session of frames, or of several
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// Folder of the results
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Rows of the recording: mixed or address seeds, or a file of rows as `spts sensing design` writes it [default:
    /// mixed, and address on the published skin]
    #[arg(long, value_name = "SEEDS|FILE")]
    rows: Option<String>,
    /// Readout profile: as_built, as_published, as_designed, ideal, or FILE.toml
    #[arg(long, value_name = "NAME|FILE.toml", default_value = DEFAULT_READOUT)]
    readout: String,
    /// Numbers of measurements that every wire takes for an image; each [1, 1000000] [default: 7, 20 and 50 % of the
    /// taxels]
    #[arg(long, value_name = "M,...", value_delimiter = ',', value_parser = parse_measurements)]
    measurements: Vec<usize>,
    /// Numbers of wires to compare. Each wire reads a band of whole rows of taxels, so there can be no more wires than
    /// rows; each [1, 1024] [default: 1, 2 and 4, up to the number of rows]
    #[arg(long, value_name = "N,...", value_delimiter = ',', value_parser = whole::<usize>(1..=1024))]
    wires: Vec<usize>,
    /// For frames in codes or relative values: pressure that sets their scale, Pa; [100, 1000000]. The largest value of
    /// all sessions becomes the conductance that a median taxel of the simulated skin has under this pressure; the
    /// other values are scaled in proportion
    #[arg(long, value_name = "PA", value_parser = within(100.0, 1e6, "[100, 1000000]"), default_value_t = 30e3)]
    peak: f64,
    /// Number of presses to record from each session, starting with the first. The tables of repeatability and drift
    /// still use every press [default: all]
    #[arg(long, value_name = "N", value_parser = whole::<usize>(1..=100_000))]
    presses: Option<usize>,
    /// Root of every random number
    #[arg(long, default_value_t = 1, value_name = "SEED", value_parser = seed)]
    seed: u64,
    #[command(flatten)]
    common: Common,
}

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report<'a> {
    #[serde(flatten)]
    few: &'a FewWiresReport,
    frames: &'a FramesReport,
}

/// Numbers of wires that are looked at.
const WIRES: [usize; 3] = [1, 2, 4];
/// Names in the results folder that no session may have there.
const RESERVED: [&str; 4] = ["figures", "tables", "wire.html", "manifest.json"];

impl WireCommand {
    pub(super) fn run(&self) -> Result<(), CliError> {
        self.common.start()?;
        let set = SessionSet::open(&self.session)?;
        notes(&set.note);
        let framed = |session: &&Session| session.raster.is_some() && session.event == Event::Press;
        let sessions: Vec<&Session> = set.sessions.iter().filter(framed).collect();
        let others: Vec<&str> = set.sessions.iter().filter(|s| !framed(s)).map(|s| s.name.as_str()).collect();
        let Some(first) = sessions.first() else {
            let path = self.session.display();
            return Err(CliError::usage(format!("{path}: no session has frames; `spts import` makes one")));
        };
        let layout = first.layout().copied().unwrap_or_default();
        if let Some(other) = sessions.iter().find(|session| session.layout() != Some(&layout)) {
            let (first, other) = (&first.name, &other.name);
            return Err(CliError::usage(format!("sessions \"{first}\" and \"{other}\" are of different skins")));
        }
        let unit = |session: &Session| session.raster().and_then(|raster| raster.info().unit);
        if let Some(other) = sessions.iter().find(|session| unit(session) != unit(first)) {
            let (first, other) = (&first.name, &other.name);
            return Err(CliError::usage(format!(
                "sessions \"{first}\" and \"{other}\" have frames in different units"
            )));
        }
        if !others.is_empty() {
            note(&format!("note: sessions without frames of presses are left out: {}", others.join(", ")));
        }
        if let Some(taken) = sessions.iter().map(|s| s.name.as_str()).find(|name| RESERVED.contains(name)) {
            let message = format!("session {taken:?}: the name is that of a file beside the sessions");
            return Err(CliError::usage(format!("{message}; spts import --name gives another")));
        }
        let folder = open_folder(&self.out)?;
        let chain = Chain::new(&self.chain()?, &layout, self.seed, Path::new("."))?;
        let mut touches: Vec<Touched> = Vec::new();
        let mut said: Vec<String> = Vec::new();
        let firsts = sessions.iter().map(|session| self.first_presses(session));
        let firsts = firsts.collect::<Result<Vec<_>, CliError>>()?;
        // one skin: what is the largest value of one session is no more in another
        let largest = firsts.iter().map(|session| {
            let courses = Courses::of(session).map_err(|e| e.at(&session.name));
            Ok(courses?.largest())
        });
        let largest = largest.collect::<Result<Vec<f64>, Refusal>>()?.into_iter().fold(0.0, f64::max);
        for (number, session) in (0..).zip(&firsts) {
            let path = |refusal: Refusal| refusal.at(&session.name);
            let found = wired(session, &chain, (self.peak, Some(largest)), self.seed, number).map_err(path)?;
            let out = if sessions.len() == 1 { folder.path("") } else { folder.folder(&session.name)? };
            found.session.write_files(&out).map_err(|error| folder.unstaged(error))?;
            touches.extend(scanned(&found));
            said.extend(found.notes);
        }
        let said = spts_eval::unique(said);
        notes(&said);
        let frames = frames_report(&sessions)?;
        let taxels = layout.taxels();
        if taxels > TrainingData::MOST_TAXELS {
            note(&format!("note: {taxels} taxels: the page is for up to {}", TrainingData::MOST_TAXELS));
            folder.commit()?;
            let objects = spts_eval::unique(touches.iter().map(|touch| touch.object.as_str())).len();
            let few = FewWiresReport { touches: touches.len(), objects, ..FewWiresReport::default() };
            let out = self.out.display();
            return self.common.print(&Report { few: &few, frames: &frames }, || format!("session: {out}"));
        }
        let study = FewWiresStudy {
            layout,
            touches,
            profile: chain.profile().clone(),
            wires: if self.wires.is_empty() {
                WIRES.into_iter().filter(|wires| *wires <= layout.rows()).collect()
            } else {
                sorted(self.wires.clone())
            },
            measurements: if self.measurements.is_empty() {
                DecodeRequest::default_measurements(taxels)
            } else {
                sorted(self.measurements.clone())
            },
            seed: self.seed,
        };
        let report = study.run(&Bars::default())?;
        if !(report.left_out.is_empty() || self.wires.is_empty() && self.measurements.is_empty()) {
            let why = "more measurements than taxels, or than the 64 rows of a pattern";
            note(&format!("note: left out, {why}: {}", report.left_out.join(", ")));
        }
        let page = FewWiresPage {
            title: if let [session] = sessions[..] {
                session.name.clone()
            } else {
                format!("{} sessions", sessions.len())
            },
            layout,
            readout: self.readout.clone(),
            report: &report,
            frames: &frames,
            touches: &study.touches,
            notes: said,
        };
        page.write(&folder).map_err(|error| folder.unstaged(error))?;
        folder.commit()?;
        let out = self.out.display();
        self.common.print(&Report { few: &report, frames: &frames }, || {
            format!("{}\nsession: {out}, page: {out}/wire.html", text(&report, &frames))
        })
    }

    fn chain(&self) -> Result<ChainConfig, CliError> {
        let mut rows = RowsConfig::default();
        match self.rows.as_deref() {
            None => {}
            Some("mixed") => rows.seeding = Some(Seeding::Mixed),
            Some("address") => rows.seeding = Some(Seeding::Address),
            Some(file) if !Path::new(file).exists() => {
                return Err(CliError::usage(format!("`--rows` = {file}: valid: mixed, address, or a file of rows")));
            }
            Some(file) => rows.patterns_file = Some(file.to_owned()),
        }
        Ok(ChainConfig { readout: Some(self.readout.clone()), rows, ..ChainConfig::default() })
    }

    /// The first presses of a session.
    fn first_presses<'a>(&self, session: &'a Session) -> Result<Cow<'a, Session>, CliError> {
        let (Some(most), Some(raster)) = (self.presses, &session.raster) else {
            return Ok(Cow::Borrowed(session));
        };
        let blocks = raster.recording.blocks().iter().take(most).cloned().collect();
        let presses = raster.presses.iter().take(most).cloned().collect();
        let raster = Recorded { recording: raster.recording.with_blocks(blocks)?, presses, ..*raster };
        Ok(Cow::Owned(Session {
            object: session.object.clone(),
            hold_s: session.hold_s,
            raster: Some(raster),
            ..Session::new(&session.name, session.event)
        }))
    }
}

/// Name, conductances and scan of every press, in the middle of its hold. A scan of many taxels has an offset that
/// grows with the sum of all, as cells that are not selected do not put out 0 V exactly: its lower quartile is taken
/// off.
fn scanned(found: &WiredFrames) -> Vec<Touched> {
    let Some(recorded) = &found.session.raster else { return Vec::new() };
    let raster = &recorded.recording;
    let frame_s = raster.measurements_per_frame() as f64 / raster.sample_rate_hz();
    let image = |press: usize| {
        let time_s = recorded.facts(press).and_then(|facts| facts.time_s).unwrap_or_default();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "within the recording")]
        let frame = ((time_s / frame_s) as usize).min(raster.frames() - 1);
        let idle = 0..raster.blocks()[press].idle_frames.unwrap_or(0).max(1).min(raster.frames());
        let count = idle.len() as f64;
        let untouched = |taxel: usize| idle.clone().map(|frame| raster.volts(press, frame)[taxel]).sum::<f64>() / count;
        let above = |(taxel, v): (usize, &f64)| v - untouched(taxel);
        let mut scan: Vec<f64> = raster.volts(press, frame).iter().enumerate().map(above).collect();
        let mut sorted = scan.clone();
        sorted.sort_unstable_by(f64::total_cmp);
        let offset_v = sorted[sorted.len() / 4];
        scan.iter_mut().for_each(|v| *v -= offset_v);
        scan
    };
    let name = |press: usize| match found.touches.len() {
        1 => found.session.name.clone(),
        _ => format!("{} {}", found.session.name, press + 1),
    };
    let touched = |(press, touch): (usize, &ConductanceMap)| Touched {
        name: name(press),
        object: found.session.object.clone(),
        conductance: touch.clone(),
        scan: image(press),
    };
    found.touches.iter().enumerate().map(touched).collect()
}
