//! Recovery rates over the phase diagram, and where they fall below one half.

use super::error::PhaseError;
use super::methods::{Method, Theory};
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_recon::recover::{PhasePoint, Signs};

/// Number of cells along each axis of the diagram.
pub const CELLS: usize = 20;

/// Settings of `spts phase`, which measures for which undersampling M/N and sparsity S/M each recovery algorithm finds
/// sparse signals.
#[derive(Debug, Clone)]
pub struct PhaseStudy {
    /// Algorithms.
    pub methods: Vec<Method>,
    /// Signs of the planted coefficients.
    pub signs: Signs,
    /// Number of unknowns N. Range [20, 2000].
    pub unknowns: usize,
    /// Number of random problems for each point. Range [1, 100000].
    pub trials: usize,
    /// Whether to compute only every fifth column.
    pub quick: bool,
    /// Seed of all problems.
    pub seed: u64,
}

/// Share of the problems that one algorithm solves at one M and S.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RatePoint {
    /// Algorithm.
    pub method: &'static str,
    /// Number of measurements M.
    pub m: usize,
    /// Number of non-zero coefficients S.
    pub s: usize,
    /// Undersampling M/N.
    pub delta: f64,
    /// Sparsity S/M.
    pub rho: f64,
    /// Share of the problems solved to 1 %. It is set to zero without a trial after two sparser points with zero.
    pub rate: f64,
}

/// Sparsity at which one algorithm solves half of the problems, for one M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Crossing {
    /// Algorithm.
    pub method: &'static str,
    /// Undersampling M/N.
    pub delta: f64,
    /// Sparsity S/M, interpolated between the last point above one half and the first at or below it. 0 stands for ρ →
    /// 0, if no point is above one half. `None` if the rate never falls that far.
    pub rho: Option<f64>,
    /// Standard error of `rho`: that of a rate of one half divided by the slope between the two points.
    pub standard_error: Option<f64>,
    /// Theoretical value for N → ∞.
    pub theory_rho: f64,
    /// The theoretical curve.
    pub theory: Theory,
}

/// Results of `spts phase`: shares of solved problems, and where they fall below one half.
#[derive(Debug, Clone, Serialize)]
pub struct PhaseReport {
    /// Number of unknowns N.
    pub unknowns: usize,
    /// Number of problems for each point.
    pub trials: usize,
    /// Seed of all problems.
    pub seed: u64,
    /// Whether the planted coefficients are all positive.
    pub positive: bool,
    /// Where the rates fall below one half.
    pub crossings: Vec<Crossing>,
    /// Every point.
    pub rates: Vec<RatePoint>,
    /// Algorithms, in the order of the tables.
    #[serde(skip)]
    pub methods: Vec<Method>,
    /// Signs of the planted coefficients.
    #[serde(skip)]
    pub signs: Signs,
}

impl PhaseStudy {
    /// Undersamplings of the plane, from the most: multiples of 1/[`CELLS`], or every fifth of them.
    fn deltas(&self) -> Vec<f64> {
        let step = if self.quick { 5 } else { 1 };
        (1..=CELLS / step).map(|i| (i * step) as f64 / CELLS as f64).collect()
    }

    /// Measures all points. The result does not depend on the number of threads.
    ///
    /// # Errors
    /// [`PhaseError`] if a method cannot be built, or N is too small for the diagram.
    pub fn run(&self, progress: &dyn Progress) -> Result<PhaseReport, PhaseError> {
        let tasks: Vec<(Method, f64)> = self
            .methods
            .iter()
            .flat_map(|&method| self.deltas().into_iter().map(move |delta| (method, delta)))
            .collect();
        progress.stage("recovering", Some(tasks.len()));
        let columns: Vec<(Vec<RatePoint>, Crossing)> = tasks
            .into_par_iter()
            .map(|(method, delta)| {
                let column = self.column(method, delta);
                progress.step();
                column
            })
            .collect::<Result<_, PhaseError>>()?;
        progress.end();
        let (rates, crossings): (Vec<_>, Vec<_>) = columns.into_iter().unzip();
        Ok(PhaseReport {
            unknowns: self.unknowns,
            trials: self.trials,
            seed: self.seed,
            positive: self.signs == Signs::Positive,
            crossings,
            rates: rates.concat(),
            methods: self.methods.clone(),
            signs: self.signs,
        })
    }

