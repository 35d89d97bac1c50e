//! Where sessions come from: folders of sessions, and the published recordings of the real skin in MATLAB files.

mod converter;
mod error;
mod inflate;
mod mat;
mod published;
mod set;
mod takes;

pub use error::DataError;
pub use mat::{MatVariable, read_mat};
pub use published::Published;
pub use set::SessionSet;
