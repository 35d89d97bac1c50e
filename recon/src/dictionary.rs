//! Dictionaries: selection of training images, K-SVD, and shifted atoms.

pub use crate::matrix::shifted;

use crate::checks::within;
use crate::kernels::{self, axpy, dot};
use crate::matrix::Matrix;
use crate::problem::{Solution, power_of_two};
use crate::recover::{CONVERGED, back_substitute};
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use spts_input::Refusal;

/// Which images a dictionary is learned from: those that are strong enough and not too much alike.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Selection {
    /// Threshold of the maximum above which an image is kept, in the unit of the images (V). Published: 0.25 V.
    pub min_peak: f64,
    /// An image is dropped if its cosine with an image already kept exceeds this. Published: 0.95.
    pub max_coherence: f64,
    /// Largest number of images that are kept.
    pub max_images: usize,
}

impl Default for Selection {
    fn default() -> Self {
        Self { min_peak: 0.25, max_coherence: 0.95, max_images: 1500 }
    }
}

/// Indices of the selected images, in order: strong enough, and not too similar to one already selected.
///
/// ```
/// use spts_recon::dictionary::{Selection, select};
///
/// let images = [vec![1.0, 0.0], vec![2.0, 0.1], vec![0.0, 1.0], vec![0.1, 0.1]];
/// // the second resembles the first, and the last is too weak
/// assert_eq!(select(&images, &Selection::default()), [0, 2]);
/// ```
pub fn select(images: &[Vec<f64>], selection: &Selection) -> Vec<usize> {
    let mut kept: Vec<usize> = Vec::new();
    let mut directions: Vec<Vec<f64>> = Vec::new();
    for (index, image) in images.iter().enumerate() {
        if kept.len() >= selection.max_images {
            break;
        }
        let peak = image.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(peak > selection.min_peak && length.is_finite()) {
            continue;
        }
        let direction: Vec<f64> = image.iter().map(|v| v / length).collect();
        let novel = directions.iter().all(|d| {
            let cosine: f64 = d.iter().zip(&direction).map(|(a, b)| a * b).sum();
            cosine <= selection.max_coherence
        });
        if novel {
            kept.push(index);
            directions.push(direction);
        }
    }
    kept
}

/// K-SVD alternates between sparse coding (a pursuit with `n_nonzero_coefs` atoms) and updates of single atoms. An
/// update is a rank-one fit to the error that the other atoms leave in the images that use the atom.
///
/// min ‖X − D A‖_F with ‖aᵢ‖₀ ≤ S and ‖dₖ‖₂ = 1. The atoms start from randomly drawn images. After each sweep, an atom
/// that no image uses, or that equals another up to sign, is replaced by the image with the largest error.
/// Source: M. Aharon, M. Elad, A. Bruckstein, IEEE Trans. Signal Process. 54 (2006) 4311; R. Rubinstein, M. Zibulevsky,
/// M. Elad, "Efficient implementation of the K-SVD algorithm using batch orthogonal matching pursuit", Technion
/// CS-2008-08 (2008), with one power step an atom as the rank-one fit.
///
/// ```
/// use rand::SeedableRng as _;
/// use spts_recon::dictionary::Ksvd;
///
/// // multiples of two images, which are the two atoms
/// let images: Vec<Vec<f64>> = (1..=10)
///     .flat_map(|k| [vec![f64::from(k), 0.0, 0.0], vec![0.0, 0.6 * f64::from(k), 0.8 * f64::from(k)]])
///     .collect();
/// let ksvd = Ksvd { n_components: 4, n_nonzero_coefs: 1, ..Ksvd::default() };
/// let dictionary = ksvd.learn(&images, &mut rand_chacha::ChaCha8Rng::seed_from_u64(1))?;
/// assert_eq!((dictionary.nrows(), dictionary.ncols()), (3, 4));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ksvd {
    /// Number of atoms, at least 1.
    pub n_components: usize,
    /// Target sparsity S, at least 1. The paper's text says 30, its code 20.
    pub n_nonzero_coefs: usize,
    /// Number of sweeps.
    pub n_iter: usize,
}

impl Default for Ksvd {
    fn default() -> Self {
        Self { n_components: 100, n_nonzero_coefs: 20, n_iter: 15 }
    }
}

