//! The arm: a Universal Robots UR5 (CB3), and its inverse kinematics by damped least squares.

use nalgebra::{Isometry3, Matrix6, Quaternion, Translation3, UnitQuaternion, Vector3, Vector6};
use spts_input::Refusal;
use std::f64::consts::FRAC_PI_2;
use std::sync::LazyLock;

/// One link and the joint that moves it, in standard Denavit–Hartenberg form: `R_z(θ)` `T_z(d)` `T_x(a)` `R_x(α)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Link {
    /// a, m.
    pub a_m: f64,
    /// d, m.
    pub d_m: f64,
    /// α, rad.
    pub alpha_rad: f64,
    /// Mass, kg.
    pub mass_kg: f64,
    /// Centre of mass in the link's own frame (the one after α), m.
    pub centre_m: [f64; 3],
    /// Moments of inertia about the frame's axes through the centre of mass: across (x = y) and along z, kg m².
    pub inertia_kg_m2: [f64; 2],
    /// Rotor inertia seen at the joint, kg m².
    pub rotor_kg_m2: f64,
    /// Largest torque, N m.
    pub torque_nm: f64,
    /// Stiffness of the position servo, N m/rad.
    pub servo_nm_per_rad: f64,
}

/// The six links. Lengths: UR5 CB3 user manual, DH table. Masses, centres and inertias: Universal Robots' ROS 2
/// description, `ur5/physical_parameters.yaml`. Torques: `joint_limits.yaml` of the same. Rotor inertias and servo
/// stiffnesses are estimates, chosen so that 20 N move the tool by less than half a millimetre.
pub(crate) const LINKS: [Link; 6] = [
    link([0.0, 0.089_159, FRAC_PI_2], 3.7, [0.0, -0.025_61, 0.001_93], [0.014_972, 0.010_406], true),
    link([-0.425, 0.0, 0.0], 8.393, [0.2125, 0.0, 0.113_36], [0.133_886, 0.015_107], true),
    link([-0.392_25, 0.0, 0.0], 2.33, [0.15, 0.0, 0.0265], [0.031_217, 0.004_095], true),
    link([0.0, 0.109_15, FRAC_PI_2], 1.219, [0.0, -0.0018, 0.016_34], [0.002_013_9, 0.002_194_2], false),
    link([0.0, 0.094_65, -FRAC_PI_2], 1.219, [0.0, 0.0018, 0.016_34], [0.001_831, 0.002_194_2], false),
    link([0.0, 0.0823, 0.0], 0.1879, [0.0, 0.0, -0.001_159], [8.06e-5, 1.32e-4], false),
];

const fn link(dh: [f64; 3], mass_kg: f64, centre_m: [f64; 3], inertia_kg_m2: [f64; 2], large: bool) -> Link {
    Link {
        a_m: dh[0],
        d_m: dh[1],
        alpha_rad: dh[2],
        mass_kg,
        centre_m,
        inertia_kg_m2,
        rotor_kg_m2: if large { 1.0 } else { 0.2 },
        torque_nm: if large { 150.0 } else { 28.0 },
        servo_nm_per_rad: if large { 40_000.0 } else { 10_000.0 },
    }
}

/// Damping of every joint, N m s/rad (estimate).
pub(crate) const JOINT_DAMPING: f64 = 2.0;

/// Position of the base in world axes, m: half a metre from the middle of the skin.
pub(crate) const BASE_M: [f64; 3] = [-0.5, 0.0, 0.0];

/// A posture with the tool above the middle of the skin, pointing down, elbow up.
pub const HOME_RAD: [f64; 6] = [std::f64::consts::PI, -1.4, 1.9, -2.07, -1.57, 0.0];

impl Link {
    /// Transformation from the joint's moving side to the link's own frame: `T_z(d)` `T_x(a)` `R_x(α)`.
    pub(crate) fn tail(&self) -> Isometry3<f64> {
        Isometry3::from_parts(
            Translation3::new(self.a_m, 0.0, self.d_m),
            UnitQuaternion::from_axis_angle(&Vector3::x_axis(), self.alpha_rad),
        )
    }
}

