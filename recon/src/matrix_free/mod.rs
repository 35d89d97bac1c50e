//! Images of large skins, from operators that are never stored.

mod detect;
mod fista;
mod grain;
mod pursuit;

pub use fista::{Descent, NnFista};
pub use pursuit::{Found, RegionPursuit};
