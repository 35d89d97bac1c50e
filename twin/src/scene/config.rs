//! A scene as written in TOML.

use crate::chain::{ChainConfig, RowsConfig};
use serde::{Deserialize, Serialize};
use spts_circuit::WireConfig;
use spts_input::Refusal;
use spts_models::{SkinLayout, parsed, parsed_text};
use spts_sim::fidelity::Tolerance;
use spts_sim::mechanics::{BendConfig, DropConfig, Expected, MechanicsConfig, PressConfig, Timestep};

/// A scene as written in TOML. A missing field takes its default.
///
/// ```
/// use spts::scene::SceneConfig;
///
/// let scene = SceneConfig::from_toml("seed = 7\nreadout = \"ideal\"\n[press]\nobject = \"T\"")?;
/// assert_eq!((scene.seed, scene.readout.as_deref()), (7, Some("ideal")));
/// let error = SceneConfig::from_toml("sead = 7").err().expect("an unknown key");
/// assert!(error.to_string().contains("sead"));
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneConfig {
    /// Name of the recorded session, and the class of a mesh. Default: the name of the object or of the mesh file, or
    /// `bounce`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Root of every random number; [0, 2^63).
    pub seed: u64,
    /// Step of the dynamics; see [`MechanicsConfig::timestep_s`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timestep_s: Option<Timestep>,
    /// The error that the scene may have; see [`MechanicsConfig::tolerance`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<Tolerance>,
    /// Tolerance for which a saved scene was chosen; see [`MechanicsConfig::chosen_for_tolerance`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen_for_tolerance: Option<Tolerance>,
    /// What was expected of that choice; see [`MechanicsConfig::chosen`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen: Option<Expected>,
    /// Time between frames, s; see [`MechanicsConfig::frame_interval_s`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_interval_s: Option<f64>,
    /// Name of the transducer; see [`ChainConfig::transducer`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transducer: Option<String>,
    /// Parameters of the transducer; see [`ChainConfig::transducer_parameters`].
    #[serde(skip_serializing_if = "toml::Table::is_empty")]
    pub transducer_parameters: toml::Table,
    /// Readout profile: a name, or a file that ends in `.toml`, relative to the scene file; see
    /// [`ChainConfig::readout`].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub readout: Option<String>,
    /// Source of the weights: `"model"` (the formula of the cells' generator) or `"firmware"` (the codes of emulated
    /// cells).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
    /// Seeds and levels of the cells, replacing those of the profile; see [`RowsConfig`].
    #[serde(skip_serializing_if = "RowsConfig::is_empty")]
    pub rows: RowsConfig,
    /// Faulty cells, in addition to those of the profile.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<toml::Table>,
    /// Wires of the skin, in place of those of the profile; see [`WireConfig`](spts_circuit::WireConfig). Default:
    /// those of the profile, else one.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub wires: Vec<WireConfig>,
    /// The skin.
    pub skin: SkinLayout,
    /// Contact model (`model`) and its parameters.
    pub contact: toml::Table,
    /// Bends the skin round a cylinder; see [`BendConfig`]. Default: the skin is flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bend: Option<BendConfig>,
    /// Presses an object with the arm. A scene has either this or `drop`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press: Option<PressConfig>,
    /// Drops a ball. A scene has either this or `press`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drop: Option<DropConfig>,
}

impl SceneConfig {
    /// The mechanical part: what happens on the skin.
    pub fn mechanics(&self) -> MechanicsConfig {
        MechanicsConfig {
            seed: self.seed,
            timestep_s: self.timestep_s,
            tolerance: self.tolerance,
            chosen_for_tolerance: self.chosen_for_tolerance,
            chosen: self.chosen,
            frame_interval_s: self.frame_interval_s,
            skin: self.skin,
            contact: self.contact.clone(),
            bend: self.bend,
            press: self.press.clone(),
            drop: self.drop.clone(),
        }
    }

    /// The part after the mechanics: transducer, readout and weights.
    pub fn chain(&self) -> ChainConfig {
        ChainConfig {
            transducer: self.transducer.clone(),
            transducer_parameters: self.transducer_parameters.clone(),
            readout: self.readout.clone(),
            profile: None,
            rows: self.rows.clone(),
            weights: self.weights.clone(),
            faults: self.faults.clone(),
            wires: self.wires.clone(),
        }
    }
}

impl From<MechanicsConfig> for SceneConfig {
    /// A scene with everything after the mechanics at its default.
    fn from(mechanics: MechanicsConfig) -> Self {
        Self::default().with_mechanics(mechanics)
    }
}

impl SceneConfig {
    /// The same scene with another mechanical part.
    pub(super) fn with_mechanics(self, mechanics: MechanicsConfig) -> Self {
        Self {
            seed: mechanics.seed,
            timestep_s: mechanics.timestep_s,
            tolerance: mechanics.tolerance,
            chosen_for_tolerance: mechanics.chosen_for_tolerance,
            chosen: mechanics.chosen,
            frame_interval_s: mechanics.frame_interval_s,
            skin: mechanics.skin,
            contact: mechanics.contact,
            bend: mechanics.bend,
            press: mechanics.press,
            drop: mechanics.drop,
            ..self
        }
    }
}

impl SceneConfig {
    /// The configuration in `table`.
    ///
    /// # Errors
    /// [`Refusal`] for an unknown key or a wrong value.
    pub(crate) fn from_table(table: toml::Table) -> Result<Self, Refusal> {
        parsed(table)
    }

    /// The configuration in the TOML text `text`.
    ///
    /// # Errors
    /// [`Refusal`], with the line.
    pub fn from_toml(text: &str) -> Result<Self, Refusal> {
        parsed_text(text)
    }
}
