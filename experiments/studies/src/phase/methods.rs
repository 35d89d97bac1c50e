//! The algorithms of the phase diagram, and their theoretical limits.

use super::error::PhaseError;
use serde::Serialize;
use spts_recon::Recover;
use spts_recon::recover::{
    Build, BuildRegularised, NnLasso, Penalty, RECOVER, REGULARISED, Signs, orthant_threshold, weak_threshold,
};

/// Algorithms of [`REGULARISED`] that do not look for few non-zeros: linear estimation spreads them over all, and total
/// variation looks for few steps.
const NOT_SPARSE: [&str; 2] = ["lmmse", "tv"];

/// Algorithms that find positive coefficients only.
const POSITIVE: [&str; 3] = ["nn_omp", "nn_lasso", "nn_lmmse"];

/// Share of the largest correlation that the lasso's penalty has here: as good as none, the limit that theory is about.
/// Its bias stays below the 1 % that tell success from failure until the normal equations are conditioned to 1e3.
const PENALTY: f64 = 1e-5;

/// Which theory predicts where a method stops to find sparse signals.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Theory {
    /// Smallest Σ|x|, or Σx with x ≥ 0 for positive signs: the law for the lasso, and a reference for every other
    /// method.
    Weak,
    /// Any non-negative fit: the law for a method that requires nothing else.
    Orthant,
}

impl Theory {
    /// Critical sparsity ρ = S/M at the undersampling `delta` = M/N, in (0, 1].
    ///
    /// # Errors
    /// [`PhaseError::Theory`] outside that range.
    pub fn rho(self, delta: f64, signs: Signs) -> Result<f64, PhaseError> {
        Ok(match self {
            Self::Weak => weak_threshold(delta, signs),
            Self::Orthant => orthant_threshold(delta),
        }?)
    }
}

/// How a method is built.
#[derive(Debug, Clone, Copy)]
enum Builder {
    /// Built for a number of non-zeros.
    Sparsity(Build),
    /// Built for a number of unknowns.
    Unknowns(BuildRegularised),
}

/// A recovery algorithm whose phase diagram is measured.
#[derive(Debug, Clone, Copy)]
pub struct Method {
    /// Name, as in the tables of the reconstruction crate.
    pub name: &'static str,
    /// Its theoretical curve.
    pub theory: Theory,
    /// Whether it is given the number of non-zeros.
    pub told_sparsity: bool,
    builder: Builder,
}

impl Method {
    /// Builds the algorithm for `n` unknowns with `sparsity` non-zeros.
    ///
    /// # Errors
    /// [`PhaseError::Method`] if a parameter is outside its range.
    pub fn build(&self, n: usize, sparsity: usize) -> Result<Box<dyn Recover>, PhaseError> {
        match self.builder {
            Builder::Sparsity(build) => Ok(build(sparsity)),
            Builder::Unknowns(build) => build(n).map_err(|error| PhaseError::Method {
                name: self.name,
                reason: error.to_string(),
            }),
        }
    }
}

/// Every method for coefficients of these signs, in the order of the tables.
///
/// ```
/// use spts_recon::recover::Signs;
/// use spts_studies::phase::methods;
///
/// let names: Vec<_> = methods(Signs::Positive).iter().map(|method| method.name).collect();
/// assert!(names.contains(&"nn_lasso"));
/// assert!(!methods(Signs::Either).iter().any(|method| method.name == "nn_lasso"), "for positive signs only");
/// ```
#[must_use]
pub fn methods(signs: Signs) -> Vec<Method> {
    let told = RECOVER.iter().map(|&(name, build)| Method {
        name,
        theory: Theory::Weak,
        told_sparsity: true,
        builder: Builder::Sparsity(build),
    });
    let sparse = REGULARISED.iter().filter(|(name, _)| !NOT_SPARSE.contains(name));
    let weighing = sparse.map(|&(name, build)| Method {
        name,
        theory: if name == "nn_lmmse" {
            Theory::Orthant
        } else {
            Theory::Weak
        },
        told_sparsity: false,
        builder: Builder::Unknowns(if name == "nn_lasso" {
            |_| Ok(Box::new(NnLasso::new(Penalty::Relative(PENALTY))?))
        } else {
            build
        }),
    });
    told.chain(weighing)
        .filter(|method| signs == Signs::Positive || !POSITIVE.contains(&method.name))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exceptions_are_in_the_tables() {
        let known: Vec<&str> = RECOVER
            .iter()
            .map(|m| m.0)
            .chain(REGULARISED.iter().map(|m| m.0))
            .collect();
        for name in NOT_SPARSE.iter().chain(&POSITIVE) {
            assert!(known.contains(name), "{name}");
        }
        assert_eq!(methods(Signs::Positive).len(), known.len() - NOT_SPARSE.len());
        let either = methods(Signs::Either);
        assert_eq!(either.len(), known.len() - NOT_SPARSE.len() - POSITIVE.len());
        for method in either {
            assert!(method.build(10, 2).is_ok(), "{}", method.name);
        }
    }
}
