//! A press without dynamics: the force follows its time course, and the contact field computes the pose.

use super::arm;
use super::model::rejected;
use super::press::{CLEARANCE_M, LAG_S, LIFT_M_PER_S2, PressPlan, TOUCH, approach_m};
use crate::mechanics::{Mechanics, PressConfig};
use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, Rotation3, UnitQuaternion};
use spts_contact::{
    ContactField, EquilibriumError, Frame, Holder, Load, Pose, PosedMesh, PreparedMesh, Seat, TaxelBins, Wrench,
};
use spts_input::Refusal;
use spts_models::PressureMap;

/// One press of a scene, a balance at every frame.
///
/// Place, rotation, onset and lift are drawn as for the stepped press of the same index. The force is the reference
/// course from the onset on, as late as the stepped press follows it; the arm holds the object with the stiffness of
/// its servos.
pub(super) struct QuasiStaticPress {
    plan: PressPlan,
    field: Box<dyn ContactField>,
    bins: TaxelBins,
    mesh: PreparedMesh,
    shape: [usize; 2],
    stiffness_pa_per_m: f64,
    interval_s: f64,
    frame: u64,
    frames: u64,
    /// Centre of mass in the object's axes, m.
    centre_m: [f64; 3],
    rotation: [[f64; 3]; 3],
    arm: Arm,
    /// Height of the origin at the touch, m.
    touch_height_m: f64,
    /// The last equilibrium.
    seat: Option<Seat>,
    last_contact: [f64; 2],
    /// Force of the last equilibrium, N, and its pressures and wrench. At the plateau every frame has the same.
    held: Option<(f64, [PressureMap; 2], Wrench)>,
    position_m: [f64; 3],
    quaternion: UnitQuaternion<f64>,
}

/// What the servos let the tool do, about the point where the load's axis meets the skin.
#[derive(Debug, Clone, Copy)]
struct Arm {
    joints_rad: [f64; 6],
    stiffness_nm_per_rad: [[f64; 2]; 2],
    /// Tilt caused by a vertical force, rad/N.
    tilt_rad_per_n: [f64; 2],
    /// Position of the object's origin under the full force, m, because the servos also yield sideways. It is kept for
    /// smaller forces (0.1 mm at 20 N), so that one height map serves the whole press.
    xy_m: [f64; 2],
}

