//! Gaussian components learned from many images of a class: clusters of similar images.

use crate::checks::{no_contact, within};
use crate::classify::evidence::Component;
use crate::classify::templates::principal;
use crate::kernels::{axpy, dot, norm};
use crate::matrix::Matrix;
use crate::recover::Gaussian;
use nalgebra::DMatrix;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use spts_input::Refusal;

/// Builds a mixture of Gaussians from many images, such as those of an object in all poses, or of many possible shapes.
///
/// Images are scaled to length 1 and clustered (k-means with k-means++ seeds). The component of a cluster with mean t
/// and covariance C is u ~ N(t, C + γ² diag E\[u²\] + f² I); γ stands for unknown gains of the taxels.
/// Sources: S. P. Lloyd, IEEE Trans. Inf. Theory 28 (1982) 129; D. Arthur, S. Vassilvitskii, "k-means++", SODA 2007.
///
/// ```
/// use rand::SeedableRng as _;
/// use spts_recon::Matrix;
/// use spts_recon::classify::ClusterModel;
///
/// // two kinds of images of one class
/// let images = Matrix::from_columns(3, 4, &[1.0, 0.0, 0.0, 2.0, 0.1, 0.0, 0.0, 0.0, 1.0, 0.0, 0.1, 3.0])?;
/// let model = ClusterModel { clusters: 2, gain: 0.1, floor: 0.05, noise: 0.1, rank: 2 };
/// let learned = model.learn(&images, 5, &mut rand_chacha::ChaCha8Rng::seed_from_u64(1))?;
/// assert_eq!(learned.components.len(), 2);
/// assert!(learned.components.iter().all(|component| component.label == Some(5)));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClusterModel {
    /// Largest number of clusters of a class, [1, 10000].
    pub clusters: usize,
    /// γ: relative standard deviation of a taxel's gain, [0, 10].
    pub gain: f64,
    /// f: standard deviation of every taxel, relative to the image's length, [1e-6, 10].
    pub floor: f64,
    /// Standard deviation of the noise of one measurement, relative to the image's length, [1e-6, 1e5].
    pub noise: f64,
    /// Number of eigenvectors of a covariance that are kept; the rest is treated as white.
    pub rank: usize,
}

/// The learned components, and in the same order the full Gaussians for [`super::ImageEstimator`].
#[derive(Debug, Clone, Default)]
pub struct Clusters {
    /// Components for the classifier.
    pub components: Vec<Component>,
    /// Gaussians for images.
    pub priors: Vec<Gaussian>,
}

/// Rounds of k-means; clusters hardly change after a dozen.
const ROUNDS: usize = 20;

impl ClusterModel {
    /// Learns the components of the class `label` from `images` (N × number of images). Images that are zero everywhere
    /// are ignored. The result depends only on `rng` and the images.
    ///
    /// # Errors
    /// [`Refusal`] if a parameter is out of range, or no image is left.
    pub fn learn(&self, images: &Matrix, label: usize, rng: &mut ChaCha8Rng) -> Result<Clusters, Refusal> {
        self.check()?;
        let units = unit_images(images);
        if units.is_empty() {
            return Err(no_contact(0));
        }
        let centres = seeds(&units, self.clusters.min(units.len()), rng);
        let members = members(&units, centres);
        let parts: Vec<(Component, Gaussian)> = members
            .par_iter()
            .filter(|own| !own.is_empty())
            .map(|own| self.component(&units, own, label))
            .collect::<Result<_, Refusal>>()?;
        let (components, priors) = parts.into_iter().unzip();
        Ok(Clusters { components, priors })
    }

    fn check(&self) -> Result<(), Refusal> {
        within("clusters", self.clusters as f64, 1.0, 10_000.0)?;
        within("gain", self.gain, 0.0, 10.0)?;
        within("floor", self.floor, 1e-6, 10.0)?;
        within("noise", self.noise, 1e-6, 1e5)?;
        Ok(())
    }

