//! Measures touches.

use super::scene::Touch;
use spts_circuit::{Constant, Mode, Profile, Readout, Weights};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};

/// Measurements of the untouched skin, whose mean is taken off.
const IDLE_MEASUREMENTS: usize = 1000;
/// Block of the untouched skin; touches have numbers far below.
const IDLE_BLOCK: u64 = 1 << 40;

/// The wire of a skin: a readout with its device's parts, and the noise of one session.
///
/// ```
/// use spts_circuit::{Mode, Profile};
/// use spts_models::{SkinLayout, Streams};
/// use spts_studies::touches::{TouchObjects, TouchScene, TouchWire};
///
/// let layout = SkinLayout::default();
/// let profile = Profile::named("ideal").expect("it ships");
/// let weights = profile.weights(Mode::Compressive, 100).expect("100 taxels");
/// let mut wire = TouchWire::new(&profile, &weights, &layout, Streams::new(1))?;
/// let touch = &TouchScene::new(layout, TouchObjects::Objects, 1, 1).draw()?[0];
/// assert_eq!(wire.measure(touch, 0, 0, 20)?.len(), 20);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
pub struct TouchWire {
    readout: Readout,
    rail_v: Option<f64>,
    idle_v: f64,
    clipped: usize,
}

impl TouchWire {
    /// A readout with `profile` and `weights`, which replace those of the profile. `device` provides its random
    /// numbers.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built.
    pub fn new(profile: &Profile, weights: &Weights, layout: &SkinLayout, device: Streams) -> Result<Self, Refusal> {
        let profile = profile.with_weights(weights).map_err(Refusal::from_error)?;
        let mut readout = Readout::new(&profile, Mode::Compressive, layout, device, 0).map_err(Refusal::from_error)?;
        let mut untouched =
            Constant::new(ConductanceMap::zeros(layout.rows(), layout.cols())).map_err(Refusal::from_error)?;
        readout.seek_row(IDLE_BLOCK, 0);
        let idle = readout
            .measure(&mut untouched, IDLE_MEASUREMENTS)
            .map_err(Refusal::from_error)?;
        Ok(Self {
            readout,
            rail_v: profile.rail_v(Mode::Compressive).map_err(Refusal::from_error)?,
            clipped: 0,
            idle_v: idle.iter().sum::<f64>() / IDLE_MEASUREMENTS as f64,
        })
    }

    /// A wire with the given readout. Nothing is subtracted from its samples.
    #[must_use]
    pub fn of(readout: Readout) -> Self {
        Self {
            readout,
            rail_v: None,
            idle_v: 0.0,
            clipped: 0,
        }
    }

    /// Unmodified samples of a skin with this conductance at the rows `first_row..first_row + measurements`, V.
    /// `number` determines the noise.
    ///
    /// # Errors
    /// [`Refusal`] if the skin has another size.
    pub fn volts(
        &mut self,
        conductance_s: ConductanceMap,
        number: u64,
        first_row: u64,
        measurements: usize,
    ) -> Result<Vec<f64>, Refusal> {
        let mut source = Constant::new(conductance_s).map_err(Refusal::from_error)?;
        self.readout.seek_row(number, first_row);
        Ok(self
            .readout
            .measure(&mut source, measurements)
            .map_err(Refusal::from_error)?)
    }

    /// Samples of `touch` at the rows `first_row..first_row + measurements`, minus the mean of the untouched skin, V.
    /// `number` determines the noise.
    ///
    /// # Errors
    /// [`Refusal`] if the touch is on a skin of another size.
    pub fn measure(
        &mut self,
        touch: &Touch,
        number: u64,
        first_row: u64,
        measurements: usize,
    ) -> Result<Vec<f64>, Refusal> {
        let mut volts = self.volts(touch.conductance_s.clone(), number, first_row, measurements)?;
        self.clipped += self.readout.info().saturated(&volts, self.rail_v);
        volts.iter_mut().for_each(|v| *v -= self.idle_v);
        Ok(volts)
    }

    /// Number of samples of all touches so far at an end of their range.
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
