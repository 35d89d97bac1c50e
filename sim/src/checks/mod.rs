//! Contact by MuJoCo's own collisions and solver: slow, independent checks of the contact fields.
//!
//! Here MuJoCo finds the contacts and balances the forces; the contact fields of `spts_contact` do both themselves. The
//! body is a triangle mesh with a prescribed motion. It is a rigid flex, so that holes and concave parts count; a mesh
//! geom would be replaced by its convex hull. The skin consists of bodies with a small sphere (a tip) at the centre of
//! every grid square. Tips touch the mesh without friction, and do not touch each other.
//!
//! The answer is static: the velocity of the body and friction are ignored, and the torque is that of the normal
//! pressure. Every call starts with the skin pressed flat below the body and lets it rise. No tip can then get caught
//! above an underside, and the answer depends only on the body.

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
