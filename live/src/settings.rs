//! What a page may set, what it is offered, and what is set.

use crate::object::unknown;
use serde::Serialize;
use spts::Refusal;
use spts_circuit::{PROFILES, Profile};
use spts_contact::objects::pressable;
use spts_eval::decoders::{DECODERS, DecoderSpec, Needs, PUBLISHED_DECODES, auto};
use spts_models::{SkinLayout, in_range, within};
use spts_recon::rows::{DESIGNERS, Designer, RowNeeds};
use std::collections::BTreeMap;

/// Where and how hard is pressed.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Press {
    /// Place on the skin, m.
    pub(crate) at_m: [f64; 2],
    /// Force, N.
    pub(crate) force_n: f64,
}

impl Press {
    pub(crate) fn new(skin: &SkinLayout, x_mm: f64, y_mm: f64, force_n: f64) -> Result<Self, Refusal> {
        let [width_m, height_m] = skin.extent_m();
        for (field, value, extent_m) in [("x_mm", x_mm, width_m), ("y_mm", y_mm, height_m)] {
            in_range(field, value, value.abs() <= 500.0 * extent_m, "the skin")?;
        }
        within("force_n", force_n, FORCE_N[0], FORCE_N[1], "[0, 200] N")?;
        Ok(Self { at_m: [1e-3 * x_mm, 1e-3 * y_mm], force_n })
    }
}

/// Decoder and rows of one of the two images.
#[derive(Clone, Copy)]
pub(crate) struct Panel {
    pub(crate) decoder: &'static DecoderSpec,
    /// Who designs the rows; `None` for random ones.
    pub(crate) rows: Option<&'static Designer>,
}

impl Panel {
    pub(crate) fn named(decoder: &str, rows: &str) -> Result<Self, Refusal> {
        Ok(Self { decoder: decoder_of(decoder)?, rows: rows_of(rows)? })
    }

    /// Name of the rows.
    pub(crate) fn rows_name(&self) -> &'static str {
        self.rows.map_or(RANDOM, |designer| designer.name)
    }
}

/// Everything that the wire depends on, and the decoders behind it.
#[derive(Clone)]
pub(crate) struct Settings {
    /// M.
    pub(crate) measurements: usize,
    pub(crate) panels: [Panel; 2],
    pub(crate) readout: &'static str,
    pub(crate) noise: f64,
    /// Fault of every broken cell, by its taxel.
    pub(crate) faults: BTreeMap<u32, &'static str>,
}

impl Settings {
    /// What a page begins with: the published pursuit on random rows beside the decoder that [`auto`] names on designed
    /// ones.
    pub(crate) fn usual() -> Result<Self, Refusal> {
        let skin = SkinLayout::default();
        let best = auto([skin.rows(), skin.cols()], false).name;
        Ok(Self {
            measurements: 20,
            panels: [Panel::named("matched", RANDOM)?, Panel::named(best, "cosine_signs")?],
            readout: spts::chain::DEFAULT_READOUT,
            noise: 1.0,
            faults: BTreeMap::new(),
        })
    }

    pub(crate) fn measure(&mut self, count: usize) -> Result<(), Refusal> {
        let [least, most] = MEASUREMENTS;
        in_range("count", count as f64, (least..=most).contains(&count), "[5, 100]")?;
        self.measurements = count;
        Ok(())
    }

    pub(crate) fn read_out(&mut self, profile: &str, noise: f64) -> Result<(), Refusal> {
        within("noise", noise, NOISE_FACTOR[0], NOISE_FACTOR[1], "[0, 10]")?;
        (self.readout, self.noise) = (readout(profile)?, noise);
        Ok(())
    }

    pub(crate) fn show(&mut self, panel: usize, decoder: &str, rows: &str) -> Result<(), Refusal> {
        let chosen = Panel::named(decoder, rows)?;
        let last = self.panels.len() - 1;
        in_range("panel", panel as f64, panel <= last, "[0, 1]")?;
        self.panels[panel] = chosen;
        Ok(())
    }

