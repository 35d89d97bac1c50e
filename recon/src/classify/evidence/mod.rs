//! Classifying the measurements themselves, without an image in between: Gaussian classes, their evidence and
//! calibrated probabilities.
//!
//! x = s·u, u ~ N(t, F Fᵀ + D): a template t, its likely deformations F, independent deviations D, and an amplitude s
//! of unknown size. [`TemplateModel`] makes such classes from images,
//! [`ClusterModel`] from many images a class, [`EvidenceClassifier`] weighs them,
//! [`Preparation`] holds what can be computed before a sample arrives and [`Evidence`] what the samples said so far;
//! [`AnytimeClassifier`] is all of them for weights ±1, one call a sample. [`ImageEstimator`] makes the image that goes
//! with a decision.

mod anytime;
mod classifier;
mod clusters;
mod component;
mod filter;
mod image;
mod lanes;
mod templates;
#[cfg(test)]
mod tests;

pub use anytime::AnytimeClassifier;
pub use classifier::{Decision, EvidenceClassifier, Posterior};
pub use clusters::{ClusterModel, Clusters};
pub use component::{Component, EvidenceError};
pub use filter::{Evidence, Preparation};
pub use image::ImageEstimator;
pub use templates::TemplateModel;
