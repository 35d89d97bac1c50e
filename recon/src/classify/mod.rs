//! Classification of objects: from an image ([`Src`]), from a window of measurements ([`EvidenceClassifier`]), or
//! measurement by measurement ([`AnytimeClassifier`]).

mod evidence;
mod src;
mod vote;

pub use evidence::{
    AnytimeClassifier, ClusterModel, Clusters, Component, Decision, Evidence, EvidenceClassifier, EvidenceError,
    ImageEstimator, Posterior, Preparation, TemplateModel,
};
pub use src::{Library, LibraryError, Src};
pub use vote::{VoteScore, majority, vote_groups};