impl QuasiStaticPress {
    /// Press `index`, nothing pressed yet; `field` must be quasi-static.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "a scene's duration is at most 60 s, in frames of at least 1 µs"
    )]
    pub(super) fn new(
        scene: &Mechanics,
        config: &PressConfig,
        index: u64,
        field: Box<dyn ContactField>,
    ) -> Result<Self, Refusal> {
        let plan = PressPlan::new(scene, config, index);
        let (low, high) = scene.mesh().bounds().unwrap_or_default();
        let rotation = plan.rotation.to_rotation_matrix().matrix().transpose().into();
        let [x, y] = plan.xy_m;
        let mut press = Self {
            bins: TaxelBins::new(scene.skin(), field.cells_per_taxel()),
            field,
            mesh: scene.mesh().clone(),
            shape: [scene.skin().rows(), scene.skin().cols()],
            stiffness_pa_per_m: config.stiffness_pa_per_m.unwrap_or(f64::INFINITY),
            interval_s: scene.frame_interval_s(),
            frame: 0,
            frames: ((scene.duration_s() / scene.frame_interval_s()) * (1.0 + 1e-9)) as u64,
            centre_m: [0, 1, 2].map(|i| 0.5 * (low[i] + high[i])),
            rotation,
            arm: Arm::at(&plan, 0.0, &arm::HOME_RAD)?,
            touch_height_m: 0.0,
            seat: None,
            last_contact: [0.0; 2],
            held: None,
            position_m: [x, y, 0.0],
            quaternion: plan.rotation,
            plan,
        };
        press.arrange(config.force_n)?;
        Ok(press)
    }

    /// Finds the heights of the touch and of the full force, and the arm's compliance there.
    fn arrange(&mut self, force_n: f64) -> Result<(), Refusal> {
        let onset_s = self.plan.onset_s;
        self.carry(force_n, onset_s)?;
        let pressed_m = self.seat.map_or(0.0, |seat| seat.height_m);
        self.arm = Arm::at(&self.plan, pressed_m, &self.arm.joints_rad)?;
        self.seat = None;
        self.carry(TOUCH * force_n, onset_s)?;
        self.touch_height_m = self.seat.map_or(0.0, |seat| seat.height_m);
        self.seat = None;
        // the highest pose has to be within reach too
        self.arm.joints_rad = arm::solve(&self.plan.flange(self.touch_height_m + CLEARANCE_M), &self.arm.joints_rad)?;
        self.hang(self.touch_height_m + CLEARANCE_M);
        Ok(())
    }

    /// Time of the frame that was given last, s.
    pub(super) fn time_s(&self) -> f64 {
        self.frame.saturating_sub(1) as f64 * self.interval_s
    }

    /// Joint angles of the arm, rad.
    pub(super) fn joints_rad(&self) -> [f64; 6] {
        let object = Isometry3::from_parts(self.position_m.into(), self.quaternion);
        let goal = object * self.plan.tool.inverse();
        // every pose is between two that were reached
        arm::solve(&goal, &self.arm.joints_rad).unwrap_or(self.arm.joints_rad)
    }

    /// The next frame; `None` at the end.
    pub(super) fn advance(&mut self) -> Result<Option<Frame>, Refusal> {
        if self.frame > self.frames {
            return Ok(None);
        }
        self.frame += 1;
        let time_s = self.time_s();
        // the servos follow the reference with a delay that the recorded courses show
        let (force_n, _) = self.plan.reference(time_s - LAG_S, self.plan.onset_s);
        let touched = time_s >= self.plan.onset_s;
        if touched && force_n > 0.0 {
            let same = |(held_n, ..): &(f64, [PressureMap; 2], Wrench)| held_n.to_bits() == force_n.to_bits();
            let (maps, wrench) = match self.held.take().filter(same) {
                Some((_, maps, wrench)) => {
                    self.last_contact[0] = time_s;
                    (maps, wrench)
                }
                None => self.carry(force_n, time_s)?,
            };
            self.held = Some((force_n, maps.clone(), wrench));
            return Ok(Some(self.frame_of(maps, wrench)));
        }
        let height_m = if touched {
            let [lifted_s, from_m] = self.last_contact;
            let rise_m = 0.5 * LIFT_M_PER_S2 * (time_s - lifted_s).powi(2);
            (from_m + rise_m).min(self.touch_height_m + CLEARANCE_M)
        } else {
            self.touch_height_m + approach_m(self.plan.onset_s - time_s, self.plan.onset_s)
        };
        self.hang(height_m);
        let [rows, cols] = self.shape;
        let nothing = Wrench { force_n: [0.0; 3], torque_nm: [0.0; 3] };
        let maps = [(); 2].map(|()| PressureMap::zeros(rows, cols));
        Ok(Some(self.frame_of(maps, nothing)))
    }

    /// Brings the object to `height_m` without contact.
    fn hang(&mut self, height_m: f64) {
        let [x, y] = self.plan.xy_m;
        self.position_m = [x, y, height_m];
        self.quaternion = self.plan.rotation;
    }

    /// Balances `force_n`: moves the object there and returns what the skin feels.
    fn carry(&mut self, force_n: f64, time_s: f64) -> Result<([PressureMap; 2], Wrench), Refusal> {
        let [x, y] = self.arm.xy_m;
        let centre = self.plan.rotation * Point3::from(self.centre_m);
        let body = PosedMesh {
            rotation: self.rotation,
            centre_of_mass_m: [x + centre.x, y + centre.y, centre.z],
            stiffness_pa_per_m: self.stiffness_pa_per_m,
            ..PosedMesh::at_rest(&self.mesh, [x, y, 0.0])
        };
        let load = Load {
            force_n,
            axis_m: self.arm.xy_m,
            holder: Holder::Elastic {
                stiffness_nm_per_rad: self.arm.stiffness_nm_per_rad,
                rest_rad: self.arm.tilt_rad_per_n.map(|tilt| tilt * force_n),
            },
            from: self.seat,
        };
        let failed =
            |error: EquilibriumError| Refusal::new(format!("`press.force_n` = {force_n} at {time_s:.4} s: {error}"));
        let field = self.field.quasi_static().ok_or_else(|| rejected("contact field"))?;
        let balance = field.carry(&body, &load).map_err(failed)?;
        let response = balance.response;
        let maps = self.bins.means(response.pressure_pa, response.patch);
        self.seat = Some(balance.seat);
        self.position_m = balance.position_m;
        let turned = Matrix3::from_fn(|i, j| balance.rotation[i][j]);
        self.quaternion = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(turned));
        self.last_contact = [time_s, balance.seat.height_m];
        Ok((maps, response.wrench))
    }

    fn frame_of(&self, [pressure, electrode_pressure]: [PressureMap; 2], wrench: Wrench) -> Frame {
        let q = self.quaternion.quaternion();
        Frame {
            time_s: self.time_s(),
            pressure,
            electrode_pressure,
            wrench,
            pose: Pose { position_m: self.position_m, quaternion: [q.w, q.i, q.j, q.k] },
        }
    }
}

