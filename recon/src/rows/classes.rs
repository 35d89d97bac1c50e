//! Rows that distinguish classes, and the choice among given rows.

use crate::classify::Component;
use crate::kernels::{adjoint, axpy, dot};
use crate::matrix::{Matrix, MatrixView};
use crate::posterior::GaussianPosterior;
use crate::rows::expected::{Expected, Headroom};
use crate::rows::greedy::random_signs;
use crate::rows::greedy::{Worth, best_row};
use crate::rows::kinds::{Trace, worth};
use crate::rows::other_grid;
use crate::rows::{DesignRows, RowTask};
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;

/// Rows of ±1 that distinguish Gaussian classes of unknown amplitude, designed one after the other.
///
/// With the classes' mean covariance Σ and noise ν, templates t are compared in the metric of the rows A: ⟨t, u⟩ =
/// tᵀAᵀ(A Σ Aᵀ + ν I)⁻¹A u. If the amplitude is unknown, the distance of u from t is D = |t|² − max(⟨t, u⟩, 0)²/|u|².
/// The union bound of the errors is Σ Q(√D/2) ≤ ½ Σ exp(−D/8) over ordered pairs of different classes (J. G. Proakis,
/// *Digital Communications*, 4th ed., §5.2). Every row is the one that reduces this sum most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Classes;

/// Rows that the search for one starts from, and most sweeps over all taxels for each of them.
const SEARCH: (usize, usize) = (24, 3);

impl DesignRows for Classes {
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, Refusal> {
        task.check_without_kinds("classes", 1 << 16, "so many rows are of no use")?;
        let n = task.expected.taxels();
        let mut apart = Apart::new(task.classes, task.expected.shape())?;
        let headroom = Headroom::of(task);
        let mut rng = ChaCha8Rng::seed_from_u64(task.seed);
        let mut rows = Matrix::zeros(task.rows, n);
        for r in 0..task.rows {
            let starts = apart.starts(SEARCH.0, &mut rng);
            let row = best_row(task, &headroom, starts, SEARCH.1, || Separation::new(&apart))?;
            apart.observe(&row);
            rows.row_mut(r).copy_from_slice(&row);
            (task.row_found)();
        }
        Ok(rows)
    }
}

/// How far classes are apart after some rows.
#[derive(Debug, Clone)]
pub(super) struct Apart {
    n: usize,
    labels: Vec<Option<usize>>,
    posterior: GaussianPosterior,
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
    pub(super) fn new(classes: &[Component], shape: [usize; 2]) -> Result<Self, Refusal> {
        let mut labels: Vec<Option<usize>> = classes.iter().map(|c| c.label).collect();
        labels.sort_unstable();
        labels.dedup();
        if labels.len() < 2 {
            return Err(Refusal::new(format!(
                "`classes` has {labels} classes; rows that tell classes apart need at least 2",
                labels = labels.len()
            )));
        }
        let n = shape[0] * shape[1];
        if let Some(other) = classes.iter().find(|c| c.mean.len() != n) {
            return Err(other_grid(other.mean.len(), shape[0], shape[1]));
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
            posterior: GaussianPosterior::new(p, n),
            variance: share * classes.iter().map(|c| c.noise_variance).sum::<f64>(),
            residual: classes.iter().flat_map(|c| c.mean.iter().copied()).collect(),
            products: vec![0.0; classes.len() * classes.len()],
        })
    }

    /// Measures the row `a`.
    pub(super) fn observe(&mut self, a: &[f64]) -> Observed {
        let (n, count) = (self.n, self.labels.len());
        let s = self.posterior.project(a) + self.variance;
        let u = self.posterior.product.clone();
        let sums: Vec<f64> = self.residual.chunks_exact(n).map(|t| dot(t, a)).collect();
        for (k, row) in self.products.chunks_exact_mut(count).enumerate() {
            axpy(sums[k] / s, &sums, row);
        }
        for (t, sum) in self.residual.chunks_exact_mut(n).zip(&sums) {
            axpy(-sum / s, &u, t);
        }
        self.posterior.lower(s);
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
        let rows = self.posterior.covariance.chunks_exact(self.n).zip(a);
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
        Self { apart, sums: vec![0.0; count], changed: vec![0.0; count], u: vec![0.0; apart.n], apa: 0.0 }
    }

    fn apa_after(&self, i: usize, delta: f64) -> f64 {
        self.apa + delta * (2.0 * self.u[i] + delta * self.apart.posterior.covariance[i * (self.apart.n + 1)])
    }
}

