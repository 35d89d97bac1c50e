//! Images of a large skin without any learning: small contacts as patches, large ones on a coarser grid.

use super::RegionPursuit;
use crate::checks::other_columns;
use crate::kernels::{dot, norm};
use crate::matrix::{Matrix, MatrixView};
use crate::operator::{Centred, LinearOperator as _, SelectColumns, SignRows, centre_by_wire, mean_share};
use crate::problem::{Problem, Recover as _, Workspace};
use crate::recover::{Penalty, Stopping, Tv};
use rayon::prelude::*;
use spts_input::Refusal;
use std::ops::Range;

/// Finds contacts as patches ([`RegionPursuit`]), and solves for the taxels in them where there are measurements enough
/// to tell them apart: the bumps of a pursuit are wider than a taxel. An offset that all measurements share is left
/// out. Time is proportional to measurements × taxels, memory to their sum beside Φ.
///
/// ```
/// use spts_recon::matrix_free::Patches;
/// use spts_recon::operator::{LinearOperator as _, SignRows};
///
/// // 40 × 40 taxels, a block of 3 × 3 is pressed, 240 rows of signs as bits
/// let word = |k: u64| (k + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(29).wrapping_mul(0xbf58_476d_1ce4_e5b9);
/// let bits: Vec<u64> = (0..240 * 25).map(|k| word(word(k))).collect();
/// let phi = SignRows::new(&bits, 1600);
/// let pressed = |k: usize| (10..13).contains(&(k / 40)) && (20..23).contains(&(k % 40));
/// let image: Vec<f64> = (0..1600).map(|k| if pressed(k) { 2.0 } else { 0.0 }).collect();
/// let mut y = vec![0.0; 240];
/// phi.apply(&image, &mut y);
/// y.iter_mut().for_each(|y| *y += 5.0);
/// let found = Patches::new(40, 40).recover(phi, &y, &[])?;
/// assert!((0..1600).all(|k| (found[k] - image[k]).abs() < 0.1));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Patches {
    rows: usize,
    cols: usize,
}

/// Rounds of a pursuit.
const MAX_ROUNDS: usize = 10;
/// Taxels count as part of a contact from this share of the image's maximum on: half the share of a support.
const PART: f64 = 0.1;
/// Measurements a taxel at least: with fewer, smoothness has to do.
const MEASUREMENTS_A_TAXEL: usize = 2;
/// Most taxels that are solved for.
const MOST_TAXELS: usize = 2048;
/// Sweeps of the coordinate descent.
const SWEEPS: usize = 100;

/// Finds contacts of any size on a large skin, by one of two methods: as small patches ([`Patches`]), or as an image of
/// small total variation ([`Tv`]) on a coarse grid, whose square cells cover several taxels each. The last ninth of the
/// measurements is kept back for the choice: the method with the smaller residual on them decodes all measurements. The
/// coarse grid is not tried if the residual of the patches is below half of the norm of these measurements, or if there
/// are fewer than 18 measurements. An offset that all measurements of a wire share is removed.
///
/// ```
/// use spts_recon::Matrix;
/// use spts_recon::matrix_free::OnSheet;
/// use spts_recon::operator::LinearOperator as _;
///
/// // half of 60 × 60 taxels is pressed: no patches; cells of 2 × 2 taxels show it
/// let sign = |k: u64| if (k * k + 7).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 63 == 1 { 1.0 } else { -1.0 };
/// let phi = Matrix::from_rows(200, 3600, (0..200 * 3600).map(sign).collect())?;
/// let image: Vec<f64> = (0..3600).map(|k| if k % 60 < 30 { 1.0 } else { 0.0 }).collect();
/// let mut y = vec![0.0; 200];
/// phi.apply(&image, &mut y);
/// let found = OnSheet::new(60, 60, 900).recover(phi.view(), &y, &[])?;
/// let off = (0..3600).filter(|k| (found[*k] - image[*k]).abs() > 0.3).count();
/// assert!(off < 36, "{off}");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OnSheet {
    patches: Patches,
    /// Cells at most.
    cells: usize,
}

/// Patches are taken without a look at cells where they leave less than this share of what is kept back.
const EXPLAINED: f64 = 0.5;
/// One measurement in so many is kept back.
const KEPT_BACK: usize = 9;
/// Most cells for each measurement: more are not told apart.
const CELLS_A_MEASUREMENT: usize = 4;
/// Weight of the total variation, as a share of the largest correlation.
const VARIATION: Penalty = Penalty::Relative(0.02);

/// Cells are coarse: the gap need not be small.
const STOPPING: Stopping = Stopping { tol: 1e-4, max_iter: 20_000 };

impl OnSheet {
    /// Usual limit on the number of cells. More cells take longer, and do not improve images of contacts that patches
    /// fail on.
    pub const CELLS: usize = 2500;

    /// A decoder for images of `rows` × `cols` taxels. Its coarse grid has at most `cells` square cells, and at most
    /// four cells for each measurement; the side of a cell is the smallest whole number of taxels that allows this.
    pub fn new(rows: usize, cols: usize, cells: usize) -> Self {
        Self { patches: Patches::new(rows, cols), cells }
    }

