//! The mechanical part of a scene, as written in TOML.

use super::{BendConfig, DropConfig, PressConfig, Timestep};
use serde::{Deserialize, Serialize};
use spts_models::SkinLayout;

/// The mechanical part of a scene, as written in TOML. A missing field takes its default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MechanicsConfig {
    /// Seed of all random numbers; [0, 2^63).
    pub seed: u64,
    /// Time step of the dynamics, s; from 1e-6 to the stable limit, which is at most 2e-3. `"auto"` is the longest
    /// stable step that divides `frame_interval_s`. Default 0.5 ms for a press, 0.1 ms for a drop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub timestep_s: Option<Timestep>,
    /// Largest acceptable relative error of the taxels' pressures; [0.03, 1]. It replaces `contact.model`,
    /// `contact.cells_per_taxel` and `timestep_s`: the scene uses the cheapest level of the shipped table that meets
    /// the tolerance ([`crate::fidelity`]).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// The tolerance for which `contact.model`, `contact.cells_per_taxel` and `timestep_s` were chosen; (0, 1]. A scene
    /// with a `tolerance` stores it here when it is saved, together with the chosen values. It changes no result.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub chosen_for_tolerance: Option<f64>,
    /// Time between frames, s; [`timestep_s`, 0.1]. Default 2 ms for a press. A drop uses it while the ball is near the
    /// skin (default one time step, 0.1 ms with `timestep_s = "auto"`; at most 0.2 ms), and 2 ms otherwise.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame_interval_s: Option<f64>,
    /// The skin.
    pub skin: SkinLayout,
    /// Contact model (`model`) and its parameters.
    pub contact: toml::Table,
    /// Bends the skin round a cylinder. Default: the skin is flat.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub bend: Option<BendConfig>,
    /// Presses an object with the arm. A scene has either this or `drop`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub press: Option<PressConfig>,
    /// Drops a ball. A scene has either this or `press`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub drop: Option<DropConfig>,
}

impl MechanicsConfig {
    /// Ten presses of the object called `name` by the arm, at the object's place.
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

    /// Ten presses of the mesh in `file` (`scale` metres a unit) in the middle of the skin.
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

    /// Ten drops of a tennis ball from half a metre onto the middle of the skin.
    #[must_use]
    pub fn bounce() -> Self {
        Self {
            drop: Some(DropConfig::default()),
            ..Self::default()
        }
    }
}