impl Arm {
    /// The arm with the object's origin at `height_m`: C = J kp⁻¹ Jᵀ about the point of the skin below it.
    fn at(plan: &PressPlan, height_m: f64, seed_rad: &[f64; 6]) -> Result<Self, Refusal> {
        let joints_rad = arm::solve(&plan.flange(height_m), seed_rad)?;
        let [x, y] = plan.xy_m;
        let pivot = arm::flange(&joints_rad).inverse() * Point3::new(x, y, 0.0);
        let jacobian = arm::jacobian(&joints_rad, &pivot.coords);
        let compliance = |i: usize, j: usize| -> f64 {
            let parts = arm::LINKS.iter().enumerate();
            parts.map(|(k, link)| jacobian[(i, k)] * jacobian[(j, k)] / link.servo_nm_per_rad).sum()
        };
        let tilts = Matrix2::from_fn(|i, j| compliance(3 + i, 3 + j));
        let stiffness = tilts.try_inverse().ok_or_else(|| rejected("the arm cannot tilt the object"))?;
        Ok(Self {
            joints_rad,
            stiffness_nm_per_rad: [0, 1].map(|i| [0, 1].map(|j| stiffness[(i, j)])),
            tilt_rad_per_n: [compliance(3, 2), compliance(4, 2)],
            xy_m: [0, 1].map(|i| plan.xy_m[i] + compliance(i, 2) * plan.config.force_n),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::world::{World, model};
    use approx::assert_relative_eq;
    use spts_contact::Frame;
    use spts_contact::mesh::cuboid;
    use std::path::Path;

    fn scene(model: &str, object: &str) -> Mechanics {
        let text = format!("[contact]\nmodel = \"{model}\"\n[press]\nobject = \"{object}\"");
        Mechanics::from_toml(&text, Path::new("")).unwrap()
    }

    fn run(scene: &Mechanics, index: usize) -> Vec<Frame> {
        World::repeat(scene, index).unwrap().frames().map(Result::unwrap).collect()
    }

    /// The same index is the same press: on the plateau the object stands where the stepped arm puts it (within a tenth
    /// of how far it gives way sideways), and the taxels feel nearly the same. The rest is friction, and outlines that
    /// cross the centres of cells: one of some hundred cells in contact, or 0.5 %.
    #[test]
    fn plateau_is_that_of_the_stepped_press() {
        for name in ["T", "tape", "tennis"] {
            let plateau = |model: &str| {
                let frames = run(&scene(model, name), 3);
                frames.into_iter().find(|f| f.time_s > 0.85).unwrap()
            };
            let (fast, slow) = (plateau("footprint"), plateau("winkler"));
            for i in 0..2 {
                let apart_m = (fast.pose.position_m[i] - slow.pose.position_m[i]).abs();
                assert!(apart_m < 2e-5, "{name}: {apart_m:e} m");
            }
            let pairs = fast.pressure.values().iter().zip(slow.pressure.values());
            let off: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
            let all: f64 = slow.pressure.values().iter().map(|b| b * b).sum();
            let rms = (off / all).sqrt();
            assert!(rms < 5e-3, "{name}: {rms}");
        }
    }

    /// The joint angles asked for bring the object to where the frame says it is.
    #[test]
    fn joints_reach_the_pose() {
        let scene = scene("footprint", "X");
        let mut world = World::new(&scene).unwrap();
        assert_eq!(world.positions().len(), 6);
        for time_s in [0.1, 0.5, 0.85, 1.3] {
            let frame = world.frames().map(Result::unwrap).find(|f| f.time_s >= time_s).unwrap();
            let joints: [f64; 6] = world.positions().try_into().unwrap();
            let tool_m = model::tool_length_m(scene.mesh());
            let tip = arm::flange(&joints) * nalgebra::Point3::new(0.0, 0.0, tool_m);
            for i in 0..3 {
                assert!((tip[i] - frame.pose.position_m[i]).abs() < 1e-9, "{tip} {:?}", frame.pose);
            }
        }
    }

    /// A whole press of a plate whose origin is 0.1 m above its face: 0.5 N on the plateau and 5 mN at the touch, on a
    /// stiff skin.
    #[test]
    fn press_of_a_body_with_a_far_origin() {
        let folder = tempfile::tempdir().unwrap();
        let mesh = cuboid([0.085, 0.07, 0.01]).translated([0.0, 0.0, -0.1]);
        std::fs::write(folder.path().join("plate.obj"), mesh.to_obj("plate")).unwrap();
        for k in ["1.5e7", "1e9"] {
            let scene = format!(
                "[contact]\nmodel = \"footprint\"\nstiffness_pa_per_m = {k}\n[press]\nmesh = \"plate.obj\"\nforce_n = 0.5"
            );
            let scene = Mechanics::from_toml(&scene, folder.path()).unwrap();
            let lowest_m = scene.mesh().vertices.iter().map(|v| v[2]).fold(f64::INFINITY, f64::min);
            assert!((lowest_m + 0.1).abs() < 1e-6, "{lowest_m}");
            let frames: Vec<_> = World::new(&scene).unwrap().frames().map(Result::unwrap).collect();
            let most_n = frames.iter().map(|f| f.wrench.force_n[2]).fold(0.0, f64::max);
            assert_relative_eq!(most_n, 0.5, max_relative = 2e-12);
        }
    }
}
