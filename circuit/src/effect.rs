//! Interface of the readout effects, the deviations of the real circuit from y = Φx.

use crate::batch::Batch;
use crate::weights::Weights;
use crate::weights_error::WeightsError;
use serde::de::DeserializeOwned;
use spts_models::{ConfigError, Streams, explain_toml};

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
}

/// Why a profile or an effect cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProfileError {
    /// Text that is not TOML, an unknown key, or a value of the wrong type.
    #[error("{0}")]
    Syntax(String),
    /// A value outside its range.
    #[error(transparent)]
    Value(#[from] ConfigError),
    /// Weights that are not valid, or belong to another skin.
    #[error(transparent)]
    Weights(#[from] WeightsError),
    /// An effect that is not in the table.
    #[error("`{name}` is not an effect; known: {known}")]
    UnknownEffect {
        /// Name in the profile, with the mode to which it belongs.
        name: String,
        /// All known names.
        known: String,
    },
    /// Parameters that an effect refuses.
    #[error("{reason}")]
    Effect {
        /// Name of the effect.
        effect: &'static str,
        /// The message, beginning with the field, such as `compressive.adc.bits`.
        reason: String,
    },
    /// A fault that is not in the table.
    #[error("`faults[{index}].name` = \"{name}\" is not a fault; known: {known}")]
    UnknownFault {
        /// Position in the list, from 0.
        index: usize,
        /// Name in the profile.
        name: String,
        /// All known names.
        known: String,
    },
    /// A fault that cannot be injected.
    #[error("{reason} (fault `{fault}` of taxel {taxel})")]
    Fault {
        /// Name of the fault.
        fault: String,
        /// Taxel.
        taxel: u32,
        /// The message, beginning with the field, such as `faults[1].taxel`.
        reason: String,
    },
    /// A profile that is not in the table.
    #[error("`{name}` is not a readout profile; known: {known}")]
    UnknownProfile {
        /// Name asked for.
        name: String,
        /// All known names.
        known: String,
    },
}

/// Builds an effect from its parameters.
pub type BuildEffect = fn(toml::Table, &EffectSession) -> Result<Box<dyn Effect>, ProfileError>;

/// Parameters of an effect from its table.
pub(crate) fn parse<T: DeserializeOwned>(table: toml::Table) -> Result<T, ProfileError> {
    table.try_into().map_err(|e| ProfileError::Syntax(explain_toml(&e)))
}
