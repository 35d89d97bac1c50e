//! Where the numbers of a report come from.

use serde::Serialize;
use spts::provenance::{Machine, Provenance};

/// What the results depend on, and the machine that made them, which they do not depend on.
#[derive(Debug, Clone, Serialize)]
pub struct Origin {
    /// Seed, scenes, versions.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Processor and threads.
    #[serde(flatten)]
    pub machine: Machine,
}

impl Origin {
    /// Results of `provenance`, made on this machine.
    pub fn here(provenance: Provenance) -> Self {
        Self { provenance, machine: Machine::here() }
    }
}
