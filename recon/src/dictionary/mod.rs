//! Dictionaries: which images are worth learning from, K-SVD, and atoms at every place.

mod coding;
mod error;
mod ksvd;
mod replace;
mod select;
#[cfg(test)]
mod tests;
mod training;
mod users;

pub use crate::shifted::shifted;
pub use error::DictionaryError;
pub use ksvd::Ksvd;
pub use select::{Selection, select};