    pub(crate) fn fault(&mut self, taxel: u32, name: Option<&str>, taxels: usize) -> Result<(), Refusal> {
        in_range("taxel", f64::from(taxel), (taxel as usize) < taxels, "the taxels of the skin")?;
        if let Some(name) = name {
            self.faults.insert(taxel, fault(name)?);
        } else {
            self.faults.remove(&taxel);
        }
        Ok(())
    }
}

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
        let panels =
            settings.panels.iter().map(|panel| UsualPanel { decoder: panel.decoder.name, rows: panel.rows_name() });
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
            label: short(label, &[": "]),
            about: label.to_owned(),
            group: "",
        };
        let objects = pressable().map(|spec| Choice {
            name: spec.name,
            label: short(spec.description, &[",", ":", " with ", " standing "]),
            about: spec.description.to_owned(),
            group: "",
        });
        let decoders = decoders().map(|spec| Choice {
            name: spec.name,
            label: spec.label.to_owned(),
            about: spec.about.to_owned(),
            group: if PUBLISHED_DECODES.contains(&spec.name) { "Published with the skin" } else { "Others" },
        });
        let designed = designers().map(|designer| Choice {
            name: designer.name,
            label: format!("designed: {}", designer.label),
            about: designer.about.to_owned(),
            group: "",
        });
        let random = Choice {
            name: RANDOM,
            label: "random".to_owned(),
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
            most_mesh_bytes: crate::object::MOST_MESH_BYTES,
            objects: objects.collect(),
            decoders: decoders.collect(),
            row_choices: std::iter::once(random).chain(designed).collect(),
            readouts: READOUTS
                .iter()
                .map(|pair| Choice { group: if is_noisy(pair.0) { "noisy" } else { "" }, ..plain(pair) })
                .collect(),
            faults: FAULTS.iter().map(plain).collect(),
            usual: Usual::of(settings),
        }
    }
}

/// What of `text` a narrow list shows: what stands before the first of `ends`.
fn short(text: &str, ends: &[&str]) -> String {
    let end = ends.iter().filter_map(|end| text.find(end)).min().unwrap_or(text.len());
    text[..end].to_owned()
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
    DECODERS.iter().filter(|spec| spec.needs != Needs::Classes && !BLIND.contains(&spec.name))
}

/// Designers of rows of ±1 for images.
fn designers() -> impl Iterator<Item = &'static Designer> {
    DESIGNERS.iter().filter(|designer| designer.needs != RowNeeds::Classes && designer.name != RANDOM)
}

/// The decoder with this name.
///
/// # Errors
/// [`Refusal`] when there is none.
pub(crate) fn decoder_of(name: &str) -> Result<&'static DecoderSpec, Refusal> {
    named("decoder", name, || decoders().map(|spec| (spec.name, spec)))
}

/// The rows with this name; `None` for random ones.
///
/// # Errors
/// [`Refusal`] when there are none.
pub(crate) fn rows_of(name: &str) -> Result<Option<&'static Designer>, Refusal> {
    let all = || std::iter::once((RANDOM, None)).chain(designers().map(|designer| (designer.name, Some(designer))));
    named("rows", name, all)
}

/// The name of the readout profile.
///
/// # Errors
/// [`Refusal`] when there is none.
pub(crate) fn readout(name: &str) -> Result<&'static str, Refusal> {
    named("profile", name, || PROFILES.iter().map(|(name, _)| (*name, *name)))
}

/// The name of the fault.
///
/// # Errors
/// [`Refusal`] when there is none.
pub(crate) fn fault(name: &str) -> Result<&'static str, Refusal> {
    named("fault", name, || FAULTS.iter().map(|(name, _)| (*name, *name)))
}

fn named<T, I>(field: &'static str, name: &str, all: impl Fn() -> I) -> Result<T, Refusal>
where
    I: Iterator<Item = (&'static str, T)>,
{
    all().find(|(known, _)| *known == name).map(|(_, found)| found).ok_or_else(|| {
        let known: Vec<&str> = all().map(|(known, _)| known).collect();
        unknown(field, name, &known)
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
            (decoder_of("evidence").map(|_| ()), ["`decoder` = \"evidence\"", "amortised"]),
            (rows_of("analog").map(|_| ()), ["`rows` = \"analog\"", "random, cosine_signs"]),
            (readout("best").map(|_| ()), ["`profile` = \"best\"", "ideal, as_built"]),
            (fault("lame").map(|_| ()), ["`fault` = \"lame\"", "dead, stuck"]),
        ] {
            let message = error.unwrap_err().to_string();
            assert!(facts.iter().all(|fact| message.contains(fact)), "{message}");
        }
    }
}
