//! One skin and what presses it: the requests of a page, and the frames that it is shown.

use crate::UPDATE_S;
use crate::object::{LiveObject, MeshUnit, Shape, Side, UploadedMesh};
use crate::presser::Presser;
use crate::settings::{Options, Panel, Press, Settings};
use crate::wires::{Line, Made, Shelf, wires};
use serde::{Deserialize, Serialize};
use spts::Refusal;
use spts_eval::algorithm::Answer;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use std::sync::Arc;
use std::time::Instant;

/// A message that is none, or asks for what there is not.
pub(crate) fn message(text: impl Into<String>) -> Refusal {
    Refusal::new(text).at("message")
}

/// Longest message of text, bytes.
pub(crate) const MOST_TEXT_BYTES: usize = 4096;

/// A message of the page.
///
/// ```
/// use spts_live::Request;
///
/// let request = Request::from_json(r#"{"type": "press", "x_mm": 3, "y_mm": -20.5, "force_n": 12}"#);
/// assert!(matches!(request, Ok(Request::Press { force_n, .. }) if force_n > 11.0));
/// assert!(Request::from_json("{\"type\": \"shout\"}").is_err());
/// ```
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// Presses here and so hard from now on.
    Press {
        /// Place of the object's middle, mm to the right of the skin's middle.
        x_mm: f64,
        /// Place of the object's middle, mm above the skin's middle as the page shows it: towards row 0.
        y_mm: f64,
        /// Force, N; 0 lifts the object.
        force_n: f64,
    },
    /// Takes another object.
    Object {
        /// Its name.
        name: String,
    },
    /// Turns the object.
    Turn {
        /// Angle about the skin's normal, degrees, counter-clockwise.
        degrees: f64,
    },
    /// Takes so many measurements an image.
    Measurements {
        /// M.
        count: usize,
    },
    /// Chooses decoder and rows of a panel.
    Panel {
        /// 0 or 1.
        panel: usize,
        /// Name of the decoder.
        decoder: String,
        /// Name of the rows.
        rows: String,
    },
    /// Chooses the electronics.
    Readout {
        /// Name of the profile.
        profile: String,
        /// What its noise is multiplied with.
        noise: f64,
    },
    /// Breaks or mends a cell.
    Fault {
        /// Taxel of the cell, row by row from 0.
        taxel: u32,
        /// Name of the fault; none mends the cell.
        name: Option<String>,
    },
    /// Mends all cells.
    MendAll,
    /// Says what the next message of bytes is: a mesh.
    Mesh {
        /// Name of the file; its ending says the format.
        name: String,
        /// Unit of the file.
        unit: MeshUnit,
    },
    /// Turns the mesh that was dropped onto another side.
    Side {
        /// Side that touches the skin.
        side: Side,
    },
}

impl Request {
    /// Reads a message.
    ///
    /// # Errors
    /// [`Refusal`] for what is too long, no JSON, or no request.
    pub fn from_json(text: &str) -> Result<Self, Refusal> {
        if text.len() > MOST_TEXT_BYTES {
            let found = text.len();
            return Err(message(format!("its length = {found} bytes is outside [0, {MOST_TEXT_BYTES}]")));
        }
        serde_json::from_str(text).map_err(|e| message(e.to_string()))
    }
}

/// One update of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "type", rename = "frame")]
pub struct Frame {
    /// Number of the update, from 1.
    pub number: u64,
    /// Force on the object, N.
    pub force_n: f64,
    /// Why the object is not pressed as asked.
    pub note: Option<String>,
    /// Mean pressure over every taxel, kPa, row by row.
    pub pressure_kpa: Vec<f64>,
    /// Taxels in the support of the pressure: above the published share of its maximum.
    pub touched: Vec<usize>,
    /// The wire, once for every kind of rows that is shown.
    pub lines: Vec<LineFrame>,
    /// The two images.
    pub panels: Vec<PanelFrame>,
    /// Time that the update took, ms.
    pub work_ms: f64,
}

/// A frame of measurements of one wire.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LineFrame {
    /// Name of its rows.
    pub rows: String,
    /// Output of the amplifier, V.
    pub volts: Vec<f64>,
    /// Output while nothing touches the skin, V.
    pub idle_v: f64,
    /// Measurements a second, Hz.
    pub sample_rate_hz: f64,
}

