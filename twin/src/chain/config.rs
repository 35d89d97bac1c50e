//! Transducer, readout and weights, as a scene writes them.

use super::rows::RowsConfig;

/// Every stage between the pressure on the skin and the recording, as a scene writes it. A missing field takes its
/// default.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChainConfig {
    /// Name of the transducer in [`TRANSDUCERS`](spts_models::TRANSDUCERS). Default [`DEFAULT_TRANSDUCER`].
    pub transducer: Option<String>,
    /// Parameters of the transducer. Default: none given, so each takes its own default.
    pub transducer_parameters: toml::Table,
    /// Readout profile: a name in [`PROFILES`](spts_circuit::PROFILES), or a file that ends in `.toml`. Default
    /// [`DEFAULT_READOUT`].
    pub readout: Option<String>,
    /// Seeds and levels of the cells. Default: those of the profile.
    pub rows: RowsConfig,
    /// Source of the weights, a name in [`WEIGHT_SOURCES`](super::WEIGHT_SOURCES). Default
    /// [`DEFAULT_WEIGHTS`](super::DEFAULT_WEIGHTS).
    pub weights: Option<String>,
    /// Faulty cells, added to those of the profile: `name`, `taxel` and the fault's parameters. Default: none.
    pub faults: Vec<toml::Table>,
}

/// Transducer of a scene that names none.
pub const DEFAULT_TRANSDUCER: &str = "velostat";
/// Readout profile of a scene that names none.
pub const DEFAULT_READOUT: &str = "as_built";
