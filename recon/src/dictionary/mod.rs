//! Dictionaries: which images are worth learning from, and what learns from them.

mod coding;
mod ksvd;
mod learner;
mod replace;
mod select;
mod shifted;
mod training;
mod users;

pub use coding::representation_error;
pub use ksvd::{Ksvd, RankOne};
pub use learner::{DictionaryError, Learner};
pub use select::{Selection, select};
pub use shifted::shifted;
