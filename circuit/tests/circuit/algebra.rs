//! Least squares and rank, enough for the tests.

/// Solves the symmetric positive definite system by Gauss elimination; `a` is row-major n × n.
fn solve(mut a: Vec<f64>, mut b: Vec<f64>) -> Vec<f64> {
    let n = b.len();
    for k in 0..n {
        for i in k + 1..n {
            let f = a[i * n + k] / a[k * n + k];
            for j in k..n {
                a[i * n + j] -= f * a[k * n + j];
            }
            b[i] -= f * b[k];
        }
    }
    for k in (0..n).rev() {
        for j in k + 1..n {
            b[k] -= a[k * n + j] * b[j];
        }
        b[k] /= a[k * n + k];
    }
    b
}

/// Least-squares solution of rows · x ≈ y by the normal equations.
pub(crate) fn least_squares(rows: &[Vec<f64>], y: &[f64]) -> Vec<f64> {
    let n = rows[0].len();
    let (mut ata, mut aty) = (vec![0.0; n * n], vec![0.0; n]);
    for (row, y) in rows.iter().zip(y) {
        for i in 0..n {
            for j in 0..n {
                ata[i * n + j] += row[i] * row[j];
            }
            aty[i] += row[i] * y;
        }
    }
    solve(ata, aty)
}

/// Rank by elimination with full pivoting; entries below `tol` count as zero.
pub(crate) fn rank(mut rows: Vec<Vec<f64>>, tol: f64) -> usize {
    let mut rank = 0;
    while rank < rows.len() {
        let pivot = (rank..rows.len())
            .flat_map(|i| (0..rows[i].len()).map(move |j| (i, j)))
            .max_by(|a, b| rows[a.0][a.1].abs().total_cmp(&rows[b.0][b.1].abs()))
            .unwrap();
        if rows[pivot.0][pivot.1].abs() <= tol {
            break;
        }
        rows.swap(rank, pivot.0);
        let top = rows[rank].clone();
        for row in &mut rows[rank + 1..] {
            let f = row[pivot.1] / top[pivot.1];
            for (r, t) in row.iter_mut().zip(&top) {
                *r -= f * t;
            }
            row[pivot.1] = 0.0;
        }
        rank += 1;
    }
    rank
}
