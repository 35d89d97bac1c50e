//! What can stop a simulation.

/// Why the twin produced no recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwinError {
    /// The scene is not valid.
    #[error(transparent)]
    Scene(#[from] spts_sim::scene::SceneError),
    /// The mechanics failed.
    #[error(transparent)]
    Sim(#[from] spts_sim::SimError),
    /// The transducer cannot be built.
    #[error("transducer `{name}` with [transducer_parameters]: {source}")]
    Transducer {
        /// Its name.
        name: String,
        /// Cause.
        source: spts_models::TransducerError,
    },
    /// The readout profile cannot be used.
    #[error("readout: {0}")]
    Profile(#[from] spts_circuit::ProfileError),
    /// A fault of the scene cannot be injected.
    #[error("[[faults]] of the scene: {0}")]
    Fault(#[source] spts_circuit::ProfileError),
    /// A source of weights that the table does not list.
    #[error("`weights` = \"{name}\" is not a source of weights; known: {known}")]
    UnknownWeights {
        /// Name in the scene.
        name: String,
        /// All known names.
        known: String,
    },
    /// The weights cannot come from the firmware.
    #[error("`weights` = \"firmware\": {0}")]
    Cells(#[from] super::CellsError),
    /// The conductance of a press is not usable.
    #[error("conductance: {0}")]
    Source(#[from] spts_circuit::SourceError),
    /// The readout could not record.
    #[error("readout: {0}")]
    Acquire(#[from] spts_circuit::AcquireError),
    /// A press that is too long to record.
    #[error("`duration_s` = {duration_s}: {measurements:.0} measurements a press are outside [1, {limit:.0}]")]
    TooLong {
        /// Length of the press, s.
        duration_s: f64,
        /// Its measurements.
        measurements: f64,
        /// Most that are recorded.
        limit: f64,
    },
    /// A profile file cannot be read.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// File.
        path: std::path::PathBuf,
        /// Cause.
        source: std::io::Error,
    },
}
