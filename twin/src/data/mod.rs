//! Reads sessions from folders of sessions, or from the published recordings of the real skin in MATLAB files.

mod mat;
mod open;
mod published;

pub use mat::{MatVariable, parse_mat};
pub use open::SessionSet;
pub use published::{Published, missing_file, nothing_found};
