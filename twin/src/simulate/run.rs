//! Simulates and records the presses of a run, a few at a time.

use super::request::Prepared;
use crate::chain::of_readout;
use crate::record::{PressFrames, Twin, TwinSession};
use crate::session::{Recorded, Session};
use serde::Serialize;
use spts_circuit::{Interpolated, Mode, Recording};
use spts_contact::Frame;
use spts_input::Refusal;
use spts_sim::world::{Bounce, PressCourse};
use std::time::{Duration, Instant};

/// Consecutive presses of a run, with all their results.
#[derive(Debug, Clone)]
pub struct SimulatedPiece<'a> {
    /// Number of the first press or drop.
    pub first: usize,
    /// Total number of presses or drops.
    pub of: usize,
    /// Results of the mechanics.
    pub presses: &'a [PressFrames],
    /// Conductance of the taxels as a function of time, one entry a press, in the session of the raster recording.
    pub conductance: Vec<Interpolated>,
    /// Blocks of the raster recording.
    pub raster: Option<Recorded>,
    /// Blocks of the compressive recording.
    pub compressive: Option<Recorded>,
}

/// The frame with the largest normal force of all presses or drops of a run.
#[derive(Debug, Clone)]
pub struct Peak {
    /// Press or drop.
    pub press: usize,
    /// Number of the frame in it.
    pub frame: usize,
    /// The frame.
    pub at: Frame,
}

/// Saturated samples of a recording: those at an end of the converter's or amplifier's range, and the number of all
/// samples.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Saturated {
    /// Number of samples at an end of the range.
    pub samples: usize,
    /// Number of all samples.
    pub of: usize,
}

/// Summary of a run after all its presses have been handed over.
#[derive(Debug, Clone)]
pub struct Simulation {
    /// Every press or drop in numbers.
    pub presses: Vec<PressSummary>,
    /// The instant of the largest force; the first of several equal ones.
    pub peak: Option<Peak>,
    /// The session with only its first blocks, at most `FIRST_BLOCKS`; `None` if nothing was recorded.
    pub first: Option<Session>,
    /// Samples at an end of the converter's or amplifier's range: of the raster recording, then of the compressive one.
    pub saturated: [Option<Saturated>; 2],
    /// Time spent on the mechanics.
    pub mechanics: Duration,
    /// Time spent on the transducer and the readouts.
    pub recording: Duration,
}

impl Simulation {
    /// Number of blocks of a recording that are kept.
    pub(crate) const FIRST_BLOCKS: usize = 6;
}

/// Simulates all presses of the scene, several in parallel. If `record`, records them in both modes as [`Twin::record`]
/// does; only in the compressive mode if emulated cells cannot scan the skin. `each` gets the presses in order, and
/// none is kept, so a run may have any number. `done` is called after the mechanics of each press. The result does not
/// depend on the number of threads.
///
/// # Errors
/// [`Refusal`] if a press is too large, the firmware cannot provide its weights, or mechanics or readout fail; or
/// the error of `each`.
pub fn run(
    prepared: &Prepared,
    record: bool,
    done: &(dyn Fn() + Sync),
    mut each: impl FnMut(SimulatedPiece<'_>) -> Result<(), Refusal>,
) -> Result<Simulation, Refusal> {
    let twin = Twin::new(&prepared.scene)?;
    let mut run = Run::new(prepared, &twin, record)?;
    let (all, together) = (prepared.scene.repeats(), twin.presses_at_once());
    for first in (0..all).step_by(together) {
        let start = Instant::now();
        let presses = twin.presses(first..(first + together).min(all), done)?;
        run.simulation.mechanics += start.elapsed();
        let start = Instant::now();
        let piece = run.record(first, all, &presses)?;
        run.simulation.recording += start.elapsed();
        each(piece)?;
    }
    Ok(run.simulation)
}

/// A run that goes on.
struct Run<'a> {
    prepared: &'a Prepared,
    raster: TwinSession<'a>,
    compressive: Option<TwinSession<'a>>,
    simulation: Simulation,
}

