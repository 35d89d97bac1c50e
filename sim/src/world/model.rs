//! The MuJoCo model of a scene: bodies, joints and servos. It has no collision geometry, because the contact field
//! computes contact.

use super::error::SimError;
use super::ur5;
use super::visual::Visuals;
use crate::mechanics::{GRAVITY_M_PER_S2, Mechanics, Task};
use mujoco_rs::prelude::MjModel;
use nalgebra::UnitQuaternion;
use spts_contact::mesh::TriMesh;
use std::fmt::Write as _;

/// MuJoCo version for which this crate is made.
pub const MUJOCO_VERSION: &str = "3.17.0";

/// Name of the body that meets the skin.
pub(crate) const BODY: &str = "body";

/// Length of the adapter between flange and object, m.
const ADAPTER_M: f64 = 0.04;

/// Distance from the flange to the object's origin along the flange's axis, m.
pub(crate) fn tool_length_m(mesh: &TriMesh) -> f64 {
    ADAPTER_M + mesh.vertices.iter().map(|v| v[2]).fold(0.0, f64::max)
}

/// Compiles the model; with `visuals`, everything a picture needs is in it too.
pub(crate) fn compile(scene: &Mechanics, visuals: Option<&Visuals>) -> Result<MjModel, SimError> {
    let found = mujoco_rs::mujoco_version();
    if found != MUJOCO_VERSION {
        return Err(SimError::Version {
            found: found.to_owned(),
            wanted: MUJOCO_VERSION,
        });
    }
    MjModel::from_xml_string(&mjcf(scene, visuals)).map_err(|error| SimError::Model(error.to_string()))
}

pub(super) fn mjcf(scene: &Mechanics, visuals: Option<&Visuals>) -> String {
    let part = |pick: fn(&Visuals) -> &str| visuals.map_or("", pick);
    let body = match scene.task() {
        Task::Press(press) => arm(&object(scene.mesh(), press.mass_kg, part(|v| &v.body)), visuals),
        Task::Drop(ball) => {
            // a thin shell: I = 2/3 m R²
            let inertia = 2.0 / 3.0 * ball.mass_kg * ball.radius_m * ball.radius_m;
            format!(
                "<body name=\"{BODY}\" pos=\"0 0 1\"><freejoint/>\
                 <inertial pos=\"0 0 0\" mass=\"{}\" diaginertia=\"{inertia} {inertia} {inertia}\"/>{}</body>\n",
                ball.mass_kg,
                part(|v| &v.body)
            )
        }
    };
    let servos = match scene.task() {
        Task::Press(_) => servos(),
        Task::Drop(_) => String::new(),
    };
    format!(
        "<mujoco model=\"spts\">\n<compiler angle=\"radian\"/>\n\
         <option timestep=\"{}\" gravity=\"0 0 -{GRAVITY_M_PER_S2}\" integrator=\"implicitfast\">\
         <flag autoreset=\"disable\" contact=\"disable\"/></option>\n{}\
         <worldbody>\n{}{body}</worldbody>\n{servos}</mujoco>\n",
        scene.timestep_s(),
        part(|v| &v.assets),
        part(|v| &v.world),
    )
}

/// The six links nested in each other, `tool` on the flange. Weights are compensated, as the real arm's controller
/// does.
fn arm(tool: &str, visuals: Option<&Visuals>) -> String {
    let mut xml = String::new();
    let mut frame = nalgebra::Isometry3::translation(ur5::BASE_M[0], ur5::BASE_M[1], ur5::BASE_M[2]);
    for (i, link) in ur5::LINKS.iter().enumerate() {
        let [x, y, z] = frame.translation.vector.into();
        let tail = link.tail();
        let centre = tail * nalgebra::Point3::from(link.centre_m);
        let [across, along] = link.inertia_kg_m2;
        let _ = writeln!(
            xml,
            "<body name=\"link{i}\" gravcomp=\"1\" pos=\"{x} {y} {z}\" quat=\"{}\">\
             <inertial mass=\"{}\" pos=\"{} {} {}\" quat=\"{}\" diaginertia=\"{across} {across} {along}\"/>\
             <joint name=\"joint{i}\" axis=\"0 0 1\" armature=\"{}\" damping=\"{}\"/>{}",
            quaternion(&frame.rotation),
            link.mass_kg,
            centre.x,
            centre.y,
            centre.z,
            quaternion(&tail.rotation),
            link.rotor_kg_m2,
            ur5::JOINT_DAMPING,
            visuals.map_or("", |v| &v.links[i]),
        );
        frame = tail;
    }
    let [x, y, z] = frame.translation.vector.into();
    let _ = write!(
        xml,
        "<body name=\"flange\" pos=\"{x} {y} {z}\" quat=\"{}\">{tool}</body>",
        quaternion(&frame.rotation)
    );
    xml.push_str(&"</body>".repeat(ur5::LINKS.len()));
    xml.push('\n');
    xml
}

/// The object, hanging upside down from the flange. Its inertia is that of a solid box of its size: the arm's own is a
/// hundred times larger.
fn object(mesh: &TriMesh, mass_kg: f64, visual: &str) -> String {
    let (low, high) = mesh.bounds().unwrap_or_default();
    let side = |i: usize| (high[i] - low[i]).max(1e-3);
    let centre = |i: usize| 0.5 * (high[i] + low[i]);
    let moment = |i: usize, j: usize| mass_kg / 12.0 * (side(i).powi(2) + side(j).powi(2));
    format!(
        "<body name=\"{BODY}\" gravcomp=\"1\" pos=\"0 0 {}\" quat=\"0 1 0 0\">\
         <inertial mass=\"{mass_kg}\" pos=\"{} {} {}\" diaginertia=\"{} {} {}\"/>{visual}</body>",
        tool_length_m(mesh),
        centre(0),
        centre(1),
        centre(2),
        moment(1, 2),
        moment(0, 2),
        moment(0, 1),
    )
}

fn servos() -> String {
    let mut xml = String::from("<actuator>\n");
    for (i, link) in ur5::LINKS.iter().enumerate() {
        let _ = writeln!(
            xml,
            "<position joint=\"joint{i}\" kp=\"{}\" dampratio=\"1\" forcerange=\"-{1} {1}\"/>",
            link.servo_nm_per_rad, link.torque_nm
        );
    }
    xml.push_str("</actuator>\n");
    xml
}

fn quaternion(rotation: &UnitQuaternion<f64>) -> String {
    let q = rotation.quaternion();
    format!("{} {} {} {}", q.w, q.i, q.j, q.k)
}
