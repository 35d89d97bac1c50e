//! The mechanical part of a scene as it is written.

use super::{BendConfig, DropConfig, PressConfig, Timestep};
use serde::{Deserialize, Serialize};
use spts_models::SkinLayout;

/// The mechanical part of a scene as it is written. Missing values take their defaults.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MechanicsConfig {
    /// Root of every random number; [0, 2^63).
    pub seed: u64,
    /// Step of the dynamics, s; from 1e-6 to the stable limit, which is 2e-3 at most. `"auto"` is the longest stable
    /// step that divides `frame_interval_s`. Default 0.5 ms for a press, 0.1 ms for a drop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timestep_s: Option<Timestep>,
    /// Error of the taxels' pressures that will do, relative; [0.03, 1]. In place of `contact.model`,
    /// `contact.cells_per_taxel` and `timestep_s`: the scene takes the cheapest level that the shipped table says meets
    /// it ([`crate::fidelity`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// Tolerance that chose `contact.model`, `contact.cells_per_taxel` and `timestep_s`. A scene that had a `tolerance`
    /// has it when it is saved, beside what was chosen. It changes no result. (0, 1].
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen_for_tolerance: Option<f64>,
    /// Time between frames, s; [`timestep_s`, 0.1]. Default 2 ms for a press. A drop uses it while the ball is near the
    /// skin (default one step, 0.1 ms with `timestep_s = "auto"`; at most 0.2 ms) and 2 ms otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_interval_s: Option<f64>,
    /// The skin.
    pub skin: SkinLayout,
    /// `model` and the parameters of that contact field.
    pub contact: toml::Table,
    /// The skin is wrapped round a cylinder. Default: it lies flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bend: Option<BendConfig>,
    /// The arm presses an object. Either this or `drop`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press: Option<PressConfig>,
    /// A ball falls. Either this or `press`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drop: Option<DropConfig>,
}

impl MechanicsConfig {
    /// The arm presses the object called `name` at its place, ten times.
    #[must_use]
    pub fn press(name: &str) -> Self {
        Self {
            press: Some(PressConfig {
                object: Some(name.to_owned()),
                ..PressConfig::default()
            }),
            ..Self::default()
        }
    }

    /// The arm presses the mesh in `file` (`scale` metres a unit) in the middle of the skin, ten times.
    #[must_use]
    pub fn press_mesh(file: &str, scale: f64) -> Self {
        Self {
            press: Some(PressConfig {
                mesh: Some(file.to_owned()),
                scale: Some(scale),
                ..PressConfig::default()
            }),
            ..Self::default()
        }
    }

    /// A tennis ball falls from half a metre on the middle of the skin, ten times.
    #[must_use]
    pub fn bounce() -> Self {
        Self {
            drop: Some(DropConfig::default()),
            ..Self::default()
        }
    }
}
