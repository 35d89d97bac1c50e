//! What a session is: recordings of one object or event, with everything known about them, and what holds in each.

use crate::provenance::Provenance;
use serde::{Deserialize, Serialize};
use spts_circuit::{Interpolated, Mode, Recording};
use spts_input::Refusal;
use spts_models::{ConductanceMap, PressureMap, SkinLayout};
use std::fmt::Display;

/// What happened in every block of a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Event {
    /// Something was pressed on the skin and held.
    Press,
    /// Something fell on the skin.
    Drop,
    /// Something touched the skin, at an unknown time.
    Touch,
}

/// Position and orientation of the pressed body, in the frame of the skin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PressPose {
    /// Position of the body's origin, m.
    pub position_m: [f64; 3],
    /// Orientation, unit quaternion (w, x, y, z).
    pub quaternion: [f64; 4],
}

/// Facts about one block of a recording beside its samples. A simulation knows all of them, a real skin hardly any.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressFacts {
    /// Time within the block to which the other facts refer, s: the middle of the hold, or the instant of the largest
    /// force.
    pub time_s: Option<f64>,
    /// Pose of the pressed body.
    pub pose: Option<PressPose>,
    /// Normal force on the skin, N.
    pub force_n: Option<f64>,
    /// Mean pressure over each taxel's area (pitch × pitch), Pa.
    pub pressure: Option<PressureMap>,
    /// Conductance of each taxel, S, as the readout saw it.
    pub conductance: Option<ConductanceMap>,
    /// Conductance over the time of the block, where it was simulated just now: no folder keeps it.
    pub course: Option<Interpolated>,
}

/// A recording, with the facts known about its blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// The samples, and the rows of weights with which they were taken.
    pub recording: Recording,
    /// Number of blocks at the beginning that only condition the skin. They are not scored.
    pub conditioning: usize,
    /// Facts about each block; empty if nothing is known.
    pub presses: Vec<PressFacts>,
}

impl Recorded {
    /// A recording without facts about its blocks.
    pub fn new(recording: Recording) -> Self {
        Self { recording, conditioning: 0, presses: Vec::new() }
    }

    /// The facts about block `block`.
    pub fn facts(&self, block: usize) -> Option<&PressFacts> {
        self.presses.get(block)
    }
}

/// Recordings of one object or event on one skin, raster and compressive, with what is known of every press.
#[derive(Debug, Clone, PartialEq)]
pub struct Session {
    /// Name that identifies the session within a set. It must be valid as a file name; spaces are allowed.
    pub name: String,
    /// What was pressed or dropped: the class that a classifier is to find. Several sessions may share it.
    pub object: String,
    /// What happened in every block.
    pub event: Event,
    /// Span [start, end) of a block in which the contact is steady, s; `None` if it is not known, as for a drop.
    pub hold_s: Option<[f64; 2]>,
    /// The raster recording.
    pub raster: Option<Recorded>,
    /// The compressive recording.
    pub compressive: Option<Recorded>,
    /// Provenance of a simulated session; `None` for a real skin.
    pub provenance: Option<Provenance>,
}

impl Session {
    /// A session called `name`, of the object with that name, without recordings.
    pub fn new(name: &str, event: Event) -> Self {
        Self {
            name: name.to_owned(),
            object: name.to_owned(),
            event,
            hold_s: None,
            raster: None,
            compressive: None,
            provenance: None,
        }
    }

    /// The raster recording.
    pub fn raster(&self) -> Option<&Recording> {
        self.raster.as_ref().map(|r| &r.recording)
    }

    /// The compressive recording.
    pub fn compressive(&self) -> Option<&Recording> {
        self.compressive.as_ref().map(|r| &r.recording)
    }

    /// Layout of the skin; `None` without a recording.
    pub fn layout(&self) -> Option<&SkinLayout> {
        self.compressive().or(self.raster()).map(Recording::layout)
    }
}

/// What names of sessions are, as a user is told.
pub(crate) const NAMES: &str =
    "the names of files: 1 to 200 bytes, not `.` or `..`, without `/`, `\\` and control characters";

/// Longest name, bytes: files have 255, and what is made of a name is longer.
const LONGEST_NAME: usize = 200;

/// Whether `name` is the name of a file and nothing else, on any system.
pub(crate) fn is_plain(name: &str) -> bool {
    let foreign = |c: char| c == '/' || c == '\\' || c.is_control();
    (1..=LONGEST_NAME).contains(&name.len()) && name != "." && name != ".." && !name.contains(foreign)
}

fn invalid<T>(field: &str, value: impl Display, range: impl Display) -> Result<T, Refusal> {
    Err(Refusal::range(field, value, range))
}

