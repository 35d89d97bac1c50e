//! Parameters of the elastic contact fields.

use crate::columns::{WinklerConfig, WinklerLayer};
use crate::limits::{self, Most, parameter};
use serde::{Deserialize, Serialize};
use spts_models::{ConfigError, SkinLayout};

/// Parameters of [`ElasticField`]: those of [`WinklerConfig`], so that a scene can change only the model's name, and
/// some more. A missing one takes its value in [`ElasticConfig::default`].
///
/// [`ElasticField`]: super::ElasticField
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct ElasticConfig {
    /// K, stiffness of the skin under uniform pressure, Pa/m; [1e4, 1e9]. It determines Young's modulus: E = K h (1 +
    /// ν)(1 − 2ν)/(1 − ν), also for the half-space.
    pub stiffness_pa_per_m: f64,
    /// τ, damping time of the Kelvin–Voigt material, s; [0, 0.02].
    pub damping_s: f64,
    /// h, thickness of the foam, m; [1e-4, 10].
    pub thickness_m: f64,
    /// ε_max, strain at which no pores are left (1 − relative density); [0.3, 1]. Not used if `densification` is off.
    pub max_strain: f64,
    /// Squares of the grid on which contact is computed, along one side of a taxel; [1, 64].
    pub cells_per_taxel: usize,
    /// μ, friction coefficient; [0, 5].
    pub friction: f64,
    /// v_reg, sliding speed below which friction is regularised, m/s; [1e-6, 1].
    pub friction_speed_m_per_s: f64,
    /// ν, Poisson's ratio; [0, 0.49].
    pub poisson: f64,
    /// Whether every time step solves the elastic problem. If not, the dynamics use a Winkler layer, and only frames
    /// have the elastic pressure, under the same force.
    pub coupled: bool,
    /// Bound on the estimated error of every pressure, relative to the largest pressure; [1e-12, 1e-2].
    pub tolerance: f64,
    /// Whether the foam densifies. Default: in a layer yes. A half-space never densifies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub densification: Option<bool>,
}

impl Default for ElasticConfig {
    /// The skin of [`WinklerConfig::default`]; ν = 0.2, a foam in small compression (L. J. Gibson and M. F. Ashby,
    /// *Cellular Solids*, 2nd ed. (1997): 0.1–0.3).
    fn default() -> Self {
        let skin = WinklerConfig::default();
        Self {
            stiffness_pa_per_m: skin.stiffness_pa_per_m,
            damping_s: skin.damping_s,
            thickness_m: skin.thickness_m,
            max_strain: skin.max_strain,
            cells_per_taxel: skin.cells_per_taxel,
            friction: skin.friction,
            friction_speed_m_per_s: skin.friction_speed_m_per_s,
            poisson: 0.2,
            coupled: true,
            tolerance: 1e-6,
            densification: None,
        }
    }
}

/// Most fine cells of an elastic field: the transforms take about 100 bytes a cell.
const MAX_CELLS: Most = (1_048_576.0, "[1, 2^20] for an elastic field");

impl ElasticConfig {
    /// Checks every range.
    pub(crate) fn check(&self, bonded: bool, skin: &SkinLayout) -> Result<(), ConfigError> {
        parameter("poisson", self.poisson, [0.0, 0.49], "[0, 0.49]")?;
        parameter("tolerance", self.tolerance, [1e-12, 1e-2], "[1e-12, 1e-2]")?;
        let densifies = f64::from(u8::from(self.densification == Some(true)));
        let most = f64::from(u8::from(bonded));
        let text = "false: a half-space has no thickness to be used up";
        parameter("densification", densifies, [0.0, most], text)?;
        limits::cells(skin, self.cells_per_taxel, (64.0, "[1, 64]"), MAX_CELLS)?;
        WinklerLayer::check(&self.winkler(), skin)
    }

    /// The same skin as independent columns.
    pub(crate) fn winkler(&self) -> WinklerConfig {
        WinklerConfig {
            stiffness_pa_per_m: self.stiffness_pa_per_m,
            damping_s: self.damping_s,
            thickness_m: self.thickness_m,
            max_strain: self.max_strain,
            cells_per_taxel: self.cells_per_taxel,
            friction: self.friction,
            friction_speed_m_per_s: self.friction_speed_m_per_s,
        }
    }
}
