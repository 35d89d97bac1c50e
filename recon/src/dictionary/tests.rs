//! What K-SVD promises with any settings: planted directions are found, images are represented better than by what it
//! starts from, atoms have unit length and depend on the seed but not on threads or on the scale of the images, few and
//! equal images work, and what cannot be learned from is refused.

use super::error::DictionaryError;
use super::ksvd::Ksvd;
use super::training::Training;
use crate::kernels::dot;
use crate::matrix::Matrix;
use crate::problem::Solution;
use crate::recover::BatchOmp;
use crate::workspace::Workspace;
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use rayon::ThreadPoolBuilder;

#[test]
fn learned_dictionaries_conform() {
    let mut suite = Suite {
        rng: ChaCha8Rng::seed_from_u64(1),
    };
    suite.planted_directions();
    suite.error_decreases();
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
                    let k = if s == 0 {
                        i % atoms.len()
                    } else {
                        self.rng.random_range(0..atoms.len())
                    };
                    let weight = self.rng.random_range(0.9..1.1);
                    image.iter_mut().zip(&atoms[k]).for_each(|(v, a)| *v += weight * a);
                }
                image
                    .iter_mut()
                    .for_each(|v| *v += self.rng.random_range(-0.017..0.017));
                image
            })
            .collect()
    }

    fn attempt(&self, settings: [usize; 3], images: &[Vec<f64>], seed: u64) -> Result<Matrix, DictionaryError> {
        let [n_components, n_nonzero_coefs, n_iter] = settings;
        let ksvd = Ksvd {
            n_components,
            n_nonzero_coefs,
            n_iter,
        };
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

    /// 12 directions from 600 images of one each. A mean of 50 noisy images is off by 0.01·√20/√50 = 0.006 of its
    /// length, which leaves a cosine of 0.99998; half of a group split at random in two is still above 0.999.
    fn planted_directions(&mut self) {
        let atoms = self.atoms(12, 20);
        let images = self.images(&atoms, 600, 1);
        let d = self.learn([16, 1, 40], &images, 1);
        for (p, planted) in atoms.iter().enumerate() {
            let best = closest(&d, planted);
            assert!(best > 0.999, "|cosine| {best} with planted direction {p}");
        }
    }

    fn error_decreases(&mut self) {
        let atoms = self.atoms(12, 20);
        let images = self.images(&atoms, 300, 2);
        let error = |sweeps| {
            let d = self.learn([16, 2, sweeps], &images, 2);
            representation_error(&images, &d, 2)
        };
        let (start, end) = (error(0), error(20));
        assert!(end < start, "error {start} → {end}");
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
                Err(e) => assert_eq!(e, DictionaryError::Degenerate { index: 60 }, "{weak:e}"),
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
            let mut image = vec![1.0; 6];
            image[5] = bad;
            assert_eq!(with(image), Err(DictionaryError::Degenerate { index: 3 }), "{bad}");
        }
        assert_eq!(
            with(vec![0.0; 6]),
            Err(DictionaryError::Degenerate { index: 3 }),
            "a zero image"
        );
        let short = DictionaryError::Shape {
            index: 3,
            len: 5,
            expected: 6,
        };
        assert_eq!(with(vec![1.0; 5]), Err(short), "a short image");
        assert_eq!(self.attempt([4, 1, 2], &[], 7), Err(DictionaryError::NoImages), "");
        assert_eq!(
            self.attempt([4, 1, 2], &[vec![], vec![]], 7),
            Err(DictionaryError::Degenerate { index: 0 }),
            "images without values"
        );
        let none = self.attempt([0, 1, 2], &images, 7);
        assert!(matches!(none, Err(DictionaryError::Setting(_))), "no atoms: {none:?}");
    }
}

/// A random direction.
pub(super) fn unit_vector(n: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let v: Vec<f64> = (0..n).map(|_| rng.random_range(-1.0..1.0)).collect();
    let length = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    v.iter().map(|v| v / length).collect()
}

/// Largest |cosine| of an atom of `dictionary` with `direction`.
pub(super) fn closest(dictionary: &Matrix, direction: &[f64]) -> f64 {
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

/// Relative error ‖X − A D‖_F / ‖X‖_F of coding `images` with `n_nonzero_coefs` atoms of `dictionary` by orthogonal
/// matching pursuit.
pub(super) fn representation_error(images: &[Vec<f64>], dictionary: &Matrix, n_nonzero_coefs: usize) -> f64 {
    let training = Training::new(images).unwrap();
    let pursuit = BatchOmp::new(dictionary.view(), n_nonzero_coefs).unwrap();
    let (mut workspace, mut solution) = (Workspace::default(), Solution::default());
    let (mut left, mut whole) = (0.0, 0.0);
    for image in 0..training.len() {
        let row = training.rows.row(image);
        pursuit.recover_into(row, &mut workspace, &mut solution).unwrap();
        left += solution.residual_norm.powi(2);
        whole += dot(row, row);
    }
    (left / whole).sqrt()
}
