//! Dictionaries: which images are worth learning from, and K-SVD.

mod ksvd;
mod select;
mod shifted;

pub use ksvd::{Ksvd, KsvdError};
pub use select::{Selection, select};
pub use shifted::shifted;
