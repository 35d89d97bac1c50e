//! Finds the converter's step from the values that occur.

use spts_circuit::Recording;

/// Grid of the values of a recording: y = `origin_v` + k·`step_v`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct ConverterSteps {
    /// LSB, V: the largest step such that every difference of two values is a multiple of it.
    pub step_v: f64,
    /// One of the values, V.
    pub origin_v: f64,
}

/// Two differences agree when they are closer than this share of the range: rounding of the file's numbers.
const RELATIVE: f64 = 1e-9;
/// Most codes a converter may span.
const MOST_CODES: f64 = 16_777_216.0;

/// Steps of the values of the given blocks; `None` when they are not on a grid, or are all equal.
pub(super) fn steps(recording: &Recording, blocks: &[usize]) -> Option<ConverterSteps> {
    let mut values: Vec<f64> = blocks
        .iter()
        .flat_map(|&block| &recording.blocks()[block].volts)
        .copied()
        .filter(|v| v.is_finite())
        .collect();
    values.sort_unstable_by(f64::total_cmp);
    values.dedup();
    let (first, last) = (*values.first()?, *values.last()?);
    let range = last - first;
    let rounding = RELATIVE * first.abs().max(last.abs());
    // Euclid's algorithm on the differences, rounding errors taken for 0
    let mut divisor = 0.0_f64;
    for pair in values.windows(2) {
        let (mut a, mut b) = (pair[1] - pair[0], divisor);
        while b > rounding {
            (a, b) = (b, a % b);
            b = if divisor > 0.0 && a - b < rounding { 0.0 } else { b };
        }
        if a > rounding {
            divisor = a;
        }
    }
    let codes = (range / divisor).round();
    // the whole range over its number of steps: the rounding of one difference does not matter
    (divisor > 0.0 && (1.0..=MOST_CODES).contains(&codes)).then(|| ConverterSteps {
        step_v: range / codes,
        origin_v: first,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_circuit::{Block, RecordingInfo, Seeding, WeightMode, Weights};
    use spts_models::SkinLayout;

    #[test]
    fn the_step_is_found_where_no_two_values_are_neighbours() {
        let lsb = 3.3 / 1023.0 * 11140.0 / 570.0;
        let volts: Vec<f64> = [10, 16, 25, 31, 100, 40]
            .iter()
            .map(|k| 32.0 - f64::from(*k) * lsb)
            .collect();
        let block = |frame_position, volts| Block {
            frame_position,
            idle_frames: None,
            volts,
        };
        // a press that is not asked for does not matter
        let other = (0..6).map(|k| 0.1 * lsb * f64::from(k)).collect();
        let blocks = vec![block(1, other), block(2, volts)];
        let layout = SkinLayout::new(2, 3, 15e-3, 10e-3).unwrap();
        let weights = Weights::new(WeightMode::Binary, Seeding::Address, 6);
        let recording = Recording::new(RecordingInfo::new(layout, weights, 64_300.0), blocks).unwrap();
        let found = steps(&recording, &[1]).unwrap();
        // differences 6, 9, 6, 9, 60 steps: gcd 3. Seven roundings of numbers near 32
        assert!((found.step_v - 3.0 * lsb).abs() < 1e-13, "{found:?}");
    }
}
