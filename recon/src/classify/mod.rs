//! Which object it is.

mod src;
mod vote;

pub use src::{Library, LibraryError, Src};
pub use vote::{VoteScore, majority, vote_groups};
