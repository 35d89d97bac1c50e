//! MuJoCo model of a skin under a mesh, in units of order one for any skin.
//!
//! Length is counted in cells, and force in K · cell³, so that a column of the skin has the stiffness 1. The engine has
//! absolute limits (smallest mass, volume, reference times), which a fine skin in metres would reach.

use mujoco_rs::prelude::{MjData, MjModel};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use spts_contact::PosedMesh;
use spts_contact::mesh::TriMesh;
use std::fmt::Write as _;

/// Radius of a tip, cells. A tip on a slope of angle θ touches beside its top, which adds r (1/cos θ − 1) to its depth,
/// and one within r of an edge touches it: small is exact, but must not slip through a triangle in one step.
pub(super) const TIP: f64 = 0.05;

/// Half the thickness that collisions give to the mesh's triangles, cells.
pub(super) const SHELL: f64 = 0.01;

/// Free distance between the flattened skin and the body's lowest vertex, cells.
const GAP: f64 = 0.01;

/// Mass of a column that is critically damped when its stiffness and its damping are 1.
pub(super) const COLUMN_MASS: f64 = 0.25;

/// Contacts are critically damped with a time constant of this many steps, the least that MuJoCo advises
/// (documentation of `solref`); with the impedance 0.9999 a tip sinks less than 1e-4 of its compression into the mesh.
const CONTACT_STEPS: f64 = 2.0;

/// Constant impedance of the contacts.
const IMPEDANCE: &str = "0.9999 0.9999 1e-6";

/// A tip moves at most this share of its own and the shell's radius in one step.
const STRIDE: f64 = 0.5;

/// Highest speed of a critically damped column of time constant 1/2 that starts at depth 1: 2/e.
const HIGHEST_SPEED: f64 = 0.74;

/// Least and most steps in a unit of time.
const STEPS: [f64; 2] = [8.0, 200.0];

/// Units of time after which a skin that has not settled is given up: finite elements, which swing sideways, take up to
/// 162 in the tests, springs 16.
const LONGEST: u32 = 300;

/// Settled: the fastest coordinate would move by less than this share of the depth in a unit of time.
const SETTLED: f64 = 1e-5;

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum EngineError {
    /// Pose or velocity of the body.
    #[error("the body's pose or velocity is not finite")]
    NotFinite,
    /// MuJoCo rejects the model.
    #[error("MuJoCo rejects the skin: {0}")]
    Rejected(String),
    /// MuJoCo builds another model than intended.
    #[error("MuJoCo counts {found} coordinates instead of {wanted}")]
    Coordinates {
        /// Number found.
        found: usize,
        /// Expected number.
        wanted: usize,
    },
    /// MuJoCo reports a warning.
    #[error("MuJoCo warning {0}: the skin is not stable")]
    Warning(usize),
    /// The skin has not come to rest.
    #[error("the skin moves by {fastest:.1e} of the depth in a unit of time after {LONGEST}: more than {SETTLED:e}")]
    NotSettled {
        /// Speed of the fastest coordinate divided by the depth.
        fastest: f64,
    },
}

/// A compiled model: the mesh above, the skin below.
pub(super) struct Engine {
    data: MjData<Box<MjModel>>,
}

/// What a model is made of besides the mesh; MJCF.
#[derive(Debug, Default)]
pub(super) struct Skin {
    /// Bodies in the world, MJCF.
    pub(super) bodies: String,
    /// Entries of the deformable section, MJCF.
    pub(super) deformable: String,
    /// Number of coordinates.
    pub(super) coordinates: usize,
    /// Degree of freedom whose contact force is that of the cell, one for each cell.
    pub(super) cell_dofs: Vec<usize>,
    /// Vertical coordinates of the flattened skin, and how far each sinks when the surface sinks by 1.
    pub(super) flat: Vec<(usize, f64)>,
}

/// A sphere with its top `SHELL` below the origin of its body, so that it touches a mesh that is exactly there.
pub(super) fn tip() -> String {
    format!(
        "<geom type=\"sphere\" size=\"{TIP}\" pos=\"0 0 {}\" contype=\"1\" conaffinity=\"0\" mass=\"0\" condim=\"1\"/>",
        -TIP - SHELL
    )
}