fn base() -> Isometry3<f64> {
    Isometry3::translation(BASE_M[0], BASE_M[1], BASE_M[2])
}

/// The tails of the six links.
static TAILS: LazyLock<[Isometry3<f64>; 6]> = LazyLock::new(|| LINKS.map(|link| link.tail()));

/// Pose of the [`flange`] and the [`jacobian`] of the point `tool`, in one pass.
fn kinematics(joints_rad: &[f64; 6], tool: &Vector3<f64>) -> (Isometry3<f64>, Matrix6<f64>) {
    let mut pose = base();
    let mut frames = [(Vector3::zeros(), Vector3::zeros()); 6];
    for ((tail, &angle), frame) in TAILS.iter().zip(joints_rad).zip(&mut frames) {
        *frame = (pose.rotation * Vector3::z(), pose.translation.vector);
        let (sin, cos) = (0.5 * angle).sin_cos();
        // a rotation about z as a quaternion; unit by construction
        let turn = UnitQuaternion::new_unchecked(Quaternion::new(cos, 0.0, 0.0, sin));
        pose = pose * turn * tail;
    }
    let tip = pose * nalgebra::Point3::from(*tool);
    let mut jacobian = Matrix6::zeros();
    for (i, (axis, origin)) in frames.iter().enumerate() {
        let velocity = axis.cross(&(tip.coords - origin));
        jacobian.fixed_view_mut::<3, 1>(0, i).copy_from(&velocity);
        jacobian.fixed_view_mut::<3, 1>(3, i).copy_from(axis);
    }
    (pose, jacobian)
}

/// Pose of the arm's flange in world axes, m, for these joint angles. Its z axis points out of the arm.
///
/// ```
/// use spts_sim::world::arm::{HOME_RAD, flange};
///
/// let pose = flange(&HOME_RAD);
/// let down = pose.rotation * nalgebra::Vector3::z();
/// assert!(down.z < -0.99, "the tool points down");
/// ```
pub fn flange(joints_rad: &[f64; 6]) -> Isometry3<f64> {
    kinematics(joints_rad, &Vector3::zeros()).0
}

/// How the point `tool` moves when the joints turn: a matrix with one column a joint. Rows 0–2 are the velocity of the
/// point in world axes, m/s for 1 rad/s of the joint, and rows 3–5 the angular velocity. `tool` is given in flange
/// axes, m.
pub(crate) fn jacobian(joints_rad: &[f64; 6], tool: &Vector3<f64>) -> Matrix6<f64> {
    kinematics(joints_rad, tool).1
}

/// λ, damping of the least squares: small against the singular values of a Jacobian in metres and radians (0.1–1) and
/// large enough to pass a singular posture.
const DAMPING: f64 = 0.02;
/// Largest change of a joint in one iteration, rad.
const MAX_STEP_RAD: f64 = 0.3;
const MAX_ITERATIONS: usize = 300;
/// A pose is reached when it is this close: position in m and rotation in rad together.
const TOLERANCE: f64 = 1e-10;

fn residual(goal: &Isometry3<f64>, pose: &Isometry3<f64>) -> Vector6<f64> {
    let shift = goal.translation.vector - pose.translation.vector;
    let turn = (goal.rotation * pose.rotation.inverse()).scaled_axis();
    Vector6::new(shift.x, shift.y, shift.z, turn.x, turn.y, turn.z)
}

