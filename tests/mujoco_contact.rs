//! The contact fields against MuJoCo's own collisions and solver.
//!
//! Here MuJoCo finds the contacts and balances the forces; the contact fields do both themselves. The body is a
//! triangle mesh, as a rigid flex, so that holes and concave parts count; a mesh geom would be replaced by its convex
//! hull. The skin consists of bodies with a small sphere (a tip) at the centre of every grid square. Tips touch the
//! mesh without friction, and do not touch each other. The answer is static: every call starts with the skin pressed
//! flat below the body and lets it rise, so that no tip gets caught above an underside.
//!
//! Length is counted in cells, and force in K · cell³, so that a column of the skin has the stiffness 1: the engine has
//! absolute limits (smallest mass, volume, reference times), which a fine skin in metres would reach.

use mujoco_rs::prelude::{MjData, MjModel};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion};
use spts_contact::mesh::{TriMesh, cuboid, extrude, polygon, sphere};
use spts_contact::{ContactField as _, ElasticConfig, ElasticField, Foam, PosedMesh, TaxelBins, WinklerLayer};
use spts_models::SkinLayout;
use std::fmt::Write as _;

/// Stiffness of every skin here, Pa/m.
const K: f64 = 1.5e7;

/// Radius of a tip, cells. A tip on a slope of angle θ touches beside its top, which adds r (1/cos θ − 1) to its depth,
/// and one within r of an edge touches it: small is exact, but must not slip through a triangle in one step.
const TIP: f64 = 0.05;
/// Half the thickness that collisions give to the mesh's triangles, cells.
const SHELL: f64 = 0.01;
/// Free distance between the flattened skin and the body's lowest vertex, cells.
const GAP: f64 = 0.01;
/// Mass of a column that is critically damped when its stiffness and its damping are 1.
const COLUMN_MASS: f64 = 0.25;
/// Contacts are critically damped with a time constant of this many steps, the least that MuJoCo advises
/// (documentation of `solref`); with the impedance 0.9999 a tip sinks less than 1e-4 of its compression into the mesh.
const CONTACT_STEPS: f64 = 2.0;
/// A tip moves at most this share of its own and the shell's radius in one step; its highest speed, that of a
/// critically damped column of time constant 1/2 that starts at depth 1, is 2/e.
const STRIDE: f64 = 0.5;
const HIGHEST_SPEED: f64 = 0.74;
/// Units of time after which a skin must have settled: finite elements, which swing sideways, take up to 162, springs
/// 16.
const LONGEST: u32 = 300;
/// Settled: the fastest coordinate would move by less than this share of the depth in a unit of time.
const SETTLED: f64 = 1e-5;

/// What a model is made of besides the mesh.
#[derive(Default)]
struct Skin {
    /// Rows and columns of cells, each with a tip at its centre, and their side, m.
    shape: [usize; 2],
    cell_m: f64,
    /// Bodies in the world and entries of the deformable section, MJCF.
    bodies: String,
    deformable: String,
    coordinates: usize,
    /// Degree of freedom whose contact force is that of the cell, one for each cell.
    cell_dofs: Vec<usize>,
    /// Vertical coordinates of the flattened skin, and how far each sinks when the surface sinks by 1.
    flat: Vec<(usize, f64)>,
}

fn on(layout: &SkinLayout, cells: usize) -> Skin {
    Skin {
        shape: [layout.rows() * cells, layout.cols() * cells],
        cell_m: layout.pitch_m() / cells as f64,
        ..Skin::default()
    }
}

/// Centre of a cell, (x, y), cells.
fn centre([rows, cols]: [usize; 2], row: usize, col: usize) -> [f64; 2] {
    [col as f64 + 0.5 - 0.5 * cols as f64, 0.5 * rows as f64 - row as f64 - 0.5]
}

/// A sphere with its top `SHELL` below the origin of its body, so that it touches a mesh that is exactly there.
fn tip() -> String {
    let z = -TIP - SHELL;
    format!(
        "<geom type=\"sphere\" size=\"{TIP}\" pos=\"0 0 {z}\" contype=\"1\" conaffinity=\"0\" mass=\"0\" condim=\"1\"/>"
    )
}