impl Engine {
    /// Compiles `skin` under `mesh`, whose coordinates are divided by `cell_m`; `None` for a mesh without a triangle.
    pub(super) fn compile(skin: &Skin, mesh: &TriMesh, cell_m: f64) -> Result<Option<Self>, EngineError> {
        let Some(indenter) = indenter(mesh, cell_m) else {
            return Ok(None);
        };
        // an overfull arena would end the process; untouched memory costs nothing
        let megabytes = 256 + skin.coordinates / 8;
        let xml = format!(
            "<mujoco model=\"skin\">\n<option gravity=\"0 0 0\" integrator=\"discrete\" o_solimp=\"{IMPEDANCE}\">\
             <flag autoreset=\"disable\" override=\"enable\"/></option>\n\
             <size memory=\"{megabytes}M\"/>\n<worldbody>\n<body name=\"indenter\" mocap=\"true\"/>\n{}</worldbody>\n\
             <deformable>\n{indenter}{}</deformable>\n</mujoco>\n",
            skin.bodies, skin.deformable
        );
        let model = MjModel::from_xml_string(&xml).map_err(|error| EngineError::Rejected(error.to_string()))?;
        let data = MjData::new(Box::new(model));
        let (found, wanted) = (data.qpos().len(), skin.coordinates);
        if found != wanted {
            return Err(EngineError::Coordinates { found, wanted });
        }
        Ok(Some(Self { data }))
    }

    /// Lets the skin rise against `body`, whose lowest vertex is `depth` cells below the free surface.
    pub(super) fn settle(
        &mut self,
        skin: &Skin,
        body: &PosedMesh<'_>,
        cell_m: f64,
        depth: f64,
    ) -> Result<(), EngineError> {
        let steps = (HIGHEST_SPEED * depth / (STRIDE * (TIP + SHELL)))
            .clamp(STEPS[0], STEPS[1])
            .ceil();
        let d = &mut self.data;
        d.reset();
        let options = d.model_opt_mut();
        options.timestep = 1.0 / steps;
        options.o_solref = [CONTACT_STEPS / steps, 1.0];
        d.mocap_pos_mut()[0] = body.position_m.map(|x| x / cell_m);
        d.mocap_quat_mut()[0] = quaternion(body.rotation);
        for &(coordinate, share) in &skin.flat {
            d.qpos_mut()[coordinate] = -(depth + GAP) * share;
        }
        let mut fastest = f64::INFINITY;
        for _ in 0..LONGEST {
            let mut time = 0.0;
            while time < 1.0 {
                d.step();
                if let Some(warning) = d.warning().iter().position(|w| w.number > 0) {
                    return Err(EngineError::Warning(warning));
                }
                time += 1.0 / steps;
            }
            fastest = d.qvel().iter().fold(0.0_f64, |most, v| most.max(v.abs())) / depth;
            if fastest <= SETTLED {
                return Ok(());
            }
        }
        Err(EngineError::NotSettled { fastest })
    }

    /// Force of the contacts along each degree of freedom.
    pub(super) fn contact_forces(&self) -> &[f64] {
        self.data.qfrc_constraint()
    }
}

/// The mesh as a flex of triangles whose vertices all belong to one body; `None` when nothing is left of it.
fn indenter(mesh: &TriMesh, cell_m: f64) -> Option<String> {
    let scaled = |i: u32| mesh.vertices[i as usize].map(|x| x / cell_m);
    let sound = |t: &&[u32; 3]| double_area(t.map(scaled)) > LEAST_AREA;
    let kept: Vec<_> = mesh.triangles.iter().filter(sound).collect();
    if kept.is_empty() {
        return None;
    }
    // vertices without a triangle are left out
    let mut number = vec![None; mesh.vertices.len()];
    let (mut vertices, mut elements, mut count) = (String::new(), String::new(), 0_usize);
    for &i in kept.into_iter().flatten() {
        let index = *number[i as usize].get_or_insert_with(|| {
            let [x, y, z] = scaled(i);
            let _ = write!(vertices, "{x} {y} {z} ");
            count += 1;
            count - 1
        });
        let _ = write!(elements, "{index} ");
    }
    Some(format!(
        "<flex name=\"indenter\" dim=\"2\" radius=\"{SHELL}\" body=\"indenter\" vertex=\"{vertices}\" element=\"{elements}\">\
         <contact contype=\"0\" conaffinity=\"1\" selfcollide=\"none\" condim=\"1\"/></flex>\n"
    ))
}

/// Triangles with a smaller double area, cells², have no normal to speak of and no cell's centre above them.
const LEAST_AREA: f64 = 1e-9;

fn double_area([a, b, c]: [[f64; 3]; 3]) -> f64 {
    let (u, v) = ([0, 1, 2].map(|i| b[i] - a[i]), [0, 1, 2].map(|i| c[i] - a[i]));
    let cross = [
        u[1] * v[2] - u[2] * v[1],
        u[2] * v[0] - u[0] * v[2],
        u[0] * v[1] - u[1] * v[0],
    ];
    cross.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Unit quaternion (w, x, y, z) of a rotation matrix.
fn quaternion(rotation: [[f64; 3]; 3]) -> [f64; 4] {
    let [a, b, c] = rotation;
    let matrix = Matrix3::new(a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2]);
    let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(matrix));
    [q.w, q.i, q.j, q.k]
}
