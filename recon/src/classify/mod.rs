//! Classification of objects: from an image ([`Src`]), or from measurements, one by one
//! ([`EvidenceClassifier`]).

mod evidence;
mod src;
mod vote;

pub use evidence::{
    ClusterModel, Clusters, Component, Decision, Evidence, EvidenceClassifier, EvidenceError, ImageEstimator,
    Posterior, Preparation, TemplateModel,
};
pub use src::{Library, LibraryError, Src};
pub use vote::{VoteScore, majority, vote_groups};