impl Worth for Separation<'_> {
    fn start(&mut self, row: &[f64]) {
        adjoint(&self.apart.posterior.covariance, row, &mut self.u);
        self.apa = dot(row, &self.u);
        let templates = self.apart.residual.chunks_exact(self.apart.n);
        self.sums.iter_mut().zip(templates).for_each(|(sum, t)| *sum = dot(t, row));
    }

    fn worth(&self) -> f64 {
        -self.apart.bound(&self.sums, self.apa.max(0.0) + self.apart.variance, f64::INFINITY)
    }

    fn after(&mut self, i: usize, delta: f64) -> f64 {
        let n = self.apart.n;
        for ((changed, sum), t) in self.changed.iter_mut().zip(&self.sums).zip(self.apart.residual.chunks_exact(n)) {
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
        axpy(delta, &self.apart.posterior.covariance[i * n..(i + 1) * n], &mut self.u);
    }
}

/// Selects `task.rows` rows of `candidates` (C × N), and returns their numbers in order of selection. Each is the row
/// that reduces the trace of the posterior covariance most, or with [`RowTask::kinds`] the largest share of a kind's
/// trace; see `greedy` in [`super::DESIGNERS`]. No row is selected twice.
///
/// Costs O(C N) for each row and kind, because P a is kept for every candidate.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::rows::{Expected, RowTask, choose_for_images};
///
/// let smooth = Expected::smooth([2, 2], 2.0)?;
/// let candidates = Matrix::from_rows(3, 4, vec![
///     1.0, -1.0, -1.0, 1.0, //
///     1.0, 1.0, 1.0, 1.0, //
///     1.0, 1.0, -1.0, -1.0,
/// ])?;
/// let chosen = choose_for_images(&RowTask::new(2, &smooth), candidates.view())?;
/// assert_eq!(chosen[0], 1, "the sum says most about a smooth image");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Refusal`] if the task is out of range, the candidates have another number of taxels, or there are too few.
pub fn choose_for_images(task: &RowTask<'_>, candidates: MatrixView<'_>) -> Result<Vec<usize>, Refusal> {
    let n = check(task, candidates)?;
    let rows: Vec<&[f64]> = candidates.values().chunks_exact(n).collect();
    let mut kinds: Vec<Candidates> = task.gaussians().iter().map(|of| Candidates::new(task, of, &rows)).collect();
    let mut chosen = Vec::with_capacity(task.rows);
    let mut left = vec![true; rows.len()];
    while chosen.len() < task.rows {
        let worth = |k: usize| worth(kinds.iter().map(|kind| (kind.trace, kind.fall(k))));
        let each = (0..rows.len()).filter(|k| left[*k]).map(|k| (worth(k), k));
        let Some((_, best)) = each.reduce(|a, b| if b.0 > a.0 { b } else { a }) else {
            break;
        };
        chosen.push(best);
        left[best] = false;
        kinds.iter_mut().for_each(|kind| kind.observe(best, &rows));
    }
    Ok(chosen)
}

/// What every candidate row says of one Gaussian, after the rows that were chosen.
struct Candidates {
    /// P a of every candidate, C × N.
    products: Vec<f64>,
    /// |P a|² and aᵀP a of every candidate.
    parts: Vec<(f64, f64)>,
    trace: Trace,
    /// σ².
    variance: f64,
    /// P a of the row that was chosen last.
    u: Vec<f64>,
}

impl Candidates {
    /// Before any measurement of the images `of`.
    fn new(task: &RowTask<'_>, of: &Expected, rows: &[&[f64]]) -> Self {
        let n = of.taxels();
        let covariance = of.covariance();
        let mut products = vec![0.0; rows.len() * n];
        for (product, row) in products.chunks_exact_mut(n).zip(rows) {
            adjoint(covariance.view().values(), row, product);
        }
        let parts = products.chunks_exact(n).zip(rows).map(|(u, a)| (dot(u, u), dot(u, a))).collect();
        Self { products, parts, trace: Trace::new(of.variance()), variance: task.variance(of), u: vec![0.0; n] }
    }

    /// How much candidate `k` lowers the trace.
    fn fall(&self, k: usize) -> f64 {
        self.parts[k].0 / (self.parts[k].1.max(0.0) + self.variance)
    }

    /// Measures candidate `k`.
    fn observe(&mut self, k: usize, rows: &[&[f64]]) {
        let n = self.u.len();
        self.trace.lower(self.trace.left() - self.fall(k));
        self.u.copy_from_slice(&self.products[k * n..(k + 1) * n]);
        let d = self.parts[k].1.max(0.0) + self.variance;
        for ((product, row), parts) in self.products.chunks_exact_mut(n).zip(rows).zip(&mut self.parts) {
            axpy(-dot(row, &self.u) / d, &self.u, product);
            *parts = (dot(product, product), dot(product, row));
        }
    }
}

