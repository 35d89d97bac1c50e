//! K-SVD dictionary learning.

use super::coding::{code, errors};
use super::error::DictionaryError;
use super::replace::replace_useless;
use super::training::{Training, at_least, set_unit, transposed};
use super::users::Users;
use crate::kernels::{axpy, dot};
use crate::matrix::Matrix;
use crate::problem::Solution;
use rand_chacha::ChaCha8Rng;

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
/// # Ok::<(), spts_recon::dictionary::DictionaryError>(())
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
        Self {
            n_components: 100,
            n_nonzero_coefs: 20,
            n_iter: 15,
        }
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
    /// [`DictionaryError`] if there is no image, an image is not usable, or a setting is out of range.
    pub fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, DictionaryError> {
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
            sweep.code(&training, self.n_nonzero_coefs)?;
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
    /// [`DictionaryError::Coding`].
    fn code(&mut self, training: &Training, n_nonzero_coefs: usize) -> Result<(), DictionaryError> {
        code(training, &self.atoms, n_nonzero_coefs, &mut self.codes)?;
        self.errors = errors(training, &self.atoms, &self.codes);
        self.users.collect(&self.codes, self.atoms.nrows());
        Ok(())
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

#[cfg(test)]
mod tests {
    use super::super::tests::{closest, unit_vector};
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    /// Σ σᵢ uᵢ vᵢᵀ with the columns of two rotations for u and v: one atom for all images is the best rank-one fit, u₁.
    #[test]
    fn one_atom_is_the_first_singular_vector() {
        let (c, s) = (0.6, 0.8);
        let images: Vec<Vec<f64>> = [(5.0 * 0.8, -2.0 * 0.6), (5.0 * 0.6, 2.0 * 0.8)]
            .map(|(a, b)| vec![c * a - s * b, s * a + c * b])
            .to_vec();
        let ksvd = Ksvd {
            n_components: 1,
            n_nonzero_coefs: 1,
            n_iter: 25,
        };
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
        let ksvd = Ksvd {
            n_components: 50,
            n_nonzero_coefs: 3,
            n_iter: 80,
        };
        let found = [1, 2, 3].map(|seed| {
            let d = ksvd.learn(&images, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            atoms.iter().filter(|atom| 1.0 - closest(&d, atom) < 0.01).count()
        });
        assert!(found.iter().all(|&n| n >= 42), "{found:?} of 50 atoms");
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
        sweep.code(&training, 2).unwrap();
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
}
