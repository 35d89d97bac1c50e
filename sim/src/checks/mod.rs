//! Contact by MuJoCo's own collisions and solver: slow, independent checks of the contact fields.
//!
//! Here the engine does everything that the other fields do by themselves: it finds where the body touches, and it
//! balances the forces. The body is a triangle mesh that only moves as it is told (a rigid flex, so that holes and
//! concave parts count, where a mesh geom would be its convex hull); the skin is made of bodies with a small sphere, a
//! tip, at the centre of every cell, which touch the mesh without friction and without touching each other.
//!
//! The answer is static: the velocity of the body is ignored, and so is friction; the torque is that of the normal
//! pressure. Every call starts from a skin pressed flat below the body and lets it rise, so that no tip can get caught
//! above an underside, and the answer depends on the body alone.

mod bed;
mod engine;
mod flex;
mod table;
mod tips;

pub use bed::{TaxelBed, TaxelBedConfig};
pub use flex::{FlexConfig, FlexLayer};
pub use table::{CONTACT_CHECKS, build_field_or_check};

#[cfg(test)]
mod tests;
