//! Scores decoders on sessions of the tactile skin, real or simulated: what they may learn, the windows they see, the tally.

pub mod board;
pub mod decode;
mod labels;
pub mod learn;
pub mod npz;
pub mod score;
mod source;
mod twin_sessions;

pub use labels::Labels;
pub use source::{PublishedSkin, Source};
pub use twin_sessions::{TwinSessions, TwinSessionsError};
