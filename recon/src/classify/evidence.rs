//! Classifies measurements directly, without an image: Gaussian classes, their evidence, and calibrated probabilities.
//!
//! Model: x = s·u, u ~ N(t, F Fᵀ + D), with a template t, its likely deformations F, independent deviations D, and an
//! amplitude s of unknown size. [`TemplateModel`] builds such classes from a few images, [`ClusterModel`] from many.
//! [`EvidenceClassifier`] compares them. [`Preparation`] holds what is computed before a sample arrives, and
//! [`Evidence`] the result of the samples so far. [`ImageEstimator`] computes the image that belongs to a decision.

use crate::amplitude::{AmplitudeRange, Marginals};
use crate::checks::{other_length, within};
use crate::classify::filter::{Evidence, LANES, Preparation, Shape};
use crate::matrix::{Matrix, MatrixView};
use crate::problem::{Problem, Recover as _, Solution, Workspace};
use crate::recover::{Gaussian, Lmmse, NnLmmse, Noise};
use spts_input::Refusal;
use std::sync::Arc;

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

impl Component {
    /// Checks lengths against `taxels` and every number against its range.
    pub(super) fn check(&self, taxels: usize) -> Result<(), Refusal> {
        within("weight", self.weight, 1e-12, 1e12)?;
        within("noise_variance", self.noise_variance, 1e-12, 1e12)?;
        for (what, values) in std::iter::once(("mean", &self.mean)).chain(self.factors.iter().map(|f| ("factor", f))) {
            if values.len() != taxels {
                return Err(other_length(what, values.len(), taxels));
            }
            for &v in values {
                within(what, v, -LARGEST, LARGEST)?;
            }
        }
        Ok(())
    }
}

/// Compares Gaussian components by their evidence given the measurements, integrated over the amplitude:
///
/// ln p(y | c) = ln Σₖ wₖ ∫ N(y; s Φ tₖ, s²(Φ Fₖ Fₖᵀ Φᵀ + vₖ I)) p(s) ds over the components k of class c.
///
/// Source of the rule: Bayes' theorem, with equal priors for the known classes.
///
/// ```
/// use spts_recon::AmplitudeRange;
/// use spts_recon::classify::{Component, EvidenceClassifier, Posterior};
///
/// // two classes of 2 taxels, whose images differ in the second one
/// let class = |label, mean: [f64; 2]| Component {
///     label: Some(label),
///     weight: 1.0,
///     mean: mean.to_vec(),
///     factors: Vec::new(),
///     noise_variance: 0.01,
/// };
/// let classes = [class(1, [1.0, 0.0]), class(2, [1.0, 1.0])];
/// let classifier = EvidenceClassifier::new(&classes, AmplitudeRange::new(0.1, 10.0)?, 0.1)?;
/// let (mut rows, mut evidence) = (classifier.preparation(), classifier.evidence());
/// for (phi, y) in [([1.0, 1.0], 4.0), ([1.0, -1.0], 0.1)] {
///     // a row of Φ times the bank
///     let mut projected = vec![0.0; classifier.bank().ncols()];
///     classifier.bank().accumulate_row(&phi, &mut projected);
///     rows.push(&projected)?;
///     evidence.observe(&rows, y)?;
/// }
/// let decision = classifier.decide(&rows, &evidence, &mut Posterior::default());
/// assert!(decision.label == Some(2) && decision.probability > 0.99);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct EvidenceClassifier {
    shape: Shape,
    bank: Matrix,
    noise: Vec<f64>,
    /// Outcome, and ln weight within it, of every component.
    members: Vec<(usize, f64)>,
    outcomes: Vec<Option<usize>>,
    log_prior: Vec<f64>,
    amplitude: AmplitudeRange,
}

/// The most probable class after the samples so far, and its probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decision {
    /// Class, or `None` for the outcome "unknown".
    pub label: Option<usize>,
    /// Probability of that outcome, [0, 1].
    pub probability: f64,
}

/// Evidence and probabilities of all outcomes. The memory is reused from decision to decision.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Posterior {
    /// ln p(y | outcome) of every outcome.
    pub log_evidence: Vec<f64>,
    /// Probability of every outcome; they sum to 1.
    pub probabilities: Vec<f64>,
    /// Posterior weight of every component; they sum to 1.
    pub(super) weights: Vec<f64>,
    /// Posterior amplitude of every component.
    pub(super) marginals: Marginals,
}