    /// Rates at one undersampling, sparsest first.
    fn column(&self, method: Method, delta: f64) -> Result<(Vec<RatePoint>, Crossing), PhaseError> {
        let mut points: Vec<RatePoint> = Vec::new();
        for cell in 0..CELLS {
            let point = PhasePoint {
                n_atoms: self.unknowns,
                delta,
                rho: (cell as f64 + 0.5) / CELLS as f64,
                signs: self.signs,
                trials: self.trials,
                seed: self.seed,
            };
            let (m, s) = point.shape();
            if points.last().is_some_and(|last| last.s == s) {
                continue;
            }
            let hopeless = points.len() >= 2 && points[points.len() - 2..].iter().all(|p| p.rate <= 0.0);
            let rate = if hopeless {
                0.0
            } else {
                point.recovery_rate(&*method.build(self.unknowns, s)?)
            };
            points.push(RatePoint {
                method: method.name,
                m,
                s,
                delta: m as f64 / self.unknowns as f64,
                rho: s as f64 / m as f64,
                rate,
            });
        }
        let delta = points.first().map_or(delta, |p| p.delta);
        let measured: Vec<(f64, f64)> = points.iter().map(|p| (p.rho, p.rate)).collect();
        let (rho, standard_error) = half(&measured, self.trials).unzip();
        let crossing = Crossing {
            method: method.name,
            delta,
            rho,
            standard_error,
            theory_rho: method.theory.rho(delta, self.signs)?,
            theory: method.theory,
        };
        Ok((points, crossing))
    }
}

/// Where the rates over (ρ, rate), sparsest first, fall to one half, and its standard error; `None` when they never do.
fn half(points: &[(f64, f64)], trials: usize) -> Option<(f64, f64)> {
    let mut before = (0.0, 1.0);
    for &(rho, rate) in points {
        if rate <= 0.5 {
            let slope = (before.1 - rate) / (rho - before.0);
            let at = before.0 + (before.1 - 0.5) / slope;
            return Some((at, 0.5 / (trials as f64).sqrt() / slope));
        }
        before = (rho, rate);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::super::methods;
    use super::*;

    #[test]
    fn the_crossing_is_interpolated() {
        let (at, error) = half(&[(0.1, 1.0), (0.2, 0.75), (0.3, 0.25), (0.4, 0.75)], 100).unwrap();
        assert!((at - 0.25).abs() < 1e-12);
        // 0.05 on a slope of 5
        assert!((error - 0.01).abs() < 1e-12);
        let (at, _) = half(&[(0.5, 0.0)], 4).unwrap();
        assert!((at - 0.25).abs() < 1e-12, "from all solved at ρ = 0");
        assert_eq!(half(&[(0.5, 1.0), (0.9, 0.6)], 4), None);
    }

    fn study(names: &[&str], unknowns: usize, trials: usize) -> PhaseStudy {
        let mut methods = methods(Signs::Positive);
        methods.retain(|m| names.contains(&m.name));
        PhaseStudy {
            methods,
            signs: Signs::Positive,
            unknowns,
            trials,
            quick: true,
            seed: 1,
        }
    }

    /// Theory is for N → ∞; the transition is about N^(−1/2) = .1 wide (Donoho and Tanner 2009), and half of the
    /// problems are solved within that of the curve. A pursuit that is told S stays below the lasso, and non-negativity
    /// alone fails below δ = ½.
    #[test]
    fn the_lasso_and_the_non_negative_fit_follow_their_theories() {
        let found = study(&["omp", "nn_lasso", "nn_lmmse"], 100, 16).run(&()).unwrap();
        let at = |method: &str, delta: f64| {
            let found = found
                .crossings
                .iter()
                .find(|c| c.method == method && (c.delta - delta).abs() < 1e-12);
            found.unwrap().clone()
        };
        for delta in [0.25, 0.5, 0.75] {
            let lasso = at("nn_lasso", delta);
            let rho = lasso.rho.unwrap();
            assert!((rho - lasso.theory_rho).abs() < 0.1, "{lasso:?}");
            assert!(at("omp", delta).rho.unwrap() < rho, "δ = {delta}");
        }
        let fit = at("nn_lmmse", 0.75);
        assert!((fit.rho.unwrap() - 2.0 / 3.0).abs() < 0.1, "{fit:?}");
        assert!(at("nn_lmmse", 0.25).rho.unwrap() < 0.03);
    }

    #[test]
    fn numbers_do_not_depend_on_the_threads() {
        let run = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let report = pool.install(|| study(&["omp", "nn_lasso"], 40, 10).run(&())).unwrap();
            serde_json::to_string(&report).unwrap()
        };
        assert_eq!(run(1), run(3));
    }
}
