//! Touches, measured.

use super::error::TouchError;
use super::scene::Touch;
use spts_circuit::{Constant, Mode, Profile, Readout, Weights};
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// Measurements of the untouched skin, whose mean is taken off.
const IDLE_MEASUREMENTS: usize = 1000;
/// Block of the untouched skin; touches have numbers far below.
const IDLE_BLOCK: u64 = 1 << 40;

/// The wire of a skin: a readout with its device's parts and one session's noise.
pub struct TouchWire {
    readout: Readout,
    rail_v: Option<f64>,
    idle_v: f64,
    clipped: usize,
}

impl TouchWire {
    /// The readout `profile` of a skin, with `weights` in place of its own; `device` is the root of its random numbers.
    ///
    /// # Errors
    /// [`TouchError`] when the readout cannot be built.
    pub fn new(profile: &Profile, weights: &Weights, layout: &SkinLayout, device: Streams) -> Result<Self, TouchError> {
        let profile = profile.with_weights(weights)?;
        let mut readout = Readout::new(&profile, Mode::Compressive, layout, device, 0)?;
        let mut untouched = Constant::new(ConductanceMap::zeros(layout.rows(), layout.cols()))?;
        readout.seek_row(IDLE_BLOCK, 0);
        let idle = readout.measure(&mut untouched, IDLE_MEASUREMENTS)?;
        Ok(Self {
            readout,
            rail_v: profile.rail_v(Mode::Compressive)?,
            clipped: 0,
            idle_v: idle.iter().sum::<f64>() / IDLE_MEASUREMENTS as f64,
        })
    }

    /// A wire of a readout that was built elsewhere, from whose samples nothing is taken off.
    #[must_use]
    pub fn of(readout: Readout) -> Self {
        Self {
            readout,
            rail_v: None,
            idle_v: 0.0,
            clipped: 0,
        }
    }

    /// Samples of a skin of this conductance at the rows `first_row..first_row + measurements`, V, as they come. The
    /// noise follows from `number`.
    ///
    /// # Errors
    /// [`TouchError`] when the skin is another one.
    pub fn volts(
        &mut self,
        conductance_s: ConductanceMap,
        number: u64,
        first_row: u64,
        measurements: usize,
    ) -> Result<Vec<f64>, TouchError> {
        let mut source = Constant::new(conductance_s)?;
        self.readout.seek_row(number, first_row);
        Ok(self.readout.measure(&mut source, measurements)?)
    }

    /// Samples of `touch` at the rows `first_row..first_row + measurements`, less the mean of the untouched skin, V.
    /// The noise follows from `number`.
    ///
    /// # Errors
    /// [`TouchError`] when the touch is of another skin.
    pub fn measure(
        &mut self,
        touch: &Touch,
        number: u64,
        first_row: u64,
        measurements: usize,
    ) -> Result<Vec<f64>, TouchError> {
        let mut volts = self.volts(touch.conductance_s.clone(), number, first_row, measurements)?;
        self.clipped += self.readout.info().saturated(&volts, self.rail_v);
        volts.iter_mut().for_each(|v| *v -= self.idle_v);
        Ok(volts)
    }

    /// Samples of all touches so far that were at an end of their range.
    #[must_use]
    pub fn clipped(&self) -> usize {
        self.clipped
    }

    /// The readout.
    #[must_use]
    pub fn readout(&self) -> &Readout {
        &self.readout
    }
}
