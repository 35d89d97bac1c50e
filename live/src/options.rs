//! What can be chosen, and its ranges.

use crate::error::LiveError;
use crate::settings::Settings;
use serde::Serialize;
use spts_circuit::{PROFILES, Profile};
use spts_contact::objects::pressable;
use spts_eval::decoders::{DECODERS, DecoderSpec, Needs, PublishedDecode};
use spts_models::SkinLayout;
use spts_recon::rows::{DESIGNERS, Designer, RowNeeds};

/// Measurements of an image.
pub const MEASUREMENTS: [usize; 2] = [5, 100];
/// Force, N.
pub const FORCE_N: [f64; 2] = [0.0, 200.0];
/// What the noise is multiplied with.
pub const NOISE_FACTOR: [f64; 2] = [0.0, 10.0];

/// The rows that the cells' generators make.
pub(crate) const RANDOM: &str = "random";
/// Decoders that look at no measurement: they show nothing here.
const BLIND: [&str; 2] = ["empty", "mean_image"];

/// Faults by name, and what they are in plain words.
pub(crate) const FAULTS: &[(&str, &str)] = &[
    ("dead", "dead: puts out nothing"),
    ("stuck", "stuck: never changes its sign"),
    ("mis_seeded", "wrong signs: follows another sequence"),
    ("overdriven", "too loud: its output is too large"),
    ("skipping_clocks", "misses clock edges"),
    ("drifting", "drifts: loses 1 % of its output a second"),
    ("detached", "detached from the wire"),
];

/// Readout profiles by name, and what they are in plain words.
const READOUTS: &[(&str, &str)] = &[
    ("ideal", "ideal: no noise, no error"),
    ("as_built", "as built: fitted to recordings"),
    ("as_published", "as published: converter of the paper"),
    ("as_designed", "as designed: parts from data sheets"),
];

/// Something to choose.
#[derive(Debug, Serialize)]
struct Choice {
    name: &'static str,
    label: String,
    about: String,
    group: &'static str,
}

/// Everything that the page offers; its first message.
#[derive(Debug, Serialize)]
#[serde(tag = "type", rename = "hello")]
pub(crate) struct Options {
    rows: usize,
    cols: usize,
    pitch_mm: f64,
    measurements: [usize; 2],
    force_n: [f64; 2],
    noise_factor: [f64; 2],
    most_mesh_bytes: usize,
    objects: Vec<Choice>,
    decoders: Vec<Choice>,
    row_choices: Vec<Choice>,
    readouts: Vec<Choice>,
    faults: Vec<Choice>,
    usual: Usual,
}

/// What a page begins with.
#[derive(Debug, Serialize)]
struct Usual {
    measurements: usize,
    readout: &'static str,
    noise: f64,
    panels: Vec<UsualPanel>,
}

#[derive(Debug, Serialize)]
struct UsualPanel {
    decoder: &'static str,
    rows: &'static str,
}

impl Usual {
    fn of(settings: &Settings) -> Self {
        let panels = settings.panels.iter().map(|panel| UsualPanel {
            decoder: panel.decoder.name,
            rows: panel.rows_name(),
        });
        Self {
            measurements: settings.measurements,
            readout: settings.readout,
            noise: settings.noise,
            panels: panels.collect(),
        }
    }
}

impl Options {
    /// What can be chosen for `skin`, and the `settings` that a page begins with.
    pub(crate) fn of(skin: &SkinLayout, settings: &Settings) -> Self {
        let plain = |&(name, label): &(&'static str, &'static str)| Choice {
            name,
            label: label.to_owned(),
            about: String::new(),
            group: "",
        };
        let objects = pressable().map(|spec| Choice {
            name: spec.name,
            label: spec
                .description
                .split([',', ':'])
                .next()
                .unwrap_or(spec.name)
                .to_owned(),
            about: spec.description.to_owned(),
            group: "",
        });
        let decoders = decoders().map(|spec| Choice {
            name: spec.name,
            label: spec.label.to_owned(),
            about: spec.about.to_owned(),
            group: if PublishedDecode::ALL.iter().any(|decode| decode.name() == spec.name) {
                "Published with the skin"
            } else {
                "Others"
            },
        });
        let designed = designers().map(|designer| Choice {
            name: designer.name,
            label: format!("designed: {}", designer.label),
            about: designer.about.to_owned(),
            group: "",
        });
        let random = Choice {
            name: RANDOM,
            label: "random, as the cells make them".to_owned(),
            about: "every cell's own pseudorandom sequence of signs, different in every window".to_owned(),
            group: "",
        };
        Self {
            rows: skin.rows(),
            cols: skin.cols(),
            pitch_mm: 1e3 * skin.pitch_m(),
            measurements: MEASUREMENTS,
            force_n: FORCE_N,
            noise_factor: NOISE_FACTOR,
            most_mesh_bytes: crate::mesh::MOST_MESH_BYTES,
            objects: objects.collect(),
            decoders: decoders.collect(),
            row_choices: std::iter::once(random).chain(designed).collect(),
            readouts: READOUTS
                .iter()
                .map(|pair| Choice {
                    group: if is_noisy(pair.0) { "noisy" } else { "" },
                    ..plain(pair)
                })
                .collect(),
            faults: FAULTS.iter().map(plain).collect(),
            usual: Usual::of(settings),
        }
    }
}

