//! The common wire as a readout sees it.

use super::rows::StoredRows;
use super::wiring::ReadoutWire;
use crate::touches::{Touch, TouchWire};
use rand_distr::{Distribution as _, StandardNormal};
use spts_circuit::{CellCodes, CompressiveWeights, Mode, Profile, Readout};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// Frames of the idle skin that the reference is the mean of.
const IDLE_FRAMES: usize = 4;
/// Measurements of the idle skin at least: its noise is estimated from them.
const IDLE_MEASUREMENTS: usize = 512;
/// Number of the idle skin's block; touches have numbers far below.
const IDLE_BLOCK: u64 = 1 << 40;
/// Mean time between false alarms that is accepted, s.
pub const FALSE_ALARM_S: f64 = 10.0;

/// The samples of a few measurements during a held touch, and the threshold that tells a touch from noise.
#[derive(Debug, Clone, PartialEq)]
pub struct WireFrame {
    /// Samples minus those of the idle skin at the same rows, V.
    pub volts: Vec<f64>,
    /// Threshold beyond which a sample means a touch, V: on an idle skin fewer than one is expected in
    /// [`FALSE_ALARM_S`].
    pub alarm_v: f64,
}

impl WireFrame {
    /// The samples of a scan of a sheet with `cols` columns that belong to a contact, and 0 for all others. A contact
    /// consists of the samples beyond the alarm threshold and the positive ones next to them. On a large skin, noise
    /// would otherwise appear as taxels.
    #[must_use]
    pub fn contacts(&self, cols: usize) -> Vec<f64> {
        let mut image = vec![0.0; self.volts.len()];
        let cols = cols.max(1);
        let rows = self.volts.len() / cols;
        for (r, c) in (0..rows).flat_map(|r| (0..cols).map(move |c| (r, c))) {
            if self.volts[r * cols + c] > self.alarm_v {
                for near in r.saturating_sub(1)..(r + 2).min(rows) {
                    let beside = near * cols + c.saturating_sub(1)..near * cols + (c + 2).min(cols);
                    let samples = self.volts[beside.clone()].iter();
                    image[beside]
                        .iter_mut()
                        .zip(samples)
                        .for_each(|(out, v)| *out = v.max(0.0));
                }
            }
        }
        image
    }
}

/// What the idle skin reads, once a session.
struct Idle {
    /// One value for each row of a frame, V.
    volts: Vec<f64>,
    /// Standard deviation of a sample minus its reference, V.
    sd_v: f64,
}

/// A wire with its parts in one session, shared by all readouts. It measures frames of one kind of rows, touch after
/// touch.
pub struct WireSession<'a> {
    wire: &'a ReadoutWire,
    layout: SkinLayout,
    device: Streams,
    period_s: f64,
    idle_s: f64,
    pressed_s: f64,
    /// The readout, and its output without a touch; built with the first frame.
    frames: Option<(TouchWire, Idle)>,
}

impl<'a> WireSession<'a> {
    /// A session with `wire` on a skin of `layout`. A measurement takes `period_s`; an untouched taxel has the
    /// conductance `idle_s` and a fully pressed one `pressed_s`, S. `device` provides its random numbers.
    #[must_use]
    pub fn new(
        wire: &'a ReadoutWire,
        layout: SkinLayout,
        device: Streams,
        period_s: f64,
        [idle_s, pressed_s]: [f64; 2],
    ) -> Self {
        Self {
            wire,
            layout,
            device,
            period_s,
            idle_s,
            pressed_s,
            frames: None,
        }
    }

