//! Output of the wire while nothing touches the skin.

use crate::chunk::{Chunk, converter_step_v};
use crate::windows::{Press, PressRows, idle_mean};
use spts_circuit::{Mode, Recording};
use std::ops::Range;
use std::sync::Arc;

/// A skin whose idle output has a standard deviation of more steps of the converter than this may be under preload.
/// Without a preload it is the idle noise, two steps in the published recordings.
const STEPS: f64 = 6.0;
/// It also has to be more than this share of that of the whole block.
const SHARE: f64 = 0.1;
/// Share of the variance that an image has to explain to be a preload.
const EXPLAINED: f64 = 0.5;
/// Measurements that an image is estimated from, at most, for every taxel.
const MEASUREMENTS_PER_TAXEL: usize = 100;
/// Measurements that it needs at least, for every taxel.
const LEAST_PER_TAXEL: usize = 4;

/// Output of an untouched skin. A flat skin gives a constant. A bent skin, such as one around an arm, is under preload
/// and gives sums like those of a touch; they are subtracted measurement by measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct Untouched {
    /// Output without load on any taxel, V.
    pub offset_v: f64,
    /// Image of the preload, V; `None` for a flat skin.
    pub image: Option<Vec<f64>>,
}

impl Untouched {
    /// The untouched skin of block `block`, from its idle frames: [`idle_mean`] for a flat skin.
    #[must_use]
    pub fn of(recording: &Recording, block: usize) -> Self {
        let frames = recording.blocks()[block].idle_frames.unwrap_or(0);
        Self::in_frames(recording, block, frames)
    }

    /// The untouched skin, from the first `frames` frames of the block.
    #[must_use]
    pub fn in_frames(recording: &Recording, block: usize, frames: usize) -> Self {
        let flat = || Self {
            offset_v: idle_mean(recording, block),
            image: None,
        };
        let taxels = recording.taxels();
        let idle = (frames * recording.measurements_per_frame()).min(MEASUREMENTS_PER_TAXEL * taxels);
        if recording.mode() != Mode::Compressive || idle < LEAST_PER_TAXEL * taxels {
            return flat();
        }
        // the last of the idle frames are the nearest to what follows
        let start = frames * recording.measurements_per_frame() - idle;
        let chunk = Chunk::new(recording, block, start, idle);
        let whole = Chunk::new(recording, block, 0, recording.blocks()[block].volts.len());
        let step_v = converter_step_v(recording).unwrap_or(0.0);
        if chunk.sd() <= (STEPS * step_v).max(SHARE * whole.sd()) {
            return flat();
        }
        let fit = chunk.fit(0).filter(|fit| fit.residual.powi(2) < 1.0 - EXPLAINED);
        fit.map_or_else(flat, |fit| Self {
            offset_v: fit.offset_v,
            image: Some(fit.image),
        })
    }

    /// Measurements `range` of block `block` minus the output of the untouched skin, V.
    #[must_use]
    pub fn without(&self, recording: &Recording, block: usize, range: Range<usize>) -> Vec<f64> {
        let volts = recording.blocks()[block].volts[range.clone()].iter();
        let Some(image) = &self.image else {
            return volts.map(|v| v - self.offset_v).collect();
        };
        let mut sums = vec![0.0; range.len()];
        let first_row = recording.rows(block, range).first_row();
        recording.weights().weighted_sums(first_row, image, &mut sums);
        volts.zip(sums).map(|(v, sum)| v - self.offset_v - sum).collect()
    }

    /// Measurements `range` of block `block` as a press whose [`y`](crate::Window::y) is free of the untouched skin's
    /// output.
    #[must_use]
    pub fn press(&self, recording: &Recording, block: usize, range: Range<usize>) -> Press {
        let volts = recording.blocks()[block].volts[range.clone()].to_vec();
        let y = self.without(recording, block, range.clone());
        Press::measured(Arc::new(PressRows::new(recording.rows(block, range))), volts, y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::place::find_touches;
    use spts_circuit::{Interpolated, Profile, Readout};
    use spts_models::{ConductanceMap, SkinLayout, Streams};

    /// Conductance of taxel 34 at the largest touch, S, and of each preloaded taxel.
    const TOUCH_S: f64 = 1.5e-3;
    const PRELOAD_S: f64 = 0.1e-3;

    /// A touch of taxel 34 between 0.2 s and 0.4 s, on a skin of which every seventh taxel is under `preload_s`.
    fn touched(preload_s: f64) -> Recording {
        let map = |touch: f64| {
            let taxel = |k: usize| {
                let preload = if k.is_multiple_of(7) { preload_s } else { 0.0 };
                preload + if k == 34 { touch * TOUCH_S } else { 0.0 }
            };
            ConductanceMap::from_values(10, 10, (0..100).map(taxel).collect())
        };
        let times = vec![0.0, 0.2, 0.25, 0.35, 0.4, 10.0];
        let press = Interpolated::new(times, [0.0, 0.0, 1.0, 1.0, 0.0, 0.0].map(map).to_vec()).unwrap();
        let profile = Profile::named("as_built").unwrap();
        let streams = Streams::new(1);
        let mut readout = Readout::new(&profile, Mode::Compressive, &SkinLayout::default(), streams, 0).unwrap();
        readout
            .record(&mut [press], 400 * 100, 0)
            .unwrap()
            .with_idle_frames(Some(100))
    }

    /// The image of the preload, 0.43 V on 15 taxels, is found to a tenth of a taxel's. Before the touch noise is left:
    /// up to 0.12 V when idle, 0.06 of ‖x‖ = 1.7 V in contact, and as much of late updates; together 0.2 V.
    #[test]
    fn preload_is_subtracted() {
        let recording = touched(PRELOAD_S);
        let untouched = Untouched::of(&recording, 0);
        let image = untouched.image.as_ref().unwrap();
        let volts_per_siemens = 4.3 * 1e3;
        for (k, found) in image.iter().enumerate() {
            let expected = if k.is_multiple_of(7) {
                volts_per_siemens * PRELOAD_S
            } else {
                0.0
            };
            let tolerance = 0.1 * volts_per_siemens * PRELOAD_S;
            assert!(
                (found - expected).abs() < tolerance,
                "taxel {k}: {found} V, expected {expected} V"
            );
        }
        let idle = untouched.without(&recording, 0, 0..10_000);
        let rms = (idle.iter().map(|v| v * v).sum::<f64>() / 1e4).sqrt();
        assert!(rms < 0.3, "{rms} V");
        let touches = find_touches(&recording);
        assert_eq!(touches.len(), 1);
        assert_eq!(touches[0].taxel(&recording), Some(34));
        // the touch begins at measurement 12 860 and ends at 25 720; it is seen a little later and less long
        assert!((12_800..14_000).contains(&touches[0].start), "{}", touches[0].start);
        assert!((24_700..25_900).contains(&touches[0].end), "{}", touches[0].end);
    }

    /// Of a flat skin the mean of the idle frames is subtracted, to the bit.
    #[test]
    fn flat_skins_have_no_preload() {
        let recording = touched(0.0);
        let untouched = Untouched::of(&recording, 0);
        assert_eq!(untouched.image, None);
        assert_eq!(untouched.offset_v.to_bits(), idle_mean(&recording, 0).to_bits());
        let y = untouched.without(&recording, 0, 500..510);
        let expected = recording.blocks()[0].volts[500..510]
            .iter()
            .map(|v| v - idle_mean(&recording, 0));
        assert!(y.iter().zip(expected).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}
