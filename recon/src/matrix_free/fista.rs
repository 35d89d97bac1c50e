//! Non-negative lasso by accelerated projected gradients.

use crate::kernels::{axpy, dot};
use crate::operator::LinearOperator;
use crate::problem::RecoverError;

/// Iterations between two looks at the duality gap, which costs half an iteration.
const BETWEEN_LOOKS: usize = 8;

/// Largest number of times that a step is halved: 2⁻⁶⁰ of the first guess.
const HALVINGS: usize = 60;

/// min ½ ‖y − A x‖² + λ Σ x subject to x ≥ 0, with products of A alone: one with A and one with Aᵀ an iteration.
///
/// The step is found by halving, so that nothing has to be known of A; the momentum starts anew whenever it points
/// uphill. Stops when the duality gap is `tol` of ½ ‖y‖².
/// Source: A. Beck, M. Teboulle, SIAM J. Imaging Sci. 2 (2009) 183; B. O'Donoghue, E. Candès, Found. Comput. Math. 15
/// (2015) 715.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NnFista {
    /// λ, in units of y·A. Range (0, ∞); at 0 the duality gap says nothing.
    pub(super) penalty: f64,
    /// Duality gap over ½ ‖y‖². Range (0, 1].
    pub(super) tol: f64,
    /// Largest number of iterations.
    pub(super) max_iter: usize,
}

/// How an iterative minimisation ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Descent {
    /// Number of iterations.
    pub iterations: usize,
    /// Duality gap divided by ½ ‖y‖² at the last check.
    pub gap: f64,
    /// Whether the gap is at most `tol`.
    pub converged: bool,
}

/// Where the descent is.
struct State {
    x: Vec<f64>,
    /// A x.
    ax: Vec<f64>,
}

impl State {
    fn at(a: &impl LinearOperator, x: Vec<f64>) -> Self {
        let mut ax = vec![0.0; a.nrows()];
        a.apply(&x, &mut ax);
        Self { x, ax }
    }

    /// `self` + `momentum` · (`self` − `before`): linear, so that no product is needed.
    fn beyond(&self, before: &Self, momentum: f64) -> Self {
        let beyond =
            |now: &[f64], before: &[f64]| now.iter().zip(before).map(|(n, b)| n + momentum * (n - b)).collect();
        Self {
            x: beyond(&self.x, &before.x),
            ax: beyond(&self.ax, &before.ax),
        }
    }

    /// Aᵀ (y − A x).
    fn slope(&self, a: &impl LinearOperator, y: &[f64]) -> Vec<f64> {
        let residual: Vec<f64> = y.iter().zip(&self.ax).map(|(y, v)| y - v).collect();
        let mut slope = vec![0.0; a.ncols()];
        a.apply_adjoint(&residual, &mut slope);
        slope
    }
}

impl NnFista {
    /// Moves `x` from where it starts to the minimiser, as near as `tol` and `max_iter` allow; entries below 0 start at
    /// 0.
    ///
    /// # Errors
    /// [`RecoverError::ShapeMismatch`] when `y` is not as long as A has rows, [`RecoverError::NotFinite`] for a NaN or
    /// an infinity.
    ///
    /// # Panics
    /// When `x` is not as long as A has columns.
    pub(super) fn descend(&self, a: &impl LinearOperator, y: &[f64], x: &mut [f64]) -> Result<Descent, RecoverError> {
        check(a, y)?;
        assert_eq!(x.len(), a.ncols(), "a start for every column");
        let mut now = State::at(a, x.iter().map(|v| v.max(0.0)).collect());
        let mut ahead = State {
            x: now.x.clone(),
            ax: now.ax.clone(),
        };
        let (mut curvature, mut pace) = (first_curvature(a, y), 1.0_f64);
        let mut descent = Descent {
            iterations: 0,
            gap: f64::INFINITY,
            converged: false,
        };
        while descent.iterations <= self.max_iter {
            if descent.iterations.is_multiple_of(BETWEEN_LOOKS) || descent.iterations == self.max_iter {
                descent.gap = self.gap(&now, &now.slope(a, y), y);
                descent.converged = descent.gap <= self.tol;
            }
            if descent.converged || descent.iterations == self.max_iter {
                break;
            }
            let slope = ahead.slope(a, y);
            let next = self.step(a, &ahead, &slope, &mut curvature);
            // uphill: the gradient of the step and the way that was gone point alike
            let uphill: f64 = (ahead.x.iter().zip(&next.x).zip(&now.x))
                .map(|((ahead, next), now)| (ahead - next) * (next - now))
                .sum();
            let faster = if uphill > 0.0 {
                1.0
            } else {
                0.5 * (1.0 + (1.0 + 4.0 * pace * pace).sqrt())
            };
            let momentum = if uphill > 0.0 { 0.0 } else { (pace - 1.0) / faster };
            pace = faster;
            ahead = next.beyond(&now, momentum);
            now = next;
            descent.iterations += 1;
        }
        x.copy_from_slice(&now.x);
        Ok(descent)
    }

