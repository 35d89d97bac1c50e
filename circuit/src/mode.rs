//! Modes of the readout and of its cells.

use crate::lcg::Jump;
use serde::{Deserialize, Serialize};

/// The two ways to read the skin: one taxel after the other, or all taxels weighted and added.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mode {
    /// One taxel a measurement, in row-major order.
    Raster,
    /// All taxels at once, with pseudorandom weights.
    Compressive,
}

impl Mode {
    /// Name of the profile section that lists the effects of this readout.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Compressive => "compressive",
        }
    }
}

/// Kind of the levels that the cells put out.
///
/// ```
/// use spts_circuit::WeightMode;
///
/// // the cell with seed 8 at its first three rows
/// let levels: Vec<f64> = (0..3).map(|row| WeightMode::Binary.level_from_seed(8, row)).collect();
/// assert!(levels.iter().all(|level| level.abs() == 1.0));
/// let analog = WeightMode::Analog.level_from_seed(8, 0);
/// assert_eq!(analog.signum(), levels[0], "both use the generator's top byte");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum WeightMode {
    /// One taxel after another: level 1 (code 255) on the scanned one and 0 (code 126, mid-scale) on the others.
    Raster,
    /// Eight-bit pseudorandom levels: the top byte of the generator.
    Analog,
    /// Pseudorandom ±1: code 255 when the top byte is 128 or more, code 0 otherwise.
    Binary,
}

impl WeightMode {
    /// Level that a generator in `state` stands for; in raster mode no cell uses its generator, and the level is 0.
    #[inline]
    pub(crate) fn level(self, state: u32) -> f64 {
        match self {
            Self::Raster => 0.0,
            Self::Analog => analog(state),
            Self::Binary => binary(state),
        }
    }

    /// Level at `row` (counted from loading the seeds) of a cell with the generator seed `seed`. In raster mode no cell
    /// uses its seed, and the level is 0.
    #[must_use]
    pub fn level_from_seed(self, seed: u32, row: u64) -> f64 {
        self.level(Jump::new(row.wrapping_add(1)).apply(seed))
    }

    /// The readout that uses these levels.
    #[must_use]
    pub fn readout(self) -> Mode {
        match self {
            Self::Raster => Mode::Raster,
            Self::Analog | Self::Binary => Mode::Compressive,
        }
    }

    /// Name, as used in profiles and tables.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Raster => "raster",
            Self::Analog => "analog",
            Self::Binary => "binary",
        }
    }
}

/// Half the largest DAC code: code (1 + level)·this.
pub(crate) const ANALOG_SCALE: f64 = 127.5;

/// Level of the top byte as a DAC code.
#[inline(always)]
pub(crate) fn analog(state: u32) -> f64 {
    (f64::from(state >> 24) - ANALOG_SCALE) / ANALOG_SCALE
}

/// ±1 from the top bit: +1.0 with the sign bit set where the top bit of the state is clear.
#[inline(always)]
pub(crate) fn binary(state: u32) -> f64 {
    f64::from_bits(0x3ff0_0000_0000_0000 | (u64::from(!state >> 31) << 63))
}
