//! From pressure on cells to the wrench on the body.

use super::{Envelope, Patch, PosedMesh};
use crate::frame::Wrench;

/// Coulomb friction, regularised: t = −μ p v_t / √(|v_t|² + v_reg²).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Friction {
    /// μ.
    pub(crate) coefficient: f64,
    /// v_reg, m/s.
    pub(crate) speed_m_per_s: f64,
}

/// Velocity of the body at `r` from its centre of mass, m/s.
#[inline]
pub(crate) fn velocity_at(body: &PosedMesh<'_>, r: [f64; 3]) -> [f64; 3] {
    let (v, w) = (body.velocity_m_per_s, body.angular_velocity_rad_per_s);
    [
        v[0] + w[1] * r[2] - w[2] * r[1],
        v[1] + w[2] * r[0] - w[0] * r[2],
        v[2] + w[0] * r[1] - w[1] * r[0],
    ]
}

/// Wrench about the body's centre of mass of `pressure_pa` (one value a cell of `patch`) with friction; the surface lies
/// `depth_m(row, col)` below z = 0.
pub(crate) fn wrench(
    envelope: &Envelope,
    patch: Patch,
    pressure_pa: &[f64],
    body: &PosedMesh<'_>,
    friction: Friction,
    depth_m: impl Fn(usize, usize) -> f64,
) -> Wrench {
    let com = body.centre_of_mass_m;
    let regular = friction.speed_m_per_s * friction.speed_m_per_s;
    let (mut force, mut torque) = ([0.0; 3], [0.0; 3]);
    let mut cells = pressure_pa.iter();
    for row in patch.rows[0]..patch.rows[1] {
        for col in patch.cols[0]..patch.cols[1] {
            let Some(&p) = cells.next() else { break };
            if p <= 0.0 {
                continue;
            }
            let [x, y] = envelope.centre_m(row, col);
            let r = [x - com[0], y - com[1], -depth_m(row, col) - com[2]];
            let velocity = velocity_at(body, r);
            let slip = (velocity[0] * velocity[0] + velocity[1] * velocity[1] + regular).sqrt();
            let drag = -friction.coefficient * p / slip;
            let t = [drag * velocity[0], drag * velocity[1], p];
            for (sum, part) in force.iter_mut().zip(t) {
                *sum += part;
            }
            torque[0] += r[1] * t[2] - r[2] * t[1];
            torque[1] += r[2] * t[0] - r[0] * t[2];
            torque[2] += r[0] * t[1] - r[1] * t[0];
        }
    }
    let area_m2 = envelope.cell_m() * envelope.cell_m();
    Wrench {
        force_n: force.map(|f| f * area_m2),
        torque_nm: torque.map(|t| t * area_m2),
    }
}