    /// Side of a cell, taxels, for so many measurements.
    fn side(&self, measurements: usize) -> usize {
        let Patches { rows, cols } = self.patches;
        let most = self.cells.min(CELLS_A_MEASUREMENT * measurements).max(1);
        (1..).find(|side| rows.div_ceil(*side) * cols.div_ceil(*side) <= most).unwrap_or(1)
    }

    /// The image of `y`, one value a taxel, in the unit of `y` over that of Φ. `wires` has the wire of every
    /// measurement, or nothing for one wire.
    ///
    /// # Errors
    /// As [`RegionPursuit::recover`].
    pub fn recover<A: Rows>(&self, phi: A, y: &[f64], wires: &[u16]) -> Result<Vec<f64>, Refusal> {
        let Patches { rows, cols } = self.patches;
        if phi.ncols() != rows * cols {
            return Err(other_columns(phi.ncols(), rows * cols));
        }
        if y.len() < 2 * KEPT_BACK {
            return self.patches.recover(phi, y, wires);
        }
        let seen = y.len() - y.len() / KEPT_BACK;
        let (first, last) = match wires {
            [] => (wires, wires),
            _ => wires.split_at(seen),
        };
        let seen_as_patches = self.patches.recover(phi.rows(0..seen), &y[..seen], first)?;
        let missed = |image: &[f64]| {
            let mut rest = vec![0.0; y.len() - seen];
            phi.rows(seen..y.len()).apply(image, &mut rest);
            rest.iter_mut().zip(&y[seen..]).for_each(|(sum, y)| *sum -= y);
            centre_by_wire(&mut rest, last);
            norm(&rest)
        };
        let side = self.side(y.len());
        let missed_by_patches = missed(&seen_as_patches);
        if missed_by_patches < EXPLAINED * missed(&vec![0.0; rows * cols]) {
            return self.patches.recover(phi, y, wires);
        }
        let cells = phi.cells([rows, cols], side);
        // total variation that does not converge is no candidate
        let Ok(seen_on_cells) = self.on_cells(side, cells.view().rows(0, seen), &y[..seen], first) else {
            return self.patches.recover(phi, y, wires);
        };
        if missed(&seen_on_cells) < missed_by_patches {
            return Ok(self.on_cells(side, cells.view(), y, wires).unwrap_or(seen_on_cells));
        }
        self.patches.recover(phi, y, wires)
    }

    /// The image of small total variation on the cells, whose sums are `cells`, measurements × cells.
    fn on_cells(&self, side: usize, cells: MatrixView<'_>, y: &[f64], wires: &[u16]) -> Result<Vec<f64>, Refusal> {
        let Patches { rows, cols } = self.patches;
        let [down, across] = [rows, cols].map(|n| n.div_ceil(side));
        let mut sums = Matrix::from_rows(cells.nrows(), cells.ncols(), cells.values().to_vec())?;
        without_means(&mut sums, wires);
        let mut centred = y.to_vec();
        centre_by_wire(&mut centred, wires);
        let mut tv = Tv::new(down, across, VARIATION)?;
        tv.stopping = STOPPING;
        let found = tv.recover(&Problem::new(sums.view(), &centred)?, &mut Workspace::default())?;
        let mut image = vec![0.0; down * across];
        found.scatter(&mut image);
        let cell = |k: usize| k / cols / side * across + k % cols / side;
        Ok((0..rows * cols).map(|k| image[cell(k)]).collect())
    }
}

/// Rows of Φ of which some can be taken, and whose weights can be added up over cells.
pub trait Rows: SelectColumns<Selected = Matrix> + Copy {
    /// The rows with these numbers.
    fn rows(self, range: Range<usize>) -> Self;

    /// Sums of the weights over the square cells of `side` taxels of a sheet of this `shape`: measurements × cells. The
    /// last cells of a row or a column may be smaller.
    fn cells(self, shape: [usize; 2], side: usize) -> Matrix;
}

/// Sums over cells of a row whose weight of taxel k is `weight(k)`.
fn add_cells([rows, cols]: [usize; 2], side: usize, weight: impl Fn(usize) -> f64, out: &mut [f64]) {
    let across = cols.div_ceil(side);
    for row in 0..rows {
        let line = &mut out[row / side * across..][..across];
        for col in 0..cols {
            line[col / side] += weight(row * cols + col);
        }
    }
}

impl Rows for MatrixView<'_> {
    fn rows(self, range: Range<usize>) -> Self {
        MatrixView::rows(self, range.start, range.len())
    }

    fn cells(self, shape: [usize; 2], side: usize) -> Matrix {
        let count = shape.map(|n| n.div_ceil(side)).iter().product();
        let mut sums = Matrix::zeros(self.nrows(), count);
        for (r, row) in self.values().chunks_exact(self.ncols().max(1)).enumerate() {
            add_cells(shape, side, |k| row[k], sums.row_mut(r));
        }
        sums
    }
}

