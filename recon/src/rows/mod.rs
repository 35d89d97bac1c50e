//! Designs rows of the sensing matrix for expected images, in place of random rows.
//!
//! A [`RowTask`] states how many rows are needed, with which levels, and for which images. A designer in [`DESIGNERS`]
//! computes the sensing matrix. [`choose_for_images`] and [`choose_for_classes`] select among given rows, such as those
//! with which a press was recorded. A designer has a file here and a line in [`DESIGNERS`]; [`conformance`] runs on all
//! of them.
//!
//! ```
//! use spts_recon::rows::{DESIGNERS, Expected, RowTask, posterior_trace};
//!
//! // eight measurements of a sheet of 6 × 6 taxels on which contacts are about two taxels wide
//! let expected = Expected::smooth([6, 6], 2.0)?;
//! let task = RowTask::new(8, &expected);
//! let build = |name: &str| DESIGNERS.iter().find(|d| d.name == name).unwrap().build;
//! let designed = build("greedy")().design(&task)?;
//! let random = build("random")().design(&task)?;
//! let left = |rows| posterior_trace(&task, rows).unwrap();
//! assert!(left(&designed) < 0.7 * left(&random));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod classes;
mod conformance;
mod expected;
mod greedy;
mod kinds;
mod simple;

pub use classes::{Classes, choose_for_classes, choose_for_images};
pub use conformance::conformance;
pub use expected::{Expected, Tolerances, largest_sum};
pub use greedy::{Greedy, posterior_trace};
pub use simple::{CosineSigns, Random, Separable};

use crate::checks::within;
use crate::classify::Component;
use crate::matrix::{Matrix, MatrixView};
use RowNeeds::{Moments, Nothing};
use spts_input::Refusal;

/// What a designer of rows is asked for: how many rows, for which images, with which noise and limit.
#[derive(Clone, Copy)]
pub struct RowTask<'a> {
    /// Number of rows M: the period of a repeated pattern, at least 1.
    pub rows: usize,
    /// Expected images.
    pub expected: &'a Expected,
    /// Kinds of these images, each with second moments of its own. With any, `greedy` and [`choose_for_images`] take
    /// the row that most lowers the largest share of a kind's variance that is left, made smooth: Σₖ (tr Pₖ / tr Cₖ)⁴
    /// after the row, with the prior and posterior covariances Cₖ and Pₖ. Empty: the row that most lowers tr P of
    /// `expected`. The limit of the sums is that of `expected`. All other designers refuse kinds.
    pub kinds: &'a [Expected],
    /// Gaussian classes, for designers that distinguish classes; empty for all others.
    pub classes: &'a [Component],
    /// Standard deviation of a measurement's noise relative to the root mean square of a random row's sum over the
    /// images or the kind, in [1e-6, 1e3].
    pub noise: f64,
    /// Headroom: largest root mean square of a row's sum over the expected images, relative to a random row's, in
    /// [0.05, 1000]. `None` for no limit.
    pub largest_sum: Option<f64>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Called after each row that is found, for a progress bar.
    pub row_found: &'a (dyn Fn() + Sync),
}

/// A way to choose rows of the sensing matrix for images that are expected.
///
/// ```
/// use spts_recon::rows::{Expected, RowTask, designer, posterior_trace};
///
/// let smooth = Expected::smooth([6, 6], 1.5)?;
/// let task = RowTask::new(8, &smooth);
/// let design = |name| (designer(name).expect("in the table").build)().design(&task);
/// let (designed, random) = (design("greedy")?, design("random")?);
/// assert!(posterior_trace(&task, &designed)? < posterior_trace(&task, &random)?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub trait DesignRows: Send + Sync {
    /// Designs an M × N sensing matrix with every level in [−1, 1]. The most useful rows come first, so that the first
    /// few are a design of their own. Equal tasks have equal results for any number of threads.
    ///
    /// # Errors
    /// [`Refusal`] if the task is out of range, or no row respects its headroom.
    fn design(&self, task: &RowTask<'_>) -> Result<Matrix, Refusal>;
}

impl<'a> RowTask<'a> {
    /// Default noise of a measurement: contact noise, and what a prior does not describe.
    pub const NOISE: f64 = 0.15;

