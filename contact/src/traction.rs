//! Computes the wrench on the body from the pressure on cells. Friction and lever arms are handled only here.

use crate::envelope::Envelope;
use crate::field::{Patch, PosedMesh, Wrench};
use crate::foam::Foam;

/// Velocity of the body at `r` from its centre of mass, m/s.
#[inline]
pub(crate) fn velocity_at(body: &PosedMesh<'_>, r: [f64; 3]) -> [f64; 3] {
    let (v, w) = (body.velocity_m_per_s, body.angular_velocity_rad_per_s);
    [v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]]
}

/// Traction on a body, summed row by row. Coulomb friction is regularised: t = −μ p v_t / √(|v_t|² + v_reg²).
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tractions {
    centre_m: [f64; 3],
    velocity_m_per_s: [f64; 3],
    spin_rad_per_s: [f64; 3],
    friction: f64,
    /// v_reg², m²/s².
    regular: f64,
    /// Whether something slides.
    rubs: bool,
    force_pa: [f64; 3],
    /// Pa m.
    torque: [f64; 3],
}

impl Tractions {
    #[inline]
    pub(crate) fn new(body: &PosedMesh<'_>, foam: &Foam) -> Self {
        let (velocity_m_per_s, spin_rad_per_s) = (body.velocity_m_per_s, body.angular_velocity_rad_per_s);
        let mut rates = velocity_m_per_s.iter().chain(&spin_rad_per_s);
        Self {
            centre_m: body.centre_of_mass_m,
            velocity_m_per_s,
            spin_rad_per_s,
            friction: foam.friction,
            regular: foam.friction_speed_m_per_s * foam.friction_speed_m_per_s,
            rubs: foam.friction > 0.0 && rates.any(|v| v.abs() > 0.0),
            force_pa: [0.0; 3],
            torque: [0.0; 3],
        }
    }

    /// Adds the cells of a row at `y_m`, whose surface lies `depth_m` below z = 0. The other slices are as long as
    /// `pressure_pa`, those for friction (Pa, along x and y) at least.
    ///
    /// The sums have four chains by the place in the row ([`sum`]): for the same bits start every row at a multiple of
    /// four columns.
    #[inline]
    pub(crate) fn add(
        &mut self,
        y_m: f64,
        x_m: &[f64],
        depth_m: &[f64],
        pressure_pa: &[f64],
        [tx, ty]: [&mut [f64]; 2],
    ) {
        let [cx, cy, cz] = self.centre_m;
        let normal = sum(pressure_pa);
        self.force_pa[2] += normal;
        self.torque[0] += (y_m - cy) * normal;
        self.torque[1] -= dot(pressure_pa, x_m) - cx * normal;
        if self.rubs && normal > 0.0 {
            let (tx, ty) = (&mut tx[..x_m.len()], &mut ty[..x_m.len()]);
            self.rub(y_m, x_m, depth_m, pressure_pa, [tx, ty]);
            let (fx, fy) = (sum(tx), sum(ty));
            self.force_pa[0] += fx;
            self.force_pa[1] += fy;
            self.torque[0] += dot(ty, depth_m) + cz * fy;
            self.torque[1] -= dot(tx, depth_m) + cz * fx;
            self.torque[2] += dot(ty, x_m) - cx * fy - (y_m - cy) * fx;
        }
    }

    /// Friction on the cells of a row.
    #[inline]
    fn rub(&self, y_m: f64, x_m: &[f64], depth_m: &[f64], pressure_pa: &[f64], [tx, ty]: [&mut [f64]; 2]) {
        let (v, w, c) = (self.velocity_m_per_s, self.spin_rad_per_s, self.centre_m);
        let across = v[0] - w[2] * (y_m - c[1]) - w[1] * c[2];
        let along = v[1] - w[2] * c[0] + w[0] * c[2];
        let cells = tx.iter_mut().zip(ty).zip(x_m).zip(depth_m).zip(pressure_pa);
        for ((((tx, ty), x), depth), p) in cells {
            let vx = across - w[1] * depth;
            let vy = along + w[2] * x + w[0] * depth;
            let drag = -self.friction * p / (vx * vx + vy * vy + self.regular).sqrt();
            *tx = drag * vx;
            *ty = drag * vy;
        }
    }

    /// Wrench about the centre of mass of tractions on cells of `area_m2`.
    #[inline]
    pub(crate) fn wrench(&self, area_m2: f64) -> Wrench {
        Wrench { force_n: self.force_pa.map(|f| f * area_m2), torque_nm: self.torque.map(|t| t * area_m2) }
    }
}

/// Cells of a row that [`wrench`] takes at a time; a multiple of four.
const BLOCK: usize = 64;

/// Wrench about the body's centre of mass of `pressure_pa` (one value a cell of `patch`) with friction; the surface
/// lies `depth_m(row, col)` below z = 0. NaN for a pose or velocity that is not finite.
pub(crate) fn wrench(
    envelope: &Envelope,
    patch: Patch,
    pressure_pa: &[f64],
    body: &PosedMesh<'_>,
    foam: &Foam,
    depth_m: impl Fn(usize, usize) -> f64,
) -> Wrench {
    if !body.is_finite() {
        return Wrench::UNKNOWN;
    }
    let mut tractions = Tractions::new(body, foam);
    let [mut x_m, mut z_m, mut tx, mut ty] = [[0.0; BLOCK]; 4];
    for (row, line) in (patch.rows[0]..).zip(pressure_pa.chunks_exact(patch.width().max(1))) {
        for (first, cells) in (patch.cols[0]..).step_by(BLOCK).zip(line.chunks(BLOCK)) {
            let n = cells.len();
            for (i, (x, z)) in x_m.iter_mut().zip(&mut z_m).take(n).enumerate() {
                *x = envelope.centre_m(row, first + i)[0];
                *z = depth_m(row, first + i);
            }
            let [_, y_m] = envelope.centre_m(row, first);
            tractions.add(y_m, &x_m[..n], &z_m[..n], cells, [&mut tx[..n], &mut ty[..n]]);
        }
    }
    tractions.wrench(envelope.cell_m() * envelope.cell_m())
}

/// Σ a, in four chains that do not wait for each other. Zeros before (by fours) and after `a` change no bit.
#[inline]
pub(crate) fn sum(a: &[f64]) -> f64 {
    let (chunks, rest) = a.as_chunks::<4>();
    let mut total = [0.0; 4];
    for chunk in chunks {
        for (t, a) in total.iter_mut().zip(chunk) {
            *t += a;
        }
    }
    for (t, a) in total.iter_mut().zip(rest) {
        *t += a;
    }
    (total[0] + total[1]) + (total[2] + total[3])
}

/// Σ a b, likewise.
#[inline]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<4>(), b.as_chunks::<4>());
    let mut total = [0.0; 4];
    for (a, b) in a.iter().zip(b) {
        for ((t, a), b) in total.iter_mut().zip(a).zip(b) {
            *t += a * b;
        }
    }
    for ((t, a), b) in total.iter_mut().zip(a_rest).zip(b_rest) {
        *t += a * b;
    }
    (total[0] + total[1]) + (total[2] + total[3])
}