/// One of the two images.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct PanelFrame {
    /// The image, V, row by row; empty when there is none.
    pub image: Vec<f64>,
    /// Intersection over union of its support with that of the pressure; none while nothing touches the skin.
    pub iou: Option<f64>,
    /// Share of taxels on the right side of the support.
    pub support: Option<f64>,
    /// Time of the decoding, µs.
    pub decode_us: f64,
    /// Why there is no image.
    pub waits_for: Option<String>,
}

/// `values` with so many digits behind the point.
pub(crate) fn rounded(values: impl IntoIterator<Item = f64>, digits: i32) -> Vec<f64> {
    let scale = 10_f64.powi(digits);
    values.into_iter().map(|v| (scale * v).round() / scale).collect()
}

/// A pressure below this is none, Pa.
const TOUCHED_PA: f64 = 1.0;

/// One skin under one mouse: requests in, frames out. What it shows is a function of the seed and of the requests
/// between its steps, as long as decoders and rows are ready ([`LiveSession::prepare`]); only times are not.
pub struct LiveSession {
    shelf: Arc<Shelf>,
    seed: u64,
    presser: Presser,
    asked: Press,
    settings: Settings,
    /// The last ones with which the wire could be built.
    sound: Settings,
    /// Whether the wires are those of the settings.
    wired: bool,
    /// Whether none is left out because its rows are being designed.
    complete: bool,
    lines: Vec<Line>,
    mesh: Option<Arc<UploadedMesh>>,
    truth: Vec<bool>,
    found: Vec<bool>,
    answer: Answer,
    number: u64,
}

impl LiveSession {
    /// A skin of this seed under the object with this name, with decoders and rows from `shelf`.
    ///
    /// # Errors
    /// [`Refusal`] for an object that is not in the table.
    pub fn new(shelf: Arc<Shelf>, seed: u64, object: &str) -> Result<Self, Refusal> {
        let settings = Settings::usual()?;
        let presser = Presser::new(shelf.layout(), LiveObject::named(object)?);
        Ok(Self {
            presser: presser.map_err(|e| message(e.to_string()))?,
            shelf,
            seed,
            asked: Press::default(),
            sound: settings.clone(),
            settings,
            wired: false,
            complete: false,
            lines: Vec::new(),
            mesh: None,
            truth: Vec::new(),
            found: Vec::new(),
            answer: Answer::default(),
            number: 0,
        })
    }

    /// Does what the page asks; the answer is the new shape when the object is another one.
    ///
    /// # Errors
    /// [`Refusal`] for a value outside its range, and nothing is changed.
    pub fn apply(&mut self, request: Request) -> Result<Option<Shape>, Refusal> {
        match request {
            Request::Press { x_mm, y_mm, force_n } => {
                self.asked = Press::new(self.shelf.layout(), x_mm, y_mm, force_n)?;
                return Ok(None);
            }
            Request::Turn { degrees } => {
                self.presser.turn(degrees)?;
                return Ok(None);
            }
            Request::Object { name } => {
                let object = LiveObject::named(&name)?;
                return Ok(Some(self.take(object)));
            }
            Request::Side { side } => {
                let mesh = self.mesh.as_ref();
                let mesh = mesh.ok_or_else(|| message("`side`: no mesh was dropped".to_owned()))?;
                let object = mesh.on(side);
                return Ok(Some(self.take(object)));
            }
            Request::Mesh { .. } => {
                return Err(message("a mesh needs its bytes".to_owned()));
            }
            Request::Measurements { count } => self.settings.measure(count)?,
            Request::Panel { panel, decoder, rows } => self.settings.show(panel, &decoder, &rows)?,
            Request::Readout { profile, noise } => self.settings.read_out(&profile, noise)?,
            Request::Fault { taxel, name } => {
                let taxels = self.shelf.layout().taxels();
                self.settings.fault(taxel, name.as_deref(), taxels)?;
            }
            Request::MendAll => self.settings.faults.clear(),
        }
        self.wired = false;
        Ok(None)
    }

    /// Presses with a mesh that was dropped.
    pub(crate) fn press_with(&mut self, mesh: Arc<UploadedMesh>) -> Shape {
        let object = mesh.object.clone();
        self.mesh = Some(mesh);
        self.take(object)
    }

    fn take(&mut self, object: LiveObject) -> Shape {
        self.presser.take(object);
        self.presser.object().shape()
    }

    /// What can be chosen, and what is.
    pub(crate) fn options(&self) -> Options {
        Options::of(self.shelf.layout(), &self.settings)
    }

