//! Dictionaries: which images are worth learning from, and what learns from them.

mod coding;
mod conformance;
mod kmeans;
mod ksvd;
mod learner;
mod online;
mod replace;
mod select;
mod shifted;
mod table;
mod training;
mod users;

pub use coding::representation_error;
pub use conformance::conformance;
pub use kmeans::KMeans;
pub use ksvd::{Ksvd, RankOne};
pub use learner::{DictionaryError, Learner};
pub use online::Online;
pub use select::{Selection, select};
pub use shifted::shifted;
pub use table::{Build, LEARNERS};
