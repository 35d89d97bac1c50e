//! Influence coefficients: displacement at one cell's centre under unit pressure on another cell.

use super::kernel::{ElasticKernel, layer_deficit};
use super::quadrature::{bessel_j0, gauss_legendre};
use std::f64::consts::PI;

/// Influence coefficients of square cells on a regular grid, m/Pa, by the offset between two cells.
#[derive(Debug, Clone)]
pub struct Influence {
    rows: usize,
    cols: usize,
    values: Vec<f64>,
}

/// Beyond this many thicknesses a bonded layer does not feel a load: its kernel decays at least as exp(−0.7 r/h), as
/// exp(−r/h) for ν ≤ 0.2 (first pole of C(k)), and 1e-8 … 1e-11 of the value at the load is left.
const REACH: f64 = 25.0;

impl Influence {
    /// Coefficients for offsets below `[rows, cols]` between cells of side `cell_m`.
    ///
    /// Half-space: A. E. H. Love's closed form (Phil. Trans. R. Soc. A 228 (1929) 377) at the cells' centres. Layer: the
    /// same plus g(r) = (1/2π) ∫ (C_layer − C_half-space) J₀(kr) k dk, smooth on the scale of h, averaged over the cell.
    #[must_use]
    pub fn new(kernel: &ElasticKernel, [rows, cols]: [usize; 2], cell_m: f64) -> Self {
        let mut values = love(rows, cols);
        let scale = cell_m * kernel.inverse_reduced_modulus_per_pa() / PI;
        values.iter_mut().for_each(|v| *v *= scale);
        let mut influence = Self { rows, cols, values };
        if let ElasticKernel::Layer {
            poisson, thickness_m, ..
        } = *kernel
        {
            let cell = cell_m / thickness_m;
            // g = (1/(π E* h)) G(r/h), and a mean over the cell counts with the cell's area
            let scale = kernel.inverse_reduced_modulus_per_pa() * cell_m * cell / PI;
            influence.add_layer(poisson, cell, scale);
        }
        influence
    }

    /// Coefficient between cells `row` rows and `col` columns apart, m/Pa.
    ///
    /// # Panics
    /// When an offset is outside the table.
    #[must_use]
    pub fn at(&self, row: usize, col: usize) -> f64 {
        self.values[row * self.cols + col]
    }

    /// Largest rise of the surface anywhere under a unit pressure on one cell, m/Pa; 0 for a half-space.
    #[must_use]
    pub fn bulge_m_per_pa(&self) -> f64 {
        self.values
            .iter()
            .fold(0.0, |bulge, v| if -v > bulge { -v } else { bulge })
    }

    /// Rise of the surface beside a wide load, in units of the depression under it: the largest value outside a half-plane
    /// under uniform pressure. 0 for a half-space, and about where a kernel is positive.
    #[must_use]
    pub fn bulge(&self) -> f64 {
        if self.bulge_m_per_pa() <= 0.0 {
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

    /// Adds the finite layer's part; `cell` is the cell's side over the thickness.
    #[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
    fn add_layer(&mut self, poisson: f64, cell: f64, scale: f64) {
        let centre = |i: usize| i as f64 * cell;
        let farthest = centre(self.rows).hypot(centre(self.cols));
        let table = Deficit::new(poisson, farthest.min(REACH + 2.0 * cell));
        let points = cell_points(cell);
        for row in 0..self.rows {
            for col in 0..self.cols {
                let value = &mut self.values[row * self.cols + col];
                let (x, y) = (centre(col), centre(row));
                if x.hypot(y) > REACH {
                    *value = 0.0;
                    continue;
                }
                let mut sum = 0.0;
                for &(dy, wy) in &points {
                    for &(dx, wx) in &points {
                        sum += wx * wy * table.at((x + dx).hypot(y + dy));
                    }
                }
                *value += scale * sum;
            }
        }
    }
}

/// Gauss points across a cell of side `cell` thicknesses, with weights that sum to 1. G is analytic within 2 of the real axis (the load's
/// image), which makes the rule's error about (cell/8)^(2n): below 1e-10 with the orders chosen.
#[expect(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "a few hundred parts at most"
)]
fn cell_points(cell: f64) -> Vec<(f64, f64)> {
    let parts = cell.ceil().clamp(1.0, 1e3) as usize;
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
#[expect(clippy::cast_precision_loss, reason = "cell counts stay far below 2^52")]
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

/// G(ρ) = ∫ D(x) J₀(x ρ) dx, tabulated: what the rigid base takes from the half-space's displacement.
struct Deficit {
    values: Vec<f64>,
}

/// Table points a thickness; eight-point interpolation errs by about 40 (1/(2 · 16))⁸ = 4e-11 of G(0).
const PER_THICKNESS: f64 = 16.0;
/// D(x) is below 1e-16 from here on.
const LAST_X: f64 = 21.0;
/// Largest phase x ρ across one panel of the 16-point rule, and largest panel.
const PANEL_PHASE: f64 = 10.0;

impl Deficit {
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most a few thousand points"
    )]
    fn new(poisson: f64, farthest: f64) -> Self {
        let rule = gauss_legendre(16);
        let points = (farthest * PER_THICKNESS).ceil() as usize + 6;
        let mut values = Vec::with_capacity(points);
        let (mut panels, mut nodes): (usize, Vec<(f64, f64)>) = (0, Vec::new());
        for i in 0..points {
            let rho = i as f64 / PER_THICKNESS;
            // in steps of a quarter, so that the nodes serve many radii
            let wanted = ((LAST_X * (rho / PANEL_PHASE).max(1.0) / 6.0).ceil() * 6.0) as usize;
            if wanted != panels {
                panels = wanted;
                let width = LAST_X / panels as f64;
                nodes.clear();
                for panel in 0..panels {
                    nodes.extend(rule.iter().map(|&(x, w)| {
                        let x = (panel as f64 + 0.5 + 0.5 * x) * width;
                        (x, 0.5 * width * w * layer_deficit(x, poisson))
                    }));
                }
            }
            values.push(nodes.iter().map(|&(x, w)| w * bessel_j0(x * rho)).sum());
        }
        Self { values }
    }

    /// Eight-point Lagrange interpolation; G is even, so negative indices mirror.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "ρ lies inside the table"
    )]
    fn at(&self, rho: f64) -> f64 {
        /// Products of the distances of one node to the others, signs included: 1/∏(i − j).
        const WEIGHTS: [f64; 8] = [
            -1.0 / 5040.0,
            1.0 / 720.0,
            -1.0 / 240.0,
            1.0 / 144.0,
            -1.0 / 144.0,
            1.0 / 240.0,
            -1.0 / 720.0,
            1.0 / 5040.0,
        ];
        let s = rho * PER_THICKNESS;
        let cell = (s as usize).min(self.values.len() - 5);
        let f = s - cell as f64;
        let d: [f64; 8] = std::array::from_fn(|i| f + 3.0 - i as f64);
        // products of all distances before and after each node
        let (mut before, mut after) = ([1.0; 8], [1.0; 8]);
        for i in 1..8 {
            before[i] = before[i - 1] * d[i - 1];
            after[7 - i] = after[8 - i] * d[8 - i];
        }
        (0..8)
            .map(|i| {
                let index = (cell + i).abs_diff(3);
                WEIGHTS[i] * before[i] * after[i] * self.values[index]
            })
            .sum()
    }
}
