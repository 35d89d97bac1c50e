//! One slide joint with a spring for each cell: the Winkler layer, made of MuJoCo bodies.

use super::engine::{COLUMN_MASS, Skin, tip};
use super::tips::Tips;
use serde::{Deserialize, Serialize};
use spts_contact::limits::{self, Most};
use spts_contact::{ContactField, PosedMesh, Response};
use spts_models::{ConfigError, SkinLayout};
use std::fmt::Write as _;

/// Parameters of [`TaxelBed`]. A missing one takes its value in [`TaxelBedConfig::default`].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct TaxelBedConfig {
    /// K, stiffness of the skin, Pa/m; [1e4, 1e9].
    pub stiffness_pa_per_m: f64,
    /// h, thickness of the foam, m; [1e-4, 10]. It has no effect, because the springs are linear.
    pub thickness_m: f64,
    /// Squares of the grid on which contact is computed, along one side of a taxel; [1, 16].
    pub cells_per_taxel: usize,
}

impl Default for TaxelBedConfig {
    /// Stiffness and thickness of [`WinklerConfig`](spts_contact::WinklerConfig); two cells a taxel side, 20 × 20
    /// joints on the 10 × 10 skin.
    fn default() -> Self {
        Self {
            stiffness_pa_per_m: 1.5e7,
            thickness_m: 6e-3,
            cells_per_taxel: 2,
        }
    }
}

/// Independent linear springs p = K δ, solved by MuJoCo: a check of [`WinklerLayer`](spts_contact::WinklerLayer) on a
/// thick layer.
///
/// A compliant body is in series with each spring: 1/K becomes 1/K + 1/K_body.
#[derive(Debug)]
pub struct TaxelBed {
    config: TaxelBedConfig,
    tips: Tips,
}

/// Most joints a bed may have.
const MAX_CELLS: Most = (4096.0, "[1, 4096]");

impl TaxelBed {
    /// A bed under `skin`.
    ///
    /// # Errors
    /// [`ConfigError`] if a parameter is outside its range.
    pub fn new(config: TaxelBedConfig, skin: &SkinLayout) -> Result<Self, ConfigError> {
        limits::foam(config.stiffness_pa_per_m, config.thickness_m)?;
        limits::cells(skin, config.cells_per_taxel, (16.0, "[1, 16]"), MAX_CELLS)?;
        let shape = [skin.rows(), skin.cols()].map(|n| n * config.cells_per_taxel);
        let cell_m = skin.pitch_m() / config.cells_per_taxel as f64;
        Ok(Self {
            config,
            tips: Tips::new(shape[0], shape[1], cell_m, springs(shape)),
        })
    }
}

/// One critically damped slide joint of stiffness 1 a cell.
fn springs(shape: [usize; 2]) -> Skin {
    let cells = shape[0] * shape[1];
    let mut skin = Skin {
        coordinates: cells,
        cell_dofs: (0..cells).collect(),
        flat: (0..cells).map(|i| (i, 1.0)).collect(),
        ..Skin::default()
    };
    for i in 0..cells {
        let [x, y] = Tips::centre(shape, i / shape[1], i % shape[1]);
        let _ = writeln!(
            skin.bodies,
            "<body pos=\"{x} {y} 0\"><inertial pos=\"0 0 0\" mass=\"{COLUMN_MASS}\" diaginertia=\"1 1 1\"/>\
             <joint type=\"slide\" axis=\"0 0 1\" stiffness=\"1\" damping=\"1\"/>{}</body>",
            tip()
        );
    }
    skin
}

impl ContactField for TaxelBed {
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        let series = 1.0 / (1.0 / self.config.stiffness_pa_per_m + 1.0 / body.stiffness_pa_per_m);
        self.tips.respond(body, series)
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
