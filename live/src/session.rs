//! One skin, what presses it, and what is shown of it.

use crate::UPDATE_S;
use crate::error::LiveError;
use crate::frame::{Frame, LineFrame, PanelFrame, rounded};
use crate::mesh::UploadedMesh;
use crate::object::{LiveObject, Shape};
use crate::options::Options;
use crate::presser::Presser;
use crate::request::Request;
use crate::settings::{Panel, Press, Settings};
use crate::shelf::{Made, Shelf};
use crate::wires::{Line, wires};
use spts_eval::algorithm::Answer;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use std::sync::Arc;
use std::time::Instant;

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
    /// [`LiveError::Unknown`] for an object that is not in the table.
    pub fn new(shelf: Arc<Shelf>, seed: u64, object: &str) -> Result<Self, LiveError> {
        let settings = Settings::usual()?;
        let presser = Presser::new(shelf.layout(), LiveObject::named(object)?);
        Ok(Self {
            presser: presser.map_err(|e| LiveError::Message(e.to_string()))?,
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
    /// [`LiveError`] for a value outside its range, and nothing is changed.
    pub fn apply(&mut self, request: Request) -> Result<Option<Shape>, LiveError> {
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
                let mesh = mesh.ok_or_else(|| LiveError::Message("`side`: no mesh was dropped".to_owned()))?;
                let object = mesh.on(side);
                return Ok(Some(self.take(object)));
            }
            Request::Mesh { .. } => {
                return Err(LiveError::Message("a mesh needs its bytes".to_owned()));
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
    pub fn press_with(&mut self, mesh: Arc<UploadedMesh>) -> Shape {
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
    #[must_use]
    pub fn shape(&self) -> Shape {
        self.presser.object().shape()
    }

    /// Waits until decoders and rows are ready.
    pub fn prepare(&self) {
        let waits = |panel: &Panel| {
            matches!(self.shelf.decoder(panel.decoder), Made::Waiting)
                || panel
                    .rows
                    .is_some_and(|designer| matches!(self.shelf.design(designer), Made::Waiting))
        };
        while self.settings.panels.iter().any(waits) {
            std::thread::sleep(std::time::Duration::from_millis(2));
        }
    }

    /// The next update: the skin is pressed, measured and decoded.
    ///
    /// # Errors
    /// [`LiveError::Chain`] when the readout refuses what was set; the last sound settings come back.
    pub fn step(&mut self) -> Result<Frame, LiveError> {
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
    fn wire(&mut self) -> Result<(), LiveError> {
        if self.wired && self.complete {
            return Ok(());
        }
        let there = if self.wired {
            std::mem::take(&mut self.lines)
        } else {
            Vec::new()
        };
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
        let waiting = |what: String| PanelFrame {
            waits_for: Some(what),
            ..PanelFrame::default()
        };
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
