//! Classification of objects: from an image ([`Src`]), or from measurements, one by one
//! ([`EvidenceClassifier`]).

mod clusters;
mod evidence;
mod filter;
mod templates;
#[cfg(test)]
mod tests;

pub use clusters::{ClusterModel, Clusters};
pub use evidence::{Component, Decision, EvidenceClassifier, ImageEstimator, Posterior};
pub use filter::{Evidence, Preparation};
pub use templates::TemplateModel;

use crate::matrix::Matrix;
use crate::problem::{Problem, Recover as _, Solution, Workspace};
use crate::recover::ReferenceOmp;
use spts_input::Refusal;

/// Labelled images: column `k` of `images` belongs to class `labels[k]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Library {
    images: Matrix,
    labels: Vec<usize>,
}

impl Library {
    /// A library of `images` (N × number of images). Images that are zero everywhere are dropped, because they can
    /// represent nothing.
    ///
    /// # Errors
    /// [`Refusal`] if the number of labels differs from that of the images, or no image is left.
    pub fn new(images: &Matrix, labels: &[usize]) -> Result<Self, Refusal> {
        if images.ncols() != labels.len() {
            return Err(Refusal::new(format!(
                "library has {columns} images but {labels} labels",
                columns = images.ncols(),
                labels = labels.len()
            )));
        }
        let columns: Vec<(Vec<f64>, usize)> = labels
            .iter()
            .enumerate()
            .map(|(k, &label)| (images.column(k), label))
            .filter(|(column, _)| column.iter().any(|v| *v != 0.0))
            .collect();
        if columns.is_empty() {
            return Err(Refusal::new("library holds no image that is different from zero"));
        }
        let slices: Vec<&[f64]> = columns.iter().map(|(c, _)| c.as_slice()).collect();
        Ok(Self {
            images: Matrix::from_column_slices(images.nrows(), &slices),
            labels: columns.iter().map(|(_, label)| *label).collect(),
        })
    }

    /// Images, N × number of images.
    pub fn images(&self) -> &Matrix {
        &self.images
    }

    /// Class of every image.
    pub fn labels(&self) -> &[usize] {
        &self.labels
    }
}

/// Represents an image as a sparse combination of library images, and returns the class whose part of the combination
/// leaves the smallest residual ‖x − L_c α_c‖₂.
///
/// Source: J. Wright et al., "Robust face recognition via sparse representation", IEEE TPAMI 31 (2009). As in the
/// published system, the combination is found by orthogonal matching pursuit with `n_nonzero_coefs` unnormalised
/// images.
///
/// ```
/// use spts_recon::classify::{Library, Src};
/// use spts_recon::{Matrix, Workspace};
///
/// // one image of each of two classes, 4 pixels each
/// let images = Matrix::from_columns(4, 2, &[1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 1.0])?;
/// let classifier = Src::new(Library::new(&images, &[7, 9])?, 2);
/// let mut work = Workspace::default();
/// assert_eq!(classifier.classify(&[0.1, 0.0, 0.9, 1.1], &mut work)?, Some(9));
/// assert_eq!(classifier.classify(&[0.0; 4], &mut work)?, None);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Src {
    library: Library,
    pursuit: ReferenceOmp,
    classes: Vec<usize>,
}

/// Scratch memory of a decision.
#[derive(Debug, Default)]
struct SrcScratch {
    solution: Solution,
    /// Library images of one class in the combination, with their coefficients.
    members: Vec<(usize, f64)>,
}

impl Src {
    /// Sparsity of the published classifier.
    pub const PUBLISHED_SPARSITY: usize = 10;

    /// A classifier that uses at most `n_nonzero_coefs` images of `library` in a combination, found as in the published
    /// code.
    pub fn new(library: Library, n_nonzero_coefs: usize) -> Self {
        let mut classes = library.labels.clone();
        classes.sort_unstable();
        classes.dedup();
        Self { library, pursuit: ReferenceOmp::new(n_nonzero_coefs), classes }
    }