    /// The wire while `touch` is held. `number` determines its noise.
    pub fn hold<'w>(&'w mut self, touch: &'w Touch, number: u64) -> HeldWire<'w, 'a> {
        HeldWire {
            session: self,
            touch,
            number,
        }
    }

    /// Output of a conductance at level 1, V/S.
    fn volts_per_siemens(&self) -> f64 {
        self.wire.profile.volts_per_siemens()
    }

    /// Threshold for samples of this standard deviation: with Chernoff's bound of a Gaussian's two tails, 2 exp(−z²/2),
    /// no more than one sample of [`FALSE_ALARM_S`] lies beyond.
    fn alarm_v(&self, sd_v: f64) -> f64 {
        sd_v * (2.0 * (2.0 * FALSE_ALARM_S / self.period_s).ln()).sqrt()
    }

    /// The samples of a frame of `measurements` rows of the whole skin, by the readout that `build` makes.
    fn frame(
        &mut self,
        conductance_s: &[f64],
        number: u64,
        measurements: usize,
        build: impl FnOnce(&Self) -> Result<Readout, Refusal>,
    ) -> Result<WireFrame, Refusal> {
        let (mut wire, idle) = match self.frames.take() {
            Some(frames) if frames.1.volts.len() == measurements => frames,
            _ => {
                let mut wire = TouchWire::of(build(self)?);
                let idle = self.idle(&mut wire, measurements)?;
                (wire, idle)
            }
        };
        let pressed = conductance_s.iter().map(|g| g + self.idle_s).collect();
        let mut volts = wire.volts(self.map(pressed), number, 0, measurements)?;
        volts.iter_mut().zip(&idle.volts).for_each(|(v, idle)| *v -= idle);
        let alarm_v = self.alarm_v(idle.sd_v);
        self.frames = Some((wire, idle));
        Ok(WireFrame { volts, alarm_v })
    }

    fn map(&self, values: Vec<f64>) -> ConductanceMap {
        ConductanceMap::from_values(self.layout.rows(), self.layout.cols(), values)
    }

    /// Frames of the idle skin: their mean, and how far single ones are from it.
    fn idle(&self, wire: &mut TouchWire, measurements: usize) -> Result<Idle, Refusal> {
        let frames = IDLE_FRAMES.max(IDLE_MEASUREMENTS.div_ceil(measurements));
        let mut volts = vec![0.0; measurements];
        let mut squares = 0.0;
        for frame in 0..frames as u64 {
            let idle = self.map(vec![self.idle_s; self.layout.taxels()]);
            for (sum, v) in volts
                .iter_mut()
                .zip(wire.volts(idle, IDLE_BLOCK + frame, 0, measurements)?)
            {
                *sum += v;
                squares += v * v;
            }
        }
        let count = frames as f64;
        volts.iter_mut().for_each(|v| *v /= count);
        let means: f64 = volts.iter().map(|v| count * v * v).sum();
        let variance = (squares - means).max(0.0) / ((count - 1.0) * measurements as f64);
        Ok(Idle {
            volts,
            sd_v: (variance * (1.0 + 1.0 / count)).sqrt(),
        })
    }
}

/// The wire while a touch is held. A [`WireReadout`](super::WireReadout) requests measurements from it, and has no
/// access to the touch itself.
pub struct HeldWire<'w, 'a> {
    session: &'w mut WireSession<'a>,
    touch: &'w Touch,
    number: u64,
}

impl HeldWire<'_, '_> {
    /// Output for a conductance at level 1, V/S.
    #[must_use]
    pub fn volts_per_siemens(&self) -> f64 {
        self.session.volts_per_siemens()
    }

    /// Levels of the codes 0 and 255 according to the data sheet.
    #[must_use]
    pub fn levels(&self) -> [f64; 2] {
        self.session.wire.levels
    }

    /// A raster frame: sample k has taxel k at level 1, and all others at 0.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built.
    pub fn scan(&mut self) -> Result<WireFrame, Refusal> {
        let taxels = self.session.layout.taxels();
        let touch = self.touch.conductance_s.values();
        self.session.frame(touch, self.number, taxels, |session| {
            let (profile, layout) = (&session.wire.profile, &session.layout);
            Ok(Readout::new(profile, Mode::Raster, layout, session.device, 0).map_err(Refusal::from_error)?)
        })
    }