    /// max(0, x + (slope − λ)/L) with L doubled until ‖A Δ‖² ≤ L ‖Δ‖².
    fn step(&self, a: &impl LinearOperator, from: &State, slope: &[f64], curvature: &mut f64) -> State {
        let mut halvings = 0;
        loop {
            let moved = |(x, s): (&f64, &f64)| (x + (s - self.penalty) / *curvature).max(0.0);
            let next = State::at(a, from.x.iter().zip(slope).map(moved).collect());
            let square =
                |now: &[f64], before: &[f64]| -> f64 { now.iter().zip(before).map(|(n, b)| (n - b).powi(2)).sum() };
            if halvings == HALVINGS || square(&next.ax, &from.ax) <= *curvature * square(&next.x, &from.x) {
                return next;
            }
            *curvature *= 2.0;
            halvings += 1;
        }
    }

    /// Primal minus dual objective over ½ ‖y‖², with the residual, shrunk until it is feasible, as the dual point.
    fn gap(&self, now: &State, slope: &[f64], y: &[f64]) -> f64 {
        let whole = 0.5 * dot(y, y);
        if whole <= 0.0 {
            return 0.0;
        }
        let steepest = slope.iter().copied().fold(0.0, f64::max);
        let shrink = if steepest > self.penalty {
            self.penalty / steepest
        } else {
            1.0
        };
        let residual: Vec<f64> = y.iter().zip(&now.ax).map(|(y, v)| y - v).collect();
        let rest: f64 = y.iter().zip(&residual).map(|(y, r)| (y - shrink * r).powi(2)).sum();
        let primal = 0.5 * dot(&residual, &residual) + self.penalty * now.x.iter().sum::<f64>();
        ((primal - (whole - 0.5 * rest)) / whole).max(0.0)
    }
}

/// ‖A g‖² / ‖g‖² along the first gradient g = Aᵀ y: not above the largest curvature, and of its order.
fn first_curvature(a: &impl LinearOperator, y: &[f64]) -> f64 {
    let (mut gradient, mut image) = (vec![0.0; a.ncols()], vec![0.0; a.nrows()]);
    a.apply_adjoint(y, &mut gradient);
    a.apply(&gradient, &mut image);
    let curvature = dot(&image, &image) / dot(&gradient, &gradient);
    if curvature.is_normal() { curvature } else { 1.0 }
}

/// Shapes and values that a recovery can work with.
pub(super) fn check(a: &impl LinearOperator, y: &[f64]) -> Result<(), RecoverError> {
    if y.len() != a.nrows() {
        return Err(RecoverError::ShapeMismatch {
            rows: a.nrows(),
            len: y.len(),
        });
    }
    match y.iter().position(|v| !v.is_finite()) {
        Some(index) => Err(RecoverError::NotFinite { index, value: y[index] }),
        None => Ok(()),
    }
}

/// y −= A x.
pub(super) fn subtract(a: &impl LinearOperator, x: &[f64], y: &mut [f64]) {
    let mut image = vec![0.0; y.len()];
    a.apply(x, &mut image);
    axpy(-1.0, &image, y);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;
    use crate::problem::{Problem, Recover as _};
    use crate::recover::{NnLasso, Penalty};
    use crate::workspace::Workspace;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]
        /// Against coordinate descent with Newton steps on the active set.
        #[test]
        fn it_is_the_non_negative_lasso(values in prop::collection::vec(-1.0..1.0, 12 * 20), y in prop::collection::vec(-1.0..1.0, 12)) {
            let a = Matrix::from_rows(12, 20, values).unwrap();
            // the other program's penalty is a measurement's share
            let penalty = 0.05;
            let fista = NnFista { penalty, tol: 1e-12, max_iter: 200_000 };
            let mut x = vec![0.0; 20];
            prop_assert!(fista.descend(&a, &y, &mut x).unwrap().converged);
            let problem = Problem::new(a.view(), &y).unwrap();
            let lasso = NnLasso::new(Penalty::Absolute(penalty / 12.0)).unwrap();
            let solution = lasso.recover(&problem, &mut Workspace::default()).unwrap();
            let objective = |x: &[f64]| {
                let mut r = y.clone();
                subtract(&a, x, &mut r);
                0.5 * dot(&r, &r) + penalty * x.iter().sum::<f64>()
            };
            let mut exact = vec![0.0; 20];
            solution.scatter(&mut exact);
            // the gaps of both: 1e-12 and 1e-9 of ½ ‖y‖² ≤ 6
            prop_assert!((objective(&x) - objective(&exact)).abs() <= 1e-8, "{} against {}", objective(&x), objective(&exact));
        }
    }

    #[test]
    fn bad_measurements_are_refused() {
        let a = Matrix::from_rows(2, 1, vec![1.0, 1.0]).unwrap();
        let fista = NnFista {
            penalty: 0.1,
            tol: 1e-6,
            max_iter: 10,
        };
        assert!(matches!(
            fista.descend(&a, &[1.0], &mut [0.0]),
            Err(RecoverError::ShapeMismatch { rows: 2, len: 1 })
        ));
        assert!(fista.descend(&a, &[1.0, f64::NAN], &mut [0.0]).is_err());
        let mut x = [3.0];
        assert!(fista.descend(&a, &[0.0, 0.0], &mut x).unwrap().converged);
    }
}
