//! The foam as a block of finite elements, solved by MuJoCo.

use super::engine::{COLUMN_MASS, Skin, tip};
use super::tips::Tips;
use serde::{Deserialize, Serialize};
use spts_contact::limits::{self, Most, parameter};
use spts_contact::{ContactField, PosedMesh, Response};
use spts_models::{ConfigError, SkinLayout};
use std::fmt::Write as _;

/// Parameters of [`FlexLayer`]. A missing one takes its value in [`FlexConfig::default`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct FlexConfig {
    /// K, stiffness of the skin under a uniform load, Pa/m; [1e4, 1e9]. It determines Young's modulus; see
    /// [`FlexLayer`].
    pub stiffness_pa_per_m: f64,
    /// h, thickness of the foam, m; [1e-4, 10], and between a tenth of a cell and ten cells.
    pub thickness_m: f64,
    /// ν, Poisson's ratio; [0, 0.4].
    pub poisson: f64,
    /// Nodes along one side of a taxel; [1, 4].
    pub cells_per_taxel: usize,
    /// Elements through the thickness; [1, 4].
    pub elements: usize,
}

impl Default for FlexConfig {
    /// Stiffness and thickness of [`WinklerConfig`](spts_contact::WinklerConfig), ν of a foam; a node a taxel, two
    /// elements through the thickness.
    fn default() -> Self {
        Self {
            stiffness_pa_per_m: 1.5e7,
            thickness_m: 6e-3,
            poisson: 0.2,
            cells_per_taxel: 1,
            elements: 2,
        }
    }
}

/// Elastic layer bonded to a rigid base, as a deformable body in MuJoCo: linear tetrahedra, six for each brick. The
/// upper nodes are the centres of the cells. The pressure of a cell is the contact force of its node divided by the
/// cell's area.
///
/// E = K h (1 + ν)(1 − 2ν)/(1 − ν), so that the response to a small uniform compression δ is K δ (bonded layer, K. L.
/// Johnson, *Contact Mechanics* (1985), §5.8).
///
/// Validity: the St. Venant–Kirchhoff material becomes softer with compression, p = K δ (1 − ε)(1 − ε/2) at the strain
/// ε = δ/h: 15 % at ε = 0.1, and it collapses above ε = 0.42. A node represents its whole cell, so the edge of a body
/// is known to half a cell, and the pressure peak there is averaged over one. The body is treated as rigid. Compared
/// with [`ElasticField`](spts_contact::ElasticField) at the same K, h = 6 mm and ν = 0.2, a block of 4 × 4 taxels of 15
/// mm differs by 5 % (relative RMS over taxels) at 1 % strain and by 11 % at 5 %; with two nodes along a taxel's side,
/// by 3.6 % at 1 %.
#[derive(Debug)]
pub struct FlexLayer {
    config: FlexConfig,
    tips: Tips,
}

/// Most cells: an answer takes seconds with 100 of them already.
const MAX_CELLS: Most = (400.0, "[1, 400]");

impl FlexLayer {
    /// A layer under `skin`.
    ///
    /// # Errors
    /// [`ConfigError`] if a parameter is outside its range.
    pub fn new(config: FlexConfig, skin: &SkinLayout) -> Result<Self, ConfigError> {
        limits::foam(config.stiffness_pa_per_m, config.thickness_m)?;
        parameter("poisson", config.poisson, [0.0, 0.4], "[0, 0.4]")?;
        parameter("elements", config.elements as f64, [1.0, 4.0], "[1, 4]")?;
        limits::cells(skin, config.cells_per_taxel, (4.0, "[1, 4]"), MAX_CELLS)?;
        let cell_m = skin.pitch_m() / config.cells_per_taxel as f64;
        let thickness = config.thickness_m / cell_m;
        parameter("thickness_m / cell side", thickness, [0.1, 10.0], "[0.1, 10]")?;
        let shape = [skin.rows(), skin.cols()].map(|n| n * config.cells_per_taxel);
        let skin = Grid {
            shape,
            thickness,
            elements: config.elements,
        }
        .skin(config.poisson);
        Ok(Self {
            config,
            tips: Tips::new(shape[0], shape[1], cell_m, skin),
        })
    }
}

/// Nodes of the block, in cells: one under each cell's centre, and a ring more outside, so that the cells at the rim
/// are as stiff as the others.
#[derive(Debug, Clone, Copy)]
struct Grid {
    shape: [usize; 2],
    thickness: f64,
    elements: usize,
}

impl Grid {
    fn rows(self) -> usize {
        self.shape[0] + 2
    }

    fn cols(self) -> usize {
        self.shape[1] + 2
    }

    fn node(self, level: usize, row: usize, col: usize) -> usize {
        (level * self.rows() + row) * self.cols() + col
    }