    /// A frame of `measurements` rows of ±1. All frames of a session must have the same kind of rows.
    ///
    /// # Errors
    /// [`Refusal`] if the rows belong to another skin.
    pub fn signs<R: CellCodes + Clone + 'static>(
        &mut self,
        rows: &R,
        measurements: usize,
    ) -> Result<WireFrame, Refusal> {
        let touch = self.touch.conductance_s.values();
        self.session.frame(touch, self.number, measurements, |session| {
            let profile = Profile {
                weights: CompressiveWeights::Binary,
                ..session.wire.profile.clone()
            };
            let readout = Readout::new(&profile, Mode::Compressive, &session.layout, session.device, 0)
                .map_err(Refusal::from_error)?;
            Ok(readout
                .with_codes(Box::new(rows.clone()))
                .map_err(Refusal::from_error)?)
        })
    }

    /// Each cell's own measurement of its taxel, S: the conductance minus that of the idle skin, with the relative
    /// noise of a contact. It is for cells with a converter of their own; the receiver at the end of the wire does not
    /// know it.
    #[must_use]
    pub fn own_values_s(&self) -> Vec<f64> {
        let mut rng = self.session.device.rng("readouts/cells", self.number);
        let noisy = |g: &f64| {
            let normal: f64 = StandardNormal.sample(&mut rng);
            g * (1.0 + self.session.wire.contact_noise * normal)
        };
        self.touch.conductance_s.values().iter().map(noisy).collect()
    }

    /// Random numbers for events that are not synchronised with a clock; different for every touch.
    #[must_use]
    pub fn moments(&self) -> Streams {
        self.session.device.child("readouts/moments", self.number)
    }

    /// Samples while `chips.taxels()` cells put out `chips` (levels −1, 0, +1) through resistors of their own with the
    /// conductance of a fully pressed taxel, and all other cells are off. `None` is a silent wire.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built.
    pub fn transmissions(&mut self, chips: Option<&StoredRows>, measurements: usize) -> Result<WireFrame, Refusal> {
        let session = &*self.session;
        let published = SkinLayout::default();
        let line = |chips: &StoredRows| -> Result<TouchWire, Refusal> {
            // the cells that transmit, whatever their places
            let layout = SkinLayout::new(1, chips.taxels(), published.pitch_m(), published.electrode_m())?;
            let readout = Readout::new(&session.wire.profile, Mode::Raster, &layout, session.device, 0)
                .map_err(Refusal::from_error)?;
            Ok(TouchWire::of(
                readout
                    .with_codes(Box::new(chips.clone()))
                    .map_err(Refusal::from_error)?,
            ))
        };
        let silent = StoredRows::new(1, vec![0]);
        let idle = line(&silent)?.volts(ConductanceMap::zeros(1, 1), IDLE_BLOCK, 0, IDLE_MEASUREMENTS)?;
        let idle_v = idle.iter().sum::<f64>() / idle.len() as f64;
        let variance = idle.iter().map(|v| (v - idle_v).powi(2)).sum::<f64>() / (idle.len() - 1) as f64;
        let (chips, each_s) = chips.map_or((&silent, 0.0), |chips| (chips, session.pressed_s));
        let map = ConductanceMap::from_values(1, chips.taxels(), vec![each_s; chips.taxels()]);
        let mut volts = line(chips)?.volts(map, self.number, 0, measurements)?;
        volts.iter_mut().for_each(|v| *v -= idle_v);
        Ok(WireFrame {
            volts,
            alarm_v: session.alarm_v(variance.sqrt()),
        })
    }

    /// Conductance of a fully pressed taxel, S.
    #[must_use]
    pub fn pressed_s(&self) -> f64 {
        self.session.pressed_s
    }

    /// Conductance of an untouched taxel, S.
    #[must_use]
    pub fn idle_s(&self) -> f64 {
        self.session.idle_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: one taxel of 3 × 4 beyond the alarm; the positive one at its corner counts, the one two columns further
    /// does not.
    #[test]
    fn contacts_are_what_is_beyond_the_alarm_and_beside_it() {
        let frame = WireFrame {
            volts: vec![2.0, -0.3, 0.0, 0.4, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.9],
            alarm_v: 1.0,
        };
        let expected = [2.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        assert_eq!(frame.contacts(4), expected);
    }
}
