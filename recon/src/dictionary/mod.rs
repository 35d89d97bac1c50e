//! Dictionaries: selection of training images, K-SVD, and shifted atoms.

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