    fn component(&self, units: &[Vec<f64>], own: &[usize], label: usize) -> Result<(Component, Gaussian), Refusal> {
        let (n, count) = (units[0].len(), own.len() as f64);
        let mean = mean(units, own);
        let centred = DMatrix::from_fn(n, own.len(), |i, k| units[own[k]][i] - mean[i]);
        let mut covariance = &centred * centred.transpose() / count;
        for i in 0..n {
            let square = own.iter().map(|&k| units[k][i].powi(2)).sum::<f64>() / count;
            covariance[(i, i)] += self.gain.powi(2) * square + self.floor.powi(2);
        }
        let prior = Gaussian::new(mean.clone(), Matrix::from(&covariance))?;
        let (factors, rest) = principal(covariance, self.rank);
        let component = Component {
            label: Some(label),
            weight: count / units.len() as f64,
            mean,
            factors,
            noise_variance: self.noise.powi(2) + rest,
        };
        Ok((component, prior))
    }
}

/// Second moments of the images, each scaled to length 1, about zero: one wide component for what is in no cluster.
///
/// # Errors
/// As [`ClusterModel::learn`].
pub(super) fn wide(model: &ClusterModel, images: &Matrix, label: usize) -> Result<Clusters, Refusal> {
    model.check()?;
    let units = unit_images(images);
    if units.is_empty() {
        return Err(no_contact(0));
    }
    let all: Vec<usize> = (0..units.len()).collect();
    let (mut component, prior) = model.component(&units, &all, label)?;
    let (n, mean) = (prior.mean().len(), prior.mean());
    let covariance = DMatrix::from_fn(n, n, |i, j| prior.covariance().row(i)[j] + mean[i] * mean[j]);
    let prior = Gaussian::new(vec![0.0; n], Matrix::from(&covariance))?;
    let (factors, rest) = principal(covariance, model.rank);
    component.mean = vec![0.0; n];
    component.factors = factors;
    component.noise_variance = model.noise.powi(2) + rest;
    Ok(Clusters { components: vec![component], priors: vec![prior] })
}

impl Clusters {
    /// The clusters of `model` for `images`, plus one wide component for images that resemble none of them. `apart`,
    /// (0, 1), is the weight of that component.
    ///
    /// # Errors
    /// As [`ClusterModel::learn`]; [`Refusal`] for a weight out of range.
    pub fn with_wide(model: &ClusterModel, images: &Matrix, apart: f64, rng: &mut ChaCha8Rng) -> Result<Self, Refusal> {
        within("apart", apart, 1e-9, 1.0 - 1e-9)?;
        let mut all = model.learn(images, 0, rng)?;
        for component in &mut all.components {
            component.weight *= 1.0 - apart;
        }
        let mut wide = wide(model, images, 0)?;
        wide.components[0].weight = apart;
        all.add(wide);
        Ok(all)
    }

    /// Adds the components of another class.
    pub fn add(&mut self, other: Self) {
        self.components.extend(other.components);
        self.priors.extend(other.priors);
    }
}

/// The images that are not zero, each of length 1.
fn unit_images(images: &Matrix) -> Vec<Vec<f64>> {
    let columns = (0..images.ncols()).map(|k| images.column(k));
    columns
        .filter_map(|mut image| {
            let length = norm(&image);
            (length > 0.0 && length.is_finite()).then(|| {
                image.iter_mut().for_each(|v| *v /= length);
                image
            })
        })
        .collect()
}

/// Squared distance of two images of which `squares` are the squared lengths.
fn distance(a: &[f64], b: &[f64], squares: f64) -> f64 {
    (squares - 2.0 * dot(a, b)).max(0.0)
}

/// First centres: each the next one with a probability that grows with the square of its distance from those chosen.
fn seeds(units: &[Vec<f64>], clusters: usize, rng: &mut ChaCha8Rng) -> Vec<Vec<f64>> {
    let mut centres: Vec<Vec<f64>> = vec![units[rng.random_range(0..units.len())].clone()];
    let mut nearest = vec![f64::INFINITY; units.len()];
    while centres.len() < clusters {
        let last = &centres[centres.len() - 1];
        nearest.par_iter_mut().zip(units).for_each(|(near, unit)| *near = near.min(distance(unit, last, 2.0)));
        let mut left = rng.random::<f64>() * nearest.iter().sum::<f64>();
        let next = nearest.iter().position(|near| {
            left -= near;
            left < 0.0
        });
        // all images are centres already
        let Some(next) = next else { break };
        centres.push(units[next].clone());
    }
    centres
}

