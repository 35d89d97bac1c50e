//! From the elastic body to influence coefficients: its compliance in the Fourier domain, and the displacement at the
//! centre of one grid square under unit pressure on another one.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// Elastic body below the skin's surface; linear and frictionless.
///
/// A pressure p̂(k) lowers the surface by û(k) = C(|k|) p̂(k).
///
/// ```
/// use spts_contact::{ElasticKernel, confined_stiffness_pa_per_m};
///
/// let (modulus_pa, poisson, thickness_m) = (150e3, 0.2, 10e-3);
/// let layer = ElasticKernel::Layer { modulus_pa, poisson, thickness_m };
/// let half_space = ElasticKernel::HalfSpace { modulus_pa, poisson };
/// // fine patterns do not feel the base; uniform pressure does
/// let fine = layer.compliance_m_per_pa(1e4) / half_space.compliance_m_per_pa(1e4);
/// assert!((fine - 1.0).abs() < 1e-6);
/// let uniform = layer.compliance_m_per_pa(0.0) * confined_stiffness_pa_per_m(modulus_pa, poisson, thickness_m);
/// assert!((uniform - 1.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum ElasticKernel {
    /// Half-space (Boussinesq).
    HalfSpace {
        /// E, Young's modulus, Pa; > 0.
        modulus_pa: f64,
        /// ν, Poisson's ratio; [0, 0.5].
        poisson: f64,
    },
    /// Layer of finite thickness, bonded to a rigid base.
    Layer {
        /// E, Young's modulus, Pa; > 0.
        modulus_pa: f64,
        /// ν, Poisson's ratio; [0, 0.5).
        poisson: f64,
        /// h, thickness, m; > 0.
        thickness_m: f64,
    },
}

impl ElasticKernel {
    /// E, Pa, and ν.
    pub(crate) fn constants(&self) -> (f64, f64) {
        match *self {
            Self::HalfSpace { modulus_pa, poisson } | Self::Layer { modulus_pa, poisson, .. } => (modulus_pa, poisson),
        }
    }

    /// 1/E* = (1 − ν²)/E, 1/Pa.
    pub(crate) fn inverse_reduced_modulus_per_pa(&self) -> f64 {
        let (modulus_pa, poisson) = self.constants();
        (1.0 - poisson * poisson) / modulus_pa
    }

    /// C(k), m/Pa, at the wave number `wave_per_m` (k > 0; for the layer also 0).
    ///
    /// Half-space: 2/(E* k). Layer: C = (2/(E* k)) · [(3−4ν) sinh 2x − 2x] / [(3−4ν) cosh 2x + 2x² + 5 − 12ν + 8ν²]
    /// with x = k h (plane-strain elasticity of a bonded layer; K. L. Johnson, *Contact Mechanics* (1985), §5.8). Both
    /// parts of the fraction are scaled by exp(−2x), so that no x overflows. C(0) = 1/K, see
    /// [`confined_stiffness_pa_per_m`].
    pub fn compliance_m_per_pa(&self, wave_per_m: f64) -> f64 {
        let half_space = 2.0 * self.inverse_reduced_modulus_per_pa() / wave_per_m;
        match *self {
            Self::HalfSpace { .. } => half_space,
            Self::Layer { modulus_pa, poisson, thickness_m } => {
                let x = wave_per_m * thickness_m;
                if x <= 0.0 {
                    return 1.0 / confined_stiffness_pa_per_m(modulus_pa, poisson, thickness_m);
                }
                let rising = -0.5 * (3.0 - 4.0 * poisson) * (-4.0 * x).exp_m1() - 2.0 * x * (-2.0 * x).exp();
                half_space * rising / layer_denominator(x, poisson)
            }
        }
    }
}

/// exp(−2x) [(3−4ν) cosh 2x + 2x² + 5 − 12ν + 8ν²].
fn layer_denominator(x: f64, poisson: f64) -> f64 {
    let decay = (-2.0 * x).exp();
    0.5 * (3.0 - 4.0 * poisson) * (1.0 + decay * decay) + (2.0 * x * x + constant(poisson)) * decay
}

fn constant(poisson: f64) -> f64 {
    5.0 - 12.0 * poisson + 8.0 * poisson * poisson
}

/// D(x) = C_layer/C_half-space − 1 at x = k h: −1 at 0, decaying as x² exp(−2x), without cancellation.
pub(crate) fn layer_deficit(x: f64, poisson: f64) -> f64 {
    let decay = (-2.0 * x).exp();
    let rest = (3.0 - 4.0 * poisson) * decay * decay + (2.0 * x * (1.0 + x) + constant(poisson)) * decay;
    -rest / layer_denominator(x, poisson)
}

/// K, stiffness of a bonded layer under uniform pressure, Pa/m: E (1−ν) / ((1+ν) (1−2ν) h).
pub fn confined_stiffness_pa_per_m(modulus_pa: f64, poisson: f64, thickness_m: f64) -> f64 {
    modulus_pa * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson) * thickness_m)
}

/// Young's modulus of a layer of stiffness K under uniform pressure, Pa: the inverse of
/// [`confined_stiffness_pa_per_m`].
pub fn modulus_of_confined_pa(stiffness_pa_per_m: f64, poisson: f64, thickness_m: f64) -> f64 {
    stiffness_pa_per_m * thickness_m * (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson)
}

// Gauss–Legendre points and the Bessel function J₀.

