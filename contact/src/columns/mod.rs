//! The foam as independent columns: the foam law, and the two contact fields that use it.

#[cfg(test)]
mod convergence_tests;
#[cfg(test)]
mod extremes_tests;
mod foam;
mod footprint;
#[cfg(test)]
mod footprint_tests;
mod potential;
mod preload;
#[cfg(test)]
mod preload_tests;
mod winkler;
#[cfg(test)]
mod winkler_tests;

pub(crate) use foam::FoamLaw;
pub(crate) use footprint::Footprint;
pub use winkler::{WinklerConfig, WinklerLayer};
