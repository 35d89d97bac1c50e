//! Interfaces of the readout effects, the deviations of the real circuit from y = Φx, and of faults of single cells.

use crate::batch::{Batch, CellRun};
use crate::weights::Weights;
use rand::RngExt as _;
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
pub(crate) use spts_models::parsed;
use spts_models::{Snapshot, Streams, in_range};

/// Inputs of an effect that are constant during a session.
#[derive(Debug, Clone)]
pub struct EffectSession {
    /// Random streams of the device, which determine its parts. They are the same in every session and mode.
    pub device: Streams,
    /// Random streams of this session and mode, which determine what happens in it.
    pub streams: Streams,
    /// Weights that the cells are meant to put out.
    pub weights: Weights,
    /// Rf, Ω: feedback resistance of the summing amplifier.
    pub feedback_ohm: f64,
    /// Measurements a second, Hz.
    pub sample_rate_hz: f64,
    /// Whether what a cell does is drawn from streams of its own: where few of many taxels conduct, the others then
    /// cost nothing.
    pub cells_apart: bool,
}

impl EffectSession {
    /// The first session of the device with this seed, with 1 kΩ and 1000 measurements a second.
    ///
    /// ```
    /// use spts_circuit::{EFFECTS, EffectSession, Seeding, WeightMode, Weights};
    ///
    /// let session = EffectSession::of(7, Weights::new(WeightMode::Binary, Seeding::Address, 100));
    /// let (_, build) = EFFECTS.iter().find(|(name, _)| *name == "rails").unwrap();
    /// let error = build(toml::from_str("limit_v = -1.0")?, &session).map(drop).unwrap_err();
    /// assert_eq!(error.to_string(), "`limit_v` = -1 is outside (0, 1e6]");
    /// # Ok::<(), toml::de::Error>(())
    /// ```
    pub fn of(seed: u64, weights: Weights) -> Self {
        Self {
            device: Streams::new(seed),
            streams: Streams::new(seed),
            weights,
            feedback_ohm: 1e3,
            sample_rate_hz: 1e3,
            cells_apart: false,
        }
    }
}

/// Inputs of an effect at the start of a block.
#[derive(Debug, Clone, Copy)]
pub struct BlockStart {
    /// Number of the block within its session, from 0. Together with the session's streams it determines all noise.
    pub block: u64,
    /// Row of the first measurement.
    pub first_row: u64,
    /// Whether the block follows the previous one without a gap.
    pub continuous: bool,
}

/// A deviation of the circuit from y = Φx. Effects act in signal order, each on the output of the one before.
///
/// The output of an effect depends only on its configuration, the session, the block's number, and the measurements so
/// far. In particular it does not depend on how they are divided into batches. Finite measurements give finite outputs.
/// [`check_effect`](crate::check_effect) checks these properties.
///
/// ```
/// use spts_circuit::{Batch, Effect, check_effect};
///
/// /// A gain error of the last amplifier.
/// struct Gain(f64);
///
/// impl Effect for Gain {
///     fn apply(&mut self, batch: &mut Batch<'_>) {
///         for y in &mut *batch.output_v {
///             *y *= self.0;
///         }
///     }
/// }
/// check_effect(&|_session| Box::new(Gain(1.02)));
/// ```
pub trait Effect: Send {
    /// Called before the first batch of every block.
    fn begin_block(&mut self, start: &BlockStart) {
        let _ = start;
    }

    /// Modifies `batch.output_v`. The batches of a block come in order and without gaps.
    fn apply(&mut self, batch: &mut Batch<'_>);

    /// Saves or loads its state in this session: what it remembers of earlier measurements. By default it remembers
    /// nothing.
    fn exchange(&mut self, state: &mut Snapshot) {
        let _ = state;
    }
}

/// One fault of a profile's `[[faults]]` list.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct FaultConfig {
    /// Name in [`FAULTS`](crate::FAULTS).
    pub name: String,
    /// Taxel, 0-based and row-major. Range [0, taxels − 1].
    pub taxel: u32,
    /// Parameters of this fault; each has a default.
    #[serde(flatten)]
    pub parameters: toml::Table,
}

