//! What the real circuit does beyond y = Φx.

use crate::weights::Weights;
use spts_models::{ConfigError, Streams};

/// One measurement on its way through the circuit.
#[derive(Debug)]
pub struct Sample<'a> {
    /// Row of the weight matrix: clock edges since the seeds were loaded.
    pub row: u64,
    /// Drive level of every taxel.
    pub levels: &'a [f64],
    /// Drive level of every taxel at the measurement before; all 0 at the first of all.
    pub previous_levels: &'a [f64],
    /// Conductance of every taxel, S.
    pub conductance_s: &'a [f64],
    /// Rf·Vd, V/S: conductance times this is what the taxel adds to the output at level 1.
    pub volts_per_siemens: f64,
    /// Σx, sum of the taxels' contributions at level 1, V.
    pub sum_v: f64,
    /// √Σ(wᵢ·xᵢ)², V: with weights ±1 this is ‖x‖₂, in raster mode the scanned taxel's own contribution.
    pub norm_v: f64,
    /// Output so far, V. It starts as Σ wᵢ·xᵢ, and every effect changes it in turn.
    pub output_v: f64,
}

impl Sample<'_> {
    /// Contribution of `taxel` at level 1, V.
    #[must_use]
    #[inline]
    pub fn taxel_v(&self, taxel: usize) -> f64 {
        self.conductance_s[taxel] * self.volts_per_siemens
    }
}

/// What an effect may depend on for a whole session.
#[derive(Debug, Clone, Copy)]
pub struct Session {
    /// Random streams of this session and mode.
    pub streams: Streams,
    /// Weights that the cells are meant to put out.
    pub weights: Weights,
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
/// The output of an effect depends on its configuration, the session, the block's number and the samples it has seen, and
/// on nothing else; NaN and infinity never come out of finite samples.
pub trait Effect: Send {
    /// Called before the first sample of every block.
    fn begin_block(&mut self, start: &BlockStart) {
        let _ = start;
    }

    /// Changes `sample.output_v`.
    fn apply(&mut self, sample: &mut Sample<'_>);
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
    /// An effect that the table does not list.
    #[error("`{name}` is not an effect; known: {known}")]
    UnknownEffect {
        /// Name in the profile.
        name: String,
        /// All known names.
        known: String,
    },
    /// Parameters of an effect that are refused.
    #[error("effect `{effect}`: {reason}")]
    Effect {
        /// Name of the effect.
        effect: &'static str,
        /// What is wrong.
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
