//! Summary of a run: the numbers as text, and notes for the user.

use super::request::Prepared;
use super::run::{PressSummary, Saturated, Simulation};
use crate::provenance::Provenance;
use crate::scene::{Scene, Task};
use crate::session::MOST_SAMPLES;
use serde::Serialize;
use spts_circuit::Mode;
use spts_contact::mesh::MeshReport;
use std::fmt::Write as _;

/// Time between the frames of a press on all but large skins, s.
const USUAL_INTERVAL_S: f64 = 2e-3;

/// Summary of a whole run. It is the same for the same scene, on any number of threads.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Summary {
    /// What touches the skin: the name of the object, `mesh`, or `ball`.
    pub body: String,
    /// `press` or `drop`.
    pub task: &'static str,
    /// Target force, N; `None` for a drop.
    pub force_n: Option<f64>,
    /// Name of the transducer.
    pub transducer: Option<String>,
    /// Name of the readout profile.
    pub readout: Option<String>,
    /// Source of the weights.
    pub weights: Option<String>,
    /// Wires of the skin.
    pub wires: usize,
    /// Time between the frames of the contact, s; in a drop while the ball is near the skin.
    pub frame_interval_s: f64,
    /// Measurements a second of the recordings, of all wires together, Hz.
    pub sample_rate_hz: Option<f64>,
    /// Largest force of all presses, N.
    pub peak_force_n: f64,
    /// Largest relative difference between the force and the integral of the pressure.
    pub force_imbalance: f64,
    /// Repairs and properties of a mesh from a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<MeshReport>,
    /// One entry a press.
    pub presses: Vec<PressSummary>,
    /// Notes for the user, such as repairs.
    pub notes: Vec<String>,
    /// Provenance of the numbers.
    pub provenance: Provenance,
}

impl Summary {
    /// The summary of `simulation`, the run of `prepared`.
    pub fn new(prepared: &Prepared, simulation: &Simulation) -> Self {
        let scene = &prepared.scene;
        let (task, force_n) = match scene.task() {
            Task::Press(press) => ("press", Some(press.force_n)),
            Task::Drop(_) => ("drop", None),
        };
        let presses = simulation.presses.clone();
        let largest = |of: fn(&PressSummary) -> f64| presses.iter().map(of).fold(0.0, f64::max);
        let mut notes = prepared.notes.clone();
        let missed = presses.iter().filter(|p| force_n.is_some() && p.course.is_none());
        notes.extend(missed.map(|p| {
            format!("press {}: the force did not reach and hold its target (peak {:.3} N)", p.press, p.peak_force_n)
        }));
        if simulation.first.is_some() {
            notes.extend(notes_on_recordings(scene, &simulation.saturated));
        }
        let unlike = scene.chain().unlike_codes();
        if unlike > 0 {
            notes.push(format!(
                "the emulated cells lost edges at {:.0} Hz: {unlike} of their codes are not the model's",
                scene.chain().sample_rate_hz()
            ));
        }
        Self {
            body: prepared.body().to_owned(),
            task,
            force_n,
            transducer: scene.config().transducer.clone(),
            readout: scene.portable().readout,
            weights: scene.config().weights.clone(),
            wires: scene.chain().wires(),
            frame_interval_s: scene.mechanics().frame_interval_s(),
            sample_rate_hz: simulation.first.as_ref().and_then(|session| Some(session.compressive()?.sample_rate_hz())),
            peak_force_n: largest(|p| p.peak_force_n),
            force_imbalance: largest(|p| p.force_imbalance),
            notes,
            mesh: scene.mechanics().mesh_report().copied(),
            provenance: Provenance::new(scene.seed(), prepared.scene_hash.clone()),
            presses,
        }
    }