    fn skin(self, poisson: f64) -> Skin {
        let mut skin = Skin::default();
        let mut names = String::new();
        for level in 0..=self.elements {
            for row in 0..self.rows() {
                for col in 0..self.cols() {
                    self.add_node(&mut skin, level, row, col);
                    let _ = write!(names, "n{} ", self.node(level, row, col));
                }
            }
        }
        let [young, poisson] = engine_moduli(self.thickness, poisson);
        let _ = writeln!(
            skin.deformable,
            "<flex name=\"foam\" dim=\"3\" radius=\"0.001\" body=\"{names}\" element=\"{}\">\
             <contact contype=\"0\" conaffinity=\"0\" selfcollide=\"none\"/>\
             <elasticity young=\"{young}\" poisson=\"{poisson}\" damping=\"1\"/></flex>",
            self.tetrahedra()
        );
        skin
    }

    /// A node is a body: fixed at the bottom, on three slide joints above it, with a tip under a cell's centre.
    fn add_node(self, skin: &mut Skin, level: usize, row: usize, col: usize) {
        let share = level as f64 / self.elements as f64;
        let [x, y] = Tips::centre([self.rows(), self.cols()], row, col);
        let (z, name) = (self.thickness * (share - 1.0), self.node(level, row, col));
        let _ = write!(skin.bodies, "<body name=\"n{name}\" pos=\"{x} {y} {z}\">");
        if level > 0 {
            let _ = write!(
                skin.bodies,
                "<inertial pos=\"0 0 0\" mass=\"{COLUMN_MASS}\" diaginertia=\"1 1 1\"/><joint type=\"slide\" axis=\"1 0 0\"/>\
                 <joint type=\"slide\" axis=\"0 1 0\"/><joint type=\"slide\" axis=\"0 0 1\"/>"
            );
            let up = skin.coordinates + 2;
            skin.flat.push((up, share));
            skin.coordinates += 3;
            let inside = (1..=self.shape[0]).contains(&row) && (1..=self.shape[1]).contains(&col);
            if level == self.elements && inside {
                skin.cell_dofs.push(up);
                skin.bodies.push_str(&tip());
            }
        }
        skin.bodies.push_str("</body>\n");
    }

    /// Every brick in six tetrahedra around its diagonal, all the same way, so that every node inside has the same
    /// share of the surface.
    fn tetrahedra(self) -> String {
        // the ways from the corner (0, 0, 0) to (1, 1, 1) along the axes; odd ones are turned to have positive volume
        const WAYS: [([usize; 3], bool); 6] = [
            ([0, 1, 2], false),
            ([1, 2, 0], false),
            ([2, 0, 1], false),
            ([0, 2, 1], true),
            ([2, 1, 0], true),
            ([1, 0, 2], true),
        ];
        let mut elements = String::new();
        for level in 0..self.elements {
            for row in 0..self.rows() - 1 {
                for col in 0..self.cols() - 1 {
                    for (way, odd) in WAYS {
                        let mut corner = [0; 3];
                        let mut nodes = [self.node(level, row + 1, col); 4];
                        for (axis, node) in way.into_iter().zip(&mut nodes[1..]) {
                            corner[axis] = 1;
                            // y falls with the row
                            *node = self.node(level + corner[2], row + 1 - corner[1], col + corner[0]);
                        }
                        if odd {
                            nodes.swap(2, 3);
                        }
                        let [a, b, c, d] = nodes;
                        let _ = write!(elements, "{a} {b} {c} {d} ");
                    }
                }
            }
        }
        elements
    }
}

/// Young's modulus and Poisson's ratio to give to the engine for a layer of `thickness` cells and unit stiffness under
/// a uniform load.
///
/// MuJoCo's energy density is μ tr(ε²) + λ (tr ε)² with Lamé's constants of its E and ν, where Hooke's law has λ/2: its
/// λ has to be half of the layer's.
fn engine_moduli(thickness: f64, poisson: f64) -> [f64; 2] {
    let young = thickness * (1.0 + poisson) * (1.0 - 2.0 * poisson) / (1.0 - poisson);
    let shear = 0.5 * young / (1.0 + poisson);
    let lame = 0.5 * young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    let ratio = 0.5 * lame / (lame + shear);
    [2.0 * shear * (1.0 + ratio), ratio]
}

impl ContactField for FlexLayer {
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        self.tips.respond(body, self.config.stiffness_pa_per_m)
    }

    fn failure(&self) -> Option<String> {
        self.tips.failure()
    }

    fn cells_per_taxel(&self) -> usize {
        self.config.cells_per_taxel
    }

    fn parameters(&self) -> toml::Table {
        // a struct of plain numbers always serialises to a table
        toml::Table::try_from(self.config).unwrap_or_default()
    }

    fn thickness_m(&self) -> f64 {
        self.config.thickness_m
    }
}
