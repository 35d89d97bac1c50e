//! Influence coefficients: displacement at the centre of one grid square under unit pressure on another one.

use super::deficit::{Deficit, REACH};
use super::kernel::{ElasticKernel, confined_stiffness_pa_per_m};
use super::quadrature::gauss_legendre;
use std::f64::consts::PI;

/// How far the surface of an elastic body yields at the centre of one grid square under 1 Pa on another one, m/Pa, by
/// the rows and columns between the two.
///
/// ```
/// use spts_contact::{ElasticKernel, Influence};
///
/// let kernel = ElasticKernel::HalfSpace { modulus_pa: 150e3, poisson: 0.2 };
/// let influence = Influence::new(&kernel, [20, 20], 2.5e-3);
/// // far from a square its pressure acts as a point force: u = F (1 − ν²)/(π E r)
/// let force_n = 2.5e-3 * 2.5e-3; // 1 Pa on the square
/// let point_m = force_n * 0.96 / (std::f64::consts::PI * 150e3 * 15.0 * 2.5e-3);
/// assert!((influence.at(0, 15) / point_m - 1.0).abs() < 1e-3);
/// ```
#[derive(Debug, Clone)]
pub struct Influence {
    rows: usize,
    cols: usize,
    values: Vec<f64>,
    bulge: Bulge,
}

/// Bounds of the rise of the surface beside a load, 0 for a half-space.
#[derive(Debug, Clone, Copy, Default)]
struct Bulge {
    /// Largest rise under unit pressure on one cell, m/Pa.
    one_m_per_pa: f64,
    /// Rise under unit pressure on every cell that raises the surface, m/Pa.
    all_m_per_pa: f64,
}

/// From this cell size on, in thicknesses, a cell's centre feels nothing but its own load.
const WIDE_CELL: f64 = 2.0 * REACH;

impl Influence {
    /// Coefficients between grid squares of side `cell_m`, m, for offsets below `shape`, `[rows, cols]`.
    ///
    /// Half-space: A. E. H. Love's closed form (Phil. Trans. R. Soc. A 228 (1929) 377) at the squares' centres. Layer:
    /// the same plus g(r) = (1/2π) ∫ (C_layer − C_half-space) J₀(kr) k dk, smooth on the scale of h, averaged over the
    /// square. Squares of 50 thicknesses or more are independent columns of compliance 1/K.
    #[must_use]
    pub fn new(kernel: &ElasticKernel, shape: [usize; 2], cell_m: f64) -> Self {
        Self::with_deficit(kernel, deficit(kernel, shape, cell_m).as_ref(), shape, cell_m)
    }

    /// [`Influence::new`] from the layer's table as [`deficit`] makes it, `None` for a half-space: one table serves the
    /// cells of every size on the same area.
    pub(crate) fn with_deficit(
        kernel: &ElasticKernel,
        deficit: Option<&Deficit>,
        [rows, cols]: [usize; 2],
        cell_m: f64,
    ) -> Self {
        let mut influence = Self {
            rows,
            cols,
            values: love(rows, cols),
            bulge: Bulge::default(),
        };
        let scale = cell_m * kernel.inverse_reduced_modulus_per_pa() / PI;
        influence.values.iter_mut().for_each(|v| *v *= scale);
        if let (&ElasticKernel::Layer { thickness_m, .. }, Some(deficit)) = (kernel, deficit) {
            let cell = cell_m / thickness_m;
            if cell >= WIDE_CELL {
                influence.set_columns(kernel);
            } else {
                // g = (1/(π E* h)) G(r/h), and a mean over the cell counts with the cell's area
                influence.add_layer(deficit, cell, scale * cell);
            }
        }
        influence.bulge = influence.measure_bulge();
        influence
    }

    /// Coefficient between grid squares `row` rows and `col` columns apart, m/Pa.
    ///
    /// # Panics
    /// If an offset is outside the table.
    #[must_use]
    pub fn at(&self, row: usize, col: usize) -> f64 {
        self.values[row * self.cols + col]
    }

    /// Largest rise of the surface under unit pressure on one grid square, m/Pa; 0 for a half-space.
    #[must_use]
    pub fn bulge_m_per_pa(&self) -> f64 {
        self.bulge.one_m_per_pa
    }

    /// Bound of the rise of the surface anywhere, m, under pressures of which the largest and the sum are given, Pa.
    pub(crate) fn bulge_below_m(&self, largest_pa: f64, sum_pa: f64) -> f64 {
        (sum_pa * self.bulge.one_m_per_pa).min(largest_pa * self.bulge.all_m_per_pa)
    }

    fn measure_bulge(&self) -> Bulge {
        // the same on either side of the load
        let sides = |offset: usize| if offset > 0 { 2.0 } else { 1.0 };
        let mut bulge = Bulge::default();
        for (i, line) in self.values.chunks_exact(self.cols.max(1)).enumerate() {
            for (j, value) in line.iter().enumerate() {
                let rise = if *value < 0.0 { -value } else { 0.0 };
                bulge.one_m_per_pa = bulge.one_m_per_pa.max(rise);
                bulge.all_m_per_pa += sides(i) * sides(j) * rise;
            }
        }
        bulge
    }