    /// The summary as text.
    pub fn table(&self) -> String {
        let mut out = format!(
            "{} {} of {}, seed {}, scene {}{}{}\n",
            self.presses.len(),
            plural(self.task, self.presses.len()),
            self.body,
            self.provenance.seed,
            self.provenance.scene_hash,
            if self.wires > 1 { format!(", {} wires", self.wires) } else { String::new() },
            match self.frame_interval_s {
                seconds if self.task == "press" && seconds > USUAL_INTERVAL_S => {
                    format!(", a frame every {seconds:.3} s")
                }
                _ => String::new(),
            }
        );
        if self.task == "press" {
            out.push_str("press   peak    plateau  error   rise   overshoot  fall   pressure  imbalance\n");
            out.push_str("           N          N      N      s           %     s        kPa\n");
        } else {
            out.push_str("drop  bounce   start  contact  speed in  speed out  restitution   peak\n");
            out.push_str("                   s       ms       m/s        m/s                   N\n");
        }
        for press in self.presses.iter().take(SHOWN_PRESSES) {
            press.line(&mut out);
        }
        if self.presses.len() > SHOWN_PRESSES {
            let _ = writeln!(out, "    … {} more, in summary.json", self.presses.len() - SHOWN_PRESSES);
        }
        out.pop();
        out
    }
}

impl PressSummary {
    fn line(&self, out: &mut String) {
        if let Some(c) = &self.course {
            let _ = writeln!(
                out,
                "{:>5} {:>6.2} {:>10.3} {:>6.3} {:>6.3} {:>11.2} {:>5.3} {:>10.2} {:>10.1e}",
                self.press,
                self.peak_force_n,
                c.plateau_force_n,
                c.plateau_error_n,
                c.rise_s,
                100.0 * c.overshoot,
                c.fall_s,
                1e-3 * self.peak_pressure_pa,
                self.force_imbalance
            );
        } else if self.bounces.is_empty() {
            let _ = writeln!(out, "{:>5} {:>6.2} (no plateau, no bounce)", self.press, self.peak_force_n);
        }
        for (number, b) in self.bounces.iter().take(SHOWN_BOUNCES).enumerate() {
            let _ = writeln!(
                out,
                "{:>4} {:>7} {:>7.3} {:>8.2} {:>9.3} {:>10.3} {:>12.3} {:>6.1}",
                self.press,
                number,
                b.start_s,
                1e3 * b.contact_s,
                b.speed_in_m_per_s,
                b.speed_out_m_per_s,
                b.restitution,
                b.peak_force_n
            );
        }
        if self.bounces.len() > SHOWN_BOUNCES {
            let _ = writeln!(out, "      … {} more", self.bounces.len() - SHOWN_BOUNCES);
        }
    }
}

/// Presses and drops that are shown.
const SHOWN_PRESSES: usize = 40;
/// Bounces of a drop that are shown.
const SHOWN_BOUNCES: usize = 8;

fn plural(word: &str, count: usize) -> String {
    match (word, count) {
        (_, 1) => word.to_owned(),
        ("press", _) => "presses".to_owned(),
        _ => format!("{word}s"),
    }
}

/// Notes on the recordings of a run: samples that saturate, more samples than can be read again, and a scan that there
/// is not.
fn notes_on_recordings(scene: &Scene, saturated: &[Option<Saturated>; 2]) -> Vec<String> {
    let modes = [Mode::Raster, Mode::Compressive].into_iter().zip(saturated);
    let mut notes = Vec::new();
    for (mode, saturated) in modes {
        let Some(Saturated { samples, of }) = *saturated else {
            continue;
        };
        if samples > 0 {
            notes.push(format!(
                "{}: {samples} of {of} samples ({:.2} %) are at the end of the converter's or the amplifier's range",
                mode.name(),
                100.0 * samples as f64 / of as f64
            ));
        }
        if of as u64 > MOST_SAMPLES {
            notes.push(format!(
                "{}: {of} samples are more than the {MOST_SAMPLES} that are read as one session",
                mode.name()
            ));
        }
    }
    if let Err(error) = scene.chain().check(Mode::Raster) {
        notes.push(format!("no raster scan was recorded: {error}"));
    }
    notes
}
