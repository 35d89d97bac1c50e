//! k-means: atoms are the means of groups of images.

use super::learner::{DictionaryError, Learner};
use super::training::{Training, at_least, set_unit, transposed};
use crate::kernels::{axpy, dot};
use crate::matrix::Matrix;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

/// k-means: every image belongs to the nearest of `n_components` centres, every centre is the mean of its images (Lloyd). Atoms are
/// the centres scaled to length 1; a code of such a dictionary with one atom is a template.
///
/// Centres start at images drawn with a probability in proportion to their squared distance from the ones drawn before (k-means++). A
/// centre without images, or with a mean of no direction, moves to the image that is farthest from its own. Ends when no image changes
/// its centre.
/// Source: S. P. Lloyd, IEEE Trans. Inf. Theory 28 (1982) 129; D. Arthur, S. Vassilvitskii, "k-means++: the advantages of careful
/// seeding", SODA 2007; spherical: I. S. Dhillon, D. S. Modha, "Concept decompositions for large sparse text data using clustering", Mach. Learn.
/// 42 (2001) 143.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct KMeans {
    /// Number of centres, at least 1.
    pub n_components: usize,
    /// Most rounds; 0 leaves the images drawn at the start.
    pub n_iter: usize,
    /// Compares directions instead of images: a light press then counts as much as a firm one, as it does for an atom.
    pub spherical: bool,
}

impl Default for KMeans {
    fn default() -> Self {
        Self {
            n_components: 100,
            n_iter: 100,
            spherical: true,
        }
    }
}

impl Learner for KMeans {
    fn learn(&self, images: &[Vec<f64>], rng: &mut ChaCha8Rng) -> Result<Matrix, DictionaryError> {
        at_least("n_components", self.n_components, 1)?;
        let mut training = Training::new(images)?;
        if self.spherical {
            training.normalise();
        }
        let mut centres = spread(&training, self.n_components, rng);
        let mut nearest = Vec::new();
        for _ in 0..self.n_iter {
            let now = assign(&training, &centres);
            if now == nearest {
                break;
            }
            nearest = now;
            self.means(&training, &nearest, &mut centres);
        }
        let mut atoms = centres.clone();
        for k in 0..atoms.nrows() {
            set_unit(atoms.row_mut(k), centres.row(k));
        }
        Ok(transposed(&atoms))
    }
}

impl KMeans {
    /// Moves every centre to the mean of the images that are nearest to it.
    fn means(&self, training: &Training, nearest: &[(usize, f64)], centres: &mut Matrix) {
        let (mut sums, mut counts) = (
            Matrix::zeros(centres.nrows(), centres.ncols()),
            vec![0_usize; centres.nrows()],
        );
        for (image, &(k, _)) in nearest.iter().enumerate() {
            axpy(1.0, training.rows.row(image), sums.row_mut(k));
            counts[k] += 1;
        }
        let mut farthest: Vec<usize> = (0..nearest.len()).collect();
        farthest.sort_by(|&a, &b| nearest[b].1.total_cmp(&nearest[a].1).then(a.cmp(&b)));
        let mut farthest = farthest.into_iter();
        for (k, &count) in counts.iter().enumerate() {
            let square = dot(sums.row(k), sums.row(k));
            // a sum that cancelled to rounding has no direction either
            if count == 0 || square <= CANCELLED * (count * count) as f64 * dot(centres.row(k), centres.row(k)) {
                if let Some(image) = farthest.next() {
                    centres.row_mut(k).copy_from_slice(training.rows.row(image));
                }
            } else if self.spherical {
                set_unit(centres.row_mut(k), sums.row(k));
            } else {
                let inverse = 1.0 / count as f64;
                for (c, s) in centres.row_mut(k).iter_mut().zip(sums.row(k)) {
                    *c = s * inverse;
                }
            }
        }
    }
}

/// Share of a centre's square below which that of the next one counts as zero.
const CANCELLED: f64 = 1e-24;

/// ‖a − b‖².
fn distance(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum()
}

/// `count` images, or all when there are fewer, each drawn in proportion to its squared distance from those before.
fn spread(training: &Training, count: usize, rng: &mut ChaCha8Rng) -> Matrix {
    let mut chosen = vec![rng.random_range(0..training.len())];
    let mut distances = vec![f64::INFINITY; training.len()];
    while chosen.len() < count.min(training.len()) {
        let newest = training.rows.row(chosen[chosen.len() - 1]);
        for (image, d) in distances.iter_mut().enumerate() {
            *d = d.min(distance(training.rows.row(image), newest));
        }
        // an image once more when all that are left equal chosen ones
        let mut rest = rng.random::<f64>() * distances.iter().sum::<f64>();
        let drawn = distances.iter().position(|d| {
            rest -= d;
            *d > 0.0 && rest <= 0.0
        });
        let last = distances.iter().rposition(|d| *d > 0.0).unwrap_or(0);
        chosen.push(drawn.unwrap_or(last));
    }
    training.only(&chosen).rows
}

/// The nearest centre of every image, the first of equals, and its squared distance.
fn assign(training: &Training, centres: &Matrix) -> Vec<(usize, f64)> {
    (0..training.len())
        .into_par_iter()
        .map(|image| {
            let mut best = (0, f64::INFINITY);
            for k in 0..centres.nrows() {
                let d = distance(training.rows.row(image), centres.row(k));
                if d < best.1 {
                    best = (k, d);
                }
            }
            best
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::conformance::closest;
    use super::*;
    use rand::SeedableRng as _;

    /// Three groups far apart: whatever the start, the centres are their means.
    #[test]
    fn centres_are_the_means_of_their_groups() {
        let images: Vec<Vec<f64>> = [
            [10.0, 0.0],
            [10.0, 1.0],
            [0.0, 10.0],
            [1.0, 10.0],
            [-10.0, 2.0],
            [-12.0, 2.0],
        ]
        .map(Vec::from)
        .to_vec();
        for seed in 0..10 {
            let k_means = KMeans {
                n_components: 3,
                spherical: false,
                ..KMeans::default()
            };
            let d = k_means.learn(&images, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            for mean in [[10.0_f64, 0.5], [0.5, 10.0], [-11.0, 2.0]] {
                let length = mean[0].hypot(mean[1]);
                let cosine = closest(&d, &mean.map(|v| v / length));
                // two roundings of a product and a sum
                assert!((cosine - 1.0).abs() < 1e-14, "seed {seed}: {cosine} at {mean:?}");
            }
        }
    }

    /// Directions 0° and 90° with lengths of 1 and 100: lengths must not matter.
    #[test]
    fn spherical_centres_do_not_see_lengths() {
        let images = [[1.0, 0.0], [100.0, 0.0], [0.0, 1.0], [0.0, 100.0]].map(Vec::from);
        for seed in 0..10 {
            let k_means = KMeans {
                n_components: 2,
                ..KMeans::default()
            };
            let d = k_means.learn(&images, &mut ChaCha8Rng::seed_from_u64(seed)).unwrap();
            assert!(
                closest(&d, &[1.0, 0.0]) > 1.0 - 1e-15 && closest(&d, &[0.0, 1.0]) > 1.0 - 1e-15,
                "{d:?}"
            );
        }
    }
}