/// One critically damped slide joint of stiffness 1 a cell: the Winkler layer.
fn springs(layout: &SkinLayout, cells: usize) -> Skin {
    let mut skin = on(layout, cells);
    let count = skin.shape[0] * skin.shape[1];
    skin.coordinates = count;
    skin.cell_dofs = (0..count).collect();
    skin.flat = (0..count).map(|i| (i, 1.0)).collect();
    for i in 0..count {
        let [x, y] = centre(skin.shape, i / skin.shape[1], i % skin.shape[1]);
        let _ = writeln!(
            skin.bodies,
            "<body pos=\"{x} {y} 0\"><inertial pos=\"0 0 0\" mass=\"{COLUMN_MASS}\" diaginertia=\"1 1 1\"/>\
             <joint type=\"slide\" axis=\"0 0 1\" stiffness=\"1\" damping=\"1\"/>{}</body>",
            tip()
        );
    }
    skin
}

/// Elastic layer bonded to a rigid base as a deformable body: linear tetrahedra, six for each brick, `elements` bricks
/// through the thickness. The upper nodes are the centres of the cells, with a ring more outside, so that the cells at
/// the rim are as stiff as the others. E = K h (1 + ν)(1 − 2ν)/(1 − ν), so that the response to a small uniform
/// compression δ is K δ (K. L. Johnson, *Contact Mechanics* (1985), §5.8). The St. Venant–Kirchhoff material becomes
/// softer with compression, p = K δ (1 − ε)(1 − ε/2) at the strain ε = δ/h.
fn flex(layout: &SkinLayout, cells: usize, thickness_m: f64, poisson: f64, elements: usize) -> Skin {
    let mut skin = on(layout, cells);
    let [rows, cols] = skin.shape.map(|n| n + 2);
    let thickness = thickness_m / skin.cell_m;
    let node = |level: usize, row: usize, col: usize| (level * rows + row) * cols + col;
    let mut names = String::new();
    for level in 0..=elements {
        for (row, col) in (0..rows * cols).map(|k| (k / cols, k % cols)) {
            let share = level as f64 / elements as f64;
            let [x, y] = centre([rows, cols], row, col);
            let (z, name) = (thickness * (share - 1.0), node(level, row, col));
            let _ = write!(names, "n{name} ");
            let _ = write!(skin.bodies, "<body name=\"n{name}\" pos=\"{x} {y} {z}\">");
            // fixed at the bottom, on three slide joints above it
            if level > 0 {
                let _ = write!(
                    skin.bodies,
                    "<inertial pos=\"0 0 0\" mass=\"{COLUMN_MASS}\" diaginertia=\"1 1 1\"/>\
                     <joint type=\"slide\" axis=\"1 0 0\"/><joint type=\"slide\" axis=\"0 1 0\"/>\
                     <joint type=\"slide\" axis=\"0 0 1\"/>"
                );
                let up = skin.coordinates + 2;
                skin.flat.push((up, share));
                skin.coordinates += 3;
                let inside = (1..rows - 1).contains(&row) && (1..cols - 1).contains(&col);
                if level == elements && inside {
                    skin.cell_dofs.push(up);
                    skin.bodies.push_str(&tip());
                }
            }
            skin.bodies.push_str("</body>\n");
        }
    }
    // every brick in six tetrahedra around its diagonal: the ways from the corner (0, 0, 0) to (1, 1, 1) along the
    // axes; odd ones are turned to have positive volume
    let ways = [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]];
    let mut tetrahedra = String::new();
    for level in 0..elements {
        for (row, col) in (0..(rows - 1) * (cols - 1)).map(|k| (k / (cols - 1), k % (cols - 1))) {
            for (number, way) in ways.into_iter().enumerate() {
                let mut corner = [0; 3];
                let mut nodes = [node(level, row + 1, col); 4];
                for (axis, at) in way.into_iter().zip(&mut nodes[1..]) {
                    corner[axis] = 1;
                    // y falls with the row
                    *at = node(level + corner[2], row + 1 - corner[1], col + corner[0]);
                }
                if number >= 3 {
                    nodes.swap(2, 3);
                }
                let [a, b, c, d] = nodes;
                let _ = write!(tetrahedra, "{a} {b} {c} {d} ");
            }
        }
    }
    // MuJoCo's energy density is μ tr(ε²) + λ (tr ε)² with Lamé's constants of its E and ν, where Hooke's law has λ/2:
    // its λ has to be half of the layer's
    let modulus = thickness * (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson);
    let shear = 0.5 * modulus / (1.0 + poisson);
    let lame = 0.5 * modulus * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let ratio = 0.5 * lame / (lame + shear);
    let young = 2.0 * shear * (1.0 + ratio);
    let _ = writeln!(
        skin.deformable,
        "<flex name=\"foam\" dim=\"3\" radius=\"0.001\" body=\"{names}\" element=\"{tetrahedra}\">\
         <contact contype=\"0\" conaffinity=\"0\" selfcollide=\"none\"/>\
         <elasticity young=\"{young}\" poisson=\"{ratio}\" damping=\"1\"/></flex>"
    );
    skin
}