impl Ksvd {
    /// Learns a dictionary from `images` of N values each. The result is N × number of atoms, with columns of length 1.
    ///
    /// With fewer images than atoms, the dictionary has one column for every image. The result depends only on the
    /// settings, the images and `rng`, not on the number of threads. Multiplying all images by a power of two does not
    /// change it.
    ///
    /// # Errors
    /// [`Refusal`] if there is no image, an image is not usable, or a setting is out of range.
    pub fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, Refusal> {
        at_least("n_components", self.n_components, 1)?;
        at_least("n_nonzero_coefs", self.n_nonzero_coefs, 1)?;
        let training = Training::new(images)?;
        let mut sweep = Sweep {
            atoms: training.draw(self.n_components, rng),
            errors: Matrix::zeros(0, 0),
            codes: Vec::new(),
            users: Users::default(),
            direction: vec![0.0; training.rows.ncols()],
        };
        for _ in 0..self.n_iter {
            sweep.code(&training, self.n_nonzero_coefs);
            for atom in 0..sweep.atoms.nrows() {
                sweep.power_step(atom);
            }
            let used: Vec<usize> = (0..sweep.atoms.nrows()).map(|k| sweep.users.of(k).len()).collect();
            replace_useless(&training, &sweep.errors, &used, &mut sweep.atoms);
        }
        Ok(transposed(&sweep.atoms))
    }
}

/// A dictionary, the codes of all images in it, and what they leave.
struct Sweep {
    /// Atoms as rows.
    atoms: Matrix,
    /// X − A D, images as rows.
    errors: Matrix,
    codes: Vec<Solution>,
    users: Users,
    /// Scratch memory for an atom.
    direction: Vec<f64>,
}

impl Sweep {
    /// Codes all images.
    ///
    /// # Errors
    /// [`Refusal`].
    fn code(&mut self, training: &Training, n_nonzero_coefs: usize) {
        let pursuit = GramPursuit::new(&self.atoms, n_nonzero_coefs);
        self.codes.resize_with(training.len(), Solution::default);
        let codes = self.codes.par_iter_mut().enumerate();
        codes.for_each_init(GramScratch::default, |scratch, (image, code)| {
            pursuit.run(training.rows.row(image), scratch, code);
        });
        self.errors = errors(training, &self.atoms, &self.codes);
        self.users.collect(&self.codes, self.atoms.nrows());
    }

    /// d ← E g/‖E g‖ and g ← Eᵀ d, where E = errors + d gᵀ over the atom's users.
    fn power_step(&mut self, atom: usize) {
        self.direction.fill(0.0);
        let mut square = 0.0;
        for &(image, slot) in self.users.of(atom) {
            let c = self.codes[image].coefficients[slot];
            axpy(c, self.errors.row(image), &mut self.direction);
            square += c * c;
        }
        axpy(square, self.atoms.row(atom), &mut self.direction);
        self.turn(atom);
    }

    /// Turns the atom into `direction` and takes g ← Eᵀ d out of the errors. One without direction, as without users,
    /// stays.
    fn turn(&mut self, atom: usize) {
        let old = self.atoms.row(atom).to_vec();
        if !set_unit(self.atoms.row_mut(atom), &self.direction) {
            return;
        }
        let new = self.atoms.row(atom);
        let kept = dot(&old, new);
        for &(image, slot) in self.users.of(atom) {
            let error = self.errors.row_mut(image);
            let coefficient = &mut self.codes[image].coefficients[slot];
            let g = dot(error, new) + *coefficient * kept;
            axpy(*coefficient, &old, error);
            axpy(-g, new, error);
            *coefficient = g;
        }
    }
}

/// Smallest share of an atom's square outside the span of the chosen ones.
const DEPENDENT_SQUARE: f64 = 1e-10;

/// Share of ‖y‖² below which the recurrence ‖r‖² ← ‖r‖² − p² holds rounding only.
const CONVERGED_SQUARE: f64 = 1e-14;

/// Scratch memory of a [`GramPursuit`].
#[derive(Debug, Default)]
struct GramScratch {
    weights: Vec<f64>,
    /// Aᵀ r: before the pursuit Aᵀ y.
    correlation: Vec<f64>,
    /// vᵢ, one after the other.
    images: Vec<f64>,
    /// Columns of R, one after the other; column n has n + 1 entries.
    upper: Vec<f64>,
    projections: Vec<f64>,
}

