//! K-SVD dictionary learning.

use crate::matrix::Matrix;
use crate::problem::{Problem, Recover as _, Solution, Workspace};
use crate::recover::ReferenceOmp;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// K-SVD: alternates sparse coding (OMP with `n_nonzero_coefs` atoms) and, atom by atom, the best rank-one fit to the
/// error that the atom's users leave.
///
/// min ‖X − D A‖_F with ‖a_i‖₀ ≤ S and ‖d_k‖₂ = 1. The rank-one fit is taken with one power step a sweep
/// (d ← E gᵀ/‖·‖, g ← dᵀ E), which converges to the same dictionary at a fraction of the cost of an SVD.
/// Source: M. Aharon, M. Elad, A. Bruckstein, IEEE Trans. Signal Process. 54 (2006) 4311; R. Rubinstein, M. Zibulevsky,
/// M. Elad, "Efficient implementation of the K-SVD algorithm", Technion CS-2008-08.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Ksvd {
    /// Number of atoms.
    pub n_components: usize,
    /// Target sparsity S. The paper's text says 30, its code 20.
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

/// Why no dictionary was learned.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum KsvdError {
    /// There is nothing to learn from.
    #[error("no training image is left after preprocessing")]
    NoImages,
    /// Images of different sizes.
    #[error("training image {index} has {len} values, the first has {expected}")]
    Shape {
        /// Which image.
        index: usize,
        /// Its length.
        len: usize,
        /// Length of the first image.
        expected: usize,
    },
    /// A training image is zero or not finite.
    #[error("training image {index} is zero or not finite")]
    Degenerate {
        /// Which image.
        index: usize,
    },
}

impl Ksvd {
    /// Learns a dictionary (N × `n_components`, unit columns) from `images`. With fewer images than atoms, every image
    /// is an atom and the dictionary has as many columns as there are images.
    ///
    /// # Errors
    /// [`KsvdError`] when there is no image, or one is degenerate.
    pub fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, KsvdError> {
        let expected = images.first().ok_or(KsvdError::NoImages)?.len();
        for (index, image) in images.iter().enumerate() {
            if image.len() != expected {
                return Err(KsvdError::Shape {
                    index,
                    len: image.len(),
                    expected,
                });
            }
            let square: f64 = image.iter().map(|v| v * v).sum();
            if !(square.is_normal()) {
                return Err(KsvdError::Degenerate { index });
            }
        }
        let mut order: Vec<usize> = (0..images.len()).collect();
        order.shuffle(rng);
        let mut atoms: Vec<Vec<f64>> = order
            .iter()
            .take(self.n_components)
            .map(|&i| unit(images[i].clone()))
            .collect();
        for _ in 0..self.n_iter {
            let codes = self.code(images, &atoms);
            update(images, codes, &mut atoms);
        }
        let slices: Vec<&[f64]> = atoms.iter().map(Vec::as_slice).collect();
        Ok(Matrix::from_column_slices(expected, &slices))
    }

    /// Sparse code of every image.
    fn code(&self, images: &[Vec<f64>], atoms: &[Vec<f64>]) -> Vec<Solution> {
        let slices: Vec<&[f64]> = atoms.iter().map(Vec::as_slice).collect();
        let dictionary = Matrix::from_column_slices(images[0].len(), &slices);
        let pursuit = ReferenceOmp::new(self.n_nonzero_coefs);
        images
            .par_iter()
            .map_init(Workspace::default, |work, image| {
                // images and atoms were checked by `learn`; an image that cannot be coded keeps an empty code
                Problem::new(dictionary.view(), image)
                    .and_then(|problem| pursuit.recover(&problem, work))
                    .unwrap_or_default()
            })
            .collect()
    }
}