    /// The underside of the object.
    pub fn shape(&self) -> Shape {
        self.presser.object().shape()
    }

    /// Waits until decoders and rows are ready.
    pub fn prepare(&self) {
        let waits = |panel: &Panel| {
            matches!(self.shelf.decoder(panel.decoder), Made::Waiting)
                || panel.rows.is_some_and(|designer| matches!(self.shelf.design(designer), Made::Waiting))
        };
        while self.settings.panels.iter().any(waits) {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    /// The next update: the skin is pressed, measured and decoded.
    ///
    /// # Errors
    /// [`Refusal`] when the readout refuses what was set; the last sound settings come back.
    pub fn step(&mut self) -> Result<Frame, Refusal> {
        let start = Instant::now();
        self.wire()?;
        self.number += 1;
        self.presser.step(&self.asked, UPDATE_S);
        for line in &mut self.lines {
            line.record(self.presser.electrode_pressure(), UPDATE_S)?;
        }
        let pressure = self.presser.pressure();
        let touched = pressure.max() > TOUCHED_PA;
        support(pressure.values(), SUPPORT_THRESHOLD, &mut self.truth);
        if !touched {
            self.truth.fill(false);
        }
        let panels = self.settings.panels.map(|panel| self.decoded(&panel, touched));
        let lines = self.lines.iter().map(|line| LineFrame {
            rows: line.rows.to_owned(),
            volts: rounded(line.volts().iter().copied(), 4),
            idle_v: line.idle_v(),
            sample_rate_hz: line.sample_rate_hz(),
        });
        Ok(Frame {
            number: self.number,
            force_n: self.presser.force_n(),
            note: self.presser.note().map(str::to_owned),
            pressure_kpa: rounded(self.presser.pressure().values().iter().map(|p| 1e-3 * p), 3),
            touched: (0..self.truth.len()).filter(|k| self.truth[*k]).collect(),
            lines: lines.collect(),
            panels: panels.into(),
            work_ms: 1e3 * start.elapsed().as_secs_f64(),
        })
    }

    /// Builds the wires again when something that they depend on was changed, and adds those whose rows were not
    /// designed before.
    fn wire(&mut self) -> Result<(), Refusal> {
        if self.wired && self.complete {
            return Ok(());
        }
        let there = if self.wired { std::mem::take(&mut self.lines) } else { Vec::new() };
        match wires(&self.settings, &self.shelf, self.seed, there) {
            Ok((lines, complete)) => {
                self.lines = lines;
                self.sound = self.settings.clone();
                (self.wired, self.complete) = (true, complete);
                Ok(())
            }
            Err(error) => {
                self.settings = self.sound.clone();
                self.wired = false;
                Err(error)
            }
        }
    }

    fn decoded(&mut self, panel: &Panel, touched: bool) -> PanelFrame {
        let waiting = |what: String| PanelFrame { waits_for: Some(what), ..PanelFrame::default() };
        let decoder = match self.shelf.decoder(panel.decoder) {
            Made::Ready(decoder) => decoder,
            Made::Waiting => return waiting("The decoder is learning …".to_owned()),
            Made::Refused(reason) => return waiting(format!("The decoder cannot be used: {reason}")),
        };
        let line = self.lines.iter().find(|line| line.rows == panel.rows_name());
        let Some(recorded) = line.and_then(Line::recorded) else {
            return match panel.rows.map(|designer| self.shelf.design(designer)) {
                Some(Made::Refused(reason)) => waiting(format!("The rows cannot be designed: {reason}")),
                _ => waiting("The rows are being designed …".to_owned()),
            };
        };
        let Some(window) = recorded.window(0, self.settings.measurements) else {
            return waiting("A measurement was lost.".to_owned());
        };
        let start = Instant::now();
        let decoded = decoder.start().decode(&window, &mut self.answer);
        let decode_us = 1e6 * start.elapsed().as_secs_f64();
        if let Err(error) = decoded {
            return waiting(format!("No image: {error}"));
        }
        support(&self.answer.image, SUPPORT_THRESHOLD, &mut self.found);
        let score = touched.then(|| SupportScore::new(&self.found, &self.truth));
        PanelFrame {
            image: rounded(self.answer.image.iter().copied(), 4),
            iou: score.map(|score| score.iou),
            support: score.map(|score| score.accuracy),
            decode_us,
            waits_for: None,
        }
    }
}