/// Orthogonal matching pursuit for many images with the same atoms, whose Gram matrix G = Aᵀ A it looks at instead of
/// A. It selects atoms like [`Omp`](crate::recover::Omp).
///
/// With the directions qᵢ of the chosen atoms, vᵢ = Aᵀ qᵢ follows from the row g of G that belongs to the new atom k,
/// vₙ = (g − Σᵢ vᵢₖ vᵢ) / d with d² = ‖aₖ‖² − Σᵢ vᵢₖ², and the correlations from vₙ: a step costs O(n·K). (The source
/// updates the correlations from the coefficients instead, Aᵀ r = Aᵀ y − G_S α, to the same effect.) d² is a
/// difference, exact to a few 1e-16 of ‖a‖²: atoms with less than 1e-10 of their square outside the span of the chosen
/// ones are passed over, and a pursuit ends when ‖r‖² is below 1e-14 of ‖y‖².
/// Source: R. Rubinstein, M. Zibulevsky, M. Elad, "Efficient implementation of the K-SVD algorithm using batch
/// orthogonal matching pursuit", Technion CS-2008-08 (2008).
struct GramPursuit {
    /// A, pixels × K.
    a: Matrix,
    /// G, K × K.
    gram: Matrix,
    /// 1/‖aₖ‖ of every atom.
    weights: Vec<f64>,
    /// Largest number of atoms.
    limit: usize,
}

impl GramPursuit {
    /// A pursuit with `atoms`, one a row, of which it chooses at most `n_nonzero_coefs`. Costs O(pixels·K²).
    fn new(atoms: &Matrix, n_nonzero_coefs: usize) -> Self {
        let (k, pixels) = (atoms.nrows(), atoms.ncols());
        let (a, mut gram) = (transposed(atoms), Matrix::zeros(k, k));
        for c in 0..k {
            kernels::adjoint(a.view().values(), atoms.row(c), gram.row_mut(c));
        }
        let (mut squares, mut weights) = (vec![0.0; k], vec![0.0; k]);
        kernels::column_squares(a.view().values(), &vec![1.0; pixels], &mut squares);
        kernels::inverse_roots(&squares, &mut weights);
        Self { a, gram, weights, limit: n_nonzero_coefs.min(pixels).min(k) }
    }

    /// Chooses the atoms of the image `y` and writes their coefficients.
    fn run(&self, y: &[f64], scratch: &mut GramScratch, solution: &mut Solution) {
        let k = self.weights.len();
        scratch.correlation.resize(k, 0.0);
        kernels::adjoint(self.a.view().values(), y, &mut scratch.correlation);
        scratch.weights.clear();
        scratch.weights.extend_from_slice(&self.weights);
        scratch.images.resize(self.limit * k, 0.0);
        scratch.upper.clear();
        scratch.projections.clear();
        let (y_square, support) = (dot(y, y), &mut solution.support);
        let mut residual_square = y_square;
        support.clear();
        while support.len() < self.limit && residual_square > CONVERGED_SQUARE * y_square {
            let Some((atom, score)) = kernels::best_magnitude(&scratch.correlation, &scratch.weights) else {
                break;
            };
            if score <= CONVERGED * y_square.sqrt() {
                break;
            }
            // chosen, or in the span of the chosen ones: not again
            scratch.weights[atom] = 0.0;
            if let Some(projection) = self.push(atom, scratch, support.len()) {
                residual_square -= projection * projection;
                support.push(atom);
            }
        }
        back_substitute(&scratch.upper, &scratch.projections, &mut solution.coefficients);
    }

    /// Appends `atom` as column `n` and returns the projection of `y` on its direction; the correlations follow when
    /// there are steps to come. `None`, and nothing is changed, when it lies in the span of the others.
    fn push(&self, atom: usize, scratch: &mut GramScratch, n: usize) -> Option<f64> {
        let (k, start) = (self.weights.len(), scratch.upper.len());
        let g = self.gram.row(atom);
        let (done, rest) = scratch.images.split_at_mut(n * k);
        scratch.upper.extend(done.chunks_exact(k).map(|v| v[atom]));
        let overlaps = &scratch.upper[start..];
        let square = g[atom] - overlaps.iter().map(|r| r * r).sum::<f64>();
        // not `<=`: a NaN must be passed over as well
        if square.partial_cmp(&(DEPENDENT_SQUARE * g[atom])) != Some(std::cmp::Ordering::Greater) {
            scratch.upper.truncate(start);
            return None;
        }
        let length = square.sqrt();
        let projection = scratch.correlation[atom] / length;
        if n + 1 < self.limit {
            let v = &mut rest[..k];
            kernels::gram_step(g, done, overlaps, length, projection, v, &mut scratch.correlation);
        }
        scratch.upper.push(length);
        scratch.projections.push(projection);
        Some(projection)
    }
}

