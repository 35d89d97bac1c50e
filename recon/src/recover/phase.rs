//! Recovery rates, the points of a phase-transition diagram.

use crate::matrix::Matrix;
use crate::problem::{Problem, Recover};
use crate::workspace::Workspace;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Signs of the planted coefficients.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Signs {
    /// Coefficients of either sign.
    Either,
    /// Positive coefficients only.
    Positive,
}

/// A point of the phase diagram, and how it is measured.
///
/// ```
/// use spts_recon::recover::{Omp, PhasePoint, Signs};
///
/// let easy = PhasePoint { n_atoms: 60, delta: 0.5, rho: 0.1, signs: Signs::Either, trials: 20, seed: 1 };
/// let hard = PhasePoint { rho: 0.8, ..easy };
/// let rate = |point: PhasePoint| point.recovery_rate(&Omp::new(point.shape().1));
/// assert!(rate(easy) > 0.9 && rate(hard) < 0.1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PhasePoint {
    /// Atoms K, at least 1.
    pub n_atoms: usize,
    /// Undersampling δ = M/K, in (0, 1].
    pub delta: f64,
    /// Sparsity ρ = S/M, in (0, 1].
    pub rho: f64,
    /// Signs of the planted coefficients.
    pub signs: Signs,
    /// Number of random problems.
    pub trials: usize,
    /// Seed of all random problems.
    pub seed: u64,
}

/// A trial succeeds when the planted signal is met to this relative error in the Euclidean norm, as in the source.
const SUCCESS: f64 = 1e-2;

impl PhasePoint {
    /// Measurements M = δK and non-zero coefficients S = ρM, rounded, each at least 1 and S at most M.
    #[must_use]
    pub fn shape(&self) -> (usize, usize) {
        #[expect(clippy::cast_possible_truncation, reason = "a share of a count")]
        let share = |of: usize, share: f64| ((of as f64 * share).round() as usize).clamp(1, of.max(1));
        let m = share(self.n_atoms, self.delta);
        (m, share(m, self.rho))
    }

    /// Share of trials in which `algorithm` finds the planted signal from exact measurements. The algorithm may have
    /// been built for the S of [`Self::shape`].
    ///
    /// Every trial draws a matrix of independent ±1, a support, and magnitudes uniform in [0.5, 1.5]. The result
    /// depends only on the point, not on the number of threads.
    /// Source: D. L. Donoho, J. Tanner, "Observed universality of phase transitions in high-dimensional geometry",
    /// Phil. Trans. R. Soc. A 367 (2009); A. Maleki, D. L. Donoho, "Optimally tuned iterative reconstruction algorithms
    /// for compressed sensing", IEEE J. Sel. Topics Signal Process. 4 (2010).
    #[must_use]
    pub fn recovery_rate(&self, algorithm: &dyn Recover) -> f64 {
        let (m, sparsity) = self.shape();
        let successes: usize = (0..self.trials as u64)
            .into_par_iter()
            .map_init(Workspace::default, |workspace, trial| {
                let (a, x) = self.draw(m, sparsity, trial);
                let y: Vec<f64> = (0..m)
                    .map(|r| a.row(r).iter().zip(&x).map(|(a, x)| a * x).sum())
                    .collect();
                let solution = Problem::new(a.view(), &y).and_then(|problem| algorithm.recover(&problem, workspace));
                let mut error = x.clone();
                if let Ok(solution) = solution {
                    for (&k, c) in solution.support.iter().zip(&solution.coefficients) {
                        error[k] -= c;
                    }
                }
                let square = |v: &[f64]| v.iter().map(|v| v * v).sum::<f64>();
                usize::from(square(&error) <= SUCCESS * SUCCESS * square(&x))
            })
            .sum();
        successes as f64 / self.trials.max(1) as f64
    }

    /// Matrix and planted signal of a trial.
    fn draw(&self, m: usize, sparsity: usize, trial: u64) -> (Matrix, Vec<f64>) {
        let k = self.n_atoms.max(1);
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(trial);
        let mut a = Matrix::zeros(m, k);
        for r in 0..m {
            a.row_mut(r).fill_with(|| if rng.random() { 1.0 } else { -1.0 });
        }
        let mut places: Vec<usize> = (0..k).collect();
        let mut x = vec![0.0; k];
        for n in 0..sparsity {
            places.swap(n, rng.random_range(n..k));
            let magnitude = rng.random_range(0.5..1.5);
            let negative = self.signs == Signs::Either && rng.random();
            x[places[n]] = if negative { -magnitude } else { magnitude };
        }
        (a, x)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Build, RECOVER};
    use super::*;

    fn rate_of(build: Build, point: &PhasePoint) -> f64 {
        point.recovery_rate(&*build(point.shape().1))
    }

    /// Deep inside and far outside the region in which greedy pursuits succeed: they need about 2·S·ln K measurements
    /// (Tropp and Gilbert 2007), 21 of the 80 for S = 2 and K = 200; with S = 0.9 M nothing tells one support from
    /// another.
    #[test]
    fn rates_are_high_where_recovery_is_easy_and_low_where_it_is_not() {
        for (name, build) in RECOVER {
            let point = PhasePoint {
                n_atoms: 200,
                delta: 0.4,
                rho: 0.03,
                signs: Signs::Positive,
                trials: 40,
                seed: 11,
            };
            let easy = rate_of(*build, &point);
            assert!(easy >= 0.95, "{name}: rate {easy} at ρ = 0.03");
            let hard = rate_of(*build, &PhasePoint { rho: 0.9, ..point });
            assert!(hard <= 0.05, "{name}: rate {hard} at ρ = 0.9");
        }
    }

    #[test]
    fn rates_do_not_depend_on_the_number_of_threads() {
        let point = PhasePoint {
            n_atoms: 60,
            delta: 0.5,
            rho: 0.25,
            signs: Signs::Either,
            trials: 40,
            seed: 3,
        };
        let rate = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| rate_of(RECOVER[1].1, &point)).to_bits()
        };
        assert_eq!(rate(1), rate(3));
    }
}