/// The images of every cluster, by their numbers.
fn members(units: &[Vec<f64>], mut centres: Vec<Vec<f64>>) -> Vec<Vec<usize>> {
    let mut members: Vec<Vec<usize>> = Vec::new();
    for _ in 0..ROUNDS {
        let squares: Vec<f64> = centres.iter().map(|c| dot(c, c)).collect();
        let nearest = |unit: &Vec<f64>| {
            let each = centres.iter().zip(&squares).map(|(c, s)| distance(unit, c, 1.0 + s));
            let best = each.enumerate().fold((0, f64::INFINITY), |best, (k, d)| if d < best.1 { (k, d) } else { best });
            best.0
        };
        let of: Vec<usize> = units.par_iter().map(nearest).collect();
        let mut found = vec![Vec::new(); centres.len()];
        of.iter().enumerate().for_each(|(k, &cluster)| found[cluster].push(k));
        let done = found == members;
        members = found;
        if done {
            break;
        }
        for (centre, own) in centres.iter_mut().zip(&members).filter(|(_, own)| !own.is_empty()) {
            *centre = mean(units, own);
        }
    }
    members
}

fn mean(units: &[Vec<f64>], own: &[usize]) -> Vec<f64> {
    let mut mean = vec![0.0; units[0].len()];
    own.iter().for_each(|&k| axpy(1.0 / own.len() as f64, &units[k], &mut mean));
    mean
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::checks::says;
    use rand::SeedableRng as _;

    const MODEL: ClusterModel = ClusterModel { clusters: 2, gain: 0.5, floor: 0.1, noise: 0.2, rank: 1 };

    /// Two kinds of images, of any length: two components, each with the mean of its kind, the gains and the floor.
    #[test]
    fn kinds_of_images_are_components() {
        let columns: Vec<&[f64]> =
            vec![&[2.0, 0.0, 0.0], &[0.0, 0.3, 0.4], &[0.0, 6.0, 8.0], &[0.0; 3], &[5.0, 0.0, 0.0]];
        let images = Matrix::from_column_slices(3, &columns);
        let found = MODEL.learn(&images, 7, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        assert_eq!(found.components.len(), 2);
        for component in &found.components {
            assert_eq!(component.label, Some(7));
            assert!((component.weight - 0.5).abs() < 1e-15);
        }
        let second = found.priors.iter().find(|p| p.mean()[0] == 0.0).unwrap();
        for (i, mean) in [0.0, 0.6, 0.8].into_iter().enumerate() {
            assert!((second.mean()[i] - mean).abs() < 1e-15);
            let variance = 0.25 * mean * mean + 0.01;
            assert!((second.covariance().row(i)[i] - variance).abs() < 1e-15);
        }
        // what the one factor leaves of the trace is noise
        let component = found.components.iter().find(|c| c.mean[0] == 0.0).unwrap();
        let kept: f64 = component.factors[0].iter().map(|v| v * v).sum();
        let trace = 0.25 + 0.03;
        assert!((kept + component.noise_variance - (trace + 0.04)).abs() < 1e-14);
    }

    #[test]
    fn a_wide_component_stands_for_the_rest() {
        let images = Matrix::from_column_slices(3, &[&[2.0, 0.0, 0.0], &[0.0, 0.3, 0.4]]);
        let all = Clusters::with_wide(&MODEL, &images, 0.75, &mut ChaCha8Rng::seed_from_u64(1)).unwrap();
        let wide = all.components.last().unwrap();
        assert_eq!((wide.mean.as_slice(), wide.weight), (&[0.0; 3][..], 0.75));
        assert!((all.components.iter().map(|c| c.weight).sum::<f64>() - 1.0).abs() < 1e-15);
        // ½ (1, 0, 0)(1, 0, 0)ᵀ + ½ (0, .6, .8)(0, .6, .8)ᵀ, gains and floor
        let covariance = all.priors.last().unwrap().covariance();
        assert!((covariance.row(0)[0] - (0.5 * 1.25 + 0.01)).abs() < 1e-15);
        assert!((covariance.row(1)[2] - 0.24).abs() < 1e-15);
    }

    #[test]
    fn images_without_a_contact_are_refused() {
        let refused = MODEL.learn(&Matrix::zeros(3, 2), 0, &mut ChaCha8Rng::seed_from_u64(1));
        assert!(refused.unwrap_err().to_string().contains("image 0 has no value"));
        let refused =
            ClusterModel { gain: f64::NAN, ..MODEL }.learn(&Matrix::zeros(3, 2), 0, &mut ChaCha8Rng::seed_from_u64(1));
        assert!(says(&refused, "is outside"));
    }
}