    /// Rise of the surface beside a wide load relative to the depression under it: the largest value outside a
    /// half-plane under uniform pressure. 0 for a half-space, and approximately 0 for a kernel that is positive
    /// everywhere.
    #[must_use]
    pub fn bulge(&self) -> f64 {
        if self.bulge.one_m_per_pa <= 0.0 {
            return 0.0;
        }
        // response to a line of cells, by distance, and its sums from the far end
        let line = |j: usize| -> f64 {
            let others: f64 = (1..self.rows).map(|i| self.at(i, j)).sum();
            self.at(0, j) + 2.0 * others
        };
        let (mut beside, mut highest) = (0.0, 0.0_f64);
        for j in (1..self.cols).rev() {
            beside += line(j);
            highest = highest.max(-beside);
        }
        highest / (line(0) + 2.0 * beside)
    }

    /// Independent columns.
    fn set_columns(&mut self, kernel: &ElasticKernel) {
        self.values.fill(0.0);
        if let (
            Some(own),
            &ElasticKernel::Layer {
                modulus_pa,
                poisson,
                thickness_m,
            },
        ) = (self.values.first_mut(), kernel)
        {
            *own = 1.0 / confined_stiffness_pa_per_m(modulus_pa, poisson, thickness_m);
        }
    }

    /// Adds the finite layer's part; `cell` is the cell's side over the thickness.
    fn add_layer(&mut self, deficit: &Deficit, cell: f64, scale: f64) {
        // distance of a cell's near side and centre from the point that sinks
        let side = |i: usize| (i as f64 - 0.5).max(0.0) * cell;
        let centre = |i: usize| i as f64 * cell;
        let points = cell_points(cell);
        for row in 0..self.rows {
            for col in 0..self.cols {
                let value = &mut self.values[row * self.cols + col];
                if side(col).hypot(side(row)) > REACH {
                    *value = 0.0;
                    continue;
                }
                let (x, y) = (centre(col), centre(row));
                let mut sum = 0.0;
                for &(dy, wy) in &points {
                    for &(dx, wx) in &points {
                        sum += wx * wy * deficit.at((x + dx).hypot(y + dy));
                    }
                }
                *value += scale * sum;
            }
        }
    }
}

/// Table of the layer's part for cells of side `cell_m` on `[rows, cols]` of them; `None` for a half-space.
pub(crate) fn deficit(kernel: &ElasticKernel, [rows, cols]: [usize; 2], cell_m: f64) -> Option<Deficit> {
    match *kernel {
        ElasticKernel::HalfSpace { .. } => None,
        ElasticKernel::Layer {
            poisson, thickness_m, ..
        } => {
            let farthest = (rows as f64).hypot(cols as f64) * cell_m / thickness_m;
            Some(Deficit::new(poisson, farthest))
        }
    }
}

/// Gauss points across a cell of side `cell` < 50 thicknesses, with weights that sum to 1. G is analytic within 2 of
/// the real axis (the load's image), which makes the rule's error about (cell/8)^(2n): below 1e-10 with the orders
/// chosen.
#[expect(clippy::cast_possible_truncation, reason = "at most 50 parts")]
fn cell_points(cell: f64) -> Vec<(f64, f64)> {
    let parts = cell.ceil().max(1.0) as usize;
    let order = match cell {
        c if c <= 0.1 => 3,
        c if c <= 0.5 => 4,
        _ => 6,
    };
    let rule = gauss_legendre(order);
    let width = cell / parts as f64;
    let part = |i: usize| (i as f64 + 0.5) * width - 0.5 * cell;
    (0..parts)
        .flat_map(|i| {
            rule.iter()
                .map(move |&(x, w)| (part(i) + 0.5 * width * x, 0.5 * w / parts as f64))
        })
        .collect()
}

/// Love's solution in units of cell side and π E*: differences of f(X, Y) = X asinh(Y/|X|) + Y asinh(X/|Y|) at the
/// corners of the loaded cell.
fn love(rows: usize, cols: usize) -> Vec<f64> {
    let corner = |i: usize| i as f64 - 0.5;
    let line = |row: usize| -> Vec<f64> {
        let y = corner(row);
        let f = |col| {
            let x = corner(col);
            x * (y / x.abs()).asinh() + y * (x / y.abs()).asinh()
        };
        (0..=cols).map(f).collect()
    };
    let mut below = line(0);
    let mut values = Vec::with_capacity(rows * cols);
    for row in 0..rows {
        let above = line(row + 1);
        values.extend((0..cols).map(|c| (above[c + 1] - above[c]) - (below[c + 1] - below[c])));
        below = above;
    }
    values
}
