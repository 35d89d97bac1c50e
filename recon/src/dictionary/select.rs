//! Selection of training images.

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
        Self {
            min_peak: 0.25,
            max_coherence: 0.95,
            max_images: 1500,
        }
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
#[must_use]
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

#[cfg(test)]
mod tests {
    use super::*;

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
        let selection = Selection {
            max_images: 2,
            ..Selection::default()
        };
        assert_eq!(select(&images, &selection), [1, 3]);
        assert_eq!(select(&images, &Selection::default()), [1, 3, 5]);
    }
}
