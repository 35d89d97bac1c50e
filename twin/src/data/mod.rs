//! Reads sessions from folders of sessions, from the published recordings of the real skin in MATLAB files, or from
//! frames of any skin or simulator.

mod frame_files;
mod frames;
mod mat;
mod open;
mod published;
mod wired;

pub use frame_files::{FRAME_FILES, FrameArray};
pub use frames::{FrameOptions, Frames};
pub use mat::{MatVariable, parse_mat};
pub use open::SessionSet;
pub use published::{Published, missing_file, nothing_found};
pub use wired::{Courses, FrameLaw, PlayedPress, WiredFrames, wired};
