//! Recordings of a real skin, read from MATLAB files.

mod directory;
mod error;
mod inflate;
mod mat;

pub use directory::{Published, RecordingsDir};
pub use error::DataError;
pub use mat::{MatVariable, read_mat};
