//! Covariance of images about a template, and its largest eigenvectors.

use super::templates::TemplateModel;
use nalgebra::DMatrix;

impl TemplateModel {
    /// Smooth part of Σ and variances of the independent one, for the template `mean`.
    pub(super) fn covariance(&self, mean: &[f64]) -> (DMatrix<f64>, Vec<f64>) {
        let deviation: Vec<f64> = self.blur(mean).iter().map(|v| self.mismatch * v).collect();
        let smooth = DMatrix::from_fn(mean.len(), mean.len(), |i, j| {
            let d2 = distance_squared(i, j, self.cols);
            let gain = match self.gains.get(i) {
                Some(gain) if i == j => gain * mean[i],
                _ => 0.0,
            };
            self.smooth_share * deviation[i] * deviation[j] * (-d2 / (2.0 * self.length_px.powi(2))).exp() + gain * gain
        });
        let independent = deviation
            .iter()
            .map(|a| (1.0 - self.smooth_share) * a * a + self.floor.powi(2));
        (smooth, independent.collect())
    }

    /// Gaussian blur with zeros around the image.
    fn blur(&self, image: &[f64]) -> Vec<f64> {
        if self.blur_px <= 0.0 {
            return image.to_vec();
        }
        let kernel = |d2: f64| (-d2 / (2.0 * self.blur_px.powi(2))).exp();
        // the sum of the kernel over all taxels of the plane; beyond 40 deviations nothing is left in double precision
        let (mut line, mut d) = (1.0, 1.0);
        while d <= 40.0 * self.blur_px + 1.0 {
            line += 2.0 * kernel(d * d);
            d += 1.0;
        }
        let near = |i: usize| -> f64 {
            let terms = image.iter().enumerate();
            terms.map(|(j, v)| v * kernel(distance_squared(i, j, self.cols))).sum()
        };
        (0..image.len()).map(|i| near(i) / (line * line)).collect()
    }
}

/// Square of the distance of two taxels of a grid with `cols` columns.
fn distance_squared(i: usize, j: usize, cols: usize) -> f64 {
    let rows = (i / cols).abs_diff(j / cols) as f64;
    let columns = (i % cols).abs_diff(j % cols) as f64;
    rows * rows + columns * columns
}

/// The `rank` largest eigenvectors of a covariance, each times the root of its eigenvalue, and the trace of what is
/// left.
pub(super) fn principal(covariance: DMatrix<f64>, rank: usize) -> (Vec<Vec<f64>>, f64) {
    let eigen = covariance.symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
    // rounding may leave a zero eigenvalue a little below zero
    let value = |k: usize| eigen.eigenvalues[k].max(0.0);
    let (kept, left) = order.split_at(rank.min(order.len()));
    let factors = kept.iter().map(|&k| {
        eigen
            .eigenvectors
            .column(k)
            .iter()
            .map(|v| v * value(k).sqrt())
            .collect()
    });
    (factors.collect(), left.iter().map(|&k| value(k)).sum())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classify::Library;
    use crate::classify::evidence::Component;
    use crate::matrix::Matrix;

    fn library() -> Library {
        let image: Vec<f64> = (0..12).map(|i| if i % 3 == 0 { 2.0 } else { 0.0 }).collect();
        Library::new(&Matrix::from_column_slices(12, &[&image]), &[5]).unwrap()
    }

    /// With every eigenvector kept, F Fᵀ is the smooth part and the rest is white: together the stated Σ's trace.
    #[test]
    fn covariance_is_the_stated_one() {
        let model = TemplateModel {
            rank: 12,
            blur_px: 0.0,
            ..TemplateModel::new(4)
        };
        let c = &model.classes(&library()).unwrap()[0];
        let t = &c.mean;
        assert!((t.iter().copied().fold(0.0, f64::max) - 1.0).abs() < 1e-15);
        for i in 0..12 {
            for j in 0..12 {
                let got: f64 = c.factors.iter().map(|f| f[i] * f[j]).sum();
                let expected = 0.22_f64.powi(2) * 0.8 * t[i] * t[j] * (-distance_squared(i, j, 4) / 8.0).exp();
                // an eigendecomposition of a matrix of norm below 1
                assert!((got - expected).abs() < 1e-14, "({i}, {j}): {got}, expected {expected}");
            }
        }
        let square: f64 = t.iter().map(|v| v * v).sum();
        let white = 0.16 + 0.2 * 0.22_f64.powi(2) * square + 12.0 * 0.025_f64.powi(2);
        assert!(
            (c.noise_variance - white).abs() < 1e-14,
            "{} for {white}",
            c.noise_variance
        );
        let fewer = TemplateModel {
            rank: 2,
            ..model.clone()
        }
        .classes(&library())
        .unwrap();
        let trace = |c: &Component| c.factors.iter().flatten().map(|v| v * v).sum::<f64>() + c.noise_variance;
        assert!((trace(&fewer[0]) - trace(c)).abs() < 1e-14);
    }

    /// Gains of a skin that was not seen add γᵢ² tᵢ² to the variance of taxel i, and nothing between taxels.
    #[test]
    fn gains_of_another_skin_are_independent() {
        let same = TemplateModel {
            rank: 12,
            ..TemplateModel::new(4)
        };
        let gains: Vec<f64> = (0..12).map(|i| 0.1 * f64::from(i)).collect();
        let other = TemplateModel {
            gains: gains.clone(),
            ..same.clone()
        };
        let [a, b] = [same, other].map(|model| model.classes(&library()).unwrap().remove(0));
        for i in 0..12 {
            for j in 0..12 {
                let product = |c: &Component| c.factors.iter().map(|f| f[i] * f[j]).sum::<f64>();
                let expected = if i == j { (gains[i] * a.mean[i]).powi(2) } else { 0.0 };
                // eigendecompositions of matrices of norm below 1
                assert!((product(&b) - product(&a) - expected).abs() < 1e-14, "({i}, {j})");
            }
        }
        assert!((a.noise_variance - b.noise_variance).abs() < 1e-14);
    }

    #[test]
    fn blur_keeps_the_sum_of_an_image_far_from_the_edge() {
        let model = TemplateModel::new(15);
        let mut image = vec![0.0; 225];
        image[112] = 1.0;
        let sum: f64 = model.blur(&image).iter().sum();
        // 7 taxels are 10 deviations
        assert!((sum - 1.0).abs() < 1e-12, "{sum}");
    }
}