    /// A task for `rows` rows and the images `expected`, without a limit of the sums.
    pub fn new(rows: usize, expected: &'a Expected) -> Self {
        Self {
            rows,
            expected,
            kinds: &[],
            classes: &[],
            noise: Self::NOISE,
            largest_sum: None,
            seed: 1,
            row_found: &|| (),
        }
    }

    /// Checks all numbers; at most `most` rows, because of `reason`.
    pub(super) fn check(&self, most: usize, reason: &'static str) -> Result<(), Refusal> {
        within("noise", self.noise, 1e-6, 1e3)?;
        if let Some(limit) = self.largest_sum {
            within("largest_sum", limit, 0.05, 1e3)?;
        }
        if self.rows == 0 || self.rows > most {
            return Err(too_many_rows(self.rows, most, reason));
        }
        let [rows, cols] = self.expected.shape();
        let other = self.kinds.iter().find(|kind| kind.shape() != [rows, cols]);
        other.map_or(Ok(()), |kind| Err(other_grid(kind.taxels(), rows, cols).at("kinds")))
    }

    /// As [`Self::check`], for what knows no kinds, called `name`.
    pub(super) fn check_without_kinds(&self, name: &str, most: usize, reason: &'static str) -> Result<(), Refusal> {
        if !self.kinds.is_empty() {
            return Err(Refusal::new(format!(
                "`kinds` has {}; valid for {name}: none; only `greedy` and the choice for images weigh kinds",
                self.kinds.len()
            )));
        }
        self.check(most, reason)
    }

    /// The Gaussians whose variance rows are to lower: the kinds, or the expected images alone.
    pub(super) fn gaussians(&self) -> &'a [Expected] {
        if self.kinds.is_empty() { std::slice::from_ref(self.expected) } else { self.kinds }
    }

    /// σ²: variance of a measurement's noise for the images `of`, in their unit.
    pub(super) fn variance(&self, of: &Expected) -> f64 {
        self.noise * self.noise * of.random_square()
    }

    /// The largest mean square of a row's sum, in the unit of the images.
    pub(super) fn largest_square(&self) -> Option<f64> {
        self.largest_sum.map(|limit| limit * limit * self.expected.random_square())
    }
}

/// What a designer needs to know about the images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowNeeds {
    /// Only the grid.
    Nothing,
    /// Their second moments.
    Moments,
    /// Classes to distinguish.
    Classes,
}

/// A designer of rows in the table [`DESIGNERS`]: its names, what it needs to know, and how it is built.
#[derive(Clone, Copy)]
pub struct Designer {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in figures and printed tables.
    pub label: &'static str,
    /// What it needs to know about the images.
    pub needs: RowNeeds,
    /// Description.
    pub about: &'static str,
    /// Builds the designer.
    pub build: fn() -> Box<dyn DesignRows>,
}

const fn line(
    name: &'static str,
    label: &'static str,
    needs: RowNeeds,
    about: &'static str,
    build: fn() -> Box<dyn DesignRows>,
) -> Designer {
    Designer { name, label, needs, about, build }
}

/// Every designer: name, label, needs, description, builder.
pub const DESIGNERS: &[Designer] = &[
    line("random", "random", Nothing, "independent random signs", || Box::new(Random)),
    line("cosine_signs", "cosine signs", Nothing, "signs of two-dimensional cosines, low frequencies first", || {
        Box::new(CosineSigns)
    }),
    line("greedy", "greedy", Moments, "row by row, the one that lowers the posterior variance most", || {
        Box::new(Greedy)
    }),
    line(
        "separable",
        "separable",
        Moments,
        "products of greedy rows along the two axes, for sheets of any size",
        || Box::new(Separable),
    ),
    line(
        "classes",
        "for classes",
        RowNeeds::Classes,
        "row by row, the one that lowers the bound of classification errors most",
        || Box::new(Classes),
    ),
];

/// The designer called `name` in [`DESIGNERS`]; `None` if there is none.
///
/// ```
/// use spts_recon::rows::{DESIGNERS, RowNeeds, designer};
///
/// assert_eq!(designer("cosine_signs").map(|d| d.needs), Some(RowNeeds::Nothing));
/// assert!(DESIGNERS.iter().all(|d| designer(d.name).is_some()));
/// ```
pub fn designer(name: &str) -> Option<&'static Designer> {
    DESIGNERS.iter().find(|d| d.name == name)
}

