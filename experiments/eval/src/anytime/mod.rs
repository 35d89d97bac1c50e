//! Decoders that stop as soon as they are confident enough: how many samples they need, and how often they are right.
//!
//! A decoder that states its confidence after every sample ([`crate::algorithm::Confidence`]) gets the samples of a
//! window one by one. For every wanted confidence it stops at the first sample that reaches it, and its answer there is
//! scored as on the board. The same decoder with a fixed number of samples is the comparison.
//! [`crate::board::TrainedBoard::stops`] trains and provides the windows.

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

/// Confidences at which decoders stop in `spts score --anytime`.
#[derive(Debug, Clone, PartialEq)]
pub struct StopSettings {
    /// Wanted probabilities of the best class, each in (0.5, 1).
    pub class: Vec<f64>,
    /// Wanted expected intersections over union of the image, each in (0.5, 1).
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