/// The first thing that is wrong with `session`.
pub(super) fn check(session: &Session) -> Result<(), Refusal> {
    check_header(session)?;
    for (mode, recorded) in [(Mode::Raster, &session.raster), (Mode::Compressive, &session.compressive)] {
        if let Some(recorded) = recorded {
            check_recorded(mode, recorded, recorded.recording.blocks().len())?;
            check_hold(session.hold_s, &recorded.recording)?;
        }
    }
    if let (Some(raster), Some(compressive)) = (session.raster(), session.compressive()) {
        let (found, needed) = (compressive.layout(), raster.layout());
        if found != needed {
            let range = format!("{{{}}}, the layout of `raster`", shown(needed));
            return invalid("compressive.info.layout", shown(found), range);
        }
    }
    Ok(())
}

/// The first thing that is wrong with what `session` says beside its recordings.
pub(super) fn check_header(session: &Session) -> Result<(), Refusal> {
    if !is_plain(&session.name) {
        return invalid("name", format!("{:?}", session.name), NAMES);
    }
    if let Some([start_s, end_s]) = session.hold_s {
        let sound = start_s.is_finite() && end_s.is_finite() && 0.0 <= start_s && start_s < end_s;
        if !sound {
            let range = "0 ≤ start < end, both finite";
            return invalid("hold_s", format!("[{start_s}, {end_s}]"), range);
        }
    }
    Ok(())
}

/// The first thing that is wrong with the recording in `mode`, which has `blocks` blocks in all.
pub(super) fn check_recorded(mode: Mode, recorded: &Recorded, blocks: usize) -> Result<(), Refusal> {
    let name = mode.name();
    let modes = match mode {
        Mode::Raster => "{\"raster\"}",
        Mode::Compressive => "{\"binary\", \"analog\"}",
    };
    let recording = &recorded.recording;
    if recording.mode() != mode {
        let found = format!("{:?}", recording.weights().mode()).to_lowercase();
        let field = format!("{name}.info.weights.mode");
        return invalid(&field, format!("{found:?}"), modes);
    }
    let (found, taxels) = (recording.measurements_per_frame(), recording.taxels());
    if mode == Mode::Raster && found != taxels {
        let field = format!("{name}.info.measurements_per_frame");
        return invalid(&field, found, format!("{{{taxels}}}, the taxels of the skin"));
    }
    if recorded.conditioning > blocks {
        let field = format!("{name}.conditioning");
        let range = format!("[0, {blocks}], the blocks of the recording");
        return invalid(&field, recorded.conditioning, range);
    }
    let end_s = recording.time_s(recording.frames());
    let times = format!("[-1e6, {end_s}] s, the end of the block");
    for (k, facts) in recorded.presses.iter().enumerate() {
        let field = |what: &str| format!("{name}.blocks[{k}].{what}");
        let known = [
            ("force_n", facts.force_n, 0.0..=1e6, "[0, 1e6] N"),
            // A time may lie before the block.
            ("time_s", facts.time_s, -1e6..=end_s * (1.0 + 1e-9), &times),
        ];
        for (what, value, valid, range) in known {
            if let Some(value) = value.filter(|value| !valid.contains(value)) {
                return invalid(&field(what), value, range);
            }
        }
        if let Some(pose) = facts.pose {
            let length = pose.quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
            if !(1.0 - 1e-3..=1.0 + 1e-3).contains(&length) {
                return invalid(&field("pose.quaternion"), format!("{:?}", pose.quaternion), "those of length 1");
            }
            if let Some(place) = pose.position_m.iter().find(|place| !(-FARTHEST_M..=FARTHEST_M).contains(*place)) {
                return invalid(&field("pose.position_m"), place, "[-1000, 1000] m");
            }
        }
    }
    Ok(())
}

/// Least hold where a frame takes longer, s.
const LEAST_HOLD_S: f64 = 0.01;
/// Farthest place of a body, m.
const FARTHEST_M: f64 = 1e3;

/// Refuses a hold in which nothing of `recording` is measured. A frame of a large skin may take longer than a hold.
pub(super) fn check_hold(hold_s: Option<[f64; 2]>, recording: &Recording) -> Result<(), Refusal> {
    let frame_s = recording.measurements_per_frame() as f64 / recording.sample_rate_hz();
    let least_s = frame_s.min(LEAST_HOLD_S);
    match hold_s {
        Some([start_s, end_s]) if end_s - start_s < least_s * (1.0 - 1e-6) => {
            let range = format!("the spans of at least a frame or {LEAST_HOLD_S} s, {least_s} s");
            invalid("hold_s", format!("[{start_s}, {end_s}]"), range)
        }
        _ => Ok(()),
    }
}

fn shown(layout: &SkinLayout) -> String {
    format!(
        "{} × {} taxels, pitch {} m, electrode {} m",
        layout.rows(),
        layout.cols(),
        layout.pitch_m(),
        layout.electrode_m()
    )
}
