//! Which object it is.

mod evidence;
mod src;
mod vote;

pub use evidence::{
    Component, Decision, Evidence, EvidenceClassifier, EvidenceError, Posterior, Preparation, TemplateModel,
    calibration_error, fit_temperature,
};
pub(crate) use src::SrcScratch;
pub use src::{Library, LibraryError, Src};
pub use vote::{VoteScore, majority, vote_groups};