impl EvidenceClassifier {
    /// A classifier with the given components and amplitude range. `unknown_prior`, [1e-12, 0.999], is the prior
    /// probability of the components without a label; it is not used if there are none. The classes share the rest
    /// equally.
    ///
    /// # Errors
    /// [`Refusal`] if there is no component, their sizes differ, or a number is out of range.
    pub fn new(components: &[Component], amplitude: AmplitudeRange, unknown_prior: f64) -> Result<Self, Refusal> {
        within("unknown_prior", unknown_prior, 1e-12, 0.999)?;
        let taxels = components.first().map_or(0, |c| c.mean.len());
        if taxels == 0 {
            return Err(Refusal::new("there is no component, or none with a taxel"));
        }
        for component in components {
            component.check(taxels)?;
        }
        let shape = Shape {
            blocks: components.len().div_ceil(LANES),
            rank: components.iter().map(|c| c.factors.len()).max().unwrap_or(0),
        };
        let mut bank = Matrix::zeros(taxels, shape.row());
        let mut noise = vec![1.0; shape.lanes()];
        for (lane, c) in components.iter().enumerate() {
            noise[lane] = c.noise_variance;
            bank.set_column(shape.column(lane, 0), &c.mean);
            for (k, factor) in c.factors.iter().enumerate() {
                bank.set_column(shape.column(lane, k + 1), factor);
            }
        }
        let outcomes = outcomes(components);
        Ok(Self {
            shape,
            bank,
            noise,
            members: members(components, &outcomes),
            log_prior: log_prior(&outcomes, unknown_prior),
            outcomes,
            amplitude,
        })
    }

    /// Means and deformations of all components, N × K. [`Preparation::push`] needs rows of Φ times this matrix. For
    /// weights ±1, [`SignTables`](crate::SignTables) compute these products.
    pub fn bank(&self) -> &Matrix {
        &self.bank
    }

    /// Outcomes in the order of [`Posterior::probabilities`]: labels in increasing order, then `None` if there are
    /// components without a label.
    #[cfg(test)]
    pub(crate) fn outcomes(&self) -> &[Option<usize>] {
        &self.outcomes
    }

    /// An empty preparation for this classifier.
    pub fn preparation(&self) -> Preparation {
        Preparation::new(self.shape, &self.noise)
    }

    /// Empty evidence for this classifier.
    pub fn evidence(&self) -> Evidence {
        Evidence::new(self.shape, self.outcomes.len())
    }

    /// Computes `posterior` from the samples so far and returns the best outcome (the first of equal ones). Without a
    /// sample, this is the prior.
    pub fn decide(&self, preparation: &Preparation, evidence: &Evidence, posterior: &mut Posterior) -> Decision {
        self.weigh(preparation, evidence, posterior);
        let outcomes = posterior.log_evidence.iter().zip(&self.log_prior);
        posterior.probabilities.clear();
        posterior.probabilities.extend(outcomes.map(|(e, p)| e + p));
        softmax(&mut posterior.probabilities);
        for (&(outcome, _), weight) in self.members.iter().zip(&mut posterior.weights) {
            *weight *= posterior.probabilities[outcome];
        }
        let mut best = 0;
        for (k, p) in posterior.probabilities.iter().enumerate() {
            if *p > posterior.probabilities[best] {
                best = k;
            }
        }
        Decision { label: self.outcomes[best], probability: posterior.probabilities[best] }
    }

