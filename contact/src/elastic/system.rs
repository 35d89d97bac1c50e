//! Elastic operator and preconditioner on a rectangle of cells.

use super::coefficients::Influence;
use super::convolution::{Convolution, Planner, good_size};

/// Plans of both precisions.
pub(crate) struct Planners {
    double: Planner<f64>,
    single: Planner<f32>,
}

impl Planners {
    pub(crate) fn new() -> Self {
        Self {
            double: Planner::new(),
            single: Planner::new(),
        }
    }
}

/// u = C p on a rectangle of `rows` × `cols` cells, and an approximate inverse.
///
/// The inverse is the circulant one: the same coefficients on a torus a little larger than the rectangle, whose
/// spectrum is inverted. It serves only to steer the iteration, so single precision does.
#[derive(Clone)]
pub(crate) struct System {
    pub(crate) shape: [usize; 2],
    elastic: Convolution<f64>,
    inverse: Convolution<f32>,
    /// Approximate pressure that lowers one free cell by one metre, Pa/m: the diagonal of the inverse.
    pub(crate) stiffness_pa_per_m: f64,
    /// Reciprocal of a cell's own coefficient, Pa/m.
    unit_pa_per_m: f64,
    input: Vec<f32>,
    output: Vec<f32>,
}

/// Cells of padding of the torus, so that opposite borders are not neighbours.
const TORUS_PADDING: usize = 4;

/// Offsets, beyond the rectangle's sides, at which [`System::new`] needs coefficients.
pub(crate) const EXTRA_OFFSETS: usize = 8;

impl System {
    /// System of `shape` cells; `diagonal_m_per_pa` is added to every cell's own coefficient (a body that yields).
    pub(crate) fn new(
        planners: &mut Planners,
        influence: &Influence,
        shape: [usize; 2],
        diagonal_m_per_pa: f64,
    ) -> Self {
        let at = |i: usize, j: usize| {
            let own = if i + j == 0 { diagonal_m_per_pa } else { 0.0 };
            influence.at(i, j) + own
        };
        let padded = shape.map(|n| good_size(2 * n - 1));
        let inside = |i: usize, j: usize| if i < shape[0] && j < shape[1] { at(i, j) } else { 0.0 };
        let elastic = Convolution::new(&mut planners.double, shape, padded, inside, |c| c);
        let torus = shape.map(|n| good_size(n + TORUS_PADDING));
        let floor = FLOOR * at(0, 0);
        let scale = 1.0 / at(0, 0);
        // single precision does not reach down to 1e-12 m/Pa squared: work in units of the cell's own coefficient
        let relative = |i: usize, j: usize| at(i, j) * scale;
        let invert = |c: f64| 1.0 / c.max(floor * scale);
        let inverse = Convolution::new(&mut planners.single, shape, torus, relative, invert);
        let cells = shape[0] * shape[1];
        let stiffness_pa_per_m = inverse.mean_transfer() * scale;
        Self {
            shape,
            elastic,
            inverse,
            stiffness_pa_per_m,
            unit_pa_per_m: scale,
            input: vec![0.0; cells],
            output: vec![0.0; cells],
        }
    }

    /// displacement = C pressure.
    pub(crate) fn displace(&mut self, pressure: &[f64], displacement: &mut [f64]) {
        self.elastic.apply(pressure, displacement);
    }

    /// direction = mask · C⁻¹ residual.
    #[expect(clippy::cast_possible_truncation, reason = "single precision is meant")]
    pub(crate) fn precondition(&mut self, residual: &[f64], mask: &[f64], direction: &mut [f64]) {
        // residuals near 1e-15 m would lose digits in single precision only below 1e-38: scale by the largest
        let largest = residual.iter().fold(f64::MIN_POSITIVE, |m, r| m.max(r.abs()));
        let inverse = 1.0 / largest;
        for (to, from) in self.input.iter_mut().zip(residual) {
            *to = (from * inverse) as f32;
        }
        let scale = largest * self.unit_pa_per_m;
        self.inverse.apply(&self.input, &mut self.output);
        for ((to, from), inside) in direction.iter_mut().zip(&self.output).zip(mask) {
            *to = f64::from(*from) * inside * scale;
        }
    }
}

/// Smallest eigenvalue of the torus, in units of a cell's own coefficient: the kernel cut off at half the torus could
/// have a smaller one, even a negative one.
const FLOOR: f64 = 1e-3;
