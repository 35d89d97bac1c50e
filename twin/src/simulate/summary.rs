//! Summary of a run, in numbers.

use super::notes;
use super::request::Prepared;
use super::run::Simulation;
use crate::provenance::Provenance;
use crate::record::PressFrames;
use crate::scene::Task;
use serde::Serialize;
use spts_contact::mesh::MeshReport;
use spts_sim::world::{Bounce, PressCourse};
use std::fmt::Write as _;

/// One contact of the ball with the skin.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BounceSummary {
    /// First instant with a force, s.
    pub start_s: f64,
    /// Time with a force, s.
    pub contact_s: f64,
    /// Speed towards the skin before the contact, m/s.
    pub speed_in_m_per_s: f64,
    /// Speed away from the skin after the contact, m/s.
    pub speed_out_m_per_s: f64,
    /// Coefficient of restitution.
    pub restitution: f64,
    /// Largest normal force, N.
    pub peak_force_n: f64,
}

impl From<&Bounce> for BounceSummary {
    fn from(b: &Bounce) -> Self {
        Self {
            start_s: b.start_s,
            contact_s: b.contact_s,
            speed_in_m_per_s: b.speed_in_m_per_s,
            speed_out_m_per_s: b.speed_out_m_per_s,
            restitution: b.restitution(),
            peak_force_n: b.peak_force_n,
        }
    }
}

/// Time course of the force in a press that reached its target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CourseSummary {
    /// First frame with a force, s.
    pub onset_s: f64,
    /// Time of the rise from 10 to 90 % of the plateau, s.
    pub rise_s: f64,
    /// Mean over the plateau, N.
    pub plateau_force_n: f64,
    /// Largest deviation from the target on the plateau, N.
    pub plateau_error_n: f64,
    /// Highest force above the target, relative to it.
    pub overshoot: f64,
    /// When the force falls below 90 % of the plateau, s.
    pub lift_s: f64,
    /// Time of the fall from 90 to 10 % of the plateau, s.
    pub fall_s: f64,
}

impl From<&PressCourse> for CourseSummary {
    fn from(c: &PressCourse) -> Self {
        Self {
            onset_s: c.onset_s,
            rise_s: c.rise_s,
            plateau_force_n: c.plateau_n,
            plateau_error_n: c.plateau_error_n,
            overshoot: c.overshoot,
            lift_s: c.lift_s,
            fall_s: c.fall_s,
        }
    }
}

/// One press or drop.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PressSummary {
    /// Number of the press, from 0.
    pub press: usize,
    /// Number of frames.
    pub frames: usize,
    /// Largest normal force in a frame, N.
    pub peak_force_n: f64,
    /// Time of the largest force, s.
    pub peak_time_s: f64,
    /// Largest pressure on a taxel in a frame, Pa.
    pub peak_pressure_pa: f64,
    /// Largest |force − Σ p·A| / force over all frames with a force.
    pub force_imbalance: f64,
    /// Time course of the force; `None` for a drop, and for a press that did not reach its target.
    pub course: Option<CourseSummary>,
    /// Contacts of the ball.
    pub bounces: Vec<BounceSummary>,
}

impl PressSummary {
    pub(super) fn new(press: usize, frames: &PressFrames, cell_area_m2: f64) -> Self {
        let (mut peak_force_n, mut peak_time_s) = (0.0, 0.0);
        let mut peak_pressure_pa = 0.0_f64;
        for frame in &frames.frames {
            let force_n = frame.wrench.force_n[2];
            if force_n > peak_force_n {
                (peak_force_n, peak_time_s) = (force_n, frame.time_s);
            }
            peak_pressure_pa = peak_pressure_pa.max(frame.pressure.max());
        }
        Self {
            press,
            frames: frames.frames.len(),
            peak_force_n,
            peak_time_s,
            peak_pressure_pa,
            force_imbalance: frames.imbalance(cell_area_m2),
            course: frames.course.as_ref().map(CourseSummary::from),
            bounces: frames.bounces.iter().map(BounceSummary::from).collect(),
        }
    }
}

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
    /// Measurements a second of the recordings, Hz.
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
    #[must_use]
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
            format!(
                "press {}: the force did not reach and hold its target (peak {:.3} N)",
                p.press, p.peak_force_n
            )
        }));
        if simulation.first.is_some() {
            notes.extend(notes::of_recordings(scene, &simulation.saturated));
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
            sample_rate_hz: simulation
                .first
                .as_ref()
                .and_then(|session| Some(session.compressive()?.sample_rate_hz())),
            peak_force_n: largest(|p| p.peak_force_n),
            force_imbalance: largest(|p| p.force_imbalance),
            notes,
            mesh: scene.mechanics().mesh_report().copied(),
            provenance: Provenance::new(scene.seed(), prepared.scene_hash.clone()),
            presses,
        }
    }

    /// The summary as text.
    #[must_use]
    pub fn table(&self) -> String {
        let mut out = format!(
            "{} {} of {}, seed {}, scene {}\n",
            self.presses.len(),
            plural(self.task, self.presses.len()),
            self.body,
            self.provenance.seed,
            self.provenance.scene_hash
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
            let _ = writeln!(
                out,
                "    … {} more, in summary.json",
                self.presses.len() - SHOWN_PRESSES
            );
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
            let _ = writeln!(
                out,
                "{:>5} {:>6.2} (no plateau, no bounce)",
                self.press, self.peak_force_n
            );
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
