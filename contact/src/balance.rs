//! The balance of foam under a body that something else carries: how its force spreads over the columns.

use crate::foam::FoamLaw;
use nalgebra::{Matrix3, Vector3};
use parry3d_f64::math::Vector;

/// A column of foam under a body.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Column {
    /// Number of the column on its skin.
    pub(crate) index: usize,
    /// Its end on the free surface, m, and the outward normal there.
    pub(crate) point_m: Vector,
    pub(crate) normal: Vector,
    pub(crate) area_m2: f64,
    /// Its share of the skin's column with this number.
    pub(crate) share: f64,
    /// How deep the body reaches into the column where it is, m; negative for a gap.
    pub(crate) depth_m: f64,
    /// Place across a load, m, from the load's axis.
    pub(crate) across_m: [f64; 2],
}

impl Column {
    pub(crate) fn new(index: usize, point_m: Vector, normal: Vector, area_m2: f64, depth_m: f64) -> Self {
        Self { index, point_m, normal, area_m2, share: 1.0, depth_m, across_m: [0.0; 2] }
    }
}

/// Largest tilt, rad, of the body in the foam against where something else holds it.
const MAX_TILT_RAD: f64 = 0.2;
/// What may be left of the force, relative to it.
const TOLERANCE: f64 = 1e-12;
const MAX_ITERATIONS: usize = 25;

/// Depths of `columns`, m, at which they carry `force_n`, with the resultant on the load's axis where that can be.
///
/// The body keeps its shape: it sinks by s and tilts by (a, b), so that a column at (u, v) has the depth d + s + a u +
/// b v. With the pressure p of the foam's law, Σ A p = F, Σ A p u = 0 and Σ A p v = 0: the minimum of the convex
/// potential Σ A ∫p dd − F s, by Newton's method. A load whose axis is beside all columns has none; then the body sinks
/// without a tilt. The force is met to 1e-12 of it in either case.
pub(crate) fn settle(law: &FoamLaw, columns: &mut [Column], force_n: f64) {
    let bed = Bed::of(law, columns);
    // roughly: the tilt begins there, and meets force and moments itself
    let sunk_m = bed.sink([0.0; 2], 0.0, force_n, 0.05);
    let state = bed.tilt(sunk_m, force_n).unwrap_or([sunk_m, 0.0, 0.0]);
    let sunk_m = bed.sink([state[1], state[2]], state[0], force_n, TOLERANCE);
    for c in columns {
        c.depth_m += sunk_m + state[1] * c.across_m[0] + state[2] * c.across_m[1];
    }
}

/// What the balance needs of the columns: depth, m, places across the load, m, and area, m².
struct Bed<'a> {
    law: &'a FoamLaw,
    columns: Vec<[f64; 4]>,
}

impl<'a> Bed<'a> {
    fn of(law: &'a FoamLaw, columns: &[Column]) -> Self {
        let of = |c: &Column| [c.depth_m, c.across_m[0], c.across_m[1], c.area_m2];
        Self { law, columns: columns.iter().map(of).collect() }
    }

    /// Force, N, and its slope with s, N/m.
    fn carried(&self, [a, b]: [f64; 2], s: f64) -> (f64, f64) {
        let (mut force, mut slope) = (0.0, 0.0);
        for [depth, u, v, area] in &self.columns {
            let depth = depth + (s + (a * u + b * v));
            if depth > 0.0 {
                let (p, k) = self.law.pressure_and_slope(depth);
                force += area * p;
                slope += area * k;
            }
        }
        (force, slope)
    }

    /// How far the tilted body sinks until the columns carry the force to `tolerance` of it, m, by Newton's steps from
    /// `from_m`: the force grows with it, and so does its slope.
    fn sink(&self, tilts: [f64; 2], from_m: f64, force_n: f64, tolerance: f64) -> f64 {
        let [a, b] = tilts;
        let depths = self.columns.iter().map(|[d, u, v, _]| d + (a * u + b * v));
        let (mut low, mut high) = (-depths.fold(f64::NEG_INFINITY, f64::max), f64::INFINITY);
        let mut s = from_m.max(low + 1e-6);
        for _ in 0..200 {
            let (force, slope) = self.carried(tilts, s);
            let off = force - force_n;
            let narrow = high.is_finite() && high - low <= f64::EPSILON * high.abs();
            if off.abs() <= tolerance * force_n || narrow {
                break;
            }
            if off > 0.0 {
                high = s;
            } else {
                low = s;
            }
            let next = s - off / slope;
            // where few columns carry it yet, the slope is too small to go by
            let most = if high.is_finite() { high } else { s + (s - low).max(2e-3) };
            s = if next > low && next < most {
                next
            } else if high.is_finite() {
                0.5 * (low + high)
            } else {
                most
            };
        }
        s
    }

