//! Order in which rows are put out.

use crate::matrix::MatrixView;

/// Orders `rows` (M × N) so that levels change least from one row to the next and from the last to the first. The cost
/// is the sum over taxels of `weights` times the squared change, because late cells and a settling amplifier cause
/// errors at changes. The order begins with row 0. It is built from nearest neighbours and improved by reversing
/// sections while this helps (G. A. Croes, Oper. Res. 6 (1958) 791).
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::rows::fewest_flips;
///
/// let rows = Matrix::from_rows(4, 2, vec![1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0])?;
/// let order = fewest_flips(rows.view(), &[1.0, 1.0]);
/// let flips = |a: usize, b: usize| rows.row(a).iter().zip(rows.row(b)).filter(|(a, b)| a != b).count();
/// assert!((0..4).all(|k| flips(order[k], order[(k + 1) % 4]) == 1));
/// # Ok::<(), spts_recon::ShapeError>(())
/// ```
///
/// # Panics
/// If the number of weights differs from that of the taxels.
#[must_use]
pub fn fewest_flips(rows: MatrixView<'_>, weights: &[f64]) -> Vec<usize> {
    let (m, n) = (rows.nrows(), rows.ncols());
    assert_eq!(weights.len(), n, "weights");
    let row = |r: usize| &rows.values()[r * n..(r + 1) * n];
    let distance = |a: usize, b: usize| {
        let pairs = row(a).iter().zip(row(b)).zip(weights);
        pairs.map(|((a, b), w)| w * (a - b) * (a - b)).sum::<f64>()
    };
    let table: Vec<f64> = (0..m * m).map(|k| distance(k / m, k % m)).collect();
    let between = |a: usize, b: usize| table[a * m + b];
    let mut order: Vec<usize> = Vec::with_capacity(m);
    let mut left: Vec<usize> = (0..m).collect();
    while !left.is_empty() {
        let next = match order.last() {
            None => 0,
            Some(&last) => {
                let each = (0..left.len()).map(|k| (between(last, left[k]), k));
                each.fold((f64::INFINITY, 0), |a, b| if b.0 < a.0 { b } else { a }).1
            }
        };
        order.push(left.remove(next));
    }
    let mut gained = true;
    while gained {
        gained = false;
        for i in 1..m {
            for j in i + 1..m {
                let (before, after) = (order[i - 1], order[(j + 1) % m]);
                let now = between(before, order[i]) + between(order[j], after);
                let turned = between(before, order[j]) + between(order[i], after);
                if turned < now * (1.0 - 1e-12) {
                    order[i..=j].reverse();
                    gained = true;
                }
            }
        }
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::matrix::Matrix;

    /// Rows that differ in one taxel each make a loop of four flips; the taxel without weight does not count.
    #[test]
    fn a_loop_of_single_flips_is_found() {
        let rows = [[1.0, 1.0, 1.0], [-1.0, -1.0, -1.0], [-1.0, 1.0, 1.0], [1.0, -1.0, -1.0]];
        let matrix = Matrix::from_rows(4, 3, rows.concat()).unwrap();
        let order = fewest_flips(matrix.view(), &[1.0, 1.0, 0.0]);
        assert_eq!(order[0], 0);
        let flips: f64 = (0..4)
            .map(|k| {
                let (a, b) = (rows[order[k]], rows[order[(k + 1) % 4]]);
                (0..2).map(|i| (a[i] - b[i]).abs() / 2.0).sum::<f64>()
            })
            .sum();
        assert!((flips - 4.0).abs() < 1e-12, "{order:?}: {flips}");
        assert_eq!(
            fewest_flips(Matrix::from_rows(1, 3, vec![1.0; 3]).unwrap().view(), &[1.0; 3]),
            [0]
        );
    }
}
