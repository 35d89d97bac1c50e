//! Scores decoders on sessions of the tactile skin, real or simulated: what they may learn, the windows they see, the tally.

pub mod board;
pub mod learn;
pub mod real;
pub mod score;
