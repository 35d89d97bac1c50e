//! Errors of the mechanical part of a scene.

use spts_contact::mesh::MeshError;
use spts_contact::{ContactError, EquilibriumError};
use spts_models::ConfigError;

/// Largest tilt of a mesh that opens upwards, degrees. Such a mesh was closed by vertical walls and a lid, which are
/// not part of the object. At a tilt θ and a depth d they reach d tan θ beyond the rim, which is less than 0.5 mm for 5
/// mm of foam.
pub const MAX_LIDDED_TILT_DEG: f64 = 5.0;

/// Why a scene is not valid.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MechanicsError {
    /// Text that is not TOML, or has an unknown key or a value of the wrong type.
    #[error("{}", .0.to_string().trim_end().replace('\n', "; "))]
    Parse(#[from] toml::de::Error),
    /// The scene cannot be written as TOML.
    #[error("cannot be written: {0}")]
    Write(#[from] toml::ser::Error),
    /// A value is outside its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// A seed that TOML cannot represent.
    #[error("`seed` = {seed} is outside [0, 2^63)")]
    Seed {
        /// Seed of the scene.
        seed: u64,
    },
    /// The contact field is not valid.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Not exactly one of two keys or sections is given.
    #[error("exactly one of {choices} is needed, found {found}")]
    OneOf {
        /// The possible keys or sections.
        choices: &'static str,
        /// Number that are given.
        found: usize,
    },
    /// A place that is given in more than one way.
    #[error(
        "give at most one of `{section}.row` with `{section}.col`, `{section}.position_m` and `{section}.position_share`; found {found}"
    )]
    Places {
        /// Section of the scene.
        section: &'static str,
        /// Number of ways that are given.
        found: usize,
    },
    /// A place too far from the sheet.
    #[error(
        "`{section}.position_m`: {axis} = {value_m} is outside [{:.4}, {most_m:.4}] m; the limit is 75 mm or 5 taxels beyond \
         the outer taxels",
        -most_m
    )]
    Position {
        /// Section of the scene.
        section: &'static str,
        /// "x" or "y".
        axis: &'static str,
        /// Place in the scene, m.
        value_m: f64,
        /// Largest distance from the middle of the sheet, m.
        most_m: f64,
    },
    /// A tolerance together with one of the values that it determines.
    #[error("`tolerance` chooses contact model, cells and time step; leave out `{key}`, or the tolerance")]
    Tolerance {
        /// The other key.
        key: String,
    },
    /// A drop onto a contact field that requires a force.
    #[error(
        "`contact.model` = \"{model}\" needs a force and cannot stop a ball: use [press] instead of [drop], or another model"
    )]
    NeedsForce {
        /// Name of the contact field.
        model: String,
    },
    /// A drop onto a bent skin.
    #[error("[bend] requires [press]: drops on a bent skin are not simulated; remove [bend]")]
    BentDrop,
    /// A bent skin with a contact field without preloads.
    #[error("`contact.model` = \"{model}\" has no preload, which [bend] needs; valid: \"winkler\", \"footprint\"")]
    BentField {
        /// Name of the contact field.
        model: String,
    },
    /// A place for each press together with a place for all.
    #[error(
        "`press.places` gives the place of every press: remove `press.row`, `press.col`, `press.position_m` and \
         `press.position_share`"
    )]
    PlacesAndPlace,
    /// `press.places` is empty.
    #[error("`press.places` = [] is empty; valid: one [row, col] or more")]
    NoPlaces,
    /// No fidelity level meets the tolerance.
    #[error(
        "`tolerance` = {tolerance}: no fidelity level of the shipped table meets it for a {task} on a skin of {pitch_m} m pitch"
    )]
    NoLevel {
        /// Tolerance in the scene.
        tolerance: f64,
        /// "press" or "drop".
        task: &'static str,
        /// Pitch of the skin, m. A large pitch needs more grid squares than a taxel can have.
        pitch_m: f64,
    },
    /// A scale together with an object, which has its own size.
    #[error("`press.scale` is for a mesh, and `press.object` = \"{name}\" has its own size; leave the scale out")]
    ScaledObject {
        /// Name in the scene.
        name: String,
    },
    /// There is no object of that name.
    #[error("`press.object` = \"{name}\" is not one of {known}")]
    UnknownObject {
        /// Name in the scene.
        name: String,
        /// All known names.
        known: String,
    },
    /// The press lifts before its force is steady.
    #[error(
        "no plateau: with `press.onset_s` = {onset_s}, `press.onset_spread_s` = {onset_spread_s} and `press.rise_s` = {rise_s} \
         the force is steady from {start_s:.3} s, but with `press.lift_s` = {lift_s} and `press.lift_spread_s` = {lift_spread_s} \
         only until {end_s:.3} s"
    )]
    NoPlateau {
        /// Start of the plateau, s.
        start_s: f64,
        /// End of the plateau, s.
        end_s: f64,
        /// Mean time of first touch, s.
        onset_s: f64,
        /// Its spread, s.
        onset_spread_s: f64,
        /// Time from 10 to 90 % of the force, s.
        rise_s: f64,
        /// Mean time of the lift, s.
        lift_s: f64,
        /// Its spread, s.
        lift_spread_s: f64,
    },
    /// The mesh cannot be used.
    #[error("`press.mesh`: {0}")]
    Mesh(#[from] MeshError),
    /// The press tilts a mesh that is open at the top.
    #[error(
        "`press.mesh` = \"{mesh}\" opens upwards ({lids} holes were closed there): `press.tilt_deg` = [{tilt_x_deg}, {tilt_y_deg}] and \
         three times `press.rotation_sd_deg` = {rotation_sd_deg} tilt it by {leaning_deg:.1}°, outside \
         [0, {MAX_LIDDED_TILT_DEG}]°, so that the closed holes would touch the skin; close the mesh, or tilt it in its file"
    )]
    TiltedLid {
        /// Mesh file as in the scene.
        mesh: String,
        /// Number of holes closed at its top.
        lids: usize,
        /// Tilt about the skin's x axis, degrees.
        tilt_x_deg: f64,
        /// Tilt about the skin's y axis, degrees.
        tilt_y_deg: f64,
        /// Standard deviation of the target about each axis, degrees.
        rotation_sd_deg: f64,
        /// Angle between the mesh's z axis and the skin's normal, including the scatter, degrees.
        leaning_deg: f64,
    },
    /// The object cannot be pressed there, or not with that force.
    #[error("`press.force_n` = {force_n}: {source}")]
    Press {
        /// Force in the scene, N.
        force_n: f64,
        /// Cause.
        source: EquilibriumError,
    },
    /// The ball cannot be dropped there, or not with that energy.
    #[error("`drop.mass_kg` = {mass_kg} from `drop.height_m` = {height_m}: {source}")]
    Drop {
        /// Mass in the scene, kg.
        mass_kg: f64,
        /// Height in the scene, m.
        height_m: f64,
        /// Cause.
        source: EquilibriumError,
    },
    /// The time step does not resolve the contact.
    #[error(
        "`timestep_s` = {timestep_s} is outside [1e-6, {limit_s:.2e}]: the contact reaches {stiffness_n_per_m:.3e} N/m \
         on {mass_kg:.3} kg; \"auto\" takes a step that fits"
    )]
    Timestep {
        /// Time step in the scene, s.
        timestep_s: f64,
        /// Largest valid time step, s.
        limit_s: f64,
        /// Largest stiffness of the contact, N/m.
        stiffness_n_per_m: f64,
        /// Oscillating mass, kg.
        mass_kg: f64,
    },
    /// No valid time step resolves the contact.
    #[error(
        "no valid `timestep_s`: the contact reaches {stiffness_n_per_m:.3e} N/m on {mass_kg:.3} kg and allows at most {limit_s:.2e} s, \
         but the shortest step is 1e-6 s; soften the contact (`contact.stiffness_pa_per_m`, `contact.damping_s`) or drop from lower"
    )]
    NoTimestep {
        /// Largest valid time step, s.
        limit_s: f64,
        /// Largest stiffness of the contact, N/m.
        stiffness_n_per_m: f64,
        /// Oscillating mass, kg.
        mass_kg: f64,
    },
}
