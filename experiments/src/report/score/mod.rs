//! The board of `spts score` as files.

mod files;
mod picture;

pub use files::{WriteError, write};