/// What the codes leave of every image, X − A D as rows.
fn errors(training: &Training, atoms: &Matrix, codes: &[Solution]) -> Matrix {
    let mut errors = training.rows.clone();
    for (image, code) in codes.iter().enumerate() {
        for (&k, &c) in code.support.iter().zip(&code.coefficients) {
            axpy(-c, atoms.row(k), errors.row_mut(image));
        }
    }
    errors
}

/// Images as rows, all multiplied by the power of two that brings the largest value into [1, 2): their squares neither
/// overflow nor vanish, and no digit is lost.
#[derive(Debug)]
struct Training {
    rows: Matrix,
}

/// Least square of an image that can be learned from; that of the strongest one is at least 1.
const SMALLEST_SQUARE: f64 = 1e-300;

impl Training {
    /// # Errors
    /// [`Refusal`], [`Refusal`], [`Refusal`].
    fn new(images: &[Vec<f64>]) -> Result<Self, Refusal> {
        let expected = images.first().ok_or(Refusal::new("no training image is left after preprocessing"))?.len();
        let mut values = Vec::with_capacity(images.len() * expected);
        for (index, image) in images.iter().enumerate() {
            let len = image.len();
            if len != expected {
                return Err(Refusal::new(format!("training image {index} has {len} values, the first has {expected}")));
            }
            values.extend_from_slice(image);
        }
        if let Some(at) = values.iter().position(|v| !v.is_finite()) {
            return Err(degenerate(at / expected));
        }
        let scale = power_of_two(&values);
        let mut rows = Matrix::zeros(images.len(), expected);
        for (index, image) in images.iter().enumerate() {
            let row = rows.row_mut(index);
            for (scaled, &value) in row.iter_mut().zip(image) {
                *scaled = value / scale;
            }
            if dot(row, row) < SMALLEST_SQUARE {
                return Err(degenerate(index));
            }
        }
        Ok(Self { rows })
    }

    /// Number of images.
    fn len(&self) -> usize {
        self.rows.nrows()
    }

    /// `count` of the images in random order, or all of them when there are fewer, as rows of length 1.
    fn draw(&self, count: usize, rng: &mut ChaCha8Rng) -> Matrix {
        let mut order: Vec<usize> = (0..self.len()).collect();
        order.shuffle(rng);
        order.truncate(count);
        let mut atoms = Matrix::zeros(order.len(), self.rows.ncols());
        for (k, &image) in order.iter().enumerate() {
            set_unit(atoms.row_mut(k), self.rows.row(image));
        }
        atoms
    }
}

/// Scales `direction` to length 1 and writes it to `out`; false, and `out` stays, when it has no direction.
fn set_unit(out: &mut [f64], direction: &[f64]) -> bool {
    let square = dot(direction, direction);
    if !square.is_normal() {
        return false;
    }
    let inverse = 1.0 / square.sqrt();
    for (o, v) in out.iter_mut().zip(direction) {
        *o = v * inverse;
    }
    true
}

/// A count of settings, at least `least`.
///
/// # Errors
/// [`Refusal`].
fn at_least(field: &'static str, value: usize, least: usize) -> Result<(), Refusal> {
    within(field, value as f64, least as f64, f64::MAX).map(|_| ())
}

/// Columns of `rows`: the dictionary whose atoms are the rows.
fn transposed(rows: &Matrix) -> Matrix {
    let atoms: Vec<&[f64]> = (0..rows.nrows()).map(|k| rows.row(k)).collect();
    Matrix::from_column_slices(rows.ncols(), &atoms)
}

/// The images that use each atom, and where in their codes.
#[derive(Debug, Default)]
struct Users {
    /// First entry of every atom in `entries`, and the end of the last.
    starts: Vec<usize>,
    entries: Vec<(usize, usize)>,
}

