//! K-SVD dictionary learning.

use super::coding::{code, errors};
use super::learner::{DictionaryError, Learner};
use super::replace::replace_useless;
use super::training::{Training, at_least, set_unit, transposed};
use super::users::Users;
use crate::kernels::{axpy, dot};
use crate::matrix::Matrix;
use crate::problem::Solution;
use nalgebra::{DMatrix, SVD};
use rand_chacha::ChaCha8Rng;

/// K-SVD: alternates sparse coding (orthogonal matching pursuit with `n_nonzero_coefs` atoms) and, atom by atom, a rank-one fit to the
/// error that the other atoms leave in the images that use this one.
///
/// min ‖X − D A‖_F with ‖aᵢ‖₀ ≤ S and ‖dₖ‖₂ = 1, from randomly drawn images. After each sweep an atom that nobody uses, or that
/// equals another up to sign, gives way to the image that is represented worst.
/// Source: M. Aharon, M. Elad, A. Bruckstein, IEEE Trans. Signal Process. 54 (2006) 4311; R. Rubinstein, M. Zibulevsky,
/// M. Elad, "Efficient implementation of the K-SVD algorithm using batch orthogonal matching pursuit", Technion CS-2008-08 (2008); more
/// than one update a sweep: L. N. Smith, M. Elad, "Improving dictionary learning: multiple dictionary updates and coefficient reuse",
/// IEEE Signal Process. Lett. 20 (2013) 79.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ksvd {
    /// Number of atoms, at least 1.
    pub n_components: usize,
    /// Target sparsity S, at least 1. The paper's text says 30, its code 20.
    pub n_nonzero_coefs: usize,
    /// Number of sweeps.
    pub n_iter: usize,
    /// How an atom is fitted.
    pub rank_one: RankOne,
    /// Rounds of atom updates a sweep, at least 1. They are cheap beside the coding.
    pub n_updates: usize,
}

/// The rank-one fit d gᵀ ≈ E to the error E (N × users) of an atom's users.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RankOne {
    /// One power step from the coefficients at hand: d ← E g/‖E g‖, g ← Eᵀ d. Repeated sweeps make it converge.
    #[default]
    Approximate,
    /// The best one, from the singular value decomposition of E. Much slower.
    Exact,
}

impl Default for Ksvd {
    fn default() -> Self {
        Self {
            n_components: 100,
            n_nonzero_coefs: 20,
            n_iter: 15,
            rank_one: RankOne::Approximate,
            n_updates: 1,
        }
    }
}

impl Learner for Ksvd {
    fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, DictionaryError> {
        at_least("n_components", self.n_components, 1)?;
        at_least("n_nonzero_coefs", self.n_nonzero_coefs, 1)?;
        at_least("n_updates", self.n_updates, 1)?;
        let training = Training::new(images)?;
        let mut sweep = Sweep {
            atoms: training.draw(self.n_components, rng),
            errors: Matrix::zeros(0, 0),
            codes: Vec::new(),
            users: Users::default(),
            direction: vec![0.0; training.rows.ncols()],
        };
        for _ in 0..self.n_iter {
            code(
                &training,
                0..training.len(),
                &sweep.atoms,
                self.n_nonzero_coefs,
                &mut sweep.codes,
            )?;
            sweep.errors = errors(&training, &sweep.atoms, &sweep.codes);
            sweep.users.collect(&sweep.codes, sweep.atoms.nrows());
            for _ in 0..self.n_updates {
                for atom in 0..sweep.atoms.nrows() {
                    match self.rank_one {
                        RankOne::Approximate => sweep.power_step(atom),
                        RankOne::Exact => sweep.exact_step(atom),
                    }
                }
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

    /// d ← the first left singular vector of E, and g ← Eᵀ d.
    fn exact_step(&mut self, atom: usize) {
        let users = self.users.of(atom);
        let mut e = DMatrix::zeros(self.direction.len(), users.len());
        for (mut column, &(image, slot)) in e.column_iter_mut().zip(users) {
            let c = self.codes[image].coefficients[slot];
            column.as_mut_slice().copy_from_slice(self.errors.row(image));
            axpy(c, self.atoms.row(atom), column.as_mut_slice());
        }
        let fit = SVD::try_new(e, true, false, f64::EPSILON, MAX_SVD_STEPS);
        let Some(u) = fit.and_then(|svd| svd.u).filter(|u| u.ncols() > 0) else {
            return self.power_step(atom);
        };
        self.direction.copy_from_slice(u.column(0).as_slice());
        if dot(&self.direction, self.atoms.row(atom)) < 0.0 {
            self.direction.iter_mut().for_each(|v| *v = -*v);
        }
        self.turn(atom);
    }

    /// Turns the atom into `direction` and takes g ← Eᵀ d out of the errors. One without direction, as without users, stays.
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

/// Steps after which a singular value decomposition is given up; a power step then takes its place. LAPACK allows 30 a singular value.
const MAX_SVD_STEPS: usize = 10_000;
