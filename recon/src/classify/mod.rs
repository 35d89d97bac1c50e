//! Which object it is.

mod evidence;
mod src;
mod vote;

pub(crate) use evidence::ImageBuffers;
pub use evidence::{
    AnytimeClassifier, Component, Decision, Evidence, EvidenceClassifier, EvidenceError, ImageEstimator, Posterior,
    Preparation, Stopped, TemplateModel, calibration_error, fit_temperature,
};
pub(crate) use src::SrcScratch;
pub use src::{Library, LibraryError, Src};
pub use vote::{VoteScore, majority, vote_groups};
