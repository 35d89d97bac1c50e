//! The image that belongs to a decision.

use super::classifier::Posterior;
use crate::matrix::MatrixView;
use crate::problem::{Problem, Recover as _, RecoverError, Solution};
use crate::recover::{Gaussian, Lmmse, NnLmmse, Noise, ParameterError};
use crate::workspace::Workspace;
use std::sync::Arc;

/// Posterior mean image E[x | y] over all components, each with its full covariance. Deviations of single taxels, which
/// the classifier treats as noise, are part of the image here.
///
/// x̂ = Σₖ wₖ (ŝₖ tₖ + Cₖ Φᵀ (Φ Cₖ Φᵀ + σ² I)⁻¹ (y − ŝₖ Φ tₖ)). The weights wₖ and mean amplitudes ŝₖ are those of the
/// decision, and Cₖ are the covariances. The image is linear in the amplitude, so the mean amplitude gives the mean
/// image.
/// Source: as [`Lmmse`].
#[derive(Debug, Clone)]
pub struct ImageEstimator {
    components: Vec<Lmmse>,
    /// Non-negative estimates, and the number of the most probable components that use them.
    non_negative: Option<(Vec<NnLmmse>, usize)>,
}

/// Memory of an estimate.
#[derive(Debug, Default)]
struct ImageScratch {
    /// y divided by the amplitude of a component.
    scaled: Vec<f64>,
    /// Image of a component at amplitude 1.
    solution: Solution,
    /// Weights, heaviest first.
    order: Vec<f64>,
}

/// Components of less posterior weight change no taxel by more than this share.
const SMALLEST_WEIGHT: f64 = 1e-3;

impl ImageEstimator {
    /// An estimator with the priors of the components in their order ([`super::TemplateModel::image_priors`]), for
    /// measurements whose noise has the standard deviation `noise` at amplitude 1.
    ///
    /// # Errors
    /// [`ParameterError`] if `noise` is outside (0, ∞).
    pub fn new(priors: Vec<Gaussian>, noise: f64) -> Result<Self, ParameterError> {
        let lmmse = |prior| Lmmse::new(Arc::new(prior), Noise::Absolute(noise));
        Ok(Self {
            components: priors.into_iter().map(lmmse).collect::<Result<_, _>>()?,
            non_negative: None,
        })
    }

    /// An estimator of non-negative images: the mean of the most probable non-negative images of the `most` (at least
    /// 1) most probable components.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn non_negative(priors: Vec<Gaussian>, noise: f64, most: usize) -> Result<Self, ParameterError> {
        let nn_lmmse = |prior| NnLmmse::new(Arc::new(prior), Noise::Absolute(noise));
        Ok(Self {
            components: Vec::new(),
            non_negative: Some((priors.into_iter().map(nn_lmmse).collect::<Result<_, _>>()?, most.max(1))),
        })
    }

    fn len(&self) -> usize {
        match &self.non_negative {
            Some((components, _)) => components.len(),
            None => self.components.len(),
        }
    }

    /// Computes `image` (one value a taxel, in units of `y`) for the window `y` = Φ x with the decision `posterior`.
    ///
    /// # Errors
    /// [`RecoverError`] if the sizes of Φ, `y` and the taxels do not match, or are zero, or a value is not finite.
    ///
    /// # Panics
    /// If `posterior` belongs to another classifier, or `image` has another length than the priors' means.
    pub fn estimate(
        &self,
        posterior: &Posterior,
        phi: MatrixView<'_>,
        y: &[f64],
        workspace: &mut Workspace,
        image: &mut [f64],
    ) -> Result<(), RecoverError> {
        assert_eq!(posterior.weights.len(), self.len(), "a prior a component");
        // the components need the rest of the workspace meanwhile
        let mut scratch = std::mem::take(workspace.scratch::<ImageScratch>());
        let done = self.accumulate(posterior, phi, y, workspace, &mut scratch, image);
        *workspace.scratch() = scratch;
        done
    }

    /// [`Self::estimate`] in scratch memory of its own.
    fn accumulate(
        &self,
        posterior: &Posterior,
        phi: MatrixView<'_>,
        y: &[f64],
        workspace: &mut Workspace,
        ImageScratch {
            scaled,
            solution,
            order,
        }: &mut ImageScratch,
        image: &mut [f64],
    ) -> Result<(), RecoverError> {
        image.fill(0.0);
        let least = self.least_weight(posterior, order);
        let mut total = 0.0;
        for (k, (&weight, amplitude)) in posterior.weights.iter().zip(&posterior.marginals.means).enumerate() {
            if weight < least {
                continue;
            }
            scaled.clear();
            scaled.extend(y.iter().map(|y| y / amplitude));
            let problem = Problem::new(phi, scaled)?;
            match &self.non_negative {
                Some((components, _)) => components[k].recover_into(&problem, workspace, solution)?,
                None => self.components[k].recover_into(&problem, workspace, solution)?,
            }
            for (&taxel, u) in solution.support.iter().zip(&solution.coefficients) {
                image[taxel] += weight * amplitude * u;
            }
            total += weight;
        }
        if self.non_negative.is_some() && total > 0.0 {
            image.iter_mut().for_each(|v| *v /= total);
        }
        Ok(())
    }

    /// Weight from which on a component takes part.
    fn least_weight(&self, posterior: &Posterior, order: &mut Vec<f64>) -> f64 {
        let Some((_, most)) = self.non_negative else {
            return SMALLEST_WEIGHT;
        };
        order.clear();
        order.extend_from_slice(&posterior.weights);
        order.sort_unstable_by(|a, b| b.total_cmp(a));
        let weight = order.get(most - 1).or(order.last()).copied().unwrap_or(0.0);
        weight.max(SMALLEST_WEIGHT)
    }
}
