//! Differences between the neighbours of a grid.

/// Grid of pixels, row-major.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Grid {
    pub(super) rows: usize,
    pub(super) cols: usize,
}

impl Grid {
    /// Number of pixels.
    pub(super) fn pixels(self) -> usize {
        self.rows * self.cols
    }

    /// Number of pairs of neighbours: first the horizontal ones, row by row, then the vertical ones.
    pub(super) fn edges(self) -> usize {
        self.rows * self.cols.saturating_sub(1) + self.rows.saturating_sub(1) * self.cols
    }

    /// d = ∇x: later minus earlier pixel of every pair.
    pub(super) fn differences(self, x: &[f64], d: &mut [f64]) {
        let (across, down) = d.split_at_mut(self.rows * self.cols.saturating_sub(1));
        if self.cols > 1 {
            for (row, d) in x.chunks_exact(self.cols).zip(across.chunks_exact_mut(self.cols - 1)) {
                for (d, pair) in d.iter_mut().zip(row.windows(2)) {
                    *d = pair[1] - pair[0];
                }
            }
        }
        for ((d, above), below) in down.iter_mut().zip(x).zip(&x[self.cols.min(x.len())..]) {
            *d = below - above;
        }
    }

    /// x += ∇ᵀ p.
    pub(super) fn add_adjoint(self, p: &[f64], x: &mut [f64]) {
        let (across, down) = p.split_at(self.rows * self.cols.saturating_sub(1));
        if self.cols > 1 {
            for (row, p) in x.chunks_exact_mut(self.cols).zip(across.chunks_exact(self.cols - 1)) {
                for (i, &p) in p.iter().enumerate() {
                    row[i] -= p;
                    row[i + 1] += p;
                }
            }
        }
        for (i, &p) in down.iter().enumerate() {
            x[i] -= p;
            x[i + self.cols] += p;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn differences_of_a_small_grid() {
        let grid = Grid { rows: 2, cols: 3 };
        let mut d = vec![0.0; grid.edges()];
        grid.differences(&[1.0, 2.0, 4.0, 8.0, 16.0, 32.0], &mut d);
        assert_eq!(d, [1.0, 2.0, 8.0, 16.0, 7.0, 14.0, 28.0]);
    }

    proptest! {
        #[test]
        fn adjoint(rows in 1_usize..5, cols in 1_usize..5, seed in prop::collection::vec(-1.0..1.0, 60)) {
            let grid = Grid { rows, cols };
            let (x, p) = (&seed[..grid.pixels()], &seed[20..20 + grid.edges()]);
            let (mut d, mut back) = (vec![0.0; grid.edges()], vec![0.0; grid.pixels()]);
            grid.differences(x, &mut d);
            grid.add_adjoint(p, &mut back);
            let lhs: f64 = d.iter().zip(p).map(|(a, b)| a * b).sum();
            let rhs: f64 = x.iter().zip(&back).map(|(a, b)| a * b).sum();
            // at most 24 differences of numbers below 1, each rounded a handful of times
            prop_assert!((lhs - rhs).abs() <= 24.0 * 8.0 * f64::EPSILON);
        }
    }
}
