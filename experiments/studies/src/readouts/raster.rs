//! Scans one taxel after another.

use super::readout::{PreparedReadout, Reading, ReadoutSkin, WireReadout, until_noticed};
use super::wire::HeldWire;
use spts_input::Refusal;

/// A raster scan: measurement k is taxel k, and the image is the samples of the contacts.
#[derive(Debug, Clone, Copy)]
pub(super) struct Raster;

/// A scan of a sheet of so many columns.
struct Scan {
    cols: usize,
}

impl WireReadout for Raster {
    fn prepare(&self, skin: &ReadoutSkin) -> Result<Box<dyn PreparedReadout>, Refusal> {
        Ok(Box::new(Scan {
            cols: skin.layout.cols(),
        }))
    }
}

impl PreparedReadout for Scan {
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64 {
        conductance_s.iter().copied().fold(0.0, f64::max)
    }

    fn read(&self, wire: &mut HeldWire<'_, '_>) -> Result<Vec<Reading>, Refusal> {
        let frame = wire.scan()?;
        let beyond: Vec<bool> = frame.volts.iter().map(|v| *v > frame.alarm_v).collect();
        // the taxel whose sample is beyond the alarm is the place
        let noticed = until_noticed(&beyond);
        Ok(vec![Reading {
            measurements: frame.volts.len(),
            image: frame.contacts(self.cols),
            noticed,
            placed: noticed,
        }])
    }
}