impl<'a> Run<'a> {
    fn new(prepared: &'a Prepared, twin: &'a Twin, record: bool) -> Result<Self, Refusal> {
        if record {
            twin.check_press(Mode::Compressive)?;
        }
        let scanned = record && twin.check_press(Mode::Raster).is_ok();
        let compressive = record.then(|| twin.start_session(&twin.acquisition(Mode::Compressive), true));
        Ok(Self {
            prepared,
            raster: twin.start_session(&twin.acquisition(Mode::Raster), scanned)?,
            compressive: compressive.transpose()?,
            simulation: Simulation {
                presses: Vec::new(),
                peak: None,
                first: record.then(|| twin.session(None, None)),
                saturated: [None; 2],
                mechanics: Duration::ZERO,
                recording: Duration::ZERO,
            },
        })
    }

    /// Records the next `presses`, of which the first has the number `first`.
    fn record<'p>(
        &mut self,
        first: usize,
        of: usize,
        presses: &'p [PressFrames],
    ) -> Result<SimulatedPiece<'p>, Refusal> {
        let Self { raster, compressive, .. } = self;
        let (raster, compressive) = rayon::join(
            || raster.record(presses),
            || compressive.as_mut().map(|session| session.record(presses)).transpose(),
        );
        let (conductance, raster) = raster?;
        let piece = SimulatedPiece {
            first,
            of,
            presses,
            conductance,
            raster,
            compressive: compressive?.and_then(|(_, recorded)| recorded),
        };
        self.keep(&piece)?;
        Ok(piece)
    }

    /// Keeps what is asked for when the run is over.
    fn keep(&mut self, piece: &SimulatedPiece<'_>) -> Result<(), Refusal> {
        let scene = &self.prepared.scene;
        let area_m2 = scene.skin().cell_area_m2();
        let simulation = &mut self.simulation;
        for (press, frames) in (piece.first..).zip(piece.presses) {
            simulation.presses.push(PressSummary::new(press, frames, area_m2));
            for (frame, at) in frames.frames.iter().enumerate() {
                let before = simulation.peak.as_ref().map(|peak| peak.at.wrench.force_n[2]);
                if before.is_none_or(|before| at.wrench.force_n[2] > before) {
                    simulation.peak = Some(Peak { press, frame, at: at.clone() });
                }
            }
        }
        let modes = [(Mode::Raster, &piece.raster), (Mode::Compressive, &piece.compressive)];
        for ((mode, recorded), saturated) in modes.into_iter().zip(&mut simulation.saturated) {
            let Some(recorded) = recorded else { continue };
            let rail_v = scene.chain().profile().rail_v(mode).ok().flatten();
            let saturated = saturated.get_or_insert_default();
            saturated.samples += recorded.recording.saturated(rail_v);
            let blocks = recorded.recording.blocks().iter();
            saturated.of += blocks.map(|block| block.volts.len()).sum::<usize>();
        }
        if let Some(first) = &mut simulation.first {
            keep_first(&mut first.raster, piece.raster.as_ref())?;
            keep_first(&mut first.compressive, piece.compressive.as_ref())?;
        }
        Ok(())
    }
}

/// Adds blocks of `piece` to `kept`, as far as there are too few.
fn keep_first(kept: &mut Option<Recorded>, piece: Option<&Recorded>) -> Result<(), Refusal> {
    let Some(piece) = piece else { return Ok(()) };
    let known = kept.as_ref().map_or(0, |kept| kept.presses.len());
    let more = Simulation::FIRST_BLOCKS.saturating_sub(known).min(piece.presses.len());
    if more == 0 {
        return Ok(());
    }
    let (mut blocks, mut presses) = match kept.take() {
        Some(kept) => (kept.recording.blocks().to_vec(), kept.presses),
        None => (Vec::new(), Vec::new()),
    };
    blocks.extend_from_slice(&piece.recording.blocks()[..more]);
    presses.extend_from_slice(&piece.presses[..more]);
    let recording = Recording::new(piece.recording.info().clone(), blocks);
    *kept = Some(Recorded { recording: recording.map_err(of_readout)?, conditioning: 0, presses });
    Ok(())
}

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
    fn new(press: usize, frames: &PressFrames, cell_area_m2: f64) -> Self {
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
