//! The table of checks.

use super::{FlexConfig, FlexLayer, TaxelBed, TaxelBedConfig};
use spts_contact::{CONTACT_FIELDS, ContactError, ContactField, ContactTable, build_contact_from};
use spts_models::SkinLayout;

/// Independent checks of the contact fields, with the names that scenes use: static answers of MuJoCo's own contacts.
/// They are too slow for the dynamics of a scene.
pub const CONTACT_CHECKS: ContactTable = &[
    ("taxel_bed", |table, skin| {
        let config: TaxelBedConfig = table.try_into()?;
        Ok(Box::new(TaxelBed::new(config, skin)?))
    }),
    ("flex", |table, skin| {
        let config: FlexConfig = table.try_into()?;
        Ok(Box::new(FlexLayer::new(config, skin)?))
    }),
];

/// Builds the contact field or check called `name`.
///
/// # Errors
/// [`ContactError`] if the name is unknown, or a parameter is not valid.
pub fn build_field_or_check(
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
) -> Result<Box<dyn ContactField>, ContactError> {
    build_contact_from(&[CONTACT_FIELDS, CONTACT_CHECKS], name, parameters, skin)
}