impl Users {
    /// Collects the users of `n_atoms` atoms from the codes of all images.
    fn collect(&mut self, codes: &[Solution], n_atoms: usize) {
        self.starts.clear();
        self.starts.resize(n_atoms + 1, 0);
        for &atom in codes.iter().flat_map(|c| &c.support) {
            self.starts[atom + 1] += 1;
        }
        for atom in 0..n_atoms {
            self.starts[atom + 1] += self.starts[atom];
        }
        let mut next = self.starts.clone();
        self.entries.clear();
        self.entries.resize(self.starts[n_atoms], (0, 0));
        for (image, code) in codes.iter().enumerate() {
            for (slot, &atom) in code.support.iter().enumerate() {
                self.entries[next[atom]] = (image, slot);
                next[atom] += 1;
            }
        }
    }

    /// (image, place in its code) of every user of `atom`, in the order of the images.
    fn of(&self, atom: usize) -> &[(usize, usize)] {
        &self.entries[self.starts[atom]..self.starts[atom + 1]]
    }
}

/// |cosine| from which two atoms count as one. Rubinstein's KSVD-Box has the same limit.
const TWIN: f64 = 0.99;

/// Share of an image's square below which its error is rounding, and the image no better than the atom it would
/// replace.
const REPRESENTED: f64 = 1e-20;

/// Replaces atoms (rows) without users and, of two that are equal up to sign, the one with fewer users, by the images
/// with the largest `errors`, each image once. Stops when all images that are left are represented.
fn replace_useless(training: &Training, errors: &Matrix, used: &[usize], atoms: &mut Matrix) {
    let useless = useless(atoms, used);
    if useless.is_empty() {
        return;
    }
    let squares: Vec<f64> = (0..errors.nrows()).map(|i| dot(errors.row(i), errors.row(i))).collect();
    let mut order: Vec<usize> = (0..errors.nrows()).collect();
    order.sort_by(|&a, &b| squares[b].total_cmp(&squares[a]).then(a.cmp(&b)));
    for (k, &image) in useless.into_iter().zip(&order) {
        let row = training.rows.row(image);
        if squares[image] <= REPRESENTED * dot(row, row) {
            break;
        }
        set_unit(atoms.row_mut(k), row);
    }
}

/// Indices of the atoms without users, and of twins, in order.
fn useless(atoms: &Matrix, used: &[usize]) -> Vec<usize> {
    let mut of_use: Vec<bool> = used.iter().map(|&n| n > 0).collect();
    for a in 0..atoms.nrows() {
        for b in a + 1..atoms.nrows() {
            if of_use[a] && of_use[b] && dot(atoms.row(a), atoms.row(b)).abs() > TWIN {
                of_use[if used[b] > used[a] { a } else { b }] = false;
            }
        }
    }
    (0..used.len()).filter(|&k| !of_use[k]).collect()
}