/// A fault of one cell. Its effect on a row is a function of the session, the taxel and the row.
///
/// ```
/// use spts_circuit::{CellRun, Fault};
///
/// /// A taxel that conducts half as well as it should.
/// struct Worn;
///
/// impl Fault for Worn {
///     fn drives(&self) -> bool {
///         false // the level is still the generator's
///     }
///     fn apply(&mut self, run: &mut CellRun<'_>) {
///         run.gains.iter_mut().for_each(|gain| *gain *= 0.5);
///     }
/// }
/// let (mut levels, mut gains) = ([1.0, -1.0], [1.0, 1.0]);
/// Worn.apply(&mut CellRun { first_row: 0, period_s: 1.55e-5, levels: &mut levels, gains: &mut gains });
/// assert_eq!(gains, [0.5, 0.5]);
/// ```
pub trait Fault: Send {
    /// Whether the fault determines the level of the cell. A cell has at most one such fault.
    fn drives(&self) -> bool {
        true
    }

    /// Modifies levels and gains. A run may begin at any row.
    fn apply(&mut self, run: &mut CellRun<'_>);
}

/// Builds a fault of a taxel from its parameters.
pub type BuildFault = fn(toml::Table, u32, &EffectSession) -> Result<Box<dyn Fault>, Refusal>;

/// Either one value, or `[low, high]`, from which a value is drawn uniformly once for each session (or for each taxel
/// or device, if the effect says so).
///
/// The spans of the shipped profile are prediction intervals: a new session of the real skin lies inside nine times in
/// ten. Because values are drawn uniformly inside, simulated sessions leave out the most extreme tenth.
///
/// ```
/// use spts_circuit::Span;
/// use spts_models::Streams;
///
/// #[derive(serde::Deserialize)]
/// struct Noise {
///     sd_v: Span,
/// }
/// let noise: Noise = toml::from_str("sd_v = [0.01, 0.03]")?;
/// let drawn_v = noise.sd_v.draw(&mut Streams::new(1).rng("session", 0));
/// assert!((0.01..0.03).contains(&drawn_v));
/// # Ok::<(), toml::de::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Span {
    /// The same in every session.
    Fixed(f64),
    /// Uniform between two values.
    Between([f64; 2]),
}

impl Span {
    fn ends(self) -> [f64; 2] {
        match self {
            Self::Fixed(v) => [v, v],
            Self::Between(ends) => ends,
        }
    }

    /// Checks that both ends lie in `[min, max]` and are in order.
    ///
    /// # Errors
    /// [`Refusal`] with `field` and `range`.
    pub fn within(self, field: &str, min: f64, max: f64, range: &'static str) -> Result<Self, Refusal> {
        let [low, high] = self.ends();
        in_range(field, low, low >= min && low <= max, range)?;
        in_range(field, high, high >= low && high <= max, range)?;
        Ok(self)
    }

    /// A value drawn after both ends are checked, as [`Span::within`] and [`Span::draw`] do.
    pub(crate) fn drawn(
        self,
        field: &str,
        [min, max]: [f64; 2],
        range: &'static str,
        rng: &mut impl rand::Rng,
    ) -> Result<f64, Refusal> {
        Ok(self.within(field, min, max, range)?.draw(rng))
    }

    /// Draws one value. One number of `rng` is used in either case.
    pub fn draw(self, rng: &mut impl rand::Rng) -> f64 {
        let [low, high] = self.ends();
        let u: f64 = rng.random();
        low + (high - low) * u
    }
}

/// Builds an effect from its parameters.
pub type BuildEffect = fn(toml::Table, &EffectSession) -> Result<Box<dyn Effect>, Refusal>;
