//! The MuJoCo model of a scene: bodies, joints and servos, and for pictures shapes, colours, lights and cameras. It has
//! no collision geometry, because the contact field computes contact.

use super::arm;
use super::arm::BASE_M;
use crate::mechanics::{GRAVITY_M_PER_S2, Mechanics, Task};
use mujoco_rs::prelude::MjModel;
use nalgebra::UnitQuaternion;
use spts_contact::mesh::TriMesh;
use spts_input::Refusal;
use std::fmt::Write as _;

/// MJCF fragments for the places of the model where a picture needs something.
#[derive(Debug, Clone)]
pub(crate) struct Visuals {
    /// Settings, materials, textures and the mesh.
    pub(crate) assets: String,
    /// Room, table, skin, base of the arm, lights and cameras.
    pub(crate) world: String,
    /// Shape of the object or ball.
    pub(crate) body: String,
}

/// Name of the object's or ball's shape.
pub(crate) const BODY_GEOM: &str = "body";

/// Name of the pad of taxel `index`.
pub(crate) fn pad_name(index: usize) -> String {
    format!("pad{index}")
}

/// Geoms of the skin's pads are drawn only up to this many taxels.
pub(crate) const MAX_PADS: usize = 1024;

/// Colour (r, g, b) of a pad that is not pressed.
pub(crate) const PAD_RGB: [f32; 3] = [0.20, 0.22, 0.25];

/// Height of the table's top, m: the sheet with foam and carrier lies on it.
fn table_m(thickness_m: f64) -> f64 {
    -thickness_m - 2e-3
}

impl Visuals {
    pub(crate) fn new(scene: &Mechanics, thickness_m: f64, width: usize, height: usize) -> Self {
        let thickness_m = thickness_m.min(0.03);
        let (hue, press) = match scene.task() {
            Task::Press(_) => ("0.30 0.78 0.80", true),
            Task::Drop(_) => ("0.80 0.90 0.18", false),
        };
        Self {
            assets: assets(scene.mesh(), width, height),
            world: world(scene, thickness_m, press),
            body: format!(
                "<geom name=\"{BODY_GEOM}\" type=\"mesh\" mesh=\"body\" mass=\"0\" contype=\"0\" conaffinity=\"0\" rgba=\"{hue} 1\" material=\"object\"/>{}",
                if press { adapter(scene.mesh()) } else { String::new() }
            ),
        }
    }
}

/// Adapter between the top of the object and the flange, drawn in the object's frame.
fn adapter(mesh: &TriMesh) -> String {
    let top = mesh.vertices.iter().map(|v| v[2]).fold(0.0, f64::max);
    format!(
        "{}{}",
        geom("cylinder", [0.0, 0.0, top], [0.0, 0.0, top + 0.04], 0.016, "steel"),
        geom("cylinder", [0.0, 0.0, top + 0.032], [0.0, 0.0, top + 0.04], 0.0315, "steel")
    )
}

fn assets(mesh: &TriMesh, width: usize, height: usize) -> String {
    let mut vertices = String::new();
    for [x, y, z] in &mesh.vertices {
        let _ = write!(vertices, "{x} {y} {z} ");
    }
    let mut faces = String::new();
    for [a, b, c] in &mesh.triangles {
        let _ = write!(faces, "{a} {b} {c} ");
    }
    let look = include_str!("../../assets/look.xml");
    let look = look.replace("{width}", &width.to_string()).replace("{height}", &height.to_string());
    look.replace("{vertices}", &vertices).replace("{faces}", &faces)
}

fn world(scene: &Mechanics, thickness_m: f64, press: bool) -> String {
    let table = table_m(thickness_m);
    let [width, height] = scene.skin().extent_m();
    let (hx, hy) = (0.5 * width, 0.5 * height);
    let (reach_x, reach_y) = (hx.max(0.32), hy.max(0.42));
    let floor = table - 0.72;
    let target = [0.0, 0.0, 0.012];
    let (wide, close) = if press {
        (camera("wide", [0.52, -0.94, 0.52], [-0.215, 0.0, 0.215], 34.0), [0.21, -0.235, 0.165])
    } else {
        (camera("wide", [0.42, -0.62, 0.40], [0.0, 0.0, 0.13], 38.0), [0.21, -0.26, 0.17])
    };
    let scale = (hx.max(hy) / 0.075).max(1.0);
    let close = camera("close", close.map(|c| c * scale), target, 38.0);
    let mut xml = format!(
        r#"<light pos="0.6 -0.9 1.8" dir="-0.42 0.55 -1.1" diffuse="0.56 0.55 0.53" specular="0.25 0.25 0.25" castshadow="true" directional="true"/>
<light pos="-1 1 1.5" dir="0.6 -0.6 -0.9" diffuse="0.20 0.21 0.24" specular="0 0 0" castshadow="false" directional="true"/>
{wide}{close}
<geom type="plane" size="4 4 0.1" pos="0 0 {floor}" material="floor" contype="0" conaffinity="0"/>
{}{}{}
"#,
        slab([if press { -0.24 } else { 0.0 }, 0.0, table - 0.02], [reach_x + 0.22, reach_y, 0.02], "table"),
        slab([0.0, 0.0, table + 1e-3], [hx + 0.012, hy + 0.012, 1e-3], "carrier"),
        slab([0.0, 0.0, -0.5 * thickness_m - 2e-4], [hx, hy, 0.5 * thickness_m - 2e-4], "foam"),
    );
    if press {
        let foot = [BASE_M[0], BASE_M[1], table];
        xml += &geom("cylinder", foot, [foot[0], foot[1], table + 0.012], 0.085, "dark");
        xml += &geom("cylinder", [foot[0], foot[1], table + 0.012], [foot[0], foot[1], 0.035], 0.075, "grey");
    }
    if scene.skin().taxels() <= MAX_PADS {
        let half = 0.5 * scene.skin().pitch_m() * 0.88;
        for row in 0_u32..u32::try_from(scene.skin().rows()).unwrap_or(0) {
            for col in 0_u32..u32::try_from(scene.skin().cols()).unwrap_or(0) {
                let [x, y] = scene.skin().position_m(f64::from(row), f64::from(col));
                let index = row as usize * scene.skin().cols() + col as usize;
                let [r, g, b] = PAD_RGB;
                let _ = writeln!(
                    xml,
                    "<geom name=\"{}\" type=\"box\" pos=\"{x} {y} -3e-4\" size=\"{half} {half} 3e-4\" contype=\"0\" \
                     conaffinity=\"0\" material=\"pad\" rgba=\"{r} {g} {b} 1\"/>",
                    pad_name(index)
                );
            }
        }
    }
    xml
}

