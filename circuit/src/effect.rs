//! What the real circuit does beyond y = Φx.

use crate::batch::Batch;
use crate::weights::Weights;
use crate::weights_error::WeightsError;
use serde::de::DeserializeOwned;
use spts_models::{ConfigError, Streams, explain_toml};

/// What an effect may depend on for a whole session.
#[derive(Debug, Clone)]
pub struct Session {
    /// Random streams of the device: what its parts are, the same in every session and mode.
    pub device: Streams,
    /// Random streams of this session and mode: what happens in it.
    pub streams: Streams,
    /// Weights that the cells are meant to put out.
    pub weights: Weights,
    /// Rf, Ω: feedback resistance of the summing amplifier.
    pub feedback_ohm: f64,
    /// Measurements a second, Hz.
    pub sample_rate_hz: f64,
}

/// What an effect may depend on at the start of a block.
#[derive(Debug, Clone, Copy)]
pub struct BlockStart {
    /// Number of the block within its session, from 0. Together with the session's streams it decides all noise.
    pub block: u64,
    /// Row of the first measurement.
    pub first_row: u64,
    /// Whether the block follows the one before it without a gap.
    pub continuous: bool,
}

/// A departure of the circuit from y = Φx. Effects act in signal order, each on what the ones before it left.
///
/// The output of an effect depends on its configuration, the session, the block's number and the measurements it has
/// seen, and on nothing else, above all not on how they are cut into batches; NaN and infinity never come out of finite
/// measurements. [`check_effect`](crate::check_effect) checks this.
pub trait Effect: Send {
    /// Called before the first batch of every block.
    fn begin_block(&mut self, start: &BlockStart) {
        let _ = start;
    }

    /// Changes `batch.output_v`. The batches of a block come in order and leave nothing out.
    fn apply(&mut self, batch: &mut Batch<'_>);
}

/// A profile or an effect that cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// Not TOML, an unknown key, or a value of the wrong type.
    #[error("{0}")]
    Syntax(String),
    /// A value outside its range.
    #[error(transparent)]
    Value(#[from] ConfigError),
    /// Weights that are unusable, or those of another skin.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// An effect that the table does not list.
    #[error("`{name}` is not an effect; known: {known}")]
    UnknownEffect {
        /// Name in the profile, with the mode it stands under.
        name: String,
        /// All known names.
        known: String,
    },
    /// Parameters of an effect that are refused.
    #[error("{reason}")]
    Effect {
        /// Name of the effect.
        effect: &'static str,
        /// What is wrong, from the field on, such as `compressive.adc.bits`.
        reason: String,
    },
    /// A fault that the table does not list.
    #[error("`faults[{index}].name` = \"{name}\" is not a fault; known: {known}")]
    UnknownFault {
        /// Its place in the list, from 0.
        index: usize,
        /// Name in the profile.
        name: String,
        /// All known names.
        known: String,
    },
    /// A fault that is refused.
    #[error("{reason} (fault `{fault}` of taxel {taxel})")]
    Fault {
        /// Name of the fault.
        fault: String,
        /// Taxel.
        taxel: u32,
        /// What is wrong, from the field on, such as `faults[1].taxel`.
        reason: String,
    },
    /// A profile that the table does not list.
    #[error("`{name}` is not a readout profile; known: {known}")]
    UnknownProfile {
        /// Name asked for.
        name: String,
        /// All known names.
        known: String,
    },
}

/// Builds an effect from its parameters.
pub type BuildEffect = fn(toml::Table, &Session) -> Result<Box<dyn Effect>, ProfileError>;

/// Parameters of an effect from its table.
pub(crate) fn parse<T: DeserializeOwned>(table: toml::Table) -> Result<T, ProfileError> {
    table.try_into().map_err(|e| ProfileError::Syntax(explain_toml(&e)))
}