/// One damped step from `joints_rad` towards `goal`: Δq = Jᵀ (J Jᵀ + λ² I)⁻¹ e. λ decreases with the error, so the last
/// steps are Newton's. Returns the error before the step.
pub fn improve(goal: &Isometry3<f64>, joints_rad: &mut [f64; 6]) -> f64 {
    let (pose, jacobian) = kinematics(joints_rad, &Vector3::zeros());
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
/// use spts_sim::world::arm::{HOME_RAD, flange, solve};
///
/// let mut goal = flange(&HOME_RAD);
/// goal.translation.z += 0.05; // 5 cm higher
/// let joints_rad = solve(&goal, &HOME_RAD)?;
/// assert!((flange(&joints_rad).translation.vector - goal.translation.vector).norm() < 1e-6);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
///
/// # Errors
/// [`Refusal`] if the iteration ends elsewhere.
pub fn solve(goal: &Isometry3<f64>, seed_rad: &[f64; 6]) -> Result<[f64; 6], Refusal> {
    let mut joints_rad = *seed_rad;
    for _ in 0..MAX_ITERATIONS {
        if improve(goal, &mut joints_rad) < TOLERANCE {
            return Ok(joints_rad);
        }
    }
    let error_m = residual(goal, &flange(&joints_rad)).fixed_rows::<3>(0).norm();
    let position_m: [f64; 3] = goal.translation.vector.into();
    Err(Refusal::new(format!(
        "the arm cannot reach the flange position {position_m:?} m in that orientation (remaining distance {error_m:.3} m)"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The textbook matrix product, written out.
    fn dh_product(joints: &[f64; 6]) -> nalgebra::Matrix4<f64> {
        let mut t = base().to_homogeneous();
        for (l, q) in LINKS.iter().zip(joints) {
            let ((s, c), (sa, ca)) = (q.sin_cos(), l.alpha_rad.sin_cos());
            #[rustfmt::skip]
            let a = nalgebra::Matrix4::new(
                c, -s * ca, s * sa, l.a_m * c,
                s, c * ca, -c * sa, l.a_m * s,
                0.0, sa, ca, l.d_m,
                0.0, 0.0, 0.0, 1.0,
            );
            t *= a;
        }
        t
    }

    proptest! {
        #[test]
        fn flange_is_the_dh_product(joints in prop::array::uniform6(-6.2..6.2_f64)) {
            let error = (flange(&joints).to_homogeneous() - dh_product(&joints)).abs().max();
            // six products of numbers below 1
            prop_assert!(error < 1e-14, "{error:e}");
        }

        /// Central differences with step h = 1e-5: error h² / 6 × third derivative (≤ 2 m) ≈ 3e-11, round-off 1e-11.
        #[test]
        fn jacobian_is_the_derivative(joints in prop::array::uniform6(-3.0..3.0_f64), i in 0..6_usize) {
            let tool = Vector3::new(0.01, -0.02, 0.05);
            let h = 1e-5;
            let at = |sign: f64| {
                let mut q = joints;
                q[i] += sign * h;
                flange(&q) * nalgebra::Point3::from(tool)
            };
            let numeric = (at(1.0) - at(-1.0)) / (2.0 * h);
            let error = (jacobian(&joints, &tool).fixed_view::<3, 1>(0, i) - numeric).abs().max();
            prop_assert!(error < 1e-9, "{error:e}");
        }

        /// Any posture the arm can take above the skin, tool down within 30°, any rotation, is found from home.
        #[test]
        fn inverse_kinematics_converges(
            x in -0.09..0.09_f64, y in -0.09..0.09_f64, z in 0.0..0.25_f64,
            turn in -3.1..3.1_f64, tilt in -0.5..0.5_f64, towards in -3.1..3.1_f64,
        ) {
            let axis = nalgebra::Unit::new_normalize(Vector3::new(towards.cos(), towards.sin(), 0.0));
            let rotation = UnitQuaternion::from_axis_angle(&axis, tilt)
                * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), turn)
                * UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI);
            let goal = Isometry3::from_parts(Translation3::new(x, y, z + 0.05), rotation);
            let joints = solve(&goal, &HOME_RAD).unwrap();
            let found = flange(&joints);
            prop_assert!((found.translation.vector - goal.translation.vector).norm() < 1e-9);
            prop_assert!(found.rotation.angle_to(&goal.rotation) < 1e-7);
        }
    }
}
