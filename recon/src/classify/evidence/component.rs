//! One Gaussian component of a class.

use crate::checks::{RangeError, within};
use crate::recover::PriorError;

/// Images u ~ N(`mean`, F Fᵀ) seen through y/s = Φ u + e, e ~ N(0, `noise_variance`·I).
///
/// Independent deviations D of the taxels belong into `noise_variance` as tr D: for weights ±1 that is exactly what
/// they add to the variance of every measurement, and what they add to the covariance of two measurements has mean zero
/// over the weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Class, or `None` for a component that stands for everything unknown.
    pub label: Option<usize>,
    /// Weight among the components of the same class, > 0; only ratios count.
    pub weight: f64,
    /// Mean image t, length N, in units of the amplitude.
    pub mean: Vec<f64>,
    /// Columns of F, each of length N.
    pub factors: Vec<Vec<f64>>,
    /// Variance of a measurement at amplitude 1 that `factors` does not explain, [1e-12, 1e12].
    pub noise_variance: f64,
}

/// Images are given in units of the amplitude; what is beyond this is surely not.
const LARGEST: f64 = 1e6;

/// Why evidence cannot be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EvidenceError {
    /// No component was given, or components without a taxel.
    #[error("there is no component, or none with a taxel")]
    Empty,
    /// Something has the wrong length.
    #[error("{what} has {len} values, expected {expected}")]
    Shape {
        /// What.
        what: &'static str,
        /// Its length.
        len: usize,
        /// The length that fits.
        expected: usize,
    },
    /// A parameter or a measurement is out of range.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// Images that make no Gaussian prior.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A template image has no value above zero.
    #[error("image {index} has no value above zero")]
    NoContact {
        /// Which image.
        index: usize,
    },
    /// A measurement arrived whose weights have not been prepared.
    #[error("measurement {index} arrived, but only {prepared} rows are prepared")]
    NotPrepared {
        /// Index of the measurement.
        index: usize,
        /// Number of prepared rows.
        prepared: usize,
    },
    /// A row arrived with its sample while rows prepared before it still wait for theirs.
    #[error("a row arrived with its sample, but {waiting} rows prepared before it still wait for theirs")]
    RowsWaiting {
        /// Number of prepared rows without a sample.
        waiting: usize,
    },
}

impl Component {
    /// Checks lengths against `taxels` and every number against its range.
    pub(super) fn check(&self, taxels: usize) -> Result<(), EvidenceError> {
        within("weight", self.weight, 1e-12, 1e12)?;
        within("noise_variance", self.noise_variance, 1e-12, 1e12)?;
        for (what, values) in std::iter::once(("mean", &self.mean)).chain(self.factors.iter().map(|f| ("factor", f))) {
            if values.len() != taxels {
                return Err(EvidenceError::Shape {
                    what,
                    len: values.len(),
                    expected: taxels,
                });
            }
            for &v in values {
                within(what, v, -LARGEST, LARGEST)?;
            }
        }
        Ok(())
    }
}
