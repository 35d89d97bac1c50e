//! Where the contact is.

mod blob;
mod centre;
mod track;

pub use blob::{BlobConfig, BlobEvidence, Estimate, Localiser};
pub use centre::{centre_of_mass, distance};
pub use track::{Contact, TrackConfig, Tracker};
