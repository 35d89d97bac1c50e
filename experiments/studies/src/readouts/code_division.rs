//! Code division: every taxel has a code that is orthogonal to all others.

use super::readout::{PreparedReadout, Reading, ReadoutSkin, WireReadout, until_noticed};
use super::rows::WalshRows;
use super::wire::HeldWire;
use spts_input::Refusal;

/// All taxels at once, taxel k with the k-th Walsh function as its code, and each one correlated with its code: as many
/// chips as the next power of two holds. Nothing is known of the images.
#[derive(Debug, Clone, Copy)]
pub(super) struct CodeDivision;

struct Coded {
    walsh: WalshRows,
    taxels: usize,
}

impl WireReadout for CodeDivision {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        let taxels = skin.layout.taxels();
        Ok(Box::new(Coded {
            walsh: WalshRows::new(taxels),
            taxels,
        }))
    }
}

impl PreparedReadout for Coded {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        let sums = self.walsh.transform(conductance_s);
        sums.iter().fold(0.0, |largest, sum| largest.max(sum.abs()))
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal> {
        let [low, high] = wire.levels();
        let (middle, half) = (0.5 * (high + low), 0.5 * (high - low));
        let chips = self.walsh.rows();
        let frame = wire.signs(&self.walsh, chips)?;
        // y = middle · Σx + half · H x, and row 0 of H is all ones
        let sum = frame.volts.first().map_or(0.0, |first| first / (middle + half));
        let plain: Vec<f64> = frame.volts.iter().map(|v| (v - middle * sum) / half).collect();
        let mut image = WalshRows::new(chips).transform(&plain);
        image.truncate(self.taxels);
        image.iter_mut().for_each(|v| *v = (*v / chips as f64).max(0.0));
        let beyond: Vec<bool> = frame.volts.iter().map(|v| v.abs() > frame.alarm_v).collect();
        Ok(vec![Reading {
            measurements: chips,
            image,
            noticed: until_noticed(&beyond),
            placed: Some(chips as f64 - 0.5),
        }])
    }
}
