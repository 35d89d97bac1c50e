//! The transducers by name, and what all of them promise.

use crate::config::ConfigError;
use crate::grid::{ConductanceMap, PressureMap};
use crate::layout::SkinLayout;
use crate::linear::Linear;
use crate::streams::Streams;
use crate::transducer::Transducer;
use crate::velostat::{Velostat, VelostatConfig};
use serde::de::DeserializeOwned;

/// A transducer that cannot be built.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransducerError {
    /// An unknown key, a value of the wrong type, or one outside its range.
    #[error("{0}")]
    Parameters(String),
    /// A value outside its range.
    #[error(transparent)]
    Value(#[from] ConfigError),
    /// A name that the table does not list.
    #[error("`{name}` is not a transducer; known: {known}")]
    Unknown {
        /// Name asked for.
        name: String,
        /// All known names.
        known: String,
    },
}

/// Builds a transducer from its parameters for a skin; `streams` decide whatever differs from skin to skin.
pub type BuildTransducer = fn(toml::Table, &SkinLayout, Streams) -> Result<Box<dyn Transducer>, TransducerError>;

/// Every transducer by name.
pub const TRANSDUCERS: &[(&str, BuildTransducer)] = &[
    ("linear", |table, _, _| Ok(Box::new(parse::<Linear>(table)?))),
    ("velostat", |table, skin, streams| {
        Ok(Box::new(Velostat::new(parse::<VelostatConfig>(table)?, skin, streams)?))
    }),
];

fn parse<T: DeserializeOwned>(table: toml::Table) -> Result<T, TransducerError> {
    table
        .try_into()
        .map_err(|e| TransducerError::Parameters(e.to_string().trim_end().to_owned()))
}

/// Transducer `name` of [`TRANSDUCERS`].
///
/// # Errors
/// [`TransducerError`] for an unknown name and for parameters that are refused.
pub fn build_transducer(
    name: &str,
    parameters: toml::Table,
    skin: &SkinLayout,
    streams: Streams,
) -> Result<Box<dyn Transducer>, TransducerError> {
    match TRANSDUCERS.iter().find(|(known, _)| *known == name) {
        Some((_, build)) => build(parameters, skin, streams),
        None => Err(TransducerError::Unknown {
            name: name.to_owned(),
            known: TRANSDUCERS
                .iter()
                .map(|(known, _)| *known)
                .collect::<Vec<_>>()
                .join(", "),
        }),
    }
}

/// Relative tolerance of a hold cut into a thousand steps: a thousand roundings of 1.1e-16, with a factor of ten to spare.
const SPLIT_TOLERANCE: f64 = 1e-12;

/// Checks what every transducer promises. `build` makes a fresh one for a skin.
///
/// Finite and non-negative for 0…1 GPa and steps of 0…1 h; monotone in the pressure; nothing conducts that is not pressed and
/// has rested; a hold is the same however it is cut; a step of no time repeats itself; negative and NaN pressure count as
/// none; equal builds give equal bits.
///
/// # Panics
/// When a promise is broken, with the numbers.
pub fn check_transducer(build: &dyn Fn(&SkinLayout) -> Box<dyn Transducer>) {
    let skin = SkinLayout::default();
    let map = |p: f64| PressureMap::from_values(skin.rows(), skin.cols(), vec![p; skin.taxels()]);
    let run = |steps: &[(f64, f64)]| {
        let (mut transducer, mut out) = (build(&skin), ConductanceMap::zeros(skin.rows(), skin.cols()));
        for (p, dt_s) in steps {
            transducer.step(&map(*p), *dt_s, &mut out);
        }
        out
    };

    for dt_s in [0.0, 1e-6, 1e-3, 1.0, 3600.0] {
        let mut below = run(&[(0.0, dt_s)]);
        for p in [1e-300, 1.0, 50.0, 150.0, 1e3, 1e4, 1e5, 1e6, 1e9] {
            let out = run(&[(p, dt_s)]);
            for (g, g_below) in out.values().iter().zip(below.values()) {
                assert!(g.is_finite() && *g >= 0.0, "{g} S at {p} Pa after {dt_s} s");
                assert!(g >= g_below, "{g} S at {p} Pa, but {g_below} S at less, after {dt_s} s");
            }
            below = out;
        }
    }

    let idle = run(&[(0.0, 1.0)]);
    let rested = run(&[(1e5, 3600.0), (0.0, 3600.0)]);
    let pressed = run(&[(1e5, 1.0)]);
    for ((idle, rested), pressed) in idle.values().iter().zip(rested.values()).zip(pressed.values()) {
        let left = (rested - idle).abs() / pressed;
        assert!(left < 1e-9, "{left:e} of a load is left after an hour of rest");
    }

    let whole = run(&[(2e4, 0.5), (5e3, 1.0)]);
    let mut cut = vec![(2e4, 0.5e-3); 1000];
    cut.extend(vec![(5e3, 1e-3); 1000]);
    for (cut, whole) in run(&cut).values().iter().zip(whole.values()) {
        let error = (cut - whole).abs() / whole;
        assert!(
            error < SPLIT_TOLERANCE,
            "cut hold {cut} S, whole {whole} S, error {error:e}"
        );
    }

    let (once, twice) = (
        run(&[(2e4, 0.5), (1e4, 0.0)]),
        run(&[(2e4, 0.5), (1e4, 0.0), (1e4, 0.0)]),
    );
    assert_eq!(once, twice, "a step of no time changes the state");
    for nothing in [-1e3, f64::NAN, f64::NEG_INFINITY] {
        assert_eq!(run(&[(nothing, 1.0)]), idle, "{nothing} Pa is not the same as 0");
    }
    assert_eq!(run(&[(2e4, 0.5)]), run(&[(2e4, 0.5)]), "equal builds differ");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_transducer_conforms() {
        for (name, build) in TRANSDUCERS {
            eprintln!("{name}");
            check_transducer(&|skin| build(toml::Table::new(), skin, Streams::new(7)).unwrap());
        }
    }

    #[test]
    fn nonsense_is_refused_with_its_name() {
        let build = |name: &str, text: &str| {
            let table = toml::from_str(text).unwrap();
            build_transducer(name, table, &SkinLayout::default(), Streams::new(0))
                .map(|_| ())
                .unwrap_err()
                .to_string()
        };
        assert!(build("foil", "").contains("known: linear, velostat"));
        assert!(build("linear", "slope_s_per_pa = nan").contains("slope_s_per_pa"));
        assert!(build("velostat", "exponnt = 0.4").contains("exponnt"));
        for text in [
            "exponent = nan",
            "reference_s = -1.0",
            "saturation_pa = inf",
            "creep.fast_s = nan",
            "creep.start_s = 1e9",
            "conditioning.first = 0.0",
            "hysteresis.width = 0.5",
        ] {
            let field = text.split(' ').next().unwrap();
            let message = build("velostat", text);
            assert!(
                message.contains(field) && message.contains("is outside"),
                "{text}: {message}"
            );
        }
    }
}