    /// Shift and tilts at which force and moments are met; `None` if the tilts are not small.
    fn tilt(&self, sunk_m: f64, force_n: f64) -> Option<[f64; 3]> {
        // with all columns on one side of the axis, no tilt brings the resultant there
        let all = |is: fn(&f64) -> bool, k: usize| self.columns.iter().all(|c| is(&c[k]));
        if [1, 2].into_iter().any(|k| all(|at| *at > 0.0, k) || all(|at| *at < 0.0, k)) {
            return None;
        }
        let reach_m = self.columns.iter().map(|[_, u, v, _]| u * u + v * v).fold(0.0, f64::max).sqrt();
        // across in units of the reach: the three unknowns are lengths
        let per_m = 1.0 / reach_m;
        let at = |state: &Vector3<f64>| {
            let (mut gradient, mut sums) = ([0.0; 3], [0.0; 6]);
            for [depth, u, v, area] in &self.columns {
                let (u, v) = (u * per_m, v * per_m);
                let depth = depth + (state.x + u * state.y + v * state.z);
                if depth <= 0.0 {
                    continue;
                }
                let (p, k) = self.law.pressure_and_slope(depth);
                let (p, k) = (area * p, area * k);
                let parts = [p, p * u, p * v];
                gradient.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
                let parts = [k, k * u, k * v, k * u * u, k * u * v, k * v * v];
                sums.iter_mut().zip(parts).for_each(|(sum, part)| *sum += part);
            }
            let [one, u, v, uu, uv, vv] = sums;
            let gradient = Vector3::new(gradient[0] - force_n, gradient[1], gradient[2]);
            (gradient, Matrix3::new(one, u, v, u, uu, uv, v, uv, vv))
        };
        let mut state = Vector3::new(sunk_m, 0.0, 0.0);
        let (mut gradient, mut hessian) = at(&state);
        for _ in 0..MAX_ITERATIONS {
            if gradient.amax() <= 1e-9 * force_n {
                break;
            }
            // one row of columns does not resist a tilt about itself
            let damped = hessian + Matrix3::from_diagonal_element(1e-9 * hessian.trace());
            let step = -damped.cholesky()?.solve(&gradient);
            let slope = gradient.dot(&step).abs();
            let mut share = 1.0;
            loop {
                let next = at(&(state + share * step));
                if next.0.dot(&step) <= 0.9 * slope {
                    state += share * step;
                    (gradient, hessian) = next;
                    break;
                }
                share *= 0.5;
                if share < 1e-3 {
                    return None;
                }
            }
            if state.yz().amax() > MAX_TILT_RAD * reach_m {
                return None;
            }
        }
        (gradient.amax() <= 1e-6 * force_n).then(|| [state.x, state.y * per_m, state.z * per_m])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::foam::Foam;

    fn grid(side: i32, depth: impl Fn(f64, f64) -> f64) -> Vec<Column> {
        let cell_m = 1e-3;
        let places =
            (-side..=side).flat_map(|i| (-side..=side).map(move |j| (f64::from(i) * cell_m, f64::from(j) * cell_m)));
        let column = |(index, (u, v))| Column {
            across_m: [u, v],
            ..Column::new(index, Vector::new(u, v, 0.0), Vector::Z, 1e-6, depth(u, v))
        };
        places.enumerate().map(column).collect()
    }

    fn sums(law: &FoamLaw, columns: &[Column]) -> [f64; 3] {
        let mut out = [0.0; 3];
        for c in columns {
            let f = c.area_m2 * law.pressure_pa(c.depth_m);
            out[0] += f;
            out[1] += f * c.across_m[0];
            out[2] += f * c.across_m[1];
        }
        out
    }

    /// A flat plate, far above or far below the skin, straight or tilted, carries the load on its axis: the pressure is
    /// the same everywhere, F/A. A load off the middle tilts it, and its resultant is on the axis.
    #[test]
    fn plates_and_balls() {
        let law = Foam::default().law(f64::INFINITY);
        for away in [-3e-3, -1e-6, 0.0, 5e-3] {
            for turn in [0.0, 0.05] {
                let mut columns = grid(10, |u, _| away + turn * u);
                settle(&law, &mut columns, 7.0);
                let mean_pa = 7.0 / (columns.len() as f64 * 1e-6);
                for c in &columns {
                    let p = law.pressure_pa(c.depth_m);
                    assert!((p / mean_pa - 1.0).abs() < 1e-5, "{away} {turn}: {p} {mean_pa}");
                }
            }
        }
        for force_n in [1e-6, 0.1, 20.0, 200.0] {
            let mut plate = grid(10, |_, _| 0.0);
            plate.iter_mut().for_each(|c| c.across_m[0] -= 1e-3);
            let mut ball = grid(15, |u, v| -(u * u + v * v) / 0.04);
            for columns in [&mut plate, &mut ball] {
                settle(&law, columns, force_n);
                let [force, x, y] = sums(&law, columns);
                assert!((force / force_n - 1.0).abs() < 1e-11, "{force}");
                assert!(x.abs().max(y.abs()) < 1e-6 * force_n * 1e-2, "{force_n}: {x} {y}");
            }
        }
    }

    /// An axis beside the plate, and a single column: the force is met all the same.
    #[test]
    fn loads_that_cannot_be_balanced() {
        let law = Foam::default().law(f64::INFINITY);
        let mut beside = grid(10, |_, _| 0.0);
        beside.iter_mut().for_each(|c| c.across_m[0] -= 0.1);
        let mut single = vec![Column::new(0, Vector::ZERO, Vector::Z, 1e-4, -1e-3)];
        for columns in [&mut beside, &mut single] {
            settle(&law, columns, 3.0);
            assert!((sums(&law, columns)[0] / 3.0 - 1.0).abs() < 1e-11);
        }
    }
}