impl Skin {
    /// Pressure on every cell under `body`, Pa, where the skin has come to rest.
    fn press(&self, body: &PosedMesh<'_>) -> Vec<f64> {
        let lowest_m = body.heights_m()[0] + body.position_m[2];
        let depth = -lowest_m / self.cell_m;
        assert!(depth > 0.0, "the body is above the skin");
        spts_sim::engine::open().expect("MuJoCo is there");
        let model = MjModel::from_xml_string(&self.mjcf(body.mesh)).expect("MuJoCo takes the skin");
        let mut data = MjData::new(Box::new(model));
        assert_eq!(data.qpos().len(), self.coordinates);
        let steps = (HIGHEST_SPEED * depth / (STRIDE * (TIP + SHELL))).clamp(8.0, 200.0).ceil();
        data.reset();
        let options = data.model_opt_mut();
        options.timestep = 1.0 / steps;
        options.o_solref = [CONTACT_STEPS / steps, 1.0];
        let rotation = Matrix3::from_fn(|i, j| body.rotation[i][j]);
        let q = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        data.mocap_pos_mut()[0] = body.position_m.map(|x| x / self.cell_m);
        data.mocap_quat_mut()[0] = [q.w, q.i, q.j, q.k];
        for &(coordinate, share) in &self.flat {
            data.qpos_mut()[coordinate] = -(depth + GAP) * share;
        }
        for _ in 0..LONGEST {
            let mut time = 0.0;
            while time < 1.0 {
                data.step();
                time += 1.0 / steps;
            }
            assert!(data.warning().iter().all(|w| w.number == 0), "the skin is not stable");
            let fastest = data.qvel().iter().fold(0.0_f64, |most, v| most.max(v.abs())) / depth;
            if fastest <= SETTLED {
                let unit_pa = K * self.cell_m;
                let forces = data.qfrc_constraint();
                return self.cell_dofs.iter().map(|&dof| (-forces[dof] * unit_pa).max(0.0)).collect();
            }
        }
        panic!("the skin has not come to rest");
    }

    fn mjcf(&self, mesh: &TriMesh) -> String {
        let mut vertices = String::new();
        for [x, y, z] in mesh.vertices.iter().map(|v| v.map(|x| x / self.cell_m)) {
            let _ = write!(vertices, "{x} {y} {z} ");
        }
        let elements: String = mesh.triangles.iter().flatten().map(|i| format!("{i} ")).collect();
        // an overfull arena would end the process; untouched memory costs nothing
        let megabytes = 256 + self.coordinates / 8;
        format!(
            "<mujoco model=\"skin\">\n<option gravity=\"0 0 0\" integrator=\"discrete\" o_solimp=\"0.9999 0.9999 1e-6\">\
             <flag autoreset=\"disable\" override=\"enable\"/></option>\n<size memory=\"{megabytes}M\"/>\n<worldbody>\n\
             <body name=\"indenter\" mocap=\"true\"/>\n{}</worldbody>\n<deformable>\n\
             <flex name=\"indenter\" dim=\"2\" radius=\"{SHELL}\" body=\"indenter\" vertex=\"{vertices}\" element=\"{elements}\">\
             <contact contype=\"0\" conaffinity=\"1\" selfcollide=\"none\" condim=\"1\"/></flex>\n{}</deformable>\n</mujoco>\n",
            self.bodies, self.deformable
        )
    }

