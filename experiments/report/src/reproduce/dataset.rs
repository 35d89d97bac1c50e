//! The simulated data set: seventeen objects in both modes, and the bouncing ball.

use super::results::ReproductionSize;
use rayon::prelude::*;
use spts::Session;
use spts::chain::Acquisition;
use spts::provenance::{Provenance, combined_hash};
use spts::record::Twin;
use spts::scene::{DropConfig, Scene, SceneConfig, Task};
use spts::session::Event;
use spts_circuit::Mode;
use spts_contact::objects::OBJECTS;
use spts_eval::{SkinRun, SkinRunPresses};
use spts_input::Refusal;
use spts_sim::World;
use spts_sim::render::{Camera, Picture, Renderer};
use spts_sim::world::{Bounce, PressCourse};
use std::path::Path;

/// One simulated object.
#[derive(Debug, Clone)]
pub(super) struct SimulatedObject {
    /// Both recordings.
    pub(super) session: Session,
    /// Number of its class.
    pub(super) label: usize,
    /// Pressure map on the plateau of the first press, Pa.
    pub(super) pressure_pa: Vec<f64>,
    /// Course of the force of every press, raster session first; `None` for one that missed its target.
    pub(super) courses: Vec<Option<PressCourse>>,
    /// Largest |Σ p·A − force| / force over the frames of all presses.
    pub(super) imbalance: f64,
    /// Picture of the scene on the plateau, or why there is none.
    pub(super) picture: Result<Picture, String>,
}

/// One simulated drop.
#[derive(Debug, Clone)]
pub(super) struct SimulatedDrop {
    /// Its bounces.
    pub(super) bounces: Vec<Bounce>,
    /// Largest |Σ p·A − force| / force over its frames.
    pub(super) imbalance: f64,
}

/// Everything that was simulated.
#[derive(Debug, Clone)]
pub(super) struct SimulatedData {
    /// Objects in label order.
    pub(super) objects: Vec<SimulatedObject>,
    /// Session of the bouncing ball.
    pub(super) bounces: Session,
    /// Mechanics of the drops.
    pub(super) drops: Vec<SimulatedDrop>,
    /// Columns of the skin.
    pub(super) cols: usize,
    /// Hash of all scenes.
    pub(super) scene_hash: String,
}

/// Landing points (row, col) of the drops, spread over the sheet as the recorded ones are.
const LANDINGS: [[f64; 2]; 8] =
    [[4.2, 4.5], [4.2, 5.8], [4.5, 5.0], [4.6, 5.7], [3.6, 3.6], [5.7, 3.3], [6.4, 4.8], [2.9, 5.1]];

/// Instant on the plateau, as a share of the press.
const PLATEAU: f64 = 0.58;
/// Size of the scene pictures, pixels.
const PICTURE: [usize; 2] = [360, 300];

/// Number of times [`simulate`] reports progress.
pub(super) fn steps(size: &ReproductionSize) -> usize {
    OBJECTS.len() * (size.raster_presses + size.compressive_presses)
}

/// Simulates the data set with root seed `seed`.
///
/// # Errors
/// [`Refusal`] when the mechanics or the readout fail.
pub(super) fn simulate(seed: u64, size: &ReproductionSize, done: &(dyn Fn() + Sync)) -> Result<SimulatedData, Refusal> {
    let objects = OBJECTS
        .par_iter()
        .map(|object| {
            let scene = press_scene(object.name, seed, size)?;
            // the recorded sessions are scored from their sixth press on
            let run = SkinRun {
                scene: &scene,
                number: u64::from(object.label),
                scanned: size.raster_presses,
                summed: size.compressive_presses,
                conditioning: size.real_protocol.first_press,
            };
            let SkinRunPresses { session, presses, .. } = run.record(done)?;
            let plateau_s = PLATEAU * scene.duration_s();
            let pressure_pa = presses
                .first()
                .and_then(|press| press.frames.iter().find(|f| f.time_s >= plateau_s))
                .map(|f| f.pressure.values().to_vec());
            let area_m2 = scene.skin().cell_area_m2();
            Ok(SimulatedObject {
                session,
                label: usize::from(object.label),
                pressure_pa: pressure_pa.unwrap_or_default(),
                imbalance: presses.iter().map(|p| p.imbalance(area_m2)).fold(0.0, f64::max),
                courses: presses.iter().map(|p| p.course).collect(),
                picture: picture(&scene, plateau_s).map_err(|e| e.to_string()),
            })
        })
        .collect::<Result<Vec<_>, Refusal>>()?;
    let scenes =
        LANDINGS.iter().enumerate().map(|(k, &landing)| drop_scene(landing, seed, k)).collect::<Result<Vec<_>, _>>()?;
    let area_m2 = scenes[0].skin().cell_area_m2();
    let twins = scenes.iter().map(Twin::new).collect::<Result<Vec<_>, _>>()?;
    let drops = twins.par_iter().map(|twin| twin.presses(0..twin.scene().repeats(), &|| ()));
    let drops: Vec<_> = drops.collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    // one session of one skin: blocks follow each other as in the published session
    let bounces = twins[0].recorded(&drops, &Acquisition::drops(Mode::Compressive, 0))?;
    let mut hashes = scenes.iter().map(Scene::hash).collect::<Result<Vec<_>, _>>()?;
    for object in OBJECTS {
        hashes.push(press_scene(object.name, seed, size)?.hash()?);
    }
    Ok(SimulatedData {
        objects,
        bounces: Session {
            object: "tennis".to_owned(),
            compressive: Some(bounces),
            provenance: Some(Provenance::new(seed, combined_hash(&hashes))),
            ..Session::new("tennis_bounces", Event::Drop)
        },
        drops: drops
            .into_iter()
            .map(|drop| SimulatedDrop { imbalance: drop.imbalance(area_m2), bounces: drop.bounces })
            .collect(),
        cols: scenes[0].skin().cols(),
        scene_hash: combined_hash(&hashes),
    })
}

/// Scene of both sessions of an object.
fn press_scene(object: &str, seed: u64, size: &ReproductionSize) -> Result<Scene, Refusal> {
    let mut config = Scene::press(object)?.config().clone();
    config.seed = seed;
    if let Some(press) = &mut config.press {
        press.presses = size.raster_presses + size.compressive_presses;
    }
    Scene::new(config, Path::new(""))
}

/// Every landing point is a scene of its own; the skin, which follows from the seed, is the same.
fn drop_scene(landing: [f64; 2], seed: u64, index: usize) -> Result<Scene, Refusal> {
    let ball = DropConfig {
        row: Some(landing[0]),
        col: Some(landing[1]),
        drops: 1,
        // late in the block, so that it holds the one bounce from the full height
        release_s: 0.95 + 0.013 * index as f64,
        ..DropConfig::default()
    };
    let config = SceneConfig { seed, drop: Some(ball), ..SceneConfig::default() };
    Scene::new(config, Path::new(""))
}

/// Picture of the first press at `time_s`: the object as it is, not see-through.
fn picture(scene: &Scene, time_s: f64) -> Result<Picture, Refusal> {
    debug_assert!(matches!(scene.task(), Task::Press(_)), "drops are not drawn here");
    let mut world = World::new(scene.mechanics())?;
    let reached = world.frames().find(|f| f.as_ref().map_or(true, |f| f.time_s >= time_s)).transpose()?;
    debug_assert!(reached.is_some(), "the plateau is within the press");
    let mut renderer = Renderer::new(&world, PICTURE[0], PICTURE[1])?;
    renderer.draw(&world, Camera::Close, None)
}
