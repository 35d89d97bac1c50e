//! Rows that distinguish classes.

use super::ascent::{Worth, climb};
use super::error::RowError;
use super::greedy::unreachable_limit;
use super::headroom::Headroom;
use super::random::random_signs;
use super::task::{DesignRows, RowTask};
use crate::classify::Component;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::Matrix;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// Rows of ±1 that distinguish Gaussian classes of unknown amplitude, designed one after the other.
///
/// With the classes' mean covariance Σ and noise ν, templates t are compared in the metric of the rows A: ⟨t, u⟩ =
/// tᵀAᵀ(A Σ Aᵀ + ν I)⁻¹A u. If the amplitude is unknown, the distance of u from t is D = |t|² − max(⟨t, u⟩, 0)²/|u|².
/// The union bound of the errors is Σ Q(√D/2) ≤ ½ Σ exp(−D/8) over ordered pairs of different classes (J. G. Proakis,
/// *Digital Communications*, 4th ed., §5.2). Every row is the one that reduces this sum most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Classes {
    /// Number of initial rows that are tried.
    pub starts: usize,
    /// Largest number of sweeps over all taxels for each of them.
    pub sweeps: usize,
}

impl Default for Classes {
    fn default() -> Self {
        Self { starts: 24, sweeps: 3 }
    }
}

impl DesignRows for Classes {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, RowError> {
        task.check(1 << 16, "so many rows are of no use")?;
        let n = task.expected.taxels();
        let mut apart = Apart::new(task.classes, task.expected.shape())?;
        let headroom = Headroom::of(task);
        let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
        let mut rows = Matrix::zeros(task.rows, n);
        for r in 0..task.rows {
            let starts = apart.starts(self.starts, &mut rng);
            let climbed = starts.into_par_iter().map(|mut row| {
                let mut headroom = headroom.clone();
                let mut worth = Separation::new(&apart);
                let found = climb(&mut worth, headroom.as_mut(), self.sweeps, &mut row);
                found.map(|worth| (worth, row))
            });
            let climbed: Vec<Option<(f64, Vec<f64>)>> = climbed.collect();
            let best = climbed
                .into_iter()
                .flatten()
                .reduce(|a, b| if b.0 > a.0 { b } else { a });
            let Some((_, row)) = best else {
                return Err(unreachable_limit(task, headroom));
            };
            apart.observe(&row);
            rows.row_mut(r).copy_from_slice(&row);
        }
        Ok(rows)
    }
}

/// How far classes are apart after some rows.
#[derive(Debug, Clone)]
pub(super) struct Apart {
    n: usize,
    labels: Vec<Option<usize>>,
    /// Posterior covariance, N × N.
    p: Vec<f64>,
    /// ν.
    variance: f64,
    /// Part of the templates that the rows do not explain, K × N.
    residual: Vec<f64>,
    /// ⟨t, u⟩, K × K.
    products: Vec<f64>,
    /// Ordered pairs of different classes, the closest first.
    pairs: Vec<(usize, usize)>,
}

/// What a row has changed.
pub(super) struct Observed {
    /// P a
    pub(super) u: Vec<f64>,
    /// Variance of its innovation, aᵀP a + ν.
    pub(super) s: f64,
    /// Its sums over the residual templates.
    pub(super) sums: Vec<f64>,
}

/// D of a template with ⟨t, t⟩ = `own` from one with ⟨u, u⟩ = `other`, when ⟨t, u⟩ = `both`.
fn apart(own: f64, both: f64, other: f64) -> f64 {
    let both = both.max(0.0);
    let explained = if other > 0.0 { both * both / other } else { 0.0 };
    (own - explained).max(0.0)
}

impl Apart {
    pub(super) fn new(classes: &[Component], shape: [usize; 2]) -> Result<Self, RowError> {
        let mut labels: Vec<Option<usize>> = classes.iter().map(|c| c.label).collect();
        labels.sort_unstable();
        labels.dedup();
        if labels.len() < 2 {
            return Err(RowError::Classes { labels: labels.len() });
        }
        let n = shape[0] * shape[1];
        if let Some(other) = classes.iter().find(|c| c.mean.len() != n) {
            return Err(RowError::Shape {
                pixels: other.mean.len(),
                rows: shape[0],
                cols: shape[1],
            });
        }
        let share = 1.0 / classes.len() as f64;
        let mut p = vec![0.0; n * n];
        for factor in classes.iter().flat_map(|c| &c.factors) {
            for (row, v) in p.chunks_exact_mut(n).zip(factor) {
                axpy(share * v, factor, row);
            }
        }
        let pairs = (0..classes.len()).flat_map(|i| (0..classes.len()).map(move |j| (i, j)));
        let differ = |&(i, j): &(usize, usize)| classes[i].label != classes[j].label;
        Ok(Self {
            n,
            pairs: pairs.filter(differ).collect(),
            labels: classes.iter().map(|c| c.label).collect(),
            p,
            variance: share * classes.iter().map(|c| c.noise_variance).sum::<f64>(),
            residual: classes.iter().flat_map(|c| c.mean.iter().copied()).collect(),
            products: vec![0.0; classes.len() * classes.len()],
        })
    }

