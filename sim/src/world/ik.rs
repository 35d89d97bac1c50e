//! Inverse kinematics of the arm by damped least squares.

use super::ur5;
use nalgebra::{Isometry3, Matrix6, Vector6};

/// λ, damping of the least squares: small against the singular values of a Jacobian in metres and radians (0.1–1) and
/// large enough to pass a singular posture.
const DAMPING: f64 = 0.02;
/// Largest change of a joint in one iteration, rad.
const MAX_STEP_RAD: f64 = 0.3;
const MAX_ITERATIONS: usize = 300;
/// A pose is reached when it is this close: position in m and rotation in rad together.
const TOLERANCE: f64 = 1e-10;

/// No joint angles reach the pose.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error(
    "the arm cannot reach the flange position {position_m:?} m in that orientation (remaining distance {error_m:.3} m)"
)]
pub struct Unreachable {
    /// Required position, m.
    pub position_m: [f64; 3],
    /// Remaining distance, m.
    pub error_m: f64,
}

fn residual(goal: &Isometry3<f64>, pose: &Isometry3<f64>) -> Vector6<f64> {
    let shift = goal.translation.vector - pose.translation.vector;
    let turn = (goal.rotation * pose.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// One damped step from `joints_rad` towards `goal`: Δq = Jᵀ (J Jᵀ + λ² I)⁻¹ e. λ decreases with the error, so the last
/// steps are Newton's. Returns the error before the step.
pub fn improve(goal: &Isometry3<f64>, joints_rad: &mut [f64; 6]) -> f64 {
    let (pose, jacobian) = ur5::flange_and_jacobian(joints_rad);
    let error = residual(goal, &pose);
    let size = error.norm();
    let lambda = DAMPING * size.min(1.0);
    let gram = jacobian * jacobian.transpose() + Matrix6::identity() * (lambda * lambda + 1e-14);
    let Some(factor) = gram.cholesky() else {
        return size;
    };
    let step = jacobian.transpose() * factor.solve(&error);
    let shrink = (MAX_STEP_RAD / step.amax().max(f64::MIN_POSITIVE)).min(1.0);
    for (joint, change) in joints_rad.iter_mut().zip(step.iter()) {
        *joint += shrink * change;
    }
    size
}

/// Joint angles that bring the flange to `goal`, starting from `seed_rad`.
///
/// ```
/// use spts_sim::world::{ik::solve, ur5::{HOME_RAD, flange}};
///
/// let mut goal = flange(&HOME_RAD);
/// goal.translation.z += 0.05; // 5 cm higher
/// let joints_rad = solve(&goal, &HOME_RAD)?;
/// assert!((flange(&joints_rad).translation.vector - goal.translation.vector).norm() < 1e-6);
/// # Ok::<(), spts_sim::world::ik::Unreachable>(())
/// ```
///
/// # Errors
/// [`Unreachable`] if the iteration ends elsewhere.
pub fn solve(goal: &Isometry3<f64>, seed_rad: &[f64; 6]) -> Result<[f64; 6], Unreachable> {
    let mut joints_rad = *seed_rad;
    for _ in 0..MAX_ITERATIONS {
        if improve(goal, &mut joints_rad) < TOLERANCE {
            return Ok(joints_rad);
        }
    }
    let error = residual(goal, &ur5::flange(&joints_rad));
    Err(Unreachable {
        position_m: goal.translation.vector.into(),
        error_m: error.fixed_rows::<3>(0).norm(),
    })
}
