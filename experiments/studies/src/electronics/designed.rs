//! The electronics of the profile `as_designed` as parameters of the closed forms.

use super::{ElectronicsError, ElectronicsStudy};
use spts_circuit::amplifier::{Network, OpAmp, Skin};
use spts_circuit::{Adc, Profile};

/// Taxels, or amplifiers of the level below, on one amplifier of a tree: those of the skin as built.
const SUB_ARRAY: u32 = 100;

impl ElectronicsStudy {
    /// The profile `as_designed`, with the default pressed skin.
    ///
    /// # Errors
    /// [`ElectronicsError`] if the profile has no amplifier or no converter.
    pub fn as_designed() -> Result<Self, ElectronicsError> {
        let profile = Profile::named("as_designed").map_err(ElectronicsError::Profile)?;
        let stage = |stage: &'static str| {
            let table = profile.compressive.get(stage).cloned();
            table.ok_or(ElectronicsError::NoStage { stage })
        };
        let parts = stage("amplifier")?;
        let number = |field: &'static str| {
            let value = parts.get(field).and_then(toml::Value::as_float);
            value.ok_or(ElectronicsError::NoNumber { field })
        };
        let op_amp: OpAmp = match parts.get("op_amp") {
            Some(table) => table.clone().try_into()?,
            None => OpAmp::default(),
        };
        let adc: Adc = stage("adc")?.try_into()?;
        Ok(Self {
            op_amp,
            network: Network {
                feedback_ohm: profile.feedback_ohm,
                feedback_f: number("feedback_f")?,
                bus_f: number("bus_f")?,
                temperature_k: number("temperature_k")?,
                ..Network::default()
            },
            taxel_f: 0.0,
            skin: Skin {
                drive_v: profile.drive_v,
                ..Skin::default()
            },
            rate_hz: profile.sample_rate_hz,
            busy_s: number("update_s")? + 1.0 / profile.sample_rate_hz - number("sample_s")?,
            sub_array: SUB_ARRAY,
            adc,
        })
    }
}
