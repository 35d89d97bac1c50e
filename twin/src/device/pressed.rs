//! An object that is pressed while the device measures. Contact only; no physics engine.

use super::virtual_device::{BlockSource, DeviceBlock, DeviceError};
use crate::chain::Chain;
use crate::wire::Wire;
use spts_circuit::{Converter, Mode};
use spts_contact::objects::ObjectSpec;
use spts_contact::{Foam, PosedMesh, PreparedMesh, TouchBody, TouchSkin, Wrench};
use spts_models::{ConfigError, in_range};
use std::f64::consts::FRAC_PI_2;

/// Which object is pressed, and how.
#[derive(Debug, Clone, Copy)]
pub struct PressedConfig {
    /// The object, pressed at its place in the published recordings.
    pub object: &'static ObjectSpec,
    /// Force of the hold, N. Range [0.1, 1000].
    pub force_n: f64,
    /// Mode of the readout.
    pub mode: Mode,
    /// Number of blocks; `None` to continue without end.
    pub blocks: Option<u64>,
    /// Number of the session.
    pub session: u64,
}

/// Frames of a block, and those at which the object comes down, is held, goes up and is gone.
const FRAMES: u32 = 1000;
const COURSE: [u32; 4] = [150, 400, 750, 900];
/// Frames between two blocks in which the clock runs and nothing is recorded.
const BETWEEN: usize = 57;
/// Depth that no press needs, m.
const DEEPEST_M: f64 = 0.05;
/// Halvings of the depth when the one for the force is looked for.
const HALVINGS: usize = 50;

/// Blocks of a virtual device on whose simulated skin an object is pressed once a block.
pub struct Pressed {
    skin: TouchSkin,
    body: TouchBody,
    posed: [[f64; 3]; 3],
    /// Position of the object's origin when its lowest point touches the skin, m.
    rest_m: [f64; 3],
    stiffness_pa_per_m: f64,
    depth_m: f64,
    wire: Wire,
    converter: Converter,
    config: PressedConfig,
    sample_rate_hz: f64,
    made: u64,
    wrenches: Vec<Wrench>,
}

impl Pressed {
    /// A source that presses the object of `config` on the skin of `chain`.
    ///
    /// # Errors
    /// [`DeviceError`] for a force outside its range or too large for the object, or a readout without a converter.
    pub fn new(chain: &Chain, config: PressedConfig) -> Result<Self, DeviceError> {
        let refused = |e: ConfigError| DeviceError::Source(e.to_string());
        let force_n = config.force_n;
        in_range("force_n", force_n, (0.1..=1e3).contains(&force_n), "[0.1, 1000] N").map_err(refused)?;
        let wire = Wire::new(chain, config.session)?;
        let converter = wire.info(config.mode).converter;
        let converter = converter.ok_or_else(|| DeviceError::Source("the readout has no converter".to_owned()))?;
        let layout = *chain.skin();
        let (spec, place) = (config.object, config.object.placement);
        let body = TouchBody::from(PreparedMesh::from((spec.build)()));
        let [x_m, y_m] = layout.position_m(place.row, place.col);
        let posed = place.matrix();
        let lowest = PosedMesh {
            rotation: posed,
            ..PosedMesh::at_rest(&body.mesh, [0.0; 3])
        };
        let [low_m, _] = lowest.heights_m();
        let mut pressed = Self {
            skin: TouchSkin::flat(layout, Foam::default()).map_err(refused)?,
            posed,
            rest_m: [x_m, y_m, -low_m],
            stiffness_pa_per_m: spec.stiffness_pa_per_m.unwrap_or(f64::INFINITY),
            depth_m: 0.0,
            body,
            sample_rate_hz: chain.sample_rate_hz(),
            wire,
            converter,
            config,
            made: 0,
            wrenches: Vec::new(),
        };
        pressed.depth_m = pressed.depth_for(config.force_n)?;
        Ok(pressed)
    }

    /// Puts the object `depth_m` into the skin at `speed_m_per_s`; the force, N.
    fn touch(&mut self, depth_m: f64, speed_m_per_s: f64) -> f64 {
        let [x, y, z] = self.rest_m;
        let posed = PosedMesh {
            rotation: self.posed,
            velocity_m_per_s: [0.0, 0.0, -speed_m_per_s],
            stiffness_pa_per_m: self.stiffness_pa_per_m,
            ..PosedMesh::at_rest(&self.body.mesh, [x, y, z - depth_m])
        };
        self.skin.touch(&[(&self.body, posed)], &mut self.wrenches);
        self.wrenches.first().map_or(0.0, |wrench| wrench.force_n[2])
    }

    fn depth_for(&mut self, force_n: f64) -> Result<f64, DeviceError> {
        let (mut low_m, mut high_m) = (0.0, DEEPEST_M);
        if self.touch(high_m, 0.0) < force_n {
            let name = self.config.object.name;
            return Err(DeviceError::Source(format!(
                "{name:?} cannot press with {force_n} N on this skin"
            )));
        }
        for _ in 0..HALVINGS {
            let middle_m = 0.5 * (low_m + high_m);
            if self.touch(middle_m, 0.0) < force_n {
                low_m = middle_m;
            } else {
                high_m = middle_m;
            }
        }
        Ok(high_m)
    }

    /// Share of the depth at `frame`.
    fn share(frame: u32) -> f64 {
        let [down, hold, up, gone] = COURSE.map(f64::from);
        let frame = f64::from(frame);
        let ramp = |share: f64| (FRAC_PI_2 * share.clamp(0.0, 1.0)).sin().powi(2);
        if frame < hold {
            ramp((frame - down) / (hold - down))
        } else {
            1.0 - ramp((frame - up) / (gone - up))
        }
    }
}

impl BlockSource for Pressed {
    fn mode(&self) -> Mode {
        self.config.mode
    }

    fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    fn next_block(&mut self) -> Result<Option<DeviceBlock>, DeviceError> {
        if self.config.blocks.is_some_and(|blocks| self.made >= blocks) {
            return Ok(None);
        }
        let mode = self.config.mode;
        let taxels = self.skin.layout().taxels();
        let frame_s = taxels as f64 / self.sample_rate_hz;
        let mut codes = Vec::with_capacity(FRAMES as usize * taxels);
        let mut volts = vec![0.0; taxels];
        for _ in 0..BETWEEN {
            self.wire.measure(mode, &mut volts)?;
        }
        for frame in 0..FRAMES {
            let depth_m = self.depth_m * Self::share(frame);
            let speed_m_per_s = (self.depth_m * Self::share(frame + 1) - depth_m) / frame_s;
            if depth_m > 0.0 {
                self.touch(depth_m, speed_m_per_s);
            } else {
                self.skin.touch(&[], &mut self.wrenches);
            }
            self.wire.feel(self.skin.electrode_pressure(), frame_s)?;
            self.wire.measure(mode, &mut volts)?;
            codes.extend(volts.iter().map(|v| self.converter.code(*v).unwrap_or(0)));
        }
        self.made += 1;
        Ok(Some(DeviceBlock {
            frame_position: self.wire.rows(mode, 0).first_row() / taxels as u64,
            codes,
        }))
    }
}
