//! Decoders that stop as soon as they are sure enough: how many samples they take, and how often they are right.
//!
//! A decoder that says after every sample how sure it is ([`crate::algorithm::Confidence`]) is given the samples of a
//! window one by one. For every wanted confidence, the first sample at which it is reached is where the decoder stops,
//! and what the decoder answers there is scored as on the board. Beside it stands the same decoder with a fixed number
//! of samples. The board trains and cuts windows: [`crate::board::TrainedBoard::stops`].

mod files;
mod rows;
mod stopper;
mod tally;
mod text;

pub use files::{FILES, write};
pub use rows::{AnytimeBoard, AnytimeObject, AnytimeRow};
pub(crate) use stopper::{End, Stopper};
pub use tally::StopScores;
pub(crate) use tally::{PressStops, intervals, mean, pool};
pub use text::table;

use crate::algorithm::Subject;

/// Wanted confidences.
#[derive(Debug, Clone, PartialEq)]
pub struct StopSettings {
    /// Probabilities of the most probable class, each in (0.5, 1).
    pub class: Vec<f64>,
    /// Expected intersections over union of the image, each in (0.5, 1).
    pub image: Vec<f64>,
}

impl Default for StopSettings {
    fn default() -> Self {
        Self {
            class: vec![0.8, 0.9, 0.95, 0.99],
            image: vec![0.6, 0.7, 0.8],
        }
    }
}

impl StopSettings {
    /// The confidences wanted of a decoder of `subject`.
    pub(crate) fn of(&self, subject: Subject) -> &[f64] {
        match subject {
            Subject::Class => &self.class,
            Subject::Image => &self.image,
        }
    }
}
