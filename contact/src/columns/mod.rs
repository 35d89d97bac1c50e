//! The foam as independent columns, and the two contact fields that use it.

mod footprint;
#[cfg(test)]
mod tests;
mod winkler;

pub(crate) use footprint::Footprint;
pub use winkler::WinklerLayer;
