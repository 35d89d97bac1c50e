//! The contact fields a scene can name.

use super::checks::{FlexConfig, FlexLayer, TaxelBed, TaxelBedConfig};
use super::{ContactField, ElasticField, Footprint, WinklerConfig, WinklerLayer};
use spts_models::{ConfigError, SkinLayout};

/// Why a contact field could not be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContactError {
    /// No field of that name.
    #[error("`contact.model` = \"{name}\" is not one of {known}")]
    Unknown {
        /// Name in the scene.
        name: String,
        /// Names that exist.
        known: String,
    },
    /// The parameters do not read as this field's.
    #[error("[contact]: {0}")]
    Table(#[from] toml::de::Error),
    /// A parameter is outside its range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

/// Builds a contact field from the parameters of a scene's `[contact]` section (without `model`).
pub type ContactBuild = fn(toml::Table, &SkinLayout) -> Result<Box<dyn ContactField>, ContactError>;

/// Every contact field, by the name a scene uses.
pub const CONTACT_FIELDS: &[(&str, ContactBuild)] = &[
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

/// Independent checks of the fields, by the name a scene uses: static answers of MuJoCo's own contacts, too slow for
/// the dynamics of a scene.
pub(crate) const CONTACT_CHECKS: &[(&str, ContactBuild)] = &[
    ("taxel_bed", |table, skin| {
        let config: TaxelBedConfig = table.try_into()?;
        Ok(Box::new(TaxelBed::new(config, skin)?))
    }),
    ("flex", |table, skin| {
        let config: FlexConfig = table.try_into()?;
        Ok(Box::new(FlexLayer::new(config, skin)?))
    }),
];

/// Builds the field or check called `name`.
///
/// # Errors
/// [`ContactError`] when the name is unknown or the parameters are not valid.
pub fn build_contact(
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
) -> Result<Box<dyn ContactField>, ContactError> {
    let all = || CONTACT_FIELDS.iter().chain(CONTACT_CHECKS);
    let Some((_, build)) = all().find(|(known, _)| *known == name) else {
        let known: Vec<_> = all().map(|(known, _)| format!("\"{known}\"")).collect();
        return Err(ContactError::Unknown {
            name: name.to_owned(),
            known: known.join(", "),
        });
    };
    build(parameters, skin)
}
