//! Errors of pressures compared with the reference, as relative root mean squares: √(Σ (p − p_ref)² / Σ p_ref²).

use super::run::{ContactRun, FinePressure};
use spts_contact::Frame;

/// Sums of a relative root mean square.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    error: f64,
    reference: f64,
}

impl Sums {
    fn add(&mut self, value: f64, reference: f64) {
        self.error += (value - reference).powi(2);
        self.reference += reference * reference;
    }

    /// 0 when nothing was expected and nothing found.
    fn relative(self) -> f64 {
        if self.error <= 0.0 {
            0.0
        } else {
            (self.error / self.reference).sqrt()
        }
    }
}

/// Error of a fine field on the grid of the reference: every cell of it takes the value of the cell its centre falls
/// into.
pub(super) fn fine_error(found: &FinePressure, reference: &FinePressure) -> f64 {
    let mut sums = Sums::default();
    let at = |i: usize, cells: usize, of: usize| (2 * i + 1) * cells / (2 * of);
    for row in 0..reference.rows {
        let line = at(row, found.rows, reference.rows) * found.cols;
        for col in 0..reference.cols {
            let value = found.pressure_pa[line + at(col, found.cols, reference.cols)];
            sums.add(value, reference.pressure_pa[row * reference.cols + col]);
        }
    }
    sums.relative()
}

/// Times at which drops are compared, s: finer than any contact's structure.
const DROP_SAMPLE_S: f64 = 5e-5;

/// Error of the taxels' pressures, over all frames of a press, or over the first contact of a drop, both counted from
/// when the force first passes half its peak: what a step's delay adds to the flight is no error of the contact.
pub(super) fn taxel_error(found: &ContactRun, reference: &ContactRun) -> f64 {
    let mut sums = Sums::default();
    if let Some(contact) = reference.bounces.first() {
        let (Some(middle_s), Some(found_s)) = (half_rise_s(reference), half_rise_s(found)) else {
            return f64::INFINITY;
        };
        let (mut time_s, end_s) = (
            contact.start_s - DROP_SAMPLE_S,
            contact.start_s + 1.2 * contact.contact_s,
        );
        while time_s <= end_s {
            let expected = pressure_at(&reference.frames, time_s);
            let values = pressure_at(&found.frames, time_s - middle_s + found_s);
            for (value, expected) in values.iter().zip(&expected) {
                sums.add(*value, *expected);
            }
            time_s += DROP_SAMPLE_S;
        }
        return sums.relative();
    }
    for frame in &reference.frames {
        let values = pressure_at(&found.frames, frame.time_s);
        for (value, expected) in values.iter().zip(frame.pressure.values()) {
            sums.add(*value, *expected);
        }
    }
    sums.relative()
}

/// When the force of the first contact passes half its peak, between frames by linear interpolation, s.
fn half_rise_s(run: &ContactRun) -> Option<f64> {
    let half_n = 0.5 * run.bounces.first()?.peak_force_n;
    let force_n = |f: &Frame| f.wrench.force_n[2];
    let pair = run.frames.windows(2).find(|w| force_n(&w[1]) >= half_n)?;
    let share = (half_n - force_n(&pair[0])) / (force_n(&pair[1]) - force_n(&pair[0]));
    Some(pair[0].time_s + share * (pair[1].time_s - pair[0].time_s))
}

/// Pressure of every taxel at `time_s`, between frames by linear interpolation, Pa.
fn pressure_at(frames: &[Frame], time_s: f64) -> Vec<f64> {
    let after = frames.partition_point(|f| f.time_s < time_s);
    let values = |f: &Frame| f.pressure.values().to_vec();
    match (frames.get(after.wrapping_sub(1)), frames.get(after)) {
        // a sample at a frame's own time is that frame, bit for bit
        (_, Some(b)) if b.time_s <= time_s => values(b),
        (Some(a), Some(b)) => {
            let share = (time_s - a.time_s) / (b.time_s - a.time_s);
            let pairs = a.pressure.values().iter().zip(b.pressure.values());
            pairs.map(|(a, b)| a + share * (b - a)).collect()
        }
        (Some(only), None) | (None, Some(only)) => values(only),
        (None, None) => Vec::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    /// Two cells against four of half the size: the values 1 and 3 against 1, 2, 3, 4 leave errors 0, −1, 0, −1.
    #[test]
    fn coarse_fields_are_compared_on_the_fine_grid() {
        let coarse = FinePressure {
            rows: 1,
            cols: 2,
            pressure_pa: vec![1.0, 3.0],
        };
        let fine = FinePressure {
            rows: 1,
            cols: 4,
            pressure_pa: vec![1.0, 2.0, 3.0, 4.0],
        };
        assert_relative_eq!(
            fine_error(&coarse, &fine),
            (2.0_f64 / 30.0).sqrt(),
            max_relative = 1e-15
        );
        assert!(fine_error(&fine, &fine) <= 0.0);
    }
}
