//! Notes for the user: about a scene before it runs, and about its recordings afterwards.

use super::run::Saturated;
use crate::chain::ChainError;
use crate::scene::{Scene, Task};
use crate::session::MOST_SAMPLES;
use spts_circuit::Mode;
use spts_contact::mesh::MeshReport;
use spts_models::REFERENCE_PA;
use spts_sim::mechanics::Mechanics;

/// Notes on `scene`: what was repaired in its mesh, what hangs over the edge, what a tolerance chose, faults, and a
/// taxel that is below the noise.
pub(super) fn of_scene(scene: &Scene) -> Result<Vec<String>, ChainError> {
    let mechanics = scene.mechanics();
    let mut notes = mechanics.mesh_report().map(MeshReport::notes).unwrap_or_default();
    notes.extend(overhang(mechanics));
    notes.extend(chosen(mechanics));
    let cols = scene.skin().cols();
    notes.extend(scene.chain().profile().faults.iter().map(|fault| {
        let taxel = fault.taxel as usize;
        format!(
            "injected fault: `{}`, taxel {taxel} (row {}, column {})",
            fault.name,
            taxel / cols,
            taxel % cols
        )
    }));
    notes.extend(below_noise(scene)?);
    Ok(notes)
}

fn overhang(mechanics: &Mechanics) -> Option<String> {
    let edges = mechanics.overhang()?.edges();
    let over = edges.iter().filter(|(_, m)| *m > 0.0);
    let over: Vec<String> = over
        .map(|(edge, m)| format!("{:.1} mm over the edge at {edge}", 1e3 * m))
        .collect();
    let what = match mechanics.task() {
        Task::Press(_) => "object",
        Task::Drop(_) => "ball",
    };
    Some(format!(
        "the {what} hangs {}: beside the sheet there is nothing to press on",
        over.join(", ")
    ))
}

fn chosen(mechanics: &Mechanics) -> Option<String> {
    let config = mechanics.config();
    let tolerance = config.chosen_for_tolerance?;
    let of = |key: &str| config.contact.get(key).map(ToString::to_string).unwrap_or_default();
    Some(format!(
        "the tolerance of {tolerance} chose the contact field {}, {} cells along a taxel and steps of {} s",
        of("model"),
        of("cells_per_taxel"),
        mechanics.timestep_s()
    ))
}

fn below_noise(scene: &Scene) -> Result<Option<String>, ChainError> {
    let signal = scene.chain().taxel_signal()?;
    Ok(signal.below_noise().then(|| {
        format!(
            "a taxel under {:.0} kPa gives {:.2e} V, a measurement has a noise of {:.2e} V and steps of {:.2e} V: the taxel is below the noise. An electrode of \
             {:.1} mm needs more feedback than the readout profile has",
            1e-3 * REFERENCE_PA,
            signal.signal_v,
            signal.noise_v,
            signal.step_v,
            1e3 * scene.skin().electrode_m()
        )
    }))
}

/// Notes on the recordings of a run: samples that saturate, more samples than can be read again, and a scan that there
/// is not.
pub(super) fn of_recordings(scene: &Scene, saturated: &[Option<Saturated>; 2]) -> Vec<String> {
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
