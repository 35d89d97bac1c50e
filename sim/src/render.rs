//! Pictures of a simulation, drawn off-screen by MuJoCo through EGL, which Linux alone has.

use crate::world::World;
use crate::world::model::{BODY_GEOM, MAX_PADS, PAD_RGB, Visuals, compile, pad_name};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase, MjvCamera};
use spts_contact::Frame;
use spts_input::Refusal;

/// Largest width or height of a picture, pixels.
const MAX_PIXELS: usize = 8192;

/// Position of the camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Camera {
    /// Arm and skin.
    Wide,
    /// The body on the skin.
    Close,
}

impl Camera {
    fn name(self) -> &'static str {
        match self {
            Self::Wide => "wide",
            Self::Close => "close",
        }
    }
}

/// An 8-bit RGB picture, rows from the top.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Picture {
    /// Width, pixels.
    pub width: usize,
    /// Height, pixels.
    pub height: usize,
    /// Red, green and blue of every pixel.
    pub rgb: Vec<u8>,
}

/// Draws a scene repeatedly. Keep the renderer to draw a film.
#[derive(Debug)]
pub struct Renderer {
    model: Box<MjModel>,
    pads: Vec<usize>,
    width: usize,
    height: usize,
}

/// Opacity of a body through which the pads are seen.
const CLEAR_ALPHA: f32 = 0.28;

impl Renderer {
    /// A renderer for the scene of `world`.
    ///
    /// # Errors
    /// [`Refusal`] if the size is outside [1, 8192], or MuJoCo rejects the model.
    pub fn new(world: &World, width: usize, height: usize) -> Result<Self, Refusal> {
        if ![width, height].iter().all(|side| (1..=MAX_PIXELS).contains(side)) {
            return Err(Refusal::new(format!(
                "picture of {width} × {height} is outside [1, {MAX_PIXELS}] pixels a side"
            )));
        }
        let thickness_m = world.scene().build_contact()?.thickness_m();
        let visuals = Visuals::new(world.scene(), thickness_m, width, height);
        let model = Box::new(compile(world.scene(), Some(&visuals))?);
        let taxels = world.scene().skin().taxels();
        let pads = (0..if taxels <= MAX_PADS { taxels } else { 0 })
            .filter_map(|i| model.name_to_id(MjtObjBase::mjOBJ_GEOM, &pad_name(i)))
            .collect();
        Ok(Self { model, pads, width, height })
    }

    /// Draws `world` in its present state. With `frame`, the skin's pads are coloured by its pressure relative to
    /// `full_scale_pa`, and a close-up shows them through the body.
    ///
    /// # Errors
    /// [`Refusal`] if EGL is missing, as on every system but Linux.
    pub fn draw(&mut self, world: &World, camera: Camera, frame: Option<(&Frame, f64)>) -> Result<Picture, Refusal> {
        for (taxel, &geom) in self.pads.iter().enumerate() {
            let level = frame.map_or(0.0, |(f, full_pa)| f.pressure.values()[taxel] / full_pa);
            let [r, g, b] = heat(level);
            self.model.geom_rgba_mut()[geom] = [r, g, b, 1.0];
        }
        if let Some(id) = self.model.name_to_id(MjtObjBase::mjOBJ_GEOM, BODY_GEOM) {
            let clear = camera == Camera::Close && frame.is_some();
            self.model.geom_rgba_mut()[id][3] = if clear { CLEAR_ALPHA } else { 1.0 };
        }
        let mut data = MjData::new(&*self.model);
        data.qpos_mut().copy_from_slice(&world.positions());
        data.forward();
        let camera = self.model.name_to_id(MjtObjBase::mjOBJ_CAMERA, camera.name()).map(MjvCamera::new_fixed);
        let rgb = pixels(&self.model, &mut data, camera, [self.width, self.height])?;
        Ok(Picture { width: self.width, height: self.height, rgb })
    }
}

/// The pixels of `data`, seen by `camera`.
#[cfg(target_os = "linux")]
fn pixels(
    model: &MjModel,
    data: &mut MjData<&MjModel>,
    camera: Option<MjvCamera>,
    [width, height]: [usize; 2],
) -> Result<Vec<u8>, Refusal> {
    use mujoco_rs::renderer::{MjRenderer, RendererError};
    let failed = |error: RendererError| {
        Refusal::new(format!(
            "off-screen rendering failed: {error} (is EGL installed? Debian: libegl1 libegl-mesa0 libgl1-mesa-dri)"
        ))
    };
    let mut renderer = MjRenderer::new(model, width, height, 0).map_err(failed)?;
    if let Some(camera) = camera {
        renderer.set_camera(camera);
    }
    renderer.sync_data(data).map_err(failed)?;
    renderer.render().map_err(failed)?;
    Ok(renderer.rgb_flat().unwrap_or_default().to_vec())
}

/// Refuses: `mujoco-rs` would open a window elsewhere.
#[cfg(not(target_os = "linux"))]
fn pixels(_: &MjModel, _: &mut MjData<&MjModel>, _: Option<MjvCamera>, _: [usize; 2]) -> Result<Vec<u8>, Refusal> {
    Err(Refusal::new("off-screen rendering failed: pictures of scenes are drawn on Linux alone"))
}

/// Colour of a pad at `level` (0 idle, 1 full scale): grey through violet and orange to yellow.
#[expect(clippy::cast_possible_truncation, reason = "colours need no more than f32")]
fn heat(level: f64) -> [f32; 3] {
    const STOPS: [[f32; 3]; 5] =
        [PAD_RGB, [0.36, 0.16, 0.52], [0.75, 0.22, 0.40], [0.97, 0.50, 0.22], [0.99, 0.90, 0.35]];
    let position = level.clamp(0.0, 1.0) as f32 * 4.0;
    let mut below = 0;
    while below < 3 && position > (below + 1) as f32 {
        below += 1;
    }
    let share = position - below as f32;
    std::array::from_fn(|c| STOPS[below][c] + share * (STOPS[below + 1][c] - STOPS[below][c]))
}