fn degenerate(index: usize) -> Refusal {
    Refusal::new(format!("training image {index} is zero, not finite, or less than 1e-150 of the strongest one"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;
    use crate::problem::{Problem, Recover as _, Workspace};
    use crate::recover::Omp;
    use rand::{RngExt as _, SeedableRng as _};
    use rayon::ThreadPoolBuilder;

    #[test]
    fn keeps_strong_and_novel_images() {
        let images = vec![
            vec![0.2, 0.0, 0.0],      // too weak
            vec![1.0, 0.0, 0.0],      // kept
            vec![2.0, 0.1, 0.0],      // the same direction
            vec![0.0, 1.0, 0.0],      // kept
            vec![f64::NAN, 1.0, 1.0], // not finite
            vec![0.0, 0.0, 1.0],      // kept, but beyond the limit
        ];
        let selection = Selection { max_images: 2, ..Selection::default() };
        assert_eq!(select(&images, &selection), [1, 3]);
        assert_eq!(select(&images, &Selection::default()), [1, 3, 5]);
    }

    /// Σ σᵢ uᵢ vᵢᵀ with the columns of two rotations for u and v: one atom for all images is the best rank-one fit, u₁.
    #[test]
    fn one_atom_is_the_first_singular_vector() {
        let (c, s) = (0.6, 0.8);
        let images: Vec<Vec<f64>> =
            [(5.0 * 0.8, -2.0 * 0.6), (5.0 * 0.6, 2.0 * 0.8)].map(|(a, b)| vec![c * a - s * b, s * a + c * b]).to_vec();
        let ksvd = Ksvd { n_components: 1, n_nonzero_coefs: 1, n_iter: 25 };
        let d = ksvd.learn(&images, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        // a power step shrinks the share of u₂ by (2/5)²: 25 of them by 1e-20
        assert!((d.row(0)[0].abs() - c).abs() < 1e-12, "{:?}", d.column(0));
        assert!((d.row(1)[0].abs() - s).abs() < 1e-12, "{:?}", d.column(0));
    }

    /// The synthetic experiment of the source (§V.A): 1,500 sums of 3 of 50 atoms in 20 dimensions, noise at 20 dB, 80
    /// sweeps; an atom is found when 1 − |cosine| < 0.01. The source finds about 46 of 50, the mean of many trials; a
    /// run here may miss four more.
    #[test]
    fn finds_the_atoms_of_the_published_experiment() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let atoms: Vec<Vec<f64>> = (0..50).map(|_| unit_vector(20, &mut rng)).collect();
        // three uniform weights of variance 1/3 on unit atoms in 20 dimensions; a hundredth of that power as uniform
        // noise
        let half = (3.0_f64 * (3.0 / 3.0 / 20.0) / 100.0).sqrt();
        let images: Vec<Vec<f64>> = (0..1500)
            .map(|_| {
                let mut image: Vec<f64> = (0..20).map(|_| rng.random_range(-half..half)).collect();
                for k in rand::seq::index::sample(&mut rng, 50, 3) {
                    axpy(rng.random_range(-1.0..1.0), &atoms[k], &mut image);
                }
                image
            })
            .collect();
        let ksvd = Ksvd { n_components: 50, n_nonzero_coefs: 3, n_iter: 80 };
        let found = [1, 2, 3].map(|seed| {
            let d = ksvd.learn(&images, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            atoms.iter().filter(|atom| 1.0 - closest(&d, atom) < 0.01).count()
        });
        assert!(found.iter().all(|&n| n >= 42), "{found:?} of 50 atoms");
    }

    /// The pursuit by Gram matrices is `Omp`, whose supports are those of scikit-learn.
    #[test]
    fn gram_matrices_give_the_codes_of_omp() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        for (pixels, count, s) in [(10, 40, 3), (25, 100, 6), (50, 100, 20), (40, 24, 8)] {
            let images: Vec<Vec<f64>> = (0..50).map(|_| unit_vector(pixels, &mut rng)).collect();
            let atoms = (0..count).flat_map(|_| unit_vector(pixels, &mut rng)).collect();
            let atoms = Matrix::from_rows(count, pixels, atoms).unwrap();
            let (pursuit, a) = (GramPursuit::new(&atoms, s), transposed(&atoms));
            let (mut scratch, mut code) = (GramScratch::default(), Solution::default());
            for image in &images {
                pursuit.run(image, &mut scratch, &mut code);
                let problem = Problem::new(a.view(), image).unwrap();
                let expected = Omp::new(s).recover(&problem, &mut Workspace::default()).unwrap();
                assert_eq!(code.support, expected.support, "{pixels} pixels, {count} atoms");
                for (found, expected) in code.coefficients.iter().zip(&expected.coefficients) {
                    assert!((found - expected).abs() <= 1e-7 * expected.abs().max(1.0), "{found}, {expected}");
                }
            }
        }
    }

    /// A power step never leaves more than the codes before it, and the kept errors are those of the codes.
    #[test]
    fn a_power_step_leaves_no_more_and_keeps_the_errors() {
        let mut rng = ChaCha8Rng::seed_from_u64(9);
        let images: Vec<Vec<f64>> = (0..60).map(|_| unit_vector(10, &mut rng)).collect();
        let training = Training::new(&images).unwrap();
        let mut sweep = Sweep {
            atoms: training.draw(8, &mut ChaCha8Rng::seed_from_u64(2)),
            errors: Matrix::zeros(0, 0),
            codes: Vec::new(),
            users: Users::default(),
            direction: vec![0.0; 10],
        };
        sweep.code(&training, 2);
        let square = |errors: &Matrix| dot(errors.view().values(), errors.view().values());
        let before = square(&sweep.errors);
        sweep.power_step(0);
        let recomputed = errors(&training, &sweep.atoms, &sweep.codes);
        for (kept, new) in sweep.errors.view().values().iter().zip(recomputed.view().values()) {
            assert!((kept - new).abs() < 1e-13, "the errors do not follow the codes");
        }
        let after = square(&recomputed);
        assert!(after <= before * (1.0 + 1e-13), "{after} against {before}");
    }

    #[test]
    fn twins_and_the_unused_give_way_to_the_worst_images() {
        let images = [[1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0], [1.0, 1.0, 1.0]].map(Vec::from);
        let training = Training::new(&images).unwrap();
        let mut atoms =
            Matrix::from_rows(4, 3, vec![1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.6, 0.8, 0.0]).unwrap();
        // the first of the twins has fewer users, the last atom has none; images 2 and 1 have the largest errors
        let errors = Matrix::from_rows(4, 3, vec![0.0, 0.0, 0.0, 0.3, 0.0, 0.0, 0.4, 0.0, 0.0, 0.1, 0.0, 0.0]).unwrap();
        replace_useless(&training, &errors, &[1, 2, 3, 0], &mut atoms);
        assert_eq!(atoms.row(0), [0.0, 0.0, 1.0]);
        assert_eq!(atoms.row(1), [-1.0, 0.0, 0.0]);
        assert_eq!(atoms.row(2), [0.0, 1.0, 0.0]);
        assert_eq!(atoms.row(3), [0.0, 1.0, 0.0]);
    }

    #[test]
    fn nothing_replaces_an_atom_when_everything_is_represented() {
        let training = Training::new(&[vec![1.0, 0.0], vec![2.0, 0.0]]).unwrap();
        let mut atoms = Matrix::from_rows(2, 2, vec![1.0, 0.0, 1.0, 0.0]).unwrap();
        replace_useless(&training, &Matrix::zeros(2, 2), &[2, 0], &mut atoms);
        assert_eq!(atoms.row(1), [1.0, 0.0]);
    }

    #[test]
    fn learned_dictionaries_conform() {
        let mut suite = Suite { rng: ChaCha8Rng::seed_from_u64(1) };
        suite.seeds_and_threads();
        suite.scales();
        suite.few_and_equal_images();
        suite.refusals();
    }

    type Images = Vec<Vec<f64>>;

    struct Suite {
        rng: ChaCha8Rng,
    }

    impl Suite {
        fn atoms(&mut self, count: usize, n: usize) -> Images {
            (0..count).map(|_| unit_vector(n, &mut self.rng)).collect()
        }

        /// Sums of `sparsity` of the atoms with weights around 1, and noise of 0.01 a value.
        fn images(&mut self, atoms: &[Vec<f64>], count: usize, sparsity: usize) -> Images {
            (0..count)
                .map(|i| {
                    let mut image = vec![0.0; atoms[0].len()];
                    for s in 0..sparsity {
                        // every atom is used equally often
                        let k = if s == 0 { i % atoms.len() } else { self.rng.random_range(0..atoms.len()) };
                        let weight = self.rng.random_range(0.9..1.1);
                        image.iter_mut().zip(&atoms[k]).for_each(|(v, a)| *v += weight * a);
                    }
                    image.iter_mut().for_each(|v| *v += self.rng.random_range(-0.017..0.017));
                    image
                })
                .collect()
        }

        fn attempt(&self, settings: [usize; 3], images: &[Vec<f64>], seed: u64) -> Result<Matrix, Refusal> {
            let [n_components, n_nonzero_coefs, n_iter] = settings;
            let ksvd = Ksvd { n_components, n_nonzero_coefs, n_iter };
            ksvd.learn(images, &mut ChaCha8Rng::seed_from_u64(seed))
        }

        /// A dictionary, which must exist and be sound. `settings`: atoms, sparsity, sweeps.
        fn learn(&self, settings: [usize; 3], images: &[Vec<f64>], seed: u64) -> Matrix {
            let d = self.attempt(settings, images, seed).unwrap_or_else(|e| panic!("{e}"));
            let expected = (images[0].len(), settings[0].min(images.len()));
            assert_eq!((d.nrows(), d.ncols()), expected, "shape");
            for k in 0..d.ncols() {
                let square: f64 = d.column(k).iter().map(|v| v * v).sum();
                // a sum of N products and a square root: below N·ε with a margin
                assert!((square - 1.0).abs() < 1e-12, "‖d{k}‖² = {square}");
            }
            d
        }

        fn seeds_and_threads(&mut self) {
            let atoms = self.atoms(8, 12);
            let images = self.images(&atoms, 100, 2);
            let with = |threads, seed| {
                let pool = ThreadPoolBuilder::new().num_threads(threads).build();
                let pool = pool.unwrap_or_else(|e| panic!("{e}"));
                bits(&pool.install(|| self.learn([10, 2, 4], &images, seed)))
            };
            let one = with(1, 3);
            for threads in [2, 8] {
                assert!(with(threads, 3) == one, "{threads} threads differ from 1");
            }
            assert!(with(1, 4) != one, "another seed gives the same dictionary");
        }

        /// Powers of two change no digit; sums of images of 1e±300 must not leave the range of numbers.
        fn scales(&mut self) {
            let atoms = self.atoms(8, 12);
            let images = self.images(&atoms, 60, 2);
            let scaled = |factor: f64| -> Images {
                let times = |image: &Vec<f64>| image.iter().map(|v| v * factor).collect();
                images.iter().map(times).collect()
            };
            let plain = bits(&self.learn([10, 2, 4], &images, 5));
            for exponent in [-900, -1, 1, 900] {
                let d = self.learn([10, 2, 4], &scaled(2.0_f64.powi(exponent)), 5);
                assert!(bits(&d) == plain, "images times 2^{exponent}");
            }
            for factor in [1e-300, 1e300] {
                self.learn([10, 2, 4], &scaled(factor), 5);
            }
            // strong, weak and hardly anything: an atom for each, or an error
            for weak in [1e-100, 1e-149, 1e-200, 1e-300] {
                let mut mixed = scaled(1e3);
                mixed.extend(scaled(weak));
                match self.attempt([10, 2, 4], &mixed, 5) {
                    Ok(d) => assert!(d.view().values().iter().all(|v| v.is_finite()), "{weak:e}"),
                    Err(e) => assert!(e.to_string().contains("training image 60 is zero"), "{weak:e}"),
                }
            }
        }

        fn few_and_equal_images(&mut self) {
            let atoms = self.atoms(8, 12);
            for count in [1, 2, 9] {
                let images = self.images(&atoms, count, 2);
                for settings in [[10, 2, 3], [10, 30, 3], [1, 1, 3], [3, 5, 3]] {
                    self.learn(settings, &images, 6);
                }
            }
            let mut equal = vec![vec![0.7; 12]; 30];
            self.learn([10, 3, 5], &equal, 6);
            // opposite images, of which a mean has no direction
            equal.extend(vec![vec![-0.7; 12]; 30]);
            self.learn([10, 3, 5], &equal, 6);
            self.learn([1, 1, 5], &equal, 6);
            self.learn([1, 1, 5], &vec![vec![2.0]; 5], 6);
        }

        fn refusals(&mut self) {
            let atoms = self.atoms(4, 6);
            let images = self.images(&atoms, 10, 1);
            let with = |bad: Vec<f64>| {
                let mut images = images.clone();
                images[3] = bad;
                self.attempt([4, 1, 2], &images, 7)
            };
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                assert!(says(&with(vec![1.0, 1.0, 1.0, 1.0, 1.0, bad]), "training image 3 is zero"));
            }
            let empty = [vec![], vec![]];
            for (refused, why) in [
                (with(vec![0.0; 6]), "training image 3 is zero"),
                (with(vec![1.0; 5]), "training image 3 has 5 values, the first has 6"),
                (self.attempt([4, 1, 2], &[], 7), "no training image"),
                (self.attempt([4, 1, 2], &empty, 7), "training image 0 is zero"),
                (self.attempt([0, 1, 2], &images, 7), "is outside"),
            ] {
                assert!(says(&refused, why), "{refused:?}");
            }
        }
    }

    /// A random direction.
    fn unit_vector(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
        let v: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
        let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
        v.iter().map(|v| v / length).collect()
    }

    /// Largest |cosine| of an atom of `dictionary` with `direction`.
    fn closest(dictionary: &Matrix, direction: &[f64]) -> f64 {
        let mut cosines = vec![0.0; dictionary.ncols()];
        for (r, &v) in direction.iter().enumerate() {
            let row = dictionary.row(r);
            cosines.iter_mut().zip(row).for_each(|(c, d)| *c += v * d);
        }
        cosines.iter().fold(0.0, |m, c| c.abs().max(m))
    }

    fn bits(d: &Matrix) -> Vec<u64> {
        d.view().values().iter().map(|v| v.to_bits()).collect()
    }
}
