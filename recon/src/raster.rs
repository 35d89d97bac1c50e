//! The baseline: a raster scan of few pixels, interpolated to the whole array.
//!
//! ```
//! use spts_recon::raster::Interpolation;
//!
//! // two of three pixels in a line are measured; the one between gets their mean or the nearest one's value
//! let scan = Interpolation::evenly_spaced(1, 3, 2);
//! let mut image = [0.0; 3];
//! scan.apply(&[1.0, 7.0, 3.0], &mut image);
//! assert_eq!(scan.measured(), [0, 2]);
//! assert!((1.0..=3.0).contains(&image[1]));
//! ```

use spade::{DelaunayTriangulation, FloatTriangulation as _, HasPosition, Point2, Triangulation as _};

/// Linear map from the readings of `measured` pixels to the whole image: every pixel is a weighted mean of up to three
/// measured ones.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolation {
    measured: Vec<usize>,
    weights: Vec<Vec<(usize, f64)>>,
}

struct Site {
    position: Point2<f64>,
    slot: usize,
}

impl HasPosition for Site {
    type Scalar = f64;
    fn position(&self) -> Point2<f64> {
        self.position
    }
}

impl Interpolation {
    /// A scan of `measurements` evenly spaced pixels of a `rows × cols` array: pixels round(i·(N−1)/(M−1)).
    /// Interpolation is linear on their Delaunay triangulation. Outside their convex hull, and everywhere if they lie
    /// on a line, the nearest measured pixel is used.
    pub fn evenly_spaced(rows: usize, cols: usize, measurements: usize) -> Self {
        Self::new(rows, cols, evenly_spaced(rows * cols, measurements))
    }

    fn new(rows: usize, cols: usize, measured: Vec<usize>) -> Self {
        let mut triangulation = DelaunayTriangulation::<Site>::new();
        for (slot, &pixel) in measured.iter().enumerate() {
            let site = Site { position: point(pixel, cols), slot };
            // the coordinates are small integers, so insertion cannot fail
            let _ = triangulation.insert(site);
        }
        let barycentric = triangulation.barycentric();
        let mut found = Vec::new();
        let weights = (0..rows * cols)
            .map(|pixel| {
                barycentric.get_weights(point(pixel, cols), &mut found);
                if found.is_empty() {
                    return nearest(&measured, pixel, cols).map(|slot| (slot, 1.0)).into_iter().collect();
                }
                found.iter().map(|(vertex, w)| (triangulation.vertex(*vertex).data().slot, *w)).collect()
            })
            .collect();
        Self { measured, weights }
    }

    /// The measured pixels, in scan order.
    pub fn measured(&self) -> &[usize] {
        &self.measured
    }

    /// Reads `image` at the measured pixels and interpolates them to the whole array.
    pub fn apply(&self, image: &[f64], out: &mut [f64]) {
        for (o, weights) in out.iter_mut().zip(&self.weights) {
            *o = weights.iter().map(|&(slot, w)| w * image[self.measured[slot]]).sum();
        }
    }
}

/// `m` evenly spaced indices of `0..n`, both ends included.
#[expect(clippy::cast_possible_truncation, reason = "indices of an array, rounded on purpose")]
fn evenly_spaced(n: usize, m: usize) -> Vec<usize> {
    let m = m.min(n);
    if m <= 1 {
        return (0..m).collect();
    }
    (0..m).map(|i| (i as f64 * (n - 1) as f64 / (m - 1) as f64).round() as usize).collect()
}

fn point(pixel: usize, cols: usize) -> Point2<f64> {
    Point2::new((pixel % cols) as f64, (pixel / cols) as f64)
}

fn nearest(measured: &[usize], pixel: usize, cols: usize) -> Option<usize> {
    let square = |other: usize| {
        let (dr, dc) = ((other / cols).abs_diff(pixel / cols), (other % cols).abs_diff(pixel % cols));
        dr * dr + dc * dc
    };
    (0..measured.len()).min_by_key(|&slot| square(measured[slot]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_scan_is_the_image() {
        let image: Vec<f64> = (0..30).map(|i| f64::from(i).sin()).collect();
        let mut out = vec![0.0; 30];
        Interpolation::evenly_spaced(5, 6, 30).apply(&image, &mut out);
        for (a, b) in image.iter().zip(&out) {
            assert!((a - b).abs() < 1e-12);
        }
    }

    /// A plane is reproduced inside the hull of the measured pixels.
    #[test]
    fn linear_images_are_interpolated_exactly() {
        let (rows, cols) = (10, 10);
        let plane: Vec<f64> = (0..100).map(|i| 0.3 * f64::from(i % 10) - 0.7 * f64::from(i / 10)).collect();
        let corners = Interpolation::new(rows, cols, vec![0, 9, 44, 90, 99]);
        let mut out = vec![0.0; 100];
        corners.apply(&plane, &mut out);
        for (a, b) in plane.iter().zip(&out) {
            assert!((a - b).abs() < 1e-12, "{a} against {b}");
        }
    }

    #[test]
    fn pixels_on_a_line_fall_back_to_the_nearest() {
        // 10 evenly spaced pixels of 10 × 10 are the diagonal
        let scan = Interpolation::evenly_spaced(10, 10, 10);
        assert_eq!(scan.measured(), [0, 11, 22, 33, 44, 55, 66, 77, 88, 99]);
        let mut out = vec![f64::NAN; 100];
        scan.apply(&(0..100).map(f64::from).collect::<Vec<_>>(), &mut out);
        assert!(out.iter().all(|v| v.is_finite()));
        assert!((out[12] - 11.0).abs() < 1e-12 || (out[12] - 22.0).abs() < 1e-12);
    }

    #[test]
    fn one_and_no_measurement() {
        for m in [0, 1, 2] {
            let mut out = vec![f64::NAN; 4];
            Interpolation::evenly_spaced(2, 2, m).apply(&[5.0, 1.0, 1.0, 5.0], &mut out);
            assert!(out.iter().all(|v| v.is_finite()), "M = {m}");
        }
    }
}