/// One sweep of atom updates. An atom nobody uses is replaced by the image that is represented worst.
fn update(images: &[Vec<f64>], mut codes: Vec<Solution>, atoms: &mut [Vec<f64>]) {
    let mut errors: Vec<Vec<f64>> = images
        .iter()
        .zip(&codes)
        .map(|(image, code)| {
            let mut error = image.clone();
            for (&k, &c) in code.support.iter().zip(&code.coefficients) {
                add(&mut error, -c, &atoms[k]);
            }
            error
        })
        .collect();
    let mut users: Vec<Vec<(usize, usize)>> = vec![Vec::new(); atoms.len()];
    for (i, code) in codes.iter().enumerate() {
        for (slot, &k) in code.support.iter().enumerate() {
            users[k].push((i, slot));
        }
    }
    let mut replaced = vec![false; images.len()];
    for (k, atom) in atoms.iter_mut().enumerate() {
        if users[k].is_empty() {
            if let Some(worst) = worst_image(&errors, &replaced) {
                replaced[worst] = true;
                *atom = unit(images[worst].clone());
            }
            continue;
        }
        let mut direction = vec![0.0; atom.len()];
        for &(i, slot) in &users[k] {
            let c = codes[i].coefficients[slot];
            add(&mut errors[i], c, atom);
            add(&mut direction, c, &errors[i]);
        }
        if direction.iter().map(|v| v * v).sum::<f64>().is_normal() {
            *atom = unit(direction);
        }
        for &(i, slot) in &users[k] {
            let c: f64 = errors[i].iter().zip(atom.iter()).map(|(e, a)| e * a).sum();
            codes[i].coefficients[slot] = c;
            add(&mut errors[i], -c, atom);
        }
    }
}

fn worst_image(errors: &[Vec<f64>], replaced: &[bool]) -> Option<usize> {
    let square = |i: usize| errors[i].iter().map(|v| v * v).sum::<f64>();
    (0..errors.len())
        .filter(|&i| !replaced[i])
        .max_by(|&a, &b| square(a).total_cmp(&square(b)))
}

fn unit(mut v: Vec<f64>) -> Vec<f64> {
    let length = v.iter().map(|x| x * x).sum::<f64>().sqrt();
    v.iter_mut().for_each(|x| *x /= length);
    v
}

fn add(out: &mut [f64], factor: f64, v: &[f64]) {
    for (o, x) in out.iter_mut().zip(v) {
        *o += factor * x;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};

    fn error(images: &[Vec<f64>], d: &Matrix, sparsity: usize) -> f64 {
        let (mut rest, mut whole) = (0.0, 0.0);
        for image in images {
            let problem = Problem::new(d.view(), image).unwrap();
            let residual = ReferenceOmp::new(sparsity)
                .recover(&problem, &mut Workspace::default())
                .unwrap()
                .residual_norm;
            rest += residual * residual;
            whole += image.iter().map(|v| v * v).sum::<f64>();
        }
        (rest / whole).sqrt()
    }

    /// Planted model: 400 images of 2 out of 12 random atoms. Learning must represent them far better than the start.
    #[test]
    fn learns_a_planted_dictionary() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let atoms: Vec<Vec<f64>> = (0..12)
            .map(|_| unit((0..20).map(|_| rng.random_range(-1.0..1.0)).collect()))
            .collect();
        let images: Vec<Vec<f64>> = (0..400)
            .map(|_| {
                let mut image = vec![0.0; 20];
                for _ in 0..2 {
                    add(&mut image, rng.random_range(0.5..1.5), &atoms[rng.random_range(0..12)]);
                }
                image
            })
            .collect();
        let settings = |n_iter| Ksvd {
            n_components: 16,
            n_nonzero_coefs: 2,
            n_iter,
        };
        let start = settings(0).learn(&images, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let learned = settings(40).learn(&images, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let (before, after) = (error(&images, &start, 2), error(&images, &learned, 2));
        // four spare atoms absorb a local minimum or two: one of twelve atoms missed costs about 1/12 of the energy
        assert!(after < 0.3 * before, "representation error {before} → {after}");
        for k in 0..learned.ncols() {
            let length: f64 = learned.column(k).iter().map(|v| v * v).sum();
            assert!((length - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn refuses_what_cannot_be_learned_from() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        let learner = Ksvd::default();
        assert_eq!(learner.learn(&[], &mut rng), Err(KsvdError::NoImages));
        assert_eq!(
            learner.learn(&[vec![0.0; 3]], &mut rng),
            Err(KsvdError::Degenerate { index: 0 })
        );
        assert_eq!(
            learner.learn(&[vec![1.0; 3], vec![1.0; 2]], &mut rng),
            Err(KsvdError::Shape {
                index: 1,
                len: 2,
                expected: 3
            })
        );
    }
}