impl Rows for SignRows<'_> {
    fn rows(self, range: Range<usize>) -> Self {
        self.part(range)
    }

    fn cells(self, shape: [usize; 2], side: usize) -> Matrix {
        let count: usize = shape.map(|n| n.div_ceil(side)).iter().product();
        let mut sums = vec![0.0; self.nrows() * count];
        sums.par_chunks_exact_mut(count.max(1)).enumerate().for_each(|(r, out)| {
            add_cells(shape, side, |k| self.weight(r, k), out);
        });
        // as many numbers as rows times cells
        Matrix::from_rows(self.nrows(), count, sums).unwrap_or_else(|_| Matrix::zeros(self.nrows(), count))
    }
}

impl Patches {
    /// Images of `rows` × `cols` taxels.
    pub fn new(rows: usize, cols: usize) -> Self {
        Self { rows, cols }
    }

    /// The image of `y`, one value a taxel, in the unit of `y` over that of Φ. `wires` has the wire of every
    /// measurement, or nothing for one wire.
    ///
    /// # Errors
    /// As [`RegionPursuit::recover`].
    pub fn recover<A>(&self, phi: A, y: &[f64], wires: &[u16]) -> Result<Vec<f64>, Refusal>
    where
        A: SelectColumns<Selected = Matrix> + Copy,
    {
        let taxels = self.rows * self.cols;
        if phi.ncols() != taxels {
            return Err(other_columns(phi.ncols(), taxels));
        }
        let pursuit = RegionPursuit { max_rounds: MAX_ROUNDS, ..RegionPursuit::new(self.rows, self.cols) };
        let mut centred = y.to_vec();
        centre_by_wire(&mut centred, wires);
        let mut image = pursuit.recover(&Centred::by_wire(phi, wires), &centred)?;
        if let Some(taxels) = contact_taxels(&image, y.len()) {
            let mut columns = phi.select_columns(&taxels);
            without_means(&mut columns, wires);
            let start: Vec<f64> = taxels.iter().map(|k| image[*k]).collect();
            image.fill(0.0);
            for (k, v) in taxels.iter().zip(non_negative(&columns, &centred, &start)) {
                image[*k] = v;
            }
        }
        Ok(image)
    }
}

/// Takes the mean off every column, wire by wire.
fn without_means(columns: &mut Matrix, wires: &[u16]) {
    let count = wires.iter().max().map_or(1, |wire| usize::from(*wire) + 1);
    let wire = |r: usize| wires.get(r).map_or(0, |wire| usize::from(*wire));
    let (mut sums, mut numbers) = (Matrix::zeros(count, columns.ncols()), vec![0.0; count]);
    for r in 0..columns.nrows() {
        sums.row_mut(wire(r)).iter_mut().zip(columns.row(r)).for_each(|(sum, v)| *sum += v);
        numbers[wire(r)] += 1.0;
    }
    for r in 0..columns.nrows() {
        let (sums, number) = (sums.row(wire(r)), numbers[wire(r)]);
        let share = if wires.is_empty() { 1.0 / number } else { mean_share(number) };
        columns.row_mut(r).iter_mut().zip(sums).for_each(|(v, sum)| *v -= sum * share);
    }
}

/// The taxels that belong to the contacts of `image`, when `measurements` are enough to tell them apart.
fn contact_taxels(image: &[f64], measurements: usize) -> Option<Vec<usize>> {
    let least = PART * image.iter().copied().fold(0.0, f64::max);
    let taxels: Vec<usize> = (0..image.len()).filter(|k| image[*k] > least).collect();
    let most = (measurements / MEASUREMENTS_A_TAXEL).min(MOST_TAXELS);
    (1..=most).contains(&taxels.len()).then_some(taxels)
}

/// The x ≥ 0 with the least ‖`columns` x − y‖, from `start` on: coordinate descent on the normal equations, in the
/// order of the columns. Source: V. Franc, V. Hlaváč, M. Navara, CAIP 2005, "Sequential coordinate-wise algorithm".
fn non_negative(columns: &Matrix, y: &[f64], start: &[f64]) -> Vec<f64> {
    let n = columns.ncols();
    let columns: Vec<Vec<f64>> = (0..n).map(|k| columns.column(k)).collect();
    let mut gram = vec![0.0; n * n];
    for k in 0..n {
        for l in 0..=k {
            let product = dot(&columns[k], &columns[l]);
            (gram[k * n + l], gram[l * n + k]) = (product, product);
        }
    }
    let mut x: Vec<f64> = start.iter().map(|v| v.max(0.0)).collect();
    // gradient of half the square
    let mut gradient: Vec<f64> = (0..n).map(|k| dot(&gram[k * n..(k + 1) * n], &x) - dot(&columns[k], y)).collect();
    for _ in 0..SWEEPS {
        for k in 0..n {
            let diagonal = gram[k * n + k];
            if diagonal <= 0.0 {
                continue;
            }
            let step = (x[k] - gradient[k] / diagonal).max(0.0) - x[k];
            if step != 0.0 {
                x[k] += step;
                gradient.iter_mut().zip(&gram[k * n..(k + 1) * n]).for_each(|(g, a)| *g += step * a);
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
