//! Online dictionary learning in mini-batches.

use super::coding::{code, errors};
use super::learner::{DictionaryError, Learner};
use super::replace::replace_useless;
use super::training::{Training, at_least, set_unit, transposed};
use crate::checks::within;
use crate::kernels::{adjoint, axpy};
use crate::matrix::Matrix;
use crate::problem::Solution;
use crate::recover::Choice;
use rand::seq::SliceRandom as _;
use rand_chacha::ChaCha8Rng;

/// Online dictionary learning: codes a mini-batch of images (a pursuit with `n_nonzero_coefs` atoms), adds the codes
/// α to the statistics P ← β P + Σ α αᵀ and Q ← β Q + Σ α xᵀ, and minimises ½ tr(Dᵀ D P) − tr(Dᵀ Qᵀ) atom by atom,
/// dₖ ← unit(dₖ + (qₖ − Dᵀ pₖ)/Pₖₖ).
///
/// The dictionary follows after every batch and not after every image, and the cost of following does not depend on the number of
/// images. β = (1 − 1/t)^ρ makes the past fade: at batch t the statistics hold about the last t/ρ batches, and ρ = `n_iter`/`memory`. After every pass, atoms that were of no use in it, and twins, give way to
/// the images of the last batch that are represented worst.
/// Source: J. Mairal, F. Bach, J. Ponce, G. Sapiro, "Online learning for matrix factorization and sparse coding", J. Mach. Learn. Res. 11
/// (2010) 19, algorithms 1 and 2 and §3.4; atoms there are at most 1 long, which makes no difference to a pursuit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Online {
    /// Number of atoms, at least 1.
    pub n_components: usize,
    /// Target sparsity S, at least 1.
    pub n_nonzero_coefs: usize,
    /// How images are coded.
    pub choice: Choice,
    /// Number of passes over the images, each in a new order.
    pub n_iter: usize,
    /// Images of a mini-batch, at least 1.
    pub batch_size: usize,
    /// How many passes the statistics hold at the end, in (0, ∞). They hold fewer before: first the dictionary follows every batch, and
    /// comes to rest by and by.
    pub memory: f64,
}

impl Default for Online {
    fn default() -> Self {
        Self {
            n_components: 100,
            n_nonzero_coefs: 20,
            choice: Choice::LeastSquares,
            n_iter: 15,
            batch_size: 64,
            memory: 0.6,
        }
    }
}

impl Learner for Online {
    fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, DictionaryError> {
        at_least("n_components", self.n_components, 1)?;
        at_least("n_nonzero_coefs", self.n_nonzero_coefs, 1)?;
        at_least("batch_size", self.batch_size, 1)?;
        within("memory", self.memory, f64::MIN_POSITIVE, f64::MAX)?;
        let training = Training::new(images)?;
        let mut atoms = training.draw(self.n_components, rng);
        let mut statistics = Statistics::new(&atoms);
        let mut order: Vec<usize> = (0..training.len()).collect();
        let mut codes = Vec::new();
        let forgetting = self.n_iter as f64 / self.memory;
        let mut batches = 0.0;
        for _ in 0..self.n_iter {
            order.shuffle(rng);
            statistics.used.fill(0);
            for batch in order.chunks(self.batch_size) {
                batches += 1.0;
                code(&training, batch, &atoms, self.n_nonzero_coefs, self.choice, &mut codes)?;
                statistics.fade((1.0_f64 - 1.0 / batches).powf(forgetting));
                statistics.add(&training, batch, &codes);
                statistics.follow(&mut atoms);
            }
            statistics.replace(&training, &codes, &mut atoms);
        }
        Ok(transposed(&atoms))
    }
}

/// What the codes so far say of the dictionary.
struct Statistics {
    /// P = Σ α αᵀ, K × K.
    products: Matrix,
    /// Q = Σ α xᵀ, K × N.
    images: Matrix,
    /// Uses of every atom in this pass.
    used: Vec<usize>,
    /// Images of the last batch.
    last: Vec<usize>,
    /// Scratch memory for an atom.
    direction: Vec<f64>,
}

impl Statistics {
    fn new(atoms: &Matrix) -> Self {
        let (k, n) = (atoms.nrows(), atoms.ncols());
        Self {
            products: Matrix::zeros(k, k),
            images: Matrix::zeros(k, n),
            used: vec![0; k],
            last: Vec::new(),
            direction: vec![0.0; n],
        }
    }

    fn fade(&mut self, factor: f64) {
        for statistic in [&mut self.products, &mut self.images] {
            for r in 0..statistic.nrows() {
                statistic.row_mut(r).iter_mut().for_each(|v| *v *= factor);
            }
        }
    }

    fn add(&mut self, training: &Training, batch: &[usize], codes: &[Solution]) {
        self.last.clear();
        self.last.extend_from_slice(batch);
        for (&image, code) in batch.iter().zip(codes) {
            for (&k, &c) in code.support.iter().zip(&code.coefficients) {
                self.used[k] += 1;
                axpy(c, training.rows.row(image), self.images.row_mut(k));
                let row = self.products.row_mut(k);
                for (&j, &other) in code.support.iter().zip(&code.coefficients) {
                    row[j] += c * other;
                }
            }
        }
    }

    /// One round of block coordinate descent over the atoms (rows); an atom that was never used stays.
    fn follow(&mut self, atoms: &mut Matrix) {
        let mut predicted = vec![0.0; self.direction.len()];
        for k in 0..atoms.nrows() {
            let weights = self.products.row(k);
            if !weights[k].is_normal() {
                continue;
            }
            adjoint(atoms.view().values(), weights, &mut predicted);
            let current = atoms.row(k).iter().zip(self.images.row(k)).zip(&predicted);
            for (d, ((a, q), p)) in self.direction.iter_mut().zip(current) {
                *d = a + (q - p) / weights[k];
            }
            set_unit(atoms.row_mut(k), &self.direction);
        }
    }

    /// Replaces useless atoms by images of the last batch, coded in `codes`, and forgets the statistics of the atoms that were.
    fn replace(&mut self, training: &Training, codes: &[Solution], atoms: &mut Matrix) {
        let batch = training.only(&self.last);
        let left = errors(&batch, atoms, codes);
        for k in replace_useless(&batch, &left, &self.used, atoms) {
            self.images.row_mut(k).fill(0.0);
            self.products.row_mut(k).fill(0.0);
            for r in 0..self.products.nrows() {
                self.products.row_mut(r)[k] = 0.0;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng as _;

    /// One atom for all images: a step is a power step, which converges to the direction of most energy. The images are
    /// (±4, 1): it is the first axis, and a step shrinks the share of the second by 16.
    #[test]
    fn one_atom_is_the_direction_of_most_energy() {
        let images = vec![vec![4.0, 1.0], vec![-4.0, 1.0]];
        let online = Online {
            n_components: 1,
            n_nonzero_coefs: 1,
            n_iter: 60,
            batch_size: 2,
            ..Online::default()
        };
        let d = online.learn(&images, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        assert!(d.row(1)[0].abs() < 1e-9, "{:?}", d.column(0));
    }

    #[test]
    fn settings_are_checked() {
        let bad = [
            Online {
                memory: f64::NAN,
                ..Online::default()
            },
            Online {
                memory: 0.0,
                ..Online::default()
            },
            Online {
                batch_size: 0,
                ..Online::default()
            },
        ];
        for online in bad {
            let error = online.learn(&[vec![1.0]], &mut ChaCha8Rng::seed_from_u64(1));
            assert!(
                matches!(error, Err(DictionaryError::Setting(_))),
                "{online:?}: {error:?}"
            );
        }
    }
}
