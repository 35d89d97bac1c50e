//! Centre of mass of an image.

/// Centre of mass of an image, as (row, col) in taxels: Σ vᵢ rᵢ / Σ vᵢ over the positive values above `threshold` ·
/// max. `None` if there are none. The threshold keeps noise from shifting the centre.
///
/// ```
/// use spts_recon::localise::{centre_of_mass, distance};
///
/// let image = [0.1, 0.0, 0.0, 0.0, 2.0, 2.0]; // 2 rows, 3 columns, noise in a corner
/// let centre = centre_of_mass(&image, 3, 0.23).expect("a contact");
/// assert!(distance(centre, [1.0, 1.5]) < 1e-12);
/// ```
#[must_use]
pub fn centre_of_mass(image: &[f64], cols: usize, threshold: f64) -> Option<[f64; 2]> {
    let max = image.iter().copied().fold(0.0_f64, f64::max);
    let floor = (threshold * max).max(0.0);
    let (mut sum, mut row, mut col) = (0.0, 0.0, 0.0);
    for (i, &v) in image.iter().enumerate().filter(|(_, v)| **v > floor) {
        sum += v;
        row += v * (i / cols) as f64;
        col += v * (i % cols) as f64;
    }
    (sum > 0.0).then(|| [row / sum, col / sum])
}

/// Euclidean distance between two positions, in taxels.
#[must_use]
pub fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centre_of_a_symmetric_cross() {
        let mut image = vec![0.0; 25];
        for i in [7, 11, 12, 13, 17] {
            image[i] = 2.0;
        }
        image[0] = 0.1; // below the threshold
        assert_eq!(centre_of_mass(&image, 5, 0.23), Some([2.0, 2.0]));
        assert_eq!(centre_of_mass(&[0.0; 25], 5, 0.23), None);
    }
}