    /// Log evidence of every outcome, and the share of every component in its outcome's.
    fn weigh(&self, preparation: &Preparation, evidence: &Evidence, posterior: &mut Posterior) {
        let count = evidence.count();
        let constant = -0.5 * count as f64 * std::f64::consts::TAU.ln();
        evidence.marginalise(preparation, self.amplitude, &mut posterior.marginals);
        posterior.weights.clear();
        let determinants = preparation.log_determinants(count).iter().copied();
        let components = self.members.iter().zip(&posterior.marginals.log_evidence);
        let weights = components.zip(determinants.chain(std::iter::repeat(0.0)));
        posterior
            .weights
            .extend(weights.map(|(((_, weight), marginal), ln_det)| weight + constant + marginal - 0.5 * ln_det));
        let peaks = &mut posterior.probabilities;
        peaks.clear();
        peaks.resize(self.outcomes.len(), f64::NEG_INFINITY);
        for (&(outcome, _), w) in self.members.iter().zip(&posterior.weights) {
            peaks[outcome] = peaks[outcome].max(*w);
        }
        let sums = &mut posterior.log_evidence;
        sums.clear();
        sums.resize(self.outcomes.len(), 0.0);
        for (&(outcome, _), w) in self.members.iter().zip(&mut posterior.weights) {
            *w = (*w - peaks[outcome]).exp();
            sums[outcome] += *w;
        }
        for (&(outcome, _), w) in self.members.iter().zip(&mut posterior.weights) {
            *w /= sums[outcome];
        }
        for ((sum, peak), carried) in sums.iter_mut().zip(&*peaks).zip(&evidence.carried) {
            *sum = peak + sum.ln() + carried;
        }
    }

    /// Ends the window. Its evidence is kept; the next sample belongs to a new window, whose image may have another
    /// amplitude and other deformations.
    pub fn next_window(&self, preparation: &Preparation, evidence: &mut Evidence, posterior: &mut Posterior) {
        self.weigh(preparation, evidence, posterior);
        evidence.carried.copy_from_slice(&posterior.log_evidence);
        evidence.begin_window();
    }
}

/// Labels in rising order, then `None` if a component has none.
fn outcomes(components: &[Component]) -> Vec<Option<usize>> {
    let mut labels: Vec<Option<usize>> = components.iter().map(|c| c.label).collect();
    labels.sort_unstable_by_key(|l| (l.is_none(), *l));
    labels.dedup();
    labels
}

/// Outcome of every component, and the logarithm of its weight within it.
fn members(components: &[Component], outcomes: &[Option<usize>]) -> Vec<(usize, f64)> {
    let total = |label| -> f64 { components.iter().filter(|c| c.label == label).map(|c| c.weight).sum() };
    let totals: Vec<f64> = outcomes.iter().map(|&label| total(label)).collect();
    components
        .iter()
        .map(|c| {
            let outcome = outcomes.iter().position(|o| *o == c.label).unwrap_or_default();
            (outcome, (c.weight / totals[outcome]).ln())
        })
        .collect()
}

fn log_prior(outcomes: &[Option<usize>], unknown_prior: f64) -> Vec<f64> {
    let known = outcomes.iter().flatten().count();
    let unknown = if known < outcomes.len() { unknown_prior } else { 0.0 };
    let share = (1.0 - unknown) / known.max(1) as f64;
    outcomes.iter().map(|o| if o.is_some() { share.ln() } else { unknown_prior.ln() }).collect()
}

/// Turns logarithms into probabilities.
fn softmax(values: &mut [f64]) {
    let max = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let mut sum = 0.0;
    for v in values.iter_mut() {
        *v = (*v - max).exp();
        sum += *v;
    }
    for v in values.iter_mut() {
        *v /= sum;
    }
}

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
    /// [`Refusal`] if `noise` is outside (0, ∞).
    pub fn new(priors: Vec<Gaussian>, noise: f64) -> Result<Self, Refusal> {
        let lmmse = |prior| Lmmse::new(Arc::new(prior), Noise::Absolute(noise));
        Ok(Self { components: priors.into_iter().map(lmmse).collect::<Result<_, _>>()?, non_negative: None })
    }

    /// An estimator of non-negative images: the mean of the most probable non-negative images of the `most` (at least
    /// 1) most probable components.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn non_negative(priors: Vec<Gaussian>, noise: f64, most: usize) -> Result<Self, Refusal> {
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
    /// [`Refusal`] if the sizes of Φ, `y` and the taxels do not match, or are zero, or a value is not finite.
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
    ) -> Result<(), Refusal> {
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
        ImageScratch { scaled, solution, order }: &mut ImageScratch,
        image: &mut [f64],
    ) -> Result<(), Refusal> {
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
