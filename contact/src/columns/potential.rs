//! The potential that a quasi-static balance minimises: pressures of one row of cells, and sums over all rows.

use super::foam::FoamLaw;
use super::preload::PreloadedRow;
use crate::quasi_static::{Holder, Load};
use nalgebra::{Matrix3, Vector3};

/// Pressure and its slope on the cells of one row.
#[derive(Debug, Clone, Default)]
pub(super) struct Row {
    pub(super) arm_m: Vec<f64>,
    pub(super) pressure_pa: Vec<f64>,
    pub(super) slope_pa_per_m: Vec<f64>,
}

/// One balance to be found: the columns' law, the load, and the height from which heights are counted.
#[derive(Debug, Clone, Copy)]
pub(super) struct Task<'a> {
    pub(super) law: FoamLaw,
    pub(super) load: &'a Load,
    /// Height of the origin at which the untilted body touches, m. Where the origin is far from the face, the state's z
    /// is small compared with this height, and small numbers resolve small forces: rounding z changes the force by at
    /// most K A ulp(z).
    pub(super) base_m: f64,
    /// Stiffness of the body's surface, Pa/m; ∞ for a rigid one.
    pub(super) body_pa_per_m: f64,
}

/// Gradient and Hessian of the potential over (z, θx, θy): N and N m.
#[derive(Debug, Clone, Copy)]
pub(super) struct Potential {
    pub(super) gradient: Vector3<f64>,
    pub(super) hessian: Matrix3<f64>,
}

/// What may be left besides, in round-offs of the state: half an ulp each of the state, of z + θ y and of the depth,
/// and as much again.
const ROUND_OFFS: f64 = 4.0;

impl Row {
    pub(super) fn resize(&mut self, width: usize) {
        self.pressure_pa.resize(width, 0.0);
        self.slope_pa_per_m.resize(width, 0.0);
    }

    /// Pressures at the depths drop − base − height + turn · arm.
    #[inline]
    pub(super) fn press(&mut self, task: &Task<'_>, height_m: f64, turn_rad: f64, drop_m: &[f64]) {
        let cells = self.pressure_pa.iter_mut().zip(&mut self.slope_pa_per_m);
        for (((p, s), drop_m), arm_m) in cells.zip(drop_m).zip(&self.arm_m) {
            let depth_m = (drop_m - task.base_m) - height_m + turn_rad * arm_m;
            (*p, *s) = task.law.pressure_and_slope(depth_m);
        }
    }

    /// The same where the foam is under preload.
    #[inline]
    pub(super) fn press_preloaded(
        &mut self,
        task: &Task<'_>,
        height_m: f64,
        turn_rad: f64,
        drop_m: &[f64],
        preload: &PreloadedRow<'_>,
    ) {
        let cells = self.pressure_pa.iter_mut().zip(&mut self.slope_pa_per_m);
        for (k, (((p, s), drop_m), arm_m)) in cells.zip(drop_m).zip(&self.arm_m).enumerate() {
            let depth_m = (drop_m - task.base_m) - height_m + turn_rad * arm_m;
            (*p, *s) = preload.pressure_and_slope(k, &task.law, depth_m);
        }
    }
}

impl Potential {
    /// Force that is not balanced, N: moments count by the lever `reach_m`.
    pub(super) fn left_n(&self, reach_m: f64) -> f64 {
        self.gradient.component_div(&Vector3::new(1.0, reach_m, reach_m)).amax()
    }

    /// What rounding `state` does to [`Potential::left_n`], N.
    pub(super) fn round_off_n(&self, state: &Vector3<f64>, reach_m: f64) -> f64 {
        let h = |i: usize| self.hessian[(i, i)];
        let tilts_rad = state[1].abs() + state[2].abs();
        let by_tilt = h(0) * reach_m + h(1).max(h(2)) / reach_m;
        ROUND_OFFS * 0.5 * f64::EPSILON * (h(0) * state[0].abs() + by_tilt * tilts_rad)
    }

    pub(super) fn hold(&mut self, holder: Holder, state: Vector3<f64>) {
        match holder {
            Holder::Rigid => {
                self.gradient = Vector3::new(self.gradient[0], 0.0, 0.0);
                self.hessian = Matrix3::from_diagonal(&Vector3::new(self.hessian[(0, 0)], 1.0, 1.0));
            }
            Holder::Elastic {
                stiffness_nm_per_rad: k,
                rest_rad,
            } => {
                let off = [state[1] - rest_rad[0], state[2] - rest_rad[1]];
                for (i, k) in (1..).zip(k) {
                    self.gradient[i] += k[0] * off[0] + k[1] * off[1];
                    self.hessian[(i, 1)] += k[0];
                    self.hessian[(i, 2)] += k[1];
                }
            }
        }
    }
}
