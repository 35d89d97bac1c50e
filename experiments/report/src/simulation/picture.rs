//! Pictures of the instant of the largest force.

use crate::ReportError;
use crate::figures::{FigureError, pressure_png};
use spts::output::{OutputError, Staged};
use spts::simulate::{Prepared, Simulation};
use spts_sim::render::{Camera, Renderer};
use spts_sim::{SimError, World};

/// Size of the pictures of the scene, pixels.
const SCENE_PIXELS: [usize; 2] = [1280, 960];
const KPA_PER_PA: f64 = 1e-3;

/// `pressure.png`: the pressure map.
pub(super) fn pressure_picture(
    staged: &Staged,
    prepared: &Prepared,
    simulation: &Simulation,
) -> Result<(), ReportError> {
    let Some(frame) = simulation.peak_frame() else {
        return Ok(());
    };
    let map = &frame.pressure;
    let title = format!(
        "{}: pressure at {:.1} N, {:.3} s",
        prepared.body(),
        frame.wrench.force_n[2],
        frame.time_s
    );
    let path = staged.path("pressure.png");
    pressure_png(map.values(), map.rows(), map.cols(), "kPa", KPA_PER_PA, &title, &path).map_err(|error| match error {
        FigureError::Io { path, source } => OutputError::Write { path, source }.into(),
        other => other.into(),
    })
}

/// `scene.png` and `scene_close.png`: the scene from afar and close up, the skin coloured by its pressure.
pub(super) fn scene_pictures(staged: &Staged, prepared: &Prepared, simulation: &Simulation) -> Result<(), SimError> {
    let Some((press, index)) = simulation.peak() else {
        return Ok(());
    };
    // the same press again, up to that frame
    let mut world = World::repeat(prepared.scene.mechanics(), press)?;
    let frame = world.frames().nth(index).transpose()?;
    let full_pa = frame.as_ref().map_or(0.0, |f| f.pressure.max()).max(f64::MIN_POSITIVE);
    let [width, height] = SCENE_PIXELS;
    let mut renderer = Renderer::new(&world, width, height)?;
    for (camera, name) in [(Camera::Wide, "scene.png"), (Camera::Close, "scene_close.png")] {
        let picture = renderer.draw(&world, camera, frame.as_ref().map(|f| (f, full_pa)))?;
        picture
            .save_png(staged.path(name))
            .map_err(|error| unstaged(staged, error))?;
    }
    Ok(())
}

/// The same error with the final place of the picture instead of the place where it waited.
fn unstaged(staged: &Staged, error: SimError) -> SimError {
    match error {
        SimError::Write { path, source } => match staged.unstaged(OutputError::Write { path, source }) {
            OutputError::Write { path, source } => SimError::Write { path, source },
            other => SimError::Render(other.to_string()),
        },
        other => other,
    }
}
