//! When the contact of a press begins, seen from the recording alone.

use spts_circuit::Recording;
use spts_recon::metrics::median;

/// A frame is in contact when its distance from the idle frame is above this many times the idle frames' median.
const THRESHOLD: f64 = 2.0;
/// So many frames in a row must be.
const RUN: usize = 3;

/// First frame of `block` in contact; `None` when nothing touches, or when it is not known which frames are idle.
#[must_use]
pub(super) fn onset_frame(recording: &Recording, block: usize) -> Option<usize> {
    let idle_frames = recording.blocks()[block].idle_frames?.max(1);
    let mut idle = vec![0.0; recording.measurements_per_frame()];
    for frame in 0..idle_frames {
        for (sum, v) in idle.iter_mut().zip(recording.volts(block, frame)) {
            *sum += if v.is_finite() { *v } else { 0.0 };
        }
    }
    idle.iter_mut().for_each(|sum| *sum /= idle_frames as f64);
    let distance = |frame: usize| {
        let squares = recording
            .volts(block, frame)
            .iter()
            .zip(&idle)
            .map(|(v, i)| if v.is_finite() { (v - i).powi(2) } else { 0.0 });
        squares.sum::<f64>().sqrt()
    };
    let quiet = median(&(0..idle_frames).map(distance).collect::<Vec<_>>())?;
    let mut run = 0;
    for frame in idle_frames..recording.frames() {
        run = if distance(frame) > THRESHOLD * quiet {
            run + 1
        } else {
            0
        };
        if run == RUN {
            return Some(frame + 1 - RUN);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Block, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;

    #[test]
    fn finds_the_first_of_three_loud_frames() {
        // four measurements a frame; ±0.1 V idle, a glitch in frame 12, contact from frame 20
        let volts: Vec<f64> = (0..40 * 4)
            .map(|i| {
                let idle = if i % 3 == 0 { 0.1 } else { -0.1 };
                idle + if i / 4 == 12 || i / 4 >= 20 { 1.0 } else { 0.0 }
            })
            .collect();
        let block = Block {
            frame_position: 40,
            idle_frames: Some(10),
            volts,
        };
        let layout = SkinLayout::new(2, 2, 15e-3, 10e-3).unwrap();
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 4);
        let recording = Recording::new(RecordingInfo::new(layout, weights, 1e3), vec![block]).unwrap();
        assert_eq!(onset_frame(&recording, 0), Some(20));
    }
}
