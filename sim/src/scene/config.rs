//! A scene as it is written.

use super::{DropConfig, PressConfig, Timestep};
use serde::{Deserialize, Serialize};
use spts_models::SkinLayout;

/// A scene as it is written. Missing values take their defaults.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct SceneConfig {
    /// Name of the session that is recorded, and the class of a mesh. Default: the object's, the mesh file's, or `bounce`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// Root of every random number; [0, 2^63).
    pub seed: u64,
    /// Step of the dynamics, s; [1e-6, stable limit], or `"auto"`. Default 0.5 ms for a press, 0.1 ms for a drop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timestep_s: Option<Timestep>,
    /// Error of the taxels' pressures that will do, relative; (0, 1]. In place of `contact.model`, `contact.cells_per_taxel`
    /// and `timestep_s`: the scene takes the cheapest rung that the shipped table says meets it ([`crate::ladder`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Time between frames, s; [`timestep_s`, 0.1]. Default 2 ms for a press. A drop uses it while the ball is near the
    /// skin (default one step, 0.1 ms with `timestep_s = "auto"`; at most 0.2 ms) and 2 ms otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_interval_s: Option<f64>,
    /// Name of the transducer; resolved by whoever owns it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub transducer: Option<String>,
    /// Parameters of the transducer named in `transducer`, as it takes them; not looked at here, resolved by whoever owns the
    /// transducer. Default: none.
    #[serde(skip_serializing_if = "toml::Table::is_empty")]
    pub transducer_parameters: toml::Table,
    /// Name of the readout profile; resolved by whoever owns it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub readout: Option<String>,
    /// Where the weights come from: `"model"`, the formula of the cells' generator, or `"firmware"`, what emulated cells put out;
    /// resolved by whoever owns them. Default: the model.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub weights: Option<String>,
    /// Faulty cells of the readout, as it takes them; not looked at here, resolved by whoever owns the readout. Default: none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub faults: Vec<toml::Table>,
    /// The skin.
    pub skin: SkinLayout,
    /// `model` and the parameters of that contact field.
    pub contact: toml::Table,
    /// The arm presses an object. Either this or `drop`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press: Option<PressConfig>,
    /// A ball falls. Either this or `press`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drop: Option<DropConfig>,
}