/// Camera at `from` that looks at `to`, z up.
fn camera(name: &str, from: [f64; 3], to: [f64; 3], fovy_deg: f64) -> String {
    let (from_v, to_v) = (nalgebra::Vector3::from(from), nalgebra::Vector3::from(to));
    let back = (from_v - to_v).normalize();
    let right = nalgebra::Vector3::z().cross(&back).normalize();
    let up = back.cross(&right);
    format!(
        "<camera name=\"{name}\" pos=\"{} {} {}\" xyaxes=\"{} {} {} {} {} {}\" fovy=\"{fovy_deg}\"/>\n",
        from[0], from[1], from[2], right.x, right.y, right.z, up.x, up.y, up.z
    )
}

fn slab(centre: [f64; 3], half: [f64; 3], material: &str) -> String {
    let ([x, y, z], [a, b, c]) = (centre, half);
    format!(
        "<geom type=\"box\" pos=\"{x} {y} {z}\" size=\"{a} {b} {c}\" material=\"{material}\" contype=\"0\" conaffinity=\"0\"/>\n"
    )
}

fn geom(kind: &str, from: [f64; 3], to: [f64; 3], radius: f64, material: &str) -> String {
    let ([a, b, c], [d, e, f]) = (from, to);
    if (a - d).abs() + (b - e).abs() + (c - f).abs() < 1e-6 {
        return String::new();
    }
    format!(
        "<geom type=\"{kind}\" fromto=\"{a} {b} {c} {d} {e} {f}\" size=\"{radius}\" material=\"{material}\" mass=\"0\" \
         contype=\"0\" conaffinity=\"0\"/>"
    )
}

/// Shapes in the frame of every link (the joint's axis is z, the next joint at the link's tail): grey tubes, and joints
/// with blue caps, offset sideways as on the real arm.
fn links() -> impl Iterator<Item = &'static str> {
    let links = include_str!("../../assets/arm.xml").split("<!-- link ");
    links.skip(1).map(|link| link.split_once("-->").map_or("", |(_, shapes)| shapes.trim()))
}

/// Name of the body that meets the skin.
pub(crate) const BODY: &str = "body";

/// Length of the adapter between flange and object, m.
const ADAPTER_M: f64 = 0.04;

/// Distance from the flange to the object's origin along the flange's axis, m.
pub(crate) fn tool_length_m(mesh: &TriMesh) -> f64 {
    ADAPTER_M + mesh.vertices.iter().map(|v| v[2]).fold(0.0, f64::max)
}

/// Compiles the model; with `visuals`, everything a picture needs is in it too.
pub(crate) fn compile(scene: &Mechanics, visuals: Option<&Visuals>) -> Result<MjModel, Refusal> {
    crate::engine::open()?;
    MjModel::from_xml_string(&mjcf(scene, visuals)).map_err(|error| rejected(&error.to_string()))
}

/// The error of a model that MuJoCo does not take.
pub(super) fn rejected(why: &str) -> Refusal {
    Refusal::new(format!("MuJoCo rejects the model: {why}"))
}

pub(super) fn mjcf(scene: &Mechanics, visuals: Option<&Visuals>) -> String {
    let part = |pick: fn(&Visuals) -> &str| visuals.map_or("", pick);
    let body = match scene.task() {
        Task::Press(press) => {
            let tool = object(scene.mesh(), press.mass_kg, part(|v| &v.body));
            arm(&tool, visuals.is_some())
        }
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
fn arm(tool: &str, visual: bool) -> String {
    let mut xml = String::new();
    let mut frame = nalgebra::Isometry3::translation(arm::BASE_M[0], arm::BASE_M[1], arm::BASE_M[2]);
    for ((i, link), shapes) in arm::LINKS.iter().enumerate().zip(links()) {
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
            arm::JOINT_DAMPING,
            if visual { shapes } else { "" },
        );
        frame = tail;
    }
    let [x, y, z] = frame.translation.vector.into();
    let _ =
        write!(xml, "<body name=\"flange\" pos=\"{x} {y} {z}\" quat=\"{}\">{tool}</body>", quaternion(&frame.rotation));
    xml.push_str(&"</body>".repeat(arm::LINKS.len()));
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
    for (i, link) in arm::LINKS.iter().enumerate() {
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
