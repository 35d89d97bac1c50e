//! Classifies measurements directly, without an image: Gaussian classes, their evidence, and calibrated probabilities.
//!
//! Model: x = s·u, u ~ N(t, F Fᵀ + D), with a template t, its likely deformations F, independent deviations D, and an
//! amplitude s of unknown size. [`TemplateModel`] builds such classes from a few images, [`ClusterModel`] from many.
//! [`EvidenceClassifier`] compares them. [`Preparation`] holds what is computed before a sample arrives, and
//! [`Evidence`] the result of the samples so far. [`ImageEstimator`] computes the image that belongs to a decision.

mod classifier;
mod clusters;
mod component;
mod covariance;
mod filter;
mod image;
mod lanes;
mod templates;
#[cfg(test)]
mod tests;

pub use classifier::{Decision, EvidenceClassifier, Posterior};
pub use clusters::{ClusterModel, Clusters};
pub use component::{Component, EvidenceError};
pub use filter::{Evidence, Preparation};
pub use image::ImageEstimator;
pub use templates::TemplateModel;