    /// Measures the row `a`.
    pub(super) fn observe(&mut self, a: &[f64]) -> Observed {
        let (n, count) = (self.n, self.labels.len());
        let mut u = vec![0.0; n];
        adjoint(&self.p, a, &mut u);
        let s = dot(a, &u) + self.variance;
        let sums: Vec<f64> = self.residual.chunks_exact(n).map(|t| dot(t, a)).collect();
        for (k, row) in self.products.chunks_exact_mut(count).enumerate() {
            axpy(sums[k] / s, &sums, row);
        }
        for (t, sum) in self.residual.chunks_exact_mut(n).zip(&sums) {
            axpy(-sum / s, &u, t);
        }
        for (i, row) in self.p.chunks_exact_mut(n).enumerate() {
            axpy(-u[i] / s, &u, row);
        }
        let mut pairs = std::mem::take(&mut self.pairs);
        pairs.sort_by(|a, b| self.distance(*a).total_cmp(&self.distance(*b)));
        self.pairs = pairs;
        Observed { u, s, sums }
    }

    /// D of the ordered pair of templates (t, u).
    fn distance(&self, (i, j): (usize, usize)) -> f64 {
        let count = self.labels.len();
        let product = |i: usize, j: usize| self.products[i * count + j];
        apart(product(i, i), product(i, j), product(j, j))
    }

    /// Bound of the errors, Σ exp(−D/8), after one more row at which the residual templates have the `sums` and the
    /// innovation the variance s. Beyond `enough`, a part of it may be the answer.
    fn bound(&self, sums: &[f64], s: f64, enough: f64) -> f64 {
        let count = self.labels.len();
        let product = |i: usize, j: usize| self.products[i * count + j] + sums[i] * sums[j] / s;
        let mut bound = 0.0;
        for &(i, j) in &self.pairs {
            bound += (-apart(product(i, i), product(i, j), product(j, j)) / 8.0).exp();
            if bound > enough {
                break;
            }
        }
        bound
    }

    /// Sums of the row `a` over the residual templates, and aᵀP a.
    pub(super) fn seen(&self, a: &[f64]) -> (Vec<f64>, f64) {
        let sums = self.residual.chunks_exact(self.n).map(|t| dot(t, a)).collect();
        let rows = self.p.chunks_exact(self.n).zip(a);
        (sums, rows.map(|(row, a_i)| a_i * dot(row, a)).sum())
    }

    /// Bound after one more row, of which this is [`Apart::seen`]; beyond `enough`, a part of it may be the answer.
    pub(super) fn bound_with(&self, (sums, apa): &(Vec<f64>, f64), enough: f64) -> f64 {
        self.bound(sums, apa.max(0.0) + self.variance, enough)
    }

    /// Signs of the differences of templates whose classes are least apart, and of chance.
    fn starts(&self, count: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
        let n = self.n;
        let mut pairs: Vec<(usize, usize)> = self.pairs.iter().copied().filter(|(i, j)| i > j).collect();
        pairs.sort_by(|a, b| self.distance(*a).total_cmp(&self.distance(*b)));
        let template = |i: usize| &self.residual[i * n..(i + 1) * n];
        let sign = |v: f64| if v < 0.0 { -1.0 } else { 1.0 };
        let differences = pairs.iter().take(count.max(1) / 2).map(|&(i, j)| {
            let (a, b) = (template(i), template(j));
            a.iter().zip(b).map(|(a, b)| sign(a - b)).collect()
        });
        let mut starts: Vec<Vec<f64>> = differences.collect();
        while starts.len() < count.max(1) {
            starts.push(random_signs(n, rng));
        }
        starts
    }
}

/// The bound, with its sign turned, while levels of one more row change.
struct Separation<'a> {
    apart: &'a Apart,
    sums: Vec<f64>,
    changed: Vec<f64>,
    /// P a
    u: Vec<f64>,
    apa: f64,
}

