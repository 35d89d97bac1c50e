//! Reads sessions from folders of sessions, or from the published recordings of the real skin in MATLAB files.

mod converter;
mod error;
mod inflate;
mod mat;
mod mat_elements;
mod open;
mod published;
mod recording_files;
mod set;

pub use error::DataError;
pub use mat::{MatVariable, parse_mat, read_mat};
pub use set::{Published, SessionSet};
