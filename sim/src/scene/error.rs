//! Why a scene is not valid.

use crate::contact::{ContactError, EquilibriumError};
use crate::mesh::MeshError;
use spts_models::ConfigError;
use std::path::PathBuf;

/// A scene that cannot be simulated.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// The error, with the file it is in.
    #[error("{}: {source}", path.display())]
    InFile {
        /// Scene file.
        path: PathBuf,
        /// What is wrong.
        source: Box<SceneError>,
    },
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[from] std::io::Error),
    /// The text is not TOML, or has a key or a type that a scene does not have.
    #[error("{0}")]
    Parse(#[from] toml::de::Error),
    /// The scene cannot be written as TOML.
    #[error("cannot be written: {0}")]
    Write(#[from] toml::ser::Error),
    /// A value is outside its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The contact field cannot be built.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Not exactly one of two keys or sections is there.
    #[error("exactly one of {choices} is needed, found {found}")]
    OneOf {
        /// What there is to choose from.
        choices: &'static str,
        /// How many are there.
        found: usize,
    },
    /// No object of that name.
    #[error("`press.object` = \"{name}\" is not one of {known}")]
    UnknownObject {
        /// Name in the scene.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// The mesh is not usable.
    #[error("`press.mesh`: {0}")]
    Mesh(#[from] MeshError),
    /// The body cannot be pressed or dropped there.
    #[error(transparent)]
    Equilibrium(#[from] EquilibriumError),
    /// The time step does not resolve the contact.
    #[error(
        "`timestep_s` = {timestep_s} is outside (0, {limit_s:.2e}]: the contact reaches {stiffness_n_per_m:.3e} N/m \
         on {mass_kg:.3} kg"
    )]
    Timestep {
        /// Step in the scene, s.
        timestep_s: f64,
        /// Largest step allowed, s.
        limit_s: f64,
        /// Largest stiffness of the contact, N/m.
        stiffness_n_per_m: f64,
        /// Mass that oscillates on it, kg.
        mass_kg: f64,
    },
}