/// Points and weights of the Gauss–Legendre rule of order `order` on [−1, 1], by Newton's method on P_n from the
/// asymptotic roots.
pub(crate) fn gauss_legendre(order: usize) -> Vec<(f64, f64)> {
    let n = order as f64;
    (0..order)
        .map(|i| {
            let mut x = (PI * (i as f64 + 0.75) / (n + 0.5)).cos();
            let mut slope = 1.0;
            for _ in 0..8 {
                let (mut last, mut p) = (1.0, x);
                for j in 2..=order {
                    let j = j as f64;
                    (last, p) = (p, ((2.0 * j - 1.0) * x * p - (j - 1.0) * last) / j);
                }
                // P'_n = n (x P_n − P_{n−1}) / (x² − 1)
                slope = if order == 1 { 1.0 } else { n * (x * p - last) / (x * x - 1.0) };
                x -= p / slope;
            }
            (x, 2.0 / ((1.0 - x * x) * slope * slope))
        })
        .collect()
}

/// Where J₀ changes from its integral to its asymptotic series: the series' smallest term there is about e^(−2x) =
/// 4e-18.
const ASYMPTOTIC_FROM: f64 = 20.0;
/// The series ends at a term of this size, or at the latest after so many.
const LAST_TERM: f64 = 1e-17;
const MOST_TERMS: u32 = 24;

/// Bessel function J₀(x), x ≥ 0, to 2e-15 absolute, and to the rounding of the phase at large x.
///
/// Below 20: (1/m) Σ cos(x cos θ_j), the midpoint rule with 64 points on the circle (16 by symmetry); its error 2
/// J₆₄(x) is below 1e-20. Above: Hankel's expansion (Abramowitz and Stegun 9.2.5), whose terms are below 1e-16 after 24
/// at x = 20.
pub(crate) fn bessel_j0(x: f64) -> f64 {
    const POINTS: u32 = 16;
    if x < ASYMPTOTIC_FROM {
        let angle = |j: u32| FRAC_PI_2 * (f64::from(j) + 0.5) / f64::from(POINTS);
        return (0..POINTS).map(|j| (x * angle(j).cos()).cos()).sum::<f64>() / f64::from(POINTS);
    }
    let (mut p, mut q, mut term) = (1.0, 0.0, 1.0);
    for k in 1..=MOST_TERMS {
        let odd = f64::from(2 * k - 1);
        term *= odd * odd / (f64::from(k) * 8.0 * x);
        // signs of P: + at k = 0, 4, 8; of Q (after J₀'s −sin): − at k = 1, + at 3
        match k % 4 {
            0 => p += term,
            1 => q -= term,
            2 => p -= term,
            _ => q += term,
        }
        if term < LAST_TERM {
            break;
        }
    }
    let (s, c) = (x - FRAC_PI_4).sin_cos();
    (2.0 / (PI * x)).sqrt() * (p * c - q * s)
}

// Reduction of the half-space's displacement by a rigid base.

/// Beyond this many thicknesses a bonded layer does not feel a load: its kernel decays at least as exp(−0.7 r/h), as
/// exp(−r/h) for ν ≤ 0.2 (first pole of C(k)), and 1e-8 … 1e-11 of the value at the load is left.
pub(crate) const REACH: f64 = 25.0;

/// G(ρ) = ∫ D(x) J₀(x ρ) dx at ρ = r/h, tabulated up to [`REACH`] and −1/ρ, which cancels the half-space, beyond.
#[derive(Debug, Clone)]
pub(crate) struct Deficit {
    values: Vec<f64>,
}

/// Table points a thickness; eight-point interpolation errs by about 40 (1/(2 · 16))⁸ = 4e-11 of G(0).
const PER_THICKNESS: f64 = 16.0;
/// D(x) is below 1e-16 from here on.
const LAST_X: f64 = 21.0;
/// Largest phase x ρ across one panel of the 16-point rule, and largest panel.
const PANEL_PHASE: f64 = 10.0;

impl Deficit {
    #[expect(clippy::cast_possible_truncation, reason = "at most a few thousand points")]
    /// Table for distances up to `farthest` thicknesses.
    pub(crate) fn new(poisson: f64, farthest: f64) -> Self {
        let rule = gauss_legendre(16);
        let points = (farthest.min(REACH) * PER_THICKNESS).ceil() as usize + 6;
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
    #[expect(clippy::cast_possible_truncation, reason = "ρ lies inside the table")]
    pub(crate) fn at(&self, rho: f64) -> f64 {
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
        if rho > REACH {
            return -1.0 / rho;
        }
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

// Influence coefficients: displacement at the centre of one grid square under unit pressure on another one.

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
        let mut influence = Self { rows, cols, values: love(rows, cols), bulge: Bulge::default() };
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
    pub fn at(&self, row: usize, col: usize) -> f64 {
        self.values[row * self.cols + col]
    }

    /// Largest rise of the surface under unit pressure on one grid square, m/Pa; 0 for a half-space.
    #[cfg(test)]
    pub(crate) fn bulge_m_per_pa(&self) -> f64 {
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
    pub(crate) fn bulge(&self) -> f64 {
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
        if let (Some(own), &ElasticKernel::Layer { modulus_pa, poisson, thickness_m }) =
            (self.values.first_mut(), kernel)
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
        ElasticKernel::Layer { poisson, thickness_m, .. } => {
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
        .flat_map(|i| rule.iter().map(move |&(x, w)| (part(i) + 0.5 * width * x, 0.5 * w / parts as f64)))
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
