//! Where the contact is.

mod blob;
mod centre;

pub use blob::{BlobConfig, BlobEvidence, Estimate, Localiser};
pub use centre::{centre_of_mass, distance};
