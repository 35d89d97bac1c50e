//! Where a virtual device has its blocks from: a recorded session, or an object that is pressed while it measures
//! (contact only, no physics engine).

use super::protocol::{BlockSource, DeviceBlock};
use crate::chain::Chain;
use crate::wire::Wire;
use spts_circuit::{Converter, Mode, Recording};
use spts_contact::objects::ObjectSpec;
use spts_contact::{Foam, PosedMesh, PreparedMesh, TouchBody, TouchSkin, Wrench};
use spts_input::Refusal;
use spts_models::in_range;
use std::f64::consts::FRAC_PI_2;

/// The blocks of a recording, in order.
///
/// ```
/// use spts::device::{BlockSource as _, Played};
/// use spts::{Block, Recording, RecordingInfo, Seeding, SkinLayout, WeightMode, Weights};
///
/// let layout = SkinLayout::new(1, 8, 5e-3, 3e-3)?;
/// let info = RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0);
/// let block = Block { frame_position: 10, idle_frames: None, volts: vec![0.25; 80] };
/// let recording = Recording::new(info, vec![block])?;
/// assert!(Played::new(&recording).is_err(), "volts without a converter's scale have no codes");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Played<'a> {
    recording: &'a Recording,
    converter: Converter,
    next: usize,
}

impl<'a> Played<'a> {
    /// The blocks of `recording`.
    ///
    /// # Errors
    /// [`Refusal`] if the recording has no codes, because it was made without a converter or its scale is
    /// unknown.
    pub fn new(recording: &'a Recording) -> Result<Self, Refusal> {
        let converter = recording.converter().copied().ok_or_else(|| {
            Refusal::new("the recording has no codes: its readout has no converter, or one of unknown scale")
        })?;
        Ok(Self { recording, converter, next: 0 })
    }
}

impl BlockSource for Played<'_> {
    fn mode(&self) -> Mode {
        self.recording.mode()
    }

    fn sample_rate_hz(&self) -> f64 {
        self.recording.sample_rate_hz()
    }

    fn next_block(&mut self) -> Result<Option<DeviceBlock>, Refusal> {
        let Some(block) = self.recording.blocks().get(self.next) else {
            return Ok(None);
        };
        self.next += 1;
        // a sample that was lost is sent as 0
        let codes = block.volts.iter().map(|v| self.converter.code(*v).unwrap_or(0));
        Ok(Some(DeviceBlock { frame_position: block.frame_position, codes: codes.collect() }))
    }
}

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
    /// [`Refusal`] for a force outside its range or too large for the object, or a readout without a converter.
    pub fn new(chain: &Chain, config: PressedConfig) -> Result<Self, Refusal> {
        let force_n = config.force_n;
        in_range("force_n", force_n, (0.1..=1e3).contains(&force_n), "[0.1, 1000] N")?;
        let wire = Wire::new(chain, config.session)?;
        let converter = wire.info(config.mode).converter;
        let converter = converter.ok_or_else(|| Refusal::new("the readout has no converter"))?;
        let layout = *chain.skin();
        let (spec, place) = (config.object, config.object.placement);
        let body = TouchBody::from(PreparedMesh::from((spec.build)()));
        let [x_m, y_m] = layout.position_m(place.row, place.col);
        let posed = place.matrix();
        let lowest = PosedMesh { rotation: posed, ..PosedMesh::at_rest(&body.mesh, [0.0; 3]) };
        let [low_m, _] = lowest.heights_m();
        let mut pressed = Self {
            skin: TouchSkin::flat(layout, Foam::default())?,
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

    fn depth_for(&mut self, force_n: f64) -> Result<f64, Refusal> {
        // from above: an object that has gone half through the skin touches nothing
        let (mut low_m, mut high_m) = (0.0, DEEPEST_M / 16.0);
        while self.touch(high_m, 0.0) < force_n {
            if high_m >= DEEPEST_M {
                let name = self.config.object.name;
                return Err(Refusal::new(format!("{name:?} cannot press with {force_n} N on this skin")));
            }
            low_m = high_m;
            high_m *= 2.0;
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
        if frame < hold { ramp((frame - down) / (hold - down)) } else { 1.0 - ramp((frame - up) / (gone - up)) }
    }
}

impl BlockSource for Pressed {
    fn mode(&self) -> Mode {
        self.config.mode
    }

    fn sample_rate_hz(&self) -> f64 {
        self.sample_rate_hz
    }

    fn next_block(&mut self) -> Result<Option<DeviceBlock>, Refusal> {
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
        Ok(Some(DeviceBlock { frame_position: self.wire.rows(mode, 0).first_row() / taxels as u64, codes }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Heard, Host, VirtualDevice};
    use super::*;
    use crate::ChainConfig;
    use spts_contact::objects::by_name;
    use spts_models::SkinLayout;
    use std::os::unix::net::UnixStream;
    use std::time::Duration;

    fn pressed(mode: Mode, blocks: u64) -> Pressed {
        let config = ChainConfig { readout: Some("as_built".to_owned()), ..ChainConfig::default() };
        let chain = Chain::new(&config, &SkinLayout::default(), 3, "".as_ref()).unwrap();
        let config =
            PressedConfig { object: by_name("T").unwrap(), force_n: 20.0, mode, blocks: Some(blocks), session: 0 };
        Pressed::new(&chain, config).unwrap()
    }

    #[test]
    fn a_host_reads_what_the_device_measures() {
        for mode in [Mode::Raster, Mode::Compressive] {
            let mut same = pressed(mode, 2);
            let (near, far) = UnixStream::pair().unwrap();
            let device = std::thread::spawn(move || {
                let mut counted = 0;
                let count = VirtualDevice::new(far, false).serve(&mut pressed(mode, 2), |_| counted += 1);
                (count.unwrap(), counted)
            });
            let mut host = Host::greet(near, Duration::from_secs(60), &|| false).unwrap().unwrap();
            let mut last = 0;
            for _ in 0..2 {
                let made = same.next_block().unwrap().unwrap();
                let mut codes: Vec<Option<u32>> = made.codes.into_iter().map(Some).collect();
                codes[99_999] = None;
                let Heard::Block(found) = host.block(100_000, 1023).unwrap() else { panic!("no block") };
                assert_eq!((found.frame_position, found.codes, found.missing), (made.frame_position, codes, None));
                assert!(found.frame_position > last + 1000);
                last = found.frame_position;
            }
            assert_eq!(device.join().unwrap(), (2, 2));
            assert!(same.next_block().unwrap().is_none());
        }
    }

    /// In a raster scan, the taxel that the object presses most reads lowest, and only while it is held.
    #[test]
    fn a_press_is_seen_while_it_lasts() {
        let block = pressed(Mode::Raster, 1).next_block().unwrap().unwrap();
        let least = |frame: usize| *block.codes[frame * 100..][..100].iter().min().unwrap();
        let idle = least(100);
        // four times what the device itself takes for a touch
        assert!(least(600) + 20 < idle, "{} of {idle}", least(600));
        assert!(least(990).abs_diff(idle) < 20);
    }
}