    /// Normal force, N, and moments about the middle of the skin, N m.
    fn wrench(&self, pressure_pa: &[f64]) -> [f64; 3] {
        let mut sums = [0.0; 3];
        for (i, p) in pressure_pa.iter().enumerate() {
            let [x, y] = centre(self.shape, i / self.shape[1], i % self.shape[1]).map(|x| x * self.cell_m);
            let force_n = p * self.cell_m * self.cell_m;
            sums = [sums[0] + force_n, sums[1] + y * force_n, sums[2] - x * force_n];
        }
        sums
    }
}

fn relative_rms(a: &[f64], b: &[f64]) -> f64 {
    let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (apart / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// `mesh`, standing on z = 0 in its own axes, tilted by `angle_rad` about x and with its origin `depth_m` below the
/// skin; torques are about the middle of the skin.
fn posed(mesh: &TriMesh, [x, y]: [f64; 2], depth_m: f64, angle_rad: f64) -> PosedMesh<'_> {
    let (s, c) = angle_rad.sin_cos();
    PosedMesh {
        rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
        centre_of_mass_m: [0.0; 3],
        ..PosedMesh::at_rest(mesh, [x, y, -depth_m])
    }
}

/// Linear springs: densification vanishes in a layer 10 m thick.
fn winkler(cells_per_taxel: usize, skin: &SkinLayout) -> WinklerLayer {
    let foam = Foam { stiffness_pa_per_m: K, thickness_m: 10.0, cells_per_taxel, ..Foam::default() };
    WinklerLayer::new(foam, skin).expect("valid")
}

/// Mean pressure over each taxel, Pa.
fn taxel_means(skin: &SkinLayout, cells: usize, fine_pa: &[f64]) -> Vec<f64> {
    let [means, _] = TaxelBins::new(skin, cells).means(fine_pa, None);
    means.values().to_vec()
}

/// 6 × 6 taxels of 15 mm: a block of finite elements that a test can afford.
fn small_skin() -> SkinLayout {
    SkinLayout::new(6, 6, 15e-3, 6e-3).expect("valid")
}

/// Springs under MuJoCo's collisions against `winkler`, on the same cells, at about 20 N.
///
/// Where they differ: a tip of radius r (with the shell, 0.06 of a cell, 0.45 mm) on a slope θ sinks r (1/cos θ − 1)
/// too deep, on the sphere at most r δ/R at its rim: 0.05 mm of 3.5 mm, weighed by the rim's small pressure below 1 %;
/// and a tip whose centre lies beside an edge by less than r is pressed too, wholly, where `winkler` counts the share
/// of the cell: edges are on the borders of cells here. The bound is 3 %. The ring is concave: its convex hull has a
/// third more area.
#[test]
fn springs_are_a_winkler_layer() {
    let ball = sphere(0.0334, 96, 128);
    // covers the half x > 0 of the skin, and the edge leans by 1°
    let edge = cuboid([0.16, 0.16, 0.02]);
    let ring = extrude(&polygon::rectangle(0.06, 0.06), &[polygon::rectangle(0.03, 0.03)], 0.01);
    let cases = [
        ("sphere", posed(&ball, [0.003, -0.002], 3.5e-3, 0.0)),
        ("edge", posed(&edge, [0.08, 0.0], 2e-4, 0.0)),
        ("leaning edge", posed(&edge, [0.08, 0.0], -4e-4, 0.02)),
        ("ring", posed(&ring, [0.0, 0.0], 6e-4, 0.005)),
    ];
    let skin = SkinLayout::default();
    let (bed, mut layer) = (springs(&skin, 2), winkler(2, &skin));
    for (name, body) in cases {
        let found_pa = bed.press(&body);
        let expected = layer.respond(&body);
        let expected_n = expected.wrench.force_n[2];
        assert!((10.0..40.0).contains(&expected_n), "{name}: {expected_n} N");
        let [found, wanted] = [&found_pa, expected.pressure_pa].map(|p| taxel_means(&skin, 2, p));
        let error = relative_rms(&found, &wanted);
        let [force_n, moments_nm @ ..] = bed.wrench(&found_pa);
        assert!(error <= 0.03, "{name}: relative RMS {error:.4}, {force_n} N for {expected_n} N");
        for (moment_nm, expected_nm) in moments_nm.into_iter().zip(expected.wrench.torque_nm) {
            // the lever of 3 % of the force at the contact's edge
            let apart_nm = moment_nm - expected_nm;
            assert!(apart_nm.abs() <= 0.03 * expected_n * 0.075, "{name}: torque off by {apart_nm} N m");
        }
    }
}

/// A plate over the whole skin compresses the foam uniformly: St. Venant–Kirchhoff's p = K δ (1 − ε)(1 − ε/2), for
/// every ν. The free ring outside disturbs the rim; in the middle, 30 mm or ten thicknesses further in, nothing is
/// left.
#[test]
fn finite_elements_under_a_uniform_load() {
    let (plate, thickness_m) = (cuboid([0.09, 0.09, 0.02]), 3e-3);
    for (poisson, strain) in [(0.0, 0.02), (0.2, 0.02), (0.2, 0.1), (0.4, 0.02)] {
        let depth_m = strain * thickness_m;
        let layer = flex(&small_skin(), 1, thickness_m, poisson, 1);
        let found_pa = layer.press(&posed(&plate, [0.0, 0.0], depth_m, 0.0))[14];
        let expected_pa = K * depth_m * (1.0 - strain) * (1.0 - 0.5 * strain);
        // what has not settled (1e-5), the tips' sinking (1e-4) and what is left of the rim
        assert!((found_pa / expected_pa - 1.0).abs() < 1e-3, "ν {poisson}, ε {strain}: {found_pa} of {expected_pa} Pa");
    }
}

/// Relative RMS over taxels between finite elements with `cells` nodes a taxel side, or springs without them, and the
/// elastic layer of 6 × 6 cells a taxel, under a block of 4 × 4 whole taxels at 1 % strain: K, h = 6 mm, ν = 0.2.
fn apart_from_layer(cells: Option<usize>) -> f64 {
    let (skin, thickness_m) = (small_skin(), 6e-3);
    let block = cuboid([0.06, 0.06, 0.02]);
    let body = posed(&block, [0.0, 0.0], 0.01 * thickness_m, 0.0);
    let elastic = ElasticConfig {
        stiffness_pa_per_m: K,
        thickness_m,
        poisson: 0.2,
        densification: Some(false),
        ..ElasticConfig::default()
    };
    let mut layer = ElasticField::new(elastic, true, &skin).expect("valid");
    let cells_of_layer = layer.cells_per_taxel();
    let expected = taxel_means(&skin, cells_of_layer, layer.respond(&body).pressure_pa);
    let found = match cells {
        Some(cells) => taxel_means(&skin, cells, &flex(&skin, cells, thickness_m, 0.2, 2).press(&body)),
        None => taxel_means(&skin, 1, winkler(1, &skin).respond(&body).pressure_pa),
    };
    relative_rms(&found, &expected)
}

/// At 1 % strain the finite elements miss 1.5 % by their material (1.5 ε) and, with one node a taxel, a part of what
/// the layer's rim carries above the middle. Springs know nothing of the rim: the finite elements have to be nearer.
#[test]
fn finite_elements_are_near_the_layer() {
    let (columns, elements) = (apart_from_layer(None), apart_from_layer(Some(1)));
    assert!(elements < columns, "finite elements {elements:.4}, springs {columns:.4}");
}

/// Half the cell: the rim's part of the error, about 3.6 of 5.1 %, falls by half in first order, the material's 1.5 %
/// stays: a third less in all, of which a fifth is asked for.
#[test]
#[ignore = "864 degrees of freedom: half a minute"]
fn finite_elements_come_nearer_with_more_nodes() {
    let [coarse, fine] = [1, 2].map(|cells| apart_from_layer(Some(cells)));
    assert!(fine <= 0.8 * coarse, "{coarse:.4} → {fine:.4}");
}