/// Orders `rows` (M × N) so that levels change least from one row to the next and from the last to the first. The cost
/// is the sum over taxels of `weights` times the squared change, because late cells and a settling amplifier cause
/// errors at changes. The order begins with row 0. It is built from nearest neighbours and improved by reversing
/// sections while this helps (G. A. Croes, Oper. Res. 6 (1958) 791).
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::rows::fewest_flips;
///
/// let rows = Matrix::from_rows(4, 2, vec![1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0])?;
/// let order = fewest_flips(rows.view(), &[1.0, 1.0]);
/// let flips = |a: usize, b: usize| rows.row(a).iter().zip(rows.row(b)).filter(|(a, b)| a != b).count();
/// assert!((0..4).all(|k| flips(order[k], order[(k + 1) % 4]) == 1));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Panics
/// If the number of weights differs from that of the taxels.
pub fn fewest_flips(rows: MatrixView<'_>, weights: &[f64]) -> Vec<usize> {
    let (m, n) = (rows.nrows(), rows.ncols());
    assert_eq!(weights.len(), n, "weights");
    let row = |r: usize| &rows.values()[r * n..(r + 1) * n];
    let distance = |a: usize, b: usize| {
        let pairs = row(a).iter().zip(row(b)).zip(weights);
        pairs.map(|((a, b), w)| w * (a - b) * (a - b)).sum::<f64>()
    };
    let table: Vec<f64> = (0..m * m).map(|k| distance(k / m, k % m)).collect();
    let between = |a: usize, b: usize| table[a * m + b];
    let mut order: Vec<usize> = Vec::with_capacity(m);
    let mut left: Vec<usize> = (0..m).collect();
    while !left.is_empty() {
        let next = match order.last() {
            None => 0,
            Some(&last) => {
                let each = (0..left.len()).map(|k| (between(last, left[k]), k));
                each.fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a }).1
            }
        };
        order.push(left.remove(next));
    }
    let mut gained = true;
    while gained {
        gained = false;
        for i in 1..m {
            for j in i + 1..m {
                let (before, after) = (order[i - 1], order[(j + 1) % m]);
                let now = between(before, order[i]) + between(order[j], after);
                let turned = between(before, order[j]) + between(order[i], after);
                if turned < now * (1.0 - 1e-12) {
                    order[i..=j].reverse();
                    gained = true;
                }
            }
        }
    }
    order
}

/// Images that do not fit the grid.
fn other_grid(pixels: usize, rows: usize, cols: usize) -> Refusal {
    Refusal::new(format!("images of {pixels} taxels on a grid of {rows} × {cols}"))
}

/// More rows than there are.
fn too_many_rows(rows: usize, most: usize, reason: &str) -> Refusal {
    Refusal::new(format!("`rows` = {rows} is outside [1, {most}]: {reason}"))
}

/// No row that respects the headroom.
fn headroom_unreachable(limit: f64, least: f64) -> Refusal {
    Refusal::new(format!(
        "no row of levels ±1 has a sum below `largest_sum` = {limit:.3} of a random row's; the smallest has {least:.3}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_designer_conforms() {
        for designer in DESIGNERS {
            conformance(designer);
        }
    }

    /// Rows that differ in one taxel each make a loop of four flips; the taxel without weight does not count.
    #[test]
    fn a_loop_of_single_flips_is_found() {
        let rows = [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, -1.0]];
        let matrix = Matrix::from_rows(4, 3, rows.concat()).unwrap();
        let order = fewest_flips(matrix.view(), &[1.0, 1.0, 0.0]);
        assert_eq!(order[0], 0);
        let flips: f64 = (0..4)
            .map(|k| {
                let (a, b) = (rows[order[k]], rows[order[(k + 1) % 4]]);
                (0..2).map(|i| (a[i] - b[i]).abs() / 2.0).sum::<f64>()
            })
            .sum();
        assert!((flips - 4.0).abs() < 1e-12, "{order:?}: {flips}");
        assert_eq!(fewest_flips(Matrix::from_rows(1, 3, vec![1.0; 3]).unwrap().view(), &[1.0; 3]), [0]);
    }
}
