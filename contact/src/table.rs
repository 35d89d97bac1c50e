//! The table of contact fields.

use crate::columns::{Footprint, WinklerConfig, WinklerLayer};
use crate::elastic::ElasticField;
use crate::field::ContactField;
use spts_models::{ConfigError, SkinLayout, explain_toml, in_section};

/// Why a contact field could not be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// There is no contact field of that name.
    #[error("`contact.model` = \"{name}\" is not one of {known}")]
    Unknown {
        /// Name in the scene.
        name: String,
        /// All known names.
        known: String,
    },
    /// The parameters are not those of this contact field.
    #[error("{}", in_section("contact", &explain_toml(.0)))]
    Table(#[from] toml::de::Error),
    /// A parameter is outside its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// Builds a contact field from the parameters of a scene's `[contact]` section (without `model`).
pub type ContactBuild = fn(toml::Table, &SkinLayout) -> Result<Box<dyn ContactField>, ContactError>;

/// Contact fields with the names that scenes use.
pub type ContactTable = &'static [(&'static str, ContactBuild)];

/// Every contact field of this crate.
pub const CONTACT_FIELDS: ContactTable = &[
    ("winkler", |table, skin| {
        let config: WinklerConfig = table.try_into()?;
        Ok(Box::new(WinklerLayer::new(config, skin)?))
    }),
    ("footprint", |table, skin| {
        Ok(Box::new(Footprint::new(table.try_into()?, skin)?))
    }),
    ("layer", |table, skin| {
        Ok(Box::new(ElasticField::new(table.try_into()?, true, skin)?))
    }),
    ("half_space", |table, skin| {
        Ok(Box::new(ElasticField::new(table.try_into()?, false, skin)?))
    }),
];

/// Builds the contact field that scenes call `name`, for the layout `skin`. `parameters` are its section `[contact]`
/// without `model`; missing ones take their defaults.
///
/// ```
/// use spts_contact::build_contact;
/// use spts_models::SkinLayout;
///
/// let parameters = toml::toml! { stiffness_pa_per_m = 1.0 };
/// let error = build_contact("winkler", parameters, &SkinLayout::default()).err().expect("too soft");
/// assert!(error.to_string().contains("`contact.stiffness_pa_per_m` = 1"));
/// ```
///
/// # Errors
/// [`ContactError`] if the name is unknown or a parameter is not valid.
pub fn build_contact(
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
) -> Result<Box<dyn ContactField>, ContactError> {
    build_contact_from(&[CONTACT_FIELDS], name, parameters, skin)
}

/// Builds the contact field called `name` from the first of `tables` that has it. It is for programs with contact
/// fields of their own: `tables` are then [`CONTACT_FIELDS`] and theirs.
///
/// # Errors
/// [`ContactError`] if no table has the name, or a parameter is not valid.
pub fn build_contact_from(
    tables: &[ContactTable],
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
) -> Result<Box<dyn ContactField>, ContactError> {
    let all = || tables.iter().copied().flatten();
    let Some((_, build)) = all().find(|(known, _)| *known == name) else {
        let known: Vec<_> = all().map(|(known, _)| format!("\"{known}\"")).collect();
        return Err(ContactError::Unknown {
            name: name.to_owned(),
            known: known.join(", "),
        });
    };
    build(parameters, skin)
}