/// Whether a factor on the noise changes anything.
fn is_noisy(profile: &str) -> bool {
    Profile::named(profile).is_ok_and(|profile| {
        let effects = &profile.compressive;
        NOISES.iter().any(|(effect, _)| effects.contains_key(*effect))
    })
}

/// Effects that are noise, each with the parameter that says how much.
pub(crate) const NOISES: [(&str, &str); 2] = [("contact_noise", "fraction"), ("idle_noise", "sd_v")];

/// Decoders that need to know no object.
fn decoders() -> impl Iterator<Item = &'static DecoderSpec> {
    DECODERS
        .iter()
        .filter(|spec| spec.needs != Needs::Classes && !BLIND.contains(&spec.name))
}

/// Designers of rows of ±1 for images.
fn designers() -> impl Iterator<Item = &'static Designer> {
    DESIGNERS
        .iter()
        .filter(|designer| designer.needs != RowNeeds::Classes && designer.name != RANDOM)
}

/// The decoder with this name.
///
/// # Errors
/// [`LiveError::Unknown`] when there is none.
pub(crate) fn decoder(name: &str) -> Result<&'static DecoderSpec, LiveError> {
    named("decoder", name, || decoders().map(|spec| (spec.name, spec)))
}

/// The rows with this name; `None` for random ones.
///
/// # Errors
/// [`LiveError::Unknown`] when there are none.
pub(crate) fn rows(name: &str) -> Result<Option<&'static Designer>, LiveError> {
    let all = || std::iter::once((RANDOM, None)).chain(designers().map(|designer| (designer.name, Some(designer))));
    named("rows", name, all)
}

/// The name of the readout profile.
///
/// # Errors
/// [`LiveError::Unknown`] when there is none.
pub(crate) fn readout(name: &str) -> Result<&'static str, LiveError> {
    named("profile", name, || PROFILES.iter().map(|(name, _)| (*name, *name)))
}

/// The name of the fault.
///
/// # Errors
/// [`LiveError::Unknown`] when there is none.
pub(crate) fn fault(name: &str) -> Result<&'static str, LiveError> {
    named("fault", name, || FAULTS.iter().map(|(name, _)| (*name, *name)))
}

fn named<T, I>(field: &'static str, name: &str, all: impl Fn() -> I) -> Result<T, LiveError>
where
    I: Iterator<Item = (&'static str, T)>,
{
    all()
        .find(|(known, _)| *known == name)
        .map(|(_, found)| found)
        .ok_or_else(|| {
            let known: Vec<&str> = all().map(|(known, _)| known).collect();
            LiveError::Unknown {
                field,
                name: name.to_owned(),
                known: known.join(", "),
            }
        })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The tables of the page and of the readout have the same names.
    #[test]
    fn every_fault_and_profile_is_offered() {
        let names = |table: &[(&'static str, &str)]| table.iter().map(|(name, _)| *name).collect::<Vec<_>>();
        let known: Vec<&str> = spts_circuit::FAULTS.iter().map(|(name, _)| *name).collect();
        assert_eq!(names(FAULTS), known);
        assert_eq!(names(READOUTS), names(PROFILES));
        assert!(is_noisy("as_built") && !is_noisy("ideal"));
    }

    #[test]
    fn a_name_that_is_not_there_is_refused_with_those_that_are() {
        for (error, facts) in [
            (
                decoder("evidence").map(|_| ()),
                ["`decoder` = \"evidence\"", "amortised"],
            ),
            (
                rows("analog").map(|_| ()),
                ["`rows` = \"analog\"", "random, cosine_signs"],
            ),
            (readout("best").map(|_| ()), ["`profile` = \"best\"", "ideal, as_built"]),
            (fault("lame").map(|_| ()), ["`fault` = \"lame\"", "dead, stuck"]),
        ] {
            let message = error.unwrap_err().to_string();
            assert!(facts.iter().all(|fact| message.contains(fact)), "{message}");
        }
    }
}
