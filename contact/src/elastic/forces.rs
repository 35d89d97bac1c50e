//! Frames of a slow press, between forces at which the elastic problem is solved.

use crate::field::{Patch, PosedMesh};

/// Ratio of neighbouring forces. Between them a pressure that grows with a power of the force, as p ∝ F^a, is off by
/// at most a |a − 1| ln²(ratio)/8: by 0.1 % for a = 1/3, the middle of a ball.
const RATIO: f64 = 1.2;
/// How far a body may stand from where the pressure was solved: sideways in cells; and relative to its depth, by how
/// much a tilt lowers its rim, and by how much it moves within the damping time.
const ASIDE_CELLS: f64 = 0.1;
const TILT: f64 = 0.01;
const SLOW: f64 = 0.02;

/// Pressures under forces a fixed ratio apart.
///
/// In a slow press the pressure follows from force, place and rotation. A press of some hundred frames needs some
/// twenty solutions then.
#[derive(Debug, Default)]
pub(super) struct Forces {
    known: Vec<Known>,
    /// Force of the last frame, N, and where the body stood.
    last: Option<(f64, Stand)>,
}

/// The pressure under one of the forces, on the patch outside of which there is none.
#[derive(Debug)]
pub(super) struct Known {
    step: i32,
    stand: Stand,
    pub(super) patch: Patch,
    pub(super) pressure_pa: Vec<f64>,
}

/// Place and rotation of a body, and the stiffness of its surface.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stand {
    place_m: [f64; 2],
    rotation: [[f64; 3]; 3],
    stiffness_pa_per_m: f64,
    /// Distance that a body may be away, m, and change of each entry of the rotation.
    aside_m: f64,
    turn: f64,
}

impl Stand {
    /// Of `body` on cells of `cell_m` and foam that is damped over `damping_s`; `None` for a body that moves too fast.
    pub(super) fn new(body: &PosedMesh<'_>, cell_m: f64, damping_s: f64) -> Option<Self> {
        let reach_m = body.mesh.vertices.as_flattened().iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let [lowest_m, _] = body.heights_m();
        let depth_m = -(lowest_m + body.position_m[2]);
        let length = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let speed_m_per_s = length(body.velocity_m_per_s) + 2.0 * reach_m * length(body.angular_velocity_rad_per_s);
        let [x, y, _] = body.position_m;
        let aside_m = ASIDE_CELLS * cell_m;
        let turn = (TILT * depth_m).min(aside_m) / reach_m;
        (damping_s * speed_m_per_s <= SLOW * depth_m).then_some(Self {
            place_m: [x, y],
            rotation: body.rotation,
            stiffness_pa_per_m: body.stiffness_pa_per_m,
            aside_m,
            turn,
        })
    }

    fn is_near(&self, other: &Self) -> bool {
        let near = |a: &[f64], b: &[f64], most: f64| a.iter().zip(b).all(|(a, b)| (a - b).abs() <= most);
        near(&self.place_m, &other.place_m, self.aside_m)
            && near(self.rotation.as_flattened(), other.rotation.as_flattened(), self.turn)
            && self.stiffness_pa_per_m.to_bits() == other.stiffness_pa_per_m.to_bits()
    }
}

/// One of the forces, N.
pub(super) fn step_n(step: i32) -> f64 {
    RATIO.powi(step)
}

impl Forces {
    /// Nothing is known of another body.
    pub(super) fn forget(&mut self) {
        self.known.clear();
        self.last = None;
    }

    /// The forces on both sides of `force_n` and the share of the upper one. `None` for a frame that stands for itself:
    /// the first one, and one whose body stands elsewhere than in the last, or under a force that is another by more
    /// than the ratio.
    #[expect(clippy::cast_possible_truncation, reason = "the logarithm of a finite number")]
    pub(super) fn around(&mut self, force_n: f64, stand: Option<Stand>) -> Option<([i32; 2], f64)> {
        let stand = stand.filter(|_| force_n > 0.0 && force_n.is_finite());
        let last = std::mem::replace(&mut self.last, stand.map(|stand| (force_n, stand)));
        let ((last_n, was), stand) = last.zip(stand)?;
        if force_n > RATIO * last_n || last_n > RATIO * force_n || !stand.is_near(&was) {
            return None;
        }
        let low = (force_n.ln() / RATIO.ln()).floor() as i32;
        let [low_n, high_n] = [step_n(low), step_n(low + 1)];
        Some(([low, low + 1], ((force_n - low_n) / (high_n - low_n)).clamp(0.0, 1.0)))
    }

    /// The pressure under a force, if it is known for `stand`.
    pub(super) fn get(&self, step: i32, stand: &Stand) -> Option<&Known> {
        self.known.iter().find(|known| known.step == step && stand.is_near(&known.stand))
    }

    /// Takes the pressure under a force; that of an earlier stand goes.
    pub(super) fn insert(&mut self, step: i32, stand: Stand, patch: Patch, pressure_pa: Vec<f64>) {
        self.known.retain(|known| known.step != step);
        self.known.push(Known { step, stand, patch, pressure_pa });
    }
}
