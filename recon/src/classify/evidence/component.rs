//! One Gaussian component of a class.

use crate::checks::{RangeError, within};
use crate::recover::PriorError;

/// Images u ~ N(`mean`, F Fᵀ), observed through y/s = Φ u + e, e ~ N(0, `noise_variance`·I).
///
/// Independent deviations D of the taxels are added to `noise_variance` as tr D. For weights ±1 this is exactly their
/// contribution to the variance of every measurement; their contribution to the covariance of two measurements has mean
/// zero over the weights.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Class; `None` for a component of the outcome "unknown".
    pub label: Option<usize>,
    /// Weight among the components of the same class, > 0. Only ratios matter.
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
    /// There is no component, or components have no taxels.
    #[error("there is no component, or none with a taxel")]
    Empty,
    /// An argument has the wrong length.
    #[error("{what} has {len} values, expected {expected}")]
    Shape {
        /// Which argument.
        what: &'static str,
        /// Its length.
        len: usize,
        /// Expected length.
        expected: usize,
    },
    /// A parameter or a measurement is out of range.
    #[error(transparent)]
    Range(#[from] RangeError),
    /// Images from which no Gaussian prior can be made.
    #[error(transparent)]
    Prior(#[from] PriorError),
    /// A template image has no value above zero.
    #[error("image {index} has no value above zero")]
    NoContact {
        /// Number of the image, from 0.
        index: usize,
    },
    /// A sample arrived before its row was prepared.
    #[error("measurement {index} arrived, but only {prepared} rows are prepared")]
    NotPrepared {
        /// Index of the measurement.
        index: usize,
        /// Number of prepared rows.
        prepared: usize,
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
