//! Refines found contacts by solving for their taxels individually.

use spts_recon::Matrix;

/// Taxels count as part of a contact from this share of the image's maximum on: half the share of a support.
const PART: f64 = 0.1;
/// Measurements a taxel at least: with fewer, smoothness has to do.
const MEASUREMENTS_A_TAXEL: usize = 2;
/// Sweeps of the coordinate descent.
const SWEEPS: usize = 100;

/// The taxels that belong to the contacts of `image`, when `measurements` are enough to tell them apart.
pub(super) fn contact_taxels(image: &[f64], measurements: usize) -> Option<Vec<usize>> {
    let least = PART * image.iter().copied().fold(0.0, f64::max);
    let taxels: Vec<usize> = (0..image.len()).filter(|k| image[*k] > least).collect();
    (!taxels.is_empty() && MEASUREMENTS_A_TAXEL * taxels.len() <= measurements).then_some(taxels)
}

/// The x ≥ 0 with the least ‖`columns` x − y‖, from `start` on: coordinate descent on the normal equations, in the
/// order of the columns. Source: V. Franc, V. Hlaváč, M. Navara, CAIP 2005, "Sequential coordinate-wise algorithm".
pub(super) fn non_negative(columns: &Matrix, y: &[f64], start: &[f64]) -> Vec<f64> {
    let n = columns.ncols();
    let columns: Vec<Vec<f64>> = (0..n).map(|k| columns.column(k)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let gram: Vec<f64> = (0..n * n).map(|e| dot(&columns[e / n], &columns[e % n])).collect();
    let mut x: Vec<f64> = start.iter().map(|v| v.max(0.0)).collect();
    // gradient of half the square
    let mut gradient: Vec<f64> = (0..n)
        .map(|k| dot(&gram[k * n..(k + 1) * n], &x) - dot(&columns[k], y))
        .collect();
    for _ in 0..SWEEPS {
        for k in 0..n {
            let diagonal = gram[k * n + k];
            if diagonal <= 0.0 {
                continue;
            }
            let step = (x[k] - gradient[k] / diagonal).max(0.0) - x[k];
            if step != 0.0 {
                x[k] += step;
                gradient
                    .iter_mut()
                    .zip(&gram[k * n..(k + 1) * n])
                    .for_each(|(g, a)| *g += step * a);
            }
        }
    }
    x
}

#[cfg(test)]
mod tests {
    use super::*;

    /// By hand: of y = (1, −1) the unit columns keep the first; and an exact solution is found where there is one.
    #[test]
    fn the_least_squares_are_not_negative() {
        let unit = Matrix::from_rows(2, 2, vec![1.0, 0.0, 0.0, 1.0]).unwrap();
        let x = non_negative(&unit, &[1.0, -1.0], &[0.0, 5.0]);
        assert!((x[0] - 1.0).abs() < 1e-12 && x[1].abs() < 1e-12, "{x:?}");
        // (2, 0.5) through three rows
        let a = Matrix::from_rows(3, 2, vec![1.0, 1.0, 1.0, -1.0, 1.0, 1.0]).unwrap();
        let x = non_negative(&a, &[2.5, 1.5, 2.5], &[0.0, 0.0]);
        assert!((x[0] - 2.0).abs() < 1e-9 && (x[1] - 0.5).abs() < 1e-9, "{x:?}");
        assert_eq!(contact_taxels(&[0.0, 1.0, 0.05, 0.5], 4), Some(vec![1, 3]));
        assert_eq!(contact_taxels(&[0.0, 1.0, 0.05, 0.5], 3), None);
        assert_eq!(contact_taxels(&[0.0; 4], 3), None);
    }
}
