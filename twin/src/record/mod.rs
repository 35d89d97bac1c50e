//! The twin as a recording device: scenes in, recordings of the same type as those of a real skin out.

mod error;
mod hold;
mod mechanics;
mod session;
mod twin;

pub use error::TwinError;
pub use hold::hold_s;
pub use mechanics::{PressFrames, press_frames};
pub use session::TwinSession;
pub use twin::Twin;
pub(crate) use twin::header;
