//! Saturated samples.

use crate::converter::Converter;
use crate::recording::Recording;
use crate::recording_info::RecordingInfo;

impl Recording {
    /// Number of saturated samples: those at an end of the converter's range, and those within one code of `rail_v`,
    /// the amplifier's largest output, V, if it is given. Missing samples do not count.
    ///
    /// If negative voltages were set to 0, an output below the range cannot be distinguished from 0.
    ///
    /// ```
    /// use spts_circuit::{Block, Recording, RecordingInfo, Seeding, WeightMode, Weights};
    /// use spts_models::SkinLayout;
    ///
    /// let weights = Weights::new(WeightMode::Raster, Seeding::Address, 4);
    /// let info = RecordingInfo::new(SkinLayout::with_pitch(1, 4, 5e-3)?, weights, 1e3);
    /// let block = Block { frame_position: 1, idle_frames: None, volts: vec![0.0, 3.0, 15.0, -15.0] };
    /// let recording = Recording::new(info, vec![block])?;
    /// assert_eq!((recording.saturated(None), recording.saturated(Some(15.0))), (0, 2));
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[must_use]
    pub fn saturated(&self, rail_v: Option<f64>) -> usize {
        let blocks = self.blocks().iter();
        blocks.map(|block| self.info().saturated(&block.volts, rail_v)).sum()
    }
}

impl RecordingInfo {
    /// As [`Recording::saturated`], for samples outside a recording.
    #[must_use]
    pub fn saturated(&self, volts: &[f64], rail_v: Option<f64>) -> usize {
        let converter = self.converter.as_ref();
        let step_v = converter.map_or(0.0, |c| c.volts(0) - c.volts(1));
        let subtracted_v = converter.map_or(0.0, Converter::subtracted_v);
        let ends = converter.map(Ends::of);
        let at_end = |v: f64| {
            let output_v = v + subtracted_v;
            ends.is_some_and(|ends| ends.reached(v)) || rail_v.is_some_and(|rail_v| output_v.abs() >= rail_v - step_v)
        };
        volts.iter().filter(|v| v.is_finite() && at_end(**v)).count()
    }
}

/// Volts of the first and the last code.
#[derive(Clone, Copy)]
struct Ends {
    first: u64,
    /// `None` if the last codes are all set to 0 V.
    last: Option<u64>,
}

impl Ends {
    fn of(converter: &Converter) -> Self {
        let [last, before] = [0, 1].map(|k| converter.volts(converter.max_code().saturating_sub(k)).to_bits());
        Self {
            first: converter.volts(0).to_bits(),
            last: (last != before).then_some(last),
        }
    }

    fn reached(self, v: f64) -> bool {
        let bits = v.to_bits();
        bits == self.first || self.last == Some(bits)
    }
}

#[cfg(test)]
mod tests {
    use crate::{Constant, Mode, Profile, Readout};
    use spts_models::{ConductanceMap, SkinLayout, Streams};

    /// One taxel of a 10-bit converter of 32 V − 64.5 V: what is beyond is counted, in the mode in which it happens,
    /// and so is what a rail of 15 V cuts off.
    #[test]
    fn samples_beyond_the_range_are_counted() {
        let skin = SkinLayout::with_pitch(1, 4, 15e-3).unwrap();
        let count = |effects: &str, mode, volts: f64| {
            let ideal = crate::PROFILES[0].1;
            let adc = |mode: &str, divider: f64, offset_v: f64| {
                format!("[{mode}.adc]\nbits = 10\nreference_v = 3.3\ndivider = {divider:?}\noffset_v = {offset_v:?}\n")
            };
            let adcs = [adc("compressive", 20.0, 32.0), adc("raster", 3.0, 4.3)].concat();
            let profile = Profile::from_toml(&format!("{ideal}\n{adcs}{effects}")).unwrap();
            let siemens = volts / profile.volts_per_siemens();
            let map = ConductanceMap::from_values(1, 4, vec![siemens, 0.0, 0.0, 0.0]);
            let mut source = Constant::new(map).unwrap();
            let mut readout = Readout::new(&profile, mode, &skin, Streams::new(1), 0).unwrap();
            let block = readout.acquire(&mut source, 400).unwrap();
            let recording = readout.recording(vec![block]).unwrap();
            recording.saturated(profile.rail_v(mode).unwrap())
        };
        assert_eq!(count("", Mode::Compressive, 20.0), 0);
        assert_eq!(count("", Mode::Compressive, 40.0), 400);
        assert_eq!(
            count("[compressive.rails]\nlimit_v = 15.0", Mode::Compressive, 20.0),
            400
        );
        assert_eq!(count("[compressive.rails]\nlimit_v = 15.0", Mode::Compressive, 14.0), 0);
        // a frame of a raster has one measurement of the taxel
        assert_eq!(count("", Mode::Raster, 5.0), 100);
        assert_eq!(count("[raster.clamp]\nsubtract_v = -0.1", Mode::Raster, 5.0), 100);
        assert_eq!(count("[raster.clamp]\nsubtract_v = -0.1", Mode::Raster, 4.0), 0);
    }
}
