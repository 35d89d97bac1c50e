//! Smooth images with few coefficients: one small bump at every candidate place.

use crate::operator::LinearOperator;

/// Bumps reach this many standard deviations: e^−4.5 of the peak.
const REACH_SD: f64 = 3.0;

/// Dictionary of one bump, a Gaussian of unit sum, at some places of an image; its rows are the taxels that the bumps
/// touch.
#[derive(Debug)]
pub(super) struct Grains {
    /// Places, increasing.
    places: Vec<usize>,
    /// Taxels covered by a bump, in increasing order.
    taxels: Vec<usize>,
    /// For every place, the rows of its taxels and the bump's value there.
    entries: Vec<Vec<(usize, f64)>>,
}

impl Grains {
    /// Bumps with the standard deviation `sd_taxels` ≥ 0 at `places`, in increasing order, of an image of `rows` ×
    /// `cols`. With 0, a bump is a taxel.
    pub(super) fn new((rows, cols): (usize, usize), places: Vec<usize>, sd_taxels: f64) -> Self {
        let bump = bump(sd_taxels);
        let around = |place: usize| {
            let (r, c) = (place / cols, place % cols);
            let inside = move |&(dr, dc, v): &(isize, isize, f64)| {
                let (r, c) = (r.checked_add_signed(dr)?, c.checked_add_signed(dc)?);
                (r < rows && c < cols).then_some((r * cols + c, v))
            };
            bump.iter().filter_map(inside)
        };
        let mut touched = vec![false; rows * cols];
        places
            .iter()
            .flat_map(|p| around(*p))
            .for_each(|(taxel, _)| touched[taxel] = true);
        let taxels: Vec<usize> = (0..rows * cols).filter(|k| touched[*k]).collect();
        let mut row_of = vec![0; rows * cols];
        taxels.iter().enumerate().for_each(|(row, taxel)| row_of[*taxel] = row);
        let entries = places
            .iter()
            .map(|p| around(*p).map(|(taxel, v)| (row_of[taxel], v)).collect())
            .collect();
        Self {
            places,
            taxels,
            entries,
        }
    }

    /// Places of the columns.
    pub(super) fn places(&self) -> &[usize] {
        &self.places
    }

    /// Taxels of the rows.
    pub(super) fn taxels(&self) -> &[usize] {
        &self.taxels
    }

    /// Length of a bump that no edge cuts.
    pub(super) fn length(sd_taxels: f64) -> f64 {
        bump(sd_taxels).iter().map(|(_, _, v)| v * v).sum::<f64>().sqrt()
    }

    /// Numbers of bytes that the dictionary holds.
    pub(super) fn bytes(&self) -> usize {
        let entries: usize = self.entries.iter().map(Vec::len).sum();
        entries * size_of::<(usize, f64)>() + (self.places.len() + self.taxels.len()) * size_of::<usize>()
    }
}

/// Offsets and values of a bump of unit sum.
fn bump(sd_taxels: f64) -> Vec<(isize, isize, f64)> {
    #[expect(clippy::cast_possible_truncation, reason = "a bump is a few taxels wide")]
    let reach = (REACH_SD * sd_taxels).floor() as isize;
    let height = |d: isize| match d {
        0 => 1.0,
        _ => (-0.5 * (d as f64 / sd_taxels).powi(2)).exp(),
    };
    let line = || -reach..=reach;
    let mut bump: Vec<_> = line()
        .flat_map(|r| line().map(move |c| (r, c, height(r) * height(c))))
        .collect();
    let sum: f64 = bump.iter().map(|(_, _, v)| v).sum();
    bump.iter_mut().for_each(|(_, _, v)| *v /= sum);
    bump
}

impl LinearOperator for Grains {
    fn nrows(&self) -> usize {
        self.taxels.len()
    }

    fn ncols(&self) -> usize {
        self.places.len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        y.fill(0.0);
        for (entries, x) in self.entries.iter().zip(x) {
            entries.iter().for_each(|&(row, v)| y[row] += v * x);
        }
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        for (entries, x) in self.entries.iter().zip(x) {
            *x = entries.iter().map(|&(row, v)| v * y[row]).sum();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::check_operator;

    #[test]
    fn bumps_have_unit_sum_and_are_cut_at_the_edges() {
        let grains = Grains::new((5, 6), vec![0, 14], 0.6);
        check_operator(&grains);
        // one taxel of reach: 4 taxels in the corner, 9 inside
        assert_eq!(grains.taxels(), [0, 1, 6, 7, 8, 9, 13, 14, 15, 19, 20, 21]);
        let mut image = vec![0.0; 12];
        grains.apply(&[0.0, 1.0], &mut image);
        assert!((image.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        let single = Grains::new((5, 6), vec![3], 0.0);
        assert_eq!((single.taxels(), single.nrows()), (&[3][..], 1));
        assert!((Grains::length(0.0) - 1.0).abs() < 1e-15);
    }
}