impl<'a> Separation<'a> {
    fn new(apart: &'a Apart) -> Self {
        let count = apart.labels.len();
        Self {
            apart,
            sums: vec![0.0; count],
            changed: vec![0.0; count],
            u: vec![0.0; apart.n],
            apa: 0.0,
        }
    }

    fn apa_after(&self, i: usize, delta: f64) -> f64 {
        self.apa + delta * (2.0 * self.u[i] + delta * self.apart.p[i * (self.apart.n + 1)])
    }
}

impl Worth for Separation<'_> {
    fn start(&mut self, row: &[f64]) {
        adjoint(&self.apart.p, row, &mut self.u);
        self.apa = dot(row, &self.u);
        let templates = self.apart.residual.chunks_exact(self.apart.n);
        self.sums
            .iter_mut()
            .zip(templates)
            .for_each(|(sum, t)| *sum = dot(t, row));
    }

    fn worth(&self) -> f64 {
        -self
            .apart
            .bound(&self.sums, self.apa.max(0.0) + self.apart.variance, f64::INFINITY)
    }

    fn after(&mut self, i: usize, delta: f64) -> f64 {
        let n = self.apart.n;
        for ((changed, sum), t) in self
            .changed
            .iter_mut()
            .zip(&self.sums)
            .zip(self.apart.residual.chunks_exact(n))
        {
            *changed = sum + delta * t[i];
        }
        let s = self.apa_after(i, delta).max(0.0) + self.apart.variance;
        -self.apart.bound(&self.changed, s, f64::INFINITY)
    }

    fn change(&mut self, i: usize, delta: f64) {
        let n = self.apart.n;
        self.apa = self.apa_after(i, delta);
        for (sum, t) in self.sums.iter_mut().zip(self.apart.residual.chunks_exact(n)) {
            *sum += delta * t[i];
        }
        axpy(delta, &self.apart.p[i * n..(i + 1) * n], &mut self.u);
    }
}

#[cfg(test)]
mod tests {
    use super::super::expected::Expected;
    use super::*;

    fn component(label: usize, mean: [f64; 4]) -> Component {
        Component {
            label: Some(label),
            weight: 1.0,
            mean: mean.to_vec(),
            factors: vec![vec![0.3, 0.1, 0.0, 0.2]],
            noise_variance: 0.5,
        }
    }

    /// Two templates that differ in one taxel: a row that is blind to the difference says nothing, and the designer
    /// finds one that is not.
    #[test]
    fn the_row_that_tells_two_classes_apart_is_found() {
        let classes = [component(1, [1.0, 1.0, 0.0, 0.0]), component(2, [0.0, 0.0, 1.0, 1.0])];
        let expected = Expected::smooth([2, 2], 0.5).unwrap();
        let task = RowTask {
            classes: &classes,
            ..RowTask::new(1, &expected)
        };
        let rows = Classes::default().design(&task).unwrap();
        let row = rows.row(0);
        let alike = |i: usize, j: usize| row[i] * row[j] > 0.0;
        assert!(alike(0, 1) && alike(2, 3) && !alike(0, 2), "{row:?}");
        let one = [component(1, [1.0; 4])];
        let refused = Classes::default().design(&RowTask { classes: &one, ..task });
        assert_eq!(refused, Err(RowError::Classes { labels: 1 }));
    }

    /// Row by row against the metric's definition.
    #[test]
    fn products_are_those_of_the_definition() {
        use nalgebra::{DMatrix, DVector};
        let classes = [
            component(1, [1.0, 0.3, 0.2, 0.0]),
            component(2, [0.0, 0.5, 1.0, 0.7]),
            component(3, [0.1, 0.9, 0.0, 0.4]),
        ];
        let mut apart = Apart::new(&classes, [2, 2]).unwrap();
        let rows = [[1.0, -1.0, 1.0, 1.0], [-1.0, -1.0, 1.0, 1.0], [1.0, 1.0, 1.0, -1.0]];
        for row in &rows {
            apart.observe(row);
        }
        let a = DMatrix::from_fn(3, 4, |i, j| rows[i][j]);
        let f = DVector::from_column_slice(&classes[0].factors[0]);
        let g = &a * &f * f.transpose() * a.transpose() + DMatrix::identity(3, 3) * 0.5;
        let inverse = g.try_inverse().unwrap();
        for i in 0..3 {
            for j in 0..3 {
                let t = |k: usize| &a * DVector::from_column_slice(&classes[k].mean);
                let expected = (t(i).transpose() * &inverse * t(j))[(0, 0)];
                assert!((apart.products[i * 3 + j] - expected).abs() < 1e-12);
            }
        }
    }
}
