//! Pictures of the instant of the largest force.

use crate::ReportError;
use crate::figures::{FigureError, pressure_png};
use spts::output::{OutputError, OutputFolder};
use spts::simulate::{Prepared, Simulation};
use spts_input::Refusal;
use spts_sim::World;
use spts_sim::render::{Camera, Picture, Renderer};

/// Size of the pictures of the scene, pixels.
const SCENE_PIXELS: [usize; 2] = [1280, 960];
const KPA_PER_PA: f64 = 1e-3;

/// `pressure.png`: the pressure map.
pub(super) fn pressure_picture(
    out: &OutputFolder,
    prepared: &Prepared,
    simulation: &Simulation,
) -> Result<(), ReportError> {
    let Some(frame) = simulation.peak.as_ref().map(|peak| &peak.at) else {
        return Ok(());
    };
    let map = &frame.pressure;
    let title = format!(
        "{}: pressure at {:.1} N, {:.3} s",
        prepared.body(),
        frame.wrench.force_n[2],
        frame.time_s
    );
    let path = out.path("pressure.png");
    pressure_png(map.values(), map.rows(), map.cols(), "kPa", KPA_PER_PA, &title, &path).map_err(|error| match error {
        FigureError::Io { path, source } => OutputError::write(&path)(source).into(),
        other => other.into(),
    })
}

/// `scene.png` and `scene_close.png`: the scene from afar and close up, the skin coloured by its pressure.
pub(super) fn scene_pictures(
    prepared: &Prepared,
    simulation: &Simulation,
) -> Result<Vec<(&'static str, Picture)>, Refusal> {
    let Some(peak) = &simulation.peak else {
        return Ok(Vec::new());
    };
    // the same press again, up to that frame
    let mut world = World::repeat(prepared.scene.mechanics(), peak.press)?;
    let frame = world.frames().nth(peak.frame).transpose()?;
    let full_pa = frame.as_ref().map_or(0.0, |f| f.pressure.max()).max(f64::MIN_POSITIVE);
    let [width, height] = SCENE_PIXELS;
    let mut renderer = Renderer::new(&world, width, height)?;
    let cameras = [("scene.png", Camera::Wide), ("scene_close.png", Camera::Close)];
    let pictures = cameras.map(|(name, camera)| {
        let picture = renderer.draw(&world, camera, frame.as_ref().map(|f| (f, full_pa)));
        Ok((name, picture?))
    });
    pictures.into_iter().collect()
}