/// As [`choose_for_images`], but each row is the one that reduces the bound of the errors between `task.classes` most;
/// see `classes` in [`super::DESIGNERS`].
///
/// # Errors
/// As [`choose_for_images`], and [`Refusal`] for fewer than two classes.
pub fn choose_for_classes(task: &RowTask<'_>, candidates: MatrixView<'_>) -> Result<Vec<usize>, Refusal> {
    let n = check(task, candidates)?;
    task.check_without_kinds("the choice for classes", usize::MAX, "")?;
    let mut apart = Apart::new(task.classes, task.expected.shape())?;
    let rows: Vec<&[f64]> = candidates.values().chunks_exact(n).collect();
    // of every candidate, its sums over what is not explained of the templates, and aᵀP a
    let mut seen: Vec<(Vec<f64>, f64)> = rows.iter().map(|row| apart.seen(row)).collect();
    let mut left = vec![true; rows.len()];
    let mut chosen = Vec::with_capacity(task.rows);
    while chosen.len() < task.rows {
        let mut least: Option<(f64, usize)> = None;
        for k in (0..rows.len()).filter(|k| left[*k]) {
            let enough = least.map_or(f64::INFINITY, |(bound, _)| bound);
            let bound = apart.bound_with(&seen[k], enough);
            if least.is_none() || bound < enough {
                least = Some((bound, k));
            }
        }
        let Some((_, best)) = least else { break };
        chosen.push(best);
        left[best] = false;
        let step = apart.observe(rows[best]);
        for ((sums, apa), row) in seen.iter_mut().zip(&rows) {
            let share = dot(row, &step.u) / step.s;
            *apa -= share * share * step.s;
            axpy(-share, &step.sums, sums);
        }
    }
    Ok(chosen)
}

/// Number of taxels.
fn check(task: &RowTask<'_>, candidates: MatrixView<'_>) -> Result<usize, Refusal> {
    let [rows, cols] = task.expected.shape();
    if candidates.ncols() != rows * cols {
        return Err(other_grid(candidates.ncols(), rows, cols));
    }
    task.check(candidates.nrows(), "there are no more candidates")?;
    Ok(rows * cols)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;
    use crate::rows::greedy::posterior_trace;
    use crate::rows::simple::Random;

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
        let task = RowTask { classes: &classes, ..RowTask::new(1, &expected) };
        let rows = Classes.design(&task).unwrap();
        let row = rows.row(0);
        let alike = |i: usize, j: usize| row[i] * row[j] > 0.0;
        assert!(alike(0, 1) && alike(2, 3) && !alike(0, 2), "{row:?}");
        let one = [component(1, [1.0; 4])];
        let refused = Classes.design(&RowTask { classes: &one, ..task });
        assert!(says(&refused, "`classes` has 1 classes"));
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

    /// Against the rule as it is written: every candidate measured in turn on top of those chosen.
    #[test]
    fn the_choice_lowers_the_trace_most() {
        let expected = Expected::smooth([4, 4], 1.2).unwrap();
        let candidates = Random.design(&RowTask::new(60, &expected)).unwrap();
        let task = RowTask::new(5, &expected);
        let chosen = choose_for_images(&task, candidates.view()).unwrap();
        let trace = |rows: &[usize]| {
            let mut picked = Matrix::zeros(rows.len(), 16);
            rows.iter().enumerate().for_each(|(r, &k)| picked.row_mut(r).copy_from_slice(candidates.row(k)));
            posterior_trace(&task, &picked).unwrap()
        };
        for m in 1..=5 {
            let best = trace(&chosen[..m]);
            for k in (0..60).filter(|k| !chosen[..m - 1].contains(k)) {
                let mut other = chosen[..m - 1].to_vec();
                other.push(k);
                assert!(trace(&other) >= best - 1e-12, "row {m}: {k} is better than {}", chosen[m - 1]);
            }
        }
        let refused = choose_for_images(&RowTask::new(61, &expected), candidates.view());
        assert!(says(&refused, "outside [1, 60]"), "{refused:?}");
    }
    /// The same for classes: what is kept for every candidate is what a look at it afresh says.
    #[test]
    fn the_choice_lowers_the_bound_most() {
        let expected = Expected::smooth([4, 4], 1.2).unwrap();
        let candidates = Random.design(&RowTask::new(60, &expected)).unwrap();
        let classes: Vec<Component> = (0..4)
            .map(|label| Component {
                label: Some(label),
                weight: 1.0,
                mean: candidates.row(label).iter().map(|v| 0.5 * v + 1.0).collect(),
                factors: vec![candidates.row(50 + label).iter().map(|v| 0.2 * v).collect()],
                noise_variance: 3.0,
            })
            .collect();
        let task = RowTask { classes: &classes, ..RowTask::new(5, &expected) };
        let chosen = choose_for_classes(&task, candidates.view()).unwrap();
        let mut apart = Apart::new(&classes, [4, 4]).unwrap();
        for (m, &best) in chosen.iter().enumerate() {
            let bound = |k: usize| apart.bound_with(&apart.seen(candidates.row(k)), f64::INFINITY);
            for k in (0..60).filter(|k| !chosen[..m].contains(k)) {
                assert!(bound(k) >= bound(best) * (1.0 - 1e-9), "row {m}: {k} is better than {best}");
            }
            apart.observe(candidates.row(best));
        }
    }
}
