//! The twin as a recording device: scenes in, recordings of the same type as the published ones out.

mod error;
mod hold;
mod press;
mod record;

pub use error::TwinError;
pub use hold::hold_s;
pub use press::{PressFrames, press_frames};
pub use record::{RecordedSession, bounce_session, press_session, recorded, recorded_from};
