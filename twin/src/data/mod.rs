//! Recordings of a real skin, read from MATLAB files, and those of the twin, read from NumPy arrays.

mod directory;
mod error;
mod inflate;
mod mat;
mod npy;
mod twin_set;

pub use directory::{Published, RecordingsDir};
pub use error::DataError;
pub use mat::{MatVariable, read_mat};
pub use npy::{NpyArray, read_npy};
pub use twin_set::{load_twin, load_twin_bounces, save_recording, save_twin};
