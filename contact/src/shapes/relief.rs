//! Bow and waves of an underside.

use super::dice::Dice;
use crate::mesh::polygon::Point;
use std::f64::consts::TAU;

/// Waves of a relief.
const WAVES: usize = 2;
/// Below this a relief is none, m: a hundredth of what a foam of 90 kPa over 6 mm feels under 1 kPa.
pub(super) const LEAST_RELIEF_M: f64 = 1e-6;

/// A smooth function of the place, in no unit: a bow along x and y and two waves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Relief {
    half_m: f64,
    bow: [f64; 2],
    /// Amplitude, phase in rad, and wave vector in rad per half extent.
    waves: [(f64, f64, Point); WAVES],
}

impl Relief {
    /// Of an object whose larger extent is `size_m`; waves are 0.7 to 2 times as long.
    pub(super) fn draw(dice: &mut Dice, size_m: f64) -> Self {
        let bow = [dice.between(-1.0, 1.0), dice.between(-1.0, 1.0)];
        let waves = [(); WAVES].map(|()| {
            let (s, c) = dice.angle_rad().sin_cos();
            let k = 0.5 * TAU / dice.between(0.7, 2.0);
            (dice.between(0.0, 0.45), dice.angle_rad(), [k * c, k * s])
        });
        Self {
            half_m: 0.5 * size_m,
            bow,
            waves,
        }
    }

    /// Heights over `points`, m, whose lowest and highest differ by `relief_m`.
    pub(super) fn heights_m(&self, points: &[Point], relief_m: f64) -> Vec<f64> {
        let mut heights: Vec<f64> = points.iter().map(|&p| self.at(p)).collect();
        let (low, high) = heights
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), &z| (l.min(z), h.max(z)));
        let scale = if high - low > 1e-9 {
            relief_m / (high - low)
        } else {
            0.0
        };
        for z in &mut heights {
            *z = (*z - low) * scale;
        }
        heights
    }

    fn at(&self, [x, y]: Point) -> f64 {
        let (x, y) = (x / self.half_m, y / self.half_m);
        let waves = self
            .waves
            .iter()
            .map(|&(a, phase, k)| a * (phase + k[0] * x + k[1] * y).cos());
        self.bow[0] * x * x + self.bow[1] * y * y + waves.sum::<f64>()
    }
}
