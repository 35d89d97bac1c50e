//! What was recorded of one object.

use spts_circuit::Recording;

/// Both sessions of an object.
#[derive(Debug, Clone)]
pub struct Session {
    /// Name of the object.
    pub object: String,
    /// Its label.
    pub label: usize,
    /// Raster session.
    pub raster: Recording,
    /// Compressive session, when there is one.
    pub compressive: Option<Recording>,
}
