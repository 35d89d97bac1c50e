//! The table of transducers. A new one is a file in `transducers/`, and here its `mod` and its line in [`TRANSDUCERS`].

mod linear;
mod velostat;

pub use linear::{Linear, LinearConfig};
pub use velostat::{REFERENCE_C, REFERENCE_PA, Velostat, VelostatConfig};

use crate::check::parsed;
use crate::layout::SkinLayout;
use crate::streams::Streams;
use crate::transducer::{OnElectrode, Transducer};
use spts_input::Refusal;

/// Builds a transducer for a skin from its parameters. `streams` determine what differs from skin to skin. The
/// conductance is that of electrodes of 10 mm × 10 mm, whatever the skin has: [`build_transducer`] scales it.
pub type BuildTransducer = fn(toml::Table, &SkinLayout, Streams) -> Result<Box<dyn Transducer>, Refusal>;

/// Every transducer, by name.
pub const TRANSDUCERS: &[(&str, BuildTransducer)] = &[
    ("linear", |table, _, _| Ok(Box::new(parsed::<Linear>(table)?))),
    ("velostat", |table, skin, streams| Ok(Box::new(Velostat::new(parsed::<VelostatConfig>(table)?, skin, streams)?))),
];

/// Builds the transducer called `name` in [`TRANSDUCERS`], and scales its conductance with the area of the skin's
/// electrodes ([`SkinLayout::relative_area`]).
///
/// ```
/// use spts_models::{SkinLayout, Streams, build_transducer};
///
/// let parameters = toml::toml! { exponent = 7.0 };
/// let error = build_transducer("velostat", parameters, &SkinLayout::default(), Streams::new(1)).err();
/// assert_eq!(error.map(|e| e.to_string()).as_deref(), Some("`exponent` = 7 is outside [0.05, 2]"));
/// ```
///
/// # Errors
/// [`Refusal`] for an unknown name, or parameters that the transducer refuses.
pub fn build_transducer(
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
    streams: Streams,
) -> Result<Box<dyn Transducer>, Refusal> {
    let Some((_, build)) = TRANSDUCERS.iter().find(|(known, _)| *known == name) else {
        let known: Vec<_> = TRANSDUCERS.iter().map(|(known, _)| *known).collect();
        let known = known.join(", ");
        let why = format!("`transducer` = \"{name}\" is not a transducer; known: {known}");
        return Err(Refusal::new(why));
    };
    let transducer = build(parameters, skin, streams)?;
    Ok(OnElectrode::wrap(transducer, skin.relative_area()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nonsense_is_refused_with_its_name() {
        let build = |name: &str, text: &str| {
            let table = toml::from_str(text).unwrap();
            build_transducer(name, table, &SkinLayout::default(), Streams::new(0)).map(|_| ()).unwrap_err().to_string()
        };
        assert!(build("foil", "").contains("known: linear, velostat"));
        assert!(build("linear", "slope_s_per_pa = nan").contains("slope_s_per_pa"));
        assert!(build("velostat", "exponnt = 0.4").contains("exponnt"));
        assert!(build("velostat", "creep.kind = 'burgers'").contains("`log` or `prony`"));
        assert!(build("velostat", "creep.shares = [0.1]").contains("creep.tau_s (length)"));
        let outside = "exponent = nan; reference_s = -1.0; saturation_pa = inf; creep.fast_s = nan; \
            creep.fast_fall_s = 2.0; creep.instant = -0.1; creep.start_s = 1e9; creep.shares = [0.1, nan, 0.1]; \
            creep.shares = [0.1, -0.01, 0.1]; creep.tau_s = [1.0, 0.0, 2.0]; session_log_sd = nan; session_tilt_log_sd = -1.0; temperature_c = 70.0; \
            resistance_per_k = 0.1; conditioning.first = 0.0; hysteresis.width = 0.5";
        for text in outside.split("; ") {
            let field = text.split(' ').next().unwrap();
            let message = build("velostat", text);
            assert!(message.contains(field) && message.contains("is outside"), "{text}: {message}");
        }
    }
}
