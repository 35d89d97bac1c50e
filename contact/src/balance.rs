//! The balance of foam under a body that something else carries: how its force spreads over the columns.

use crate::foam::FoamLaw;
use multiversion::multiversion;
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

/// Numbers that are summed side by side, in an order that is the same on every machine.
const LANES: usize = 8;

/// The columns under a load, as its balance sees them: depths, m, places across the load, m, and areas, m². Past the
/// last column, up to whole lanes, there is nothing.
#[derive(Debug, Clone, Default)]
struct Bed {
    depth_m: Vec<f64>,
    across_m: [Vec<f64>; 2],
    area_m2: Vec<f64>,
}

/// Storage of [`Balance::settle`].
#[derive(Debug, Clone, Default)]
pub(crate) struct Balance {
    bed: Bed,
    thin: Bed,
}

impl Balance {
    /// Depths of `columns`, m, at which they carry `force_n`, with the resultant on the load's axis where that can be.
    ///
    /// The body keeps its shape: it sinks by s and tilts by (a, b), so that a column at (u, v) has the depth
    /// d + s + a u + b v. With the pressure p of the foam's law, Σ A p = F, Σ A p u = 0 and Σ A p v = 0: the minimum of
    /// the convex potential Σ A ∫p dd − F s, by Newton's method. A load whose axis is beside all columns has none; then
    /// the body sinks without a tilt. The force is met to 1e-12 of it in either case.
    pub(crate) fn settle(&mut self, law: &FoamLaw, columns: &mut [Column], force_n: f64) {
        // roughly, by some of them: the tilt begins there, and meets force and moments itself
        let every = (columns.len() / SAMPLE).max(1);
        self.thin.take(columns.iter().step_by(every), every as f64);
        let sunk_m = self.thin.sink(law, [0.0; 2], 0.0, force_n, 0.05);
        let upright = [sunk_m, 0.0, 0.0];
        let near = (every > 1).then(|| self.thin.tilt(law, upright, force_n)).flatten().unwrap_or(upright);
        let deepest_m = columns.iter().fold(f64::NEG_INFINITY, |deepest, c| more(deepest, c.depth_m));
        // most likely no other one is reached
        let reached = |c: &Column| c.depth_m + sunk_m > -(deepest_m + sunk_m).abs();
        for all in [false, true] {
            self.bed.take(columns.iter().filter(|c| all || reached(c)), 1.0);
            let tilted = self.bed.tilt(law, near, force_n);
            if tilted.is_none() && !all {
                // the others may have the resultant on the axis
                continue;
            }
            let [from_m, a, b] = tilted.unwrap_or(upright);
            let sunk_m = self.bed.sink(law, [a, b], from_m, force_n, TOLERANCE);
            let shift_m = |c: &Column| sunk_m + (a * c.across_m[0] + b * c.across_m[1]);
            if all || columns.iter().all(|c| c.depth_m + shift_m(c) <= 0.0 || reached(c)) {
                columns.iter_mut().for_each(|c| c.depth_m += shift_m(c));
                break;
            }
        }
    }
}

/// About how many columns tell roughly how far a body sinks.
const SAMPLE: usize = 200;