    /// The labelled images.
    pub fn library(&self) -> &Library {
        &self.library
    }

    /// Class of `image`; `None` for an image that no library image correlates with (such as an empty one).
    ///
    /// # Errors
    /// [`Refusal`] if the size of the image differs from the library's, or a value is not finite.
    pub fn classify(&self, image: &[f64], work: &mut Workspace) -> Result<Option<usize>, Refusal> {
        let mut scratch = std::mem::take(work.scratch::<SrcScratch>());
        let problem = Problem::new(self.library.images.view(), image);
        let found = problem.and_then(|problem| self.pursuit.recover_into(&problem, work, &mut scratch.solution));
        let class = found.map(|()| self.best_class(image, &mut scratch));
        *work.scratch() = scratch;
        class
    }

    fn best_class(&self, image: &[f64], scratch: &mut SrcScratch) -> Option<usize> {
        let (solution, members) = (&scratch.solution, &mut scratch.members);
        let mut best = None;
        for &class in &self.classes {
            members.clear();
            let pairs = solution.support.iter().copied().zip(solution.coefficients.iter().copied());
            members.extend(pairs.filter(|(k, _)| self.library.labels[*k] == class));
            if members.is_empty() {
                continue;
            }
            let rows = (0..image.len()).map(|i| self.library.images.row(i));
            let square: f64 = image
                .iter()
                .zip(rows)
                .map(|(x, row)| (x - members.iter().map(|&(k, c)| c * row[k]).sum::<f64>()).powi(2))
                .sum();
            if best.is_none_or(|(_, least)| square < least) {
                best = Some((class, square));
            }
        }
        best.map(|(class, _)| class)
    }
}

/// Most frequent label, the lowest of equal ones; `None` without labels. Undecided entries (`None`) do not vote.
///
/// ```
/// use spts_recon::classify::majority;
///
/// assert_eq!(majority(&[Some(3), None, Some(5), Some(5)]), Some(5));
/// assert_eq!(majority(&[None, None]), None);
/// ```
pub fn majority(decisions: &[Option<usize>]) -> Option<usize> {
    let mut labels: Vec<usize> = decisions.iter().flatten().copied().collect();
    labels.sort_unstable();
    let mut best: Option<(usize, usize)> = None;
    for run in labels.chunk_by(|a, b| a == b) {
        if best.is_none_or(|(_, count)| run.len() > count) {
            best = Some((run[0], run.len()));
        }
    }
    best.map(|(label, _)| label)
}

/// Majority of every complete group of `size` consecutive decisions. The published script never clears its list of
/// decisions between groups; `cumulative` reproduces this, so that each vote counts all decisions so far.
pub fn vote_groups(decisions: &[Option<usize>], size: usize, cumulative: bool) -> Vec<Option<usize>> {
    (1..=decisions.len() / size.max(1))
        .map(|group| {
            let start = if cumulative { 0 } else { (group - 1) * size };
            majority(&decisions[start..group * size])
        })
        .collect()
}

/// Counts the share of correct decisions over several sequences of windows.
#[derive(Debug, Clone, Copy, Default)]
pub struct VoteScore {
    correct: f64,
    total: f64,
}

impl VoteScore {
    /// Counts `decisions` about an object of class `label`.
    pub fn add(&mut self, decisions: &[Option<usize>], label: usize) {
        for &decision in decisions {
            self.total += 1.0;
            if decision == Some(label) {
                self.correct += 1.0;
            }
        }
    }

    /// Adds the counts of `other`.
    pub fn merge(&mut self, other: Self) {
        self.correct += other.correct;
        self.total += other.total;
    }

    /// Share of correct decisions; `None` without decisions.
    pub fn share(&self) -> Option<f64> {
        (self.total > 0.0).then(|| self.correct / self.total)
    }
}