#[inline(always)]
fn more(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Σ A p and the sums of A p u and A p v, N and N m, of columns that are shifted by s + a u + b v, and of their slopes
/// A p′ times 1, u, v, u², u v and v².
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sums(law: FoamLaw, bed: &Bed, [s, a, b]: [f64; 3]) -> [f64; 9] {
    let mut lanes = [[0.0; LANES]; 9];
    let depths = bed.depth_m.as_chunks::<LANES>().0;
    let count = depths.len();
    let [us, vs] = [0, 1].map(|k| &bed.across_m[k].as_chunks::<LANES>().0[..count]);
    let areas = &bed.area_m2.as_chunks::<LANES>().0[..count];
    for n in 0..count {
        let (depth, u, v, area) = (&depths[n], &us[n], &vs[n], &areas[n]);
        // one loop for each, which become vector instructions
        let (mut p, mut k) = ([0.0; LANES], [0.0; LANES]);
        for l in 0..LANES {
            let (pressure, slope) = law.pressure_and_slope(depth[l] + (s + (a * u[l] + b * v[l])));
            p[l] = area[l] * pressure;
            k[l] = area[l] * slope;
        }
        for l in 0..LANES {
            lanes[0][l] += p[l];
            lanes[1][l] += p[l] * u[l];
            lanes[2][l] += p[l] * v[l];
        }
        for l in 0..LANES {
            lanes[3][l] += k[l];
            lanes[4][l] += k[l] * u[l];
            lanes[5][l] += k[l] * v[l];
        }
        for l in 0..LANES {
            lanes[6][l] += k[l] * u[l] * u[l];
            lanes[7][l] += k[l] * u[l] * v[l];
            lanes[8][l] += k[l] * v[l] * v[l];
        }
    }
    lanes.map(|lanes| lanes.iter().sum())
}

impl Bed {
    fn take<'a>(&mut self, columns: impl Iterator<Item = &'a Column>, share: f64) {
        let Self { depth_m, across_m: [u, v], area_m2 } = self;
        [&mut *depth_m, u, v, area_m2].into_iter().for_each(Vec::clear);
        for c in columns {
            depth_m.push(c.depth_m);
            u.push(c.across_m[0]);
            v.push(c.across_m[1]);
            area_m2.push(share * c.area_m2);
        }
        let whole = depth_m.len().next_multiple_of(LANES);
        depth_m.resize(whole, f64::NEG_INFINITY);
        [u, v, area_m2].into_iter().for_each(|values| values.resize(whole, 0.0));
    }

    /// Force, N, and its slope with s, N/m.
    fn carried(&self, law: &FoamLaw, [a, b]: [f64; 2], s: f64) -> (f64, f64) {
        let sums = sums(*law, self, [s, a, b]);
        (sums[0], sums[3])
    }

    /// How far the tilted body sinks until the columns carry the force to `tolerance` of it, m, by Newton's steps from
    /// `from_m`: the force grows with it, and so does its slope.
    fn sink(&self, law: &FoamLaw, tilts: [f64; 2], from_m: f64, force_n: f64, tolerance: f64) -> f64 {
        let [a, b] = tilts;
        let places = self.across_m[0].iter().zip(&self.across_m[1]);
        let depths = self.depth_m.iter().zip(places).map(|(d, (u, v))| d + (a * u + b * v));
        let (mut low, mut high) = (-depths.fold(f64::NEG_INFINITY, more), f64::INFINITY);
        let mut s = from_m.max(low + 1e-6);
        for _ in 0..200 {
            let (force, slope) = self.carried(law, tilts, s);
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

    /// Shift and tilts at which force and moments are met, from those that are near; `None` if the tilts are not small.
    fn tilt(&self, law: &FoamLaw, [sunk_m, a, b]: [f64; 3], force_n: f64) -> Option<[f64; 3]> {
        // with all columns on one side of the axis, no tilt brings the resultant there
        let there =
            |k: usize| self.across_m[k].iter().zip(&self.area_m2).filter(|(_, area)| **area > 0.0).map(|(at, _)| *at);
        if [0, 1].into_iter().any(|k| there(k).all(|at| at > 0.0) || there(k).all(|at| at < 0.0)) {
            return None;
        }
        let reach_m = there(0).zip(there(1)).map(|(u, v)| u * u + v * v).fold(0.0, more).sqrt();
        // across in units of the reach: the three unknowns are lengths
        let per_m = 1.0 / reach_m;
        let at = |state: &Vector3<f64>| {
            let [p, pu, pv, k, ku, kv, kuu, kuv, kvv] = sums(*law, self, [state.x, state.y * per_m, state.z * per_m]);
            let (ku, kv) = (ku * per_m, kv * per_m);
            let [kuu, kuv, kvv] = [kuu, kuv, kvv].map(|sum| sum * per_m * per_m);
            let gradient = Vector3::new(p - force_n, pu * per_m, pv * per_m);
            (gradient, Matrix3::new(k, ku, kv, ku, kuu, kuv, kv, kuv, kvv))
        };
        let mut state = Vector3::new(sunk_m, a * reach_m, b * reach_m);
        let (mut gradient, mut hessian) = at(&state);
        for _ in 0..MAX_ITERATIONS {
            // one row of columns does not resist a tilt about itself
            let damped = hessian + Matrix3::from_diagonal_element(1e-9 * hessian.trace());
            let step = -damped.cholesky()?.solve(&gradient);
            if gradient.amax() <= 1e-6 * force_n {
                // the last step: what it leaves is of the second order
                if at(&(state + step)).0.amax() <= gradient.amax() {
                    state += step;
                }
                break;
            }
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
                Balance::default().settle(&law, &mut columns, 7.0);
                let mean_pa = 7.0 / (columns.len() as f64 * 1e-6);
                for c in &columns {
                    let p = law.pressure_pa(c.depth_m);
                    assert!((p / mean_pa - 1.0).abs() < 1e-5, "{away} {turn}: {p} {mean_pa}");
                }
            }
        }
        // a plate that stands on an edge until it tilts back
        for (turn, force_n) in [(0.002, 0.1), (0.005, 0.1), (0.005, 1.0), (0.01, 1.0), (0.03, 10.0)] {
            let mut columns = grid(40, |u, _| turn * u);
            Balance::default().settle(&law, &mut columns, force_n);
            let [force, x, y] = sums(&law, &columns);
            assert!((force / force_n - 1.0).abs() < 1e-11, "{turn} {force_n}: {force}");
            assert!(x.abs().max(y.abs()) < 1e-6 * force_n * 0.04, "{turn} {force_n}: {x} {y}");
        }
        for force_n in [1e-6, 0.1, 20.0, 200.0] {
            let mut plate = grid(10, |_, _| 0.0);
            plate.iter_mut().for_each(|c| c.across_m[0] -= 1e-3);
            let mut ball = grid(15, |u, v| -(u * u + v * v) / 0.04);
            for columns in [&mut plate, &mut ball] {
                Balance::default().settle(&law, columns, force_n);
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
            Balance::default().settle(&law, columns, 3.0);
            assert!((sums(&law, columns)[0] / 3.0 - 1.0).abs() < 1e-11);
        }
    }
}
