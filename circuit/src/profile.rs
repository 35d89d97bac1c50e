//! Named parameter sets of the whole readout.

use crate::converter::Converter;
use crate::effect::{Effect, EffectSession, FaultConfig};
use crate::effects::{build_chain, converter, rail_v};
use crate::faults::build_faults;
use crate::weights::{LevelSource, Mode, Patterns, Seeding, WeightMode, Weights, not_in_mode};
use crate::wires::{WireConfig, Wires};
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_models::{SkinLayout, parsed_text, within};

/// Every profile by name, as TOML. Each parameter has its source beside it.
pub const PROFILES: &[(&str, &str)] = &[
    ("ideal", include_str!("../profiles/ideal.toml")),
    ("as_built", include_str!("../profiles/as_built.toml")),
    ("as_published", include_str!("../profiles/as_published.toml")),
    ("as_designed", include_str!("../profiles/as_designed.toml")),
];

/// Weights of the compressive mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CompressiveWeights {
    /// ±1.
    Binary,
    /// Eight bits.
    Analog,
}

/// Parameters of the readout. Each mode lists its effects by name; an effect that is not listed does not act.
///
/// ```
/// use spts_circuit::{Mode, Profile};
///
/// let text = "weights = \"binary\"\nsample_rate_hz = 64300\ndrive_v = 4.3\nfeedback_ohm = 1000\n\
///             [compressive.idle_noise]\nsd_v = 0.02\n";
/// let profile = Profile::from_toml(text)?;
/// profile.validate(100)?;
/// assert!((profile.volts_per_siemens() - 4300.0).abs() < 1e-9);
/// assert_eq!(profile.weights(Mode::Compressive, 100)?.taxels(), 100);
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    /// Weights of the compressive mode.
    pub weights: CompressiveWeights,
    /// Rule that seeds the cells. Default: that of [`Seeding::usual`] for the skin, and the addresses where none is
    /// known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seeding: Option<Seeding>,
    /// Seeds of the cells, one a taxel, in place of the rule. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seeds: Option<Vec<u32>>,
    /// Codes that the cells repeat, in place of a generator's; as a text, one row a line. Default: none. A raster scan
    /// ignores patterns and seeds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub patterns: Option<Patterns>,
    /// Clock edges a second, Hz. Range [1, 1e9]. At each of them every wire is measured once.
    pub sample_rate_hz: f64,
    /// Vd: drive voltage of a taxel at level 1, V. Range [1e-3, 1e3].
    pub drive_v: f64,
    /// Rf: feedback resistance of the summing amplifier, Ω. Range [1e-3, 1e9]. Only the product Rf·Vd acts. The value
    /// is for electrodes of 10 mm × 10 mm; see `feedback_scales` for other skins.
    pub feedback_ohm: f64,
    /// Whether Rf is divided by the electrodes' relative area, so that a taxel under the same pressure gives the same
    /// voltage whatever its size. `false` uses Rf as written on any skin. Default true. Rf does not depend on the
    /// number of taxels, because the necessary range grows with the number of pressed ones.
    #[serde(default = "scales")]
    pub feedback_scales: bool,
    /// Wires of the skin, all with the values above; see [`WireConfig`]. Default: none said, which is one wire.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub wires: Vec<WireConfig>,
    /// Faulty cells, in both modes. Default: none.
    #[serde(default)]
    pub faults: Vec<FaultConfig>,
    /// Effects of the compressive mode: name → parameters.
    #[serde(default)]
    pub compressive: toml::Table,
    /// Effects of the raster mode: name → parameters.
    #[serde(default)]
    pub raster: toml::Table,
}

/// Default of [`Profile::feedback_scales`].
fn scales() -> bool {
    true
}

impl Profile {
    /// The profile called `name` in [`PROFILES`].
    ///
    /// # Errors
    /// [`Refusal`] if there is none.
    pub fn named(name: &str) -> Result<Self, Refusal> {
        let Some((_, text)) = PROFILES.iter().find(|(known, _)| *known == name) else {
            let known: Vec<&str> = PROFILES.iter().map(|(known, _)| *known).collect();
            return Err(Refusal::new(format!("`{name}` is not a readout profile; known: {}", known.join(", "))));
        };
        Self::from_toml(text)
    }

    /// Reads a profile from TOML text. [`Profile::validate`] checks its values; building a readout checks them again.
    ///
    /// # Errors
    /// [`Refusal`] for text that is not TOML, an unknown key, or a value of the wrong type.
    pub fn from_toml(text: &str) -> Result<Self, Refusal> {
        parsed_text(text)
    }

    /// The profile with the usual rule for a skin of this `layout`, if it says nothing of the seeds.
    pub fn seeded(mut self, layout: &SkinLayout) -> Self {
        if self.seeds.is_none() && self.patterns.is_none() {
            self.seeding.get_or_insert(Seeding::usual(layout));
        }
        self
    }

    /// The profile as used for a skin with this `layout`: Rf is scaled as [`Profile::feedback_scales`] says, and
    /// `feedback_scales` of the result is off. At 10 mm nothing changes, to the bit.
    ///
    /// # Errors
    /// [`Refusal`] if the scaled Rf is outside [1e-3, 1e9] Ω, or the wires are not those of such a skin.
    pub fn on(&self, layout: &SkinLayout) -> Result<Self, Refusal> {
        Wires::new(&self.wires, layout)?;
        let scale = if self.feedback_scales { layout.relative_area() } else { 1.0 };
        let feedback_ohm = self.feedback_ohm / scale;
        let field = "feedback_ohm / (electrode_m / 10 mm)²";
        within(field, feedback_ohm, 1e-3, 1e9, "[1e-3, 1e9]")?;
        Ok(Self { feedback_ohm, feedback_scales: false, ..self.clone() })
    }

    /// Checks every value by building the effects of both modes once, for a skin of `taxels` taxels with electrodes of
    /// 10 mm × 10 mm.
    ///
    /// # Errors
    /// [`Refusal`] that names the value and its range.
    pub fn validate(&self, taxels: u32) -> Result<(), Refusal> {
        within("sample_rate_hz", self.sample_rate_hz, 1.0, 1e9, "[1, 1e9]")?;
        within("drive_v", self.drive_v, 1e-3, 1e3, "[1e-3, 1e3]")?;
        within("feedback_ohm", self.feedback_ohm, 1e-3, 1e9, "[1e-3, 1e9]")?;
        for mode in [Mode::Raster, Mode::Compressive] {
            let session = EffectSession {
                feedback_ohm: self.feedback_ohm,
                sample_rate_hz: self.sample_rate_hz,
                cells_apart: true,
                ..EffectSession::of(0, self.weights(mode, taxels)?)
            };
            self.effects(mode, &session)?;
        }
        Ok(())
    }

    /// The faults and then the effects of `mode`, in signal order.
    ///
    /// # Errors
    /// [`Refusal`] for an unknown effect or fault, or parameters that it refuses.
    pub fn effects(&self, mode: Mode, session: &EffectSession) -> Result<Vec<Box<dyn Effect>>, Refusal> {
        let mut effects = Vec::new();
        if !self.faults.is_empty() {
            effects.push(build_faults(&self.faults, session)?);
        }
        effects.extend(build_chain(self.chain(mode), session)?);
        Ok(effects)
    }

    /// Rf·Vd for electrodes of 10 mm × 10 mm, V/S. For another skin, call it on the result of [`Profile::on`].
    pub fn volts_per_siemens(&self) -> f64 {
        self.feedback_ohm * self.drive_v
    }

    /// The weights of `taxels` taxels in `mode`, as if on one wire.
    ///
    /// # Errors
    /// [`Refusal`] if `seeds` or `patterns` are not valid or have another number of taxels, or if more
    /// than one of `seeding = "mixed"`, `seeds` and `patterns` is given.
    pub fn weights(&self, mode: Mode, taxels: u32) -> Result<Weights, Refusal> {
        let seeding = self.seeding.unwrap_or_default();
        let weight_mode = match (mode, self.weights) {
            (Mode::Raster, _) => return Ok(Weights::new(WeightMode::Raster, seeding, taxels)),
            (Mode::Compressive, CompressiveWeights::Binary) => WeightMode::Binary,
            (Mode::Compressive, CompressiveWeights::Analog) => WeightMode::Analog,
        };
        // a rule that is not the default one contradicts a list
        let ruled = seeding == Seeding::Mixed || (self.seeds.is_none() && self.patterns.is_none());
        let rule = (ruled.then_some(seeding), "`seeding` = \"mixed\"");
        Weights::from_one(weight_mode, Some(taxels), rule, self.seeds.as_deref(), self.patterns.as_ref())
    }

    /// The profile with `weights` in its compressive mode and with their wires, replacing earlier ones.
    ///
    /// # Errors
    /// [`Refusal`] for raster weights.
    pub fn with_weights(&self, weights: &Weights) -> Result<Self, Refusal> {
        let mode = match weights.mode() {
            WeightMode::Binary => CompressiveWeights::Binary,
            WeightMode::Analog => CompressiveWeights::Analog,
            mode @ WeightMode::Raster => return Err(not_in_mode("weights", mode)),
        };
        let (seeding, seeds, patterns) = match weights.source() {
            LevelSource::Seeding(seeding) => (Some(*seeding), None, None),
            LevelSource::Seeds(seeds) => (None, Some(seeds.to_vec()), None),
            LevelSource::Patterns(patterns) => (None, None, Some(Patterns::clone(patterns))),
        };
        let wires = weights.wires().map_or_else(Vec::new, Wires::entries);
        Ok(Self { weights: mode, seeding, seeds, patterns, wires, ..self.clone() })
    }

    /// Scale of the converter of `mode`; `None` if the profile has no converter in this mode.
    ///
    /// # Errors
    /// [`Refusal`] for parameters that the converter refuses.
    pub fn converter(&self, mode: Mode) -> Result<Option<Converter>, Refusal> {
        converter(self.chain(mode), mode)
    }

    /// Largest output of the amplifier in `mode`, V: the smaller one of the limit of `rails` and the rail of
    /// `amplifier`; `None` without either effect.
    ///
    /// # Errors
    /// [`Refusal`] for parameters that an effect refuses.
    pub fn rail_v(&self, mode: Mode) -> Result<Option<f64>, Refusal> {
        rail_v(self.chain(mode), mode)
    }

    /// Effects of `mode` by name.
    fn chain(&self, mode: Mode) -> &toml::Table {
        match mode {
            Mode::Raster => &self.raster,
            Mode::Compressive => &self.compressive,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As it comes, and with everything that a skin adds.
    #[test]
    fn text_is_read_back() {
        let fault = toml::from_str("name = \"stuck\"\ntaxel = 3\nlevel = 0.1").unwrap();
        for (name, _) in PROFILES {
            let plain = Profile::named(name).unwrap();
            let seeds = Profile { seeds: Some(vec![1, 2]), faults: vec![FaultConfig::clone(&fault)], ..plain.clone() };
            let patterns = Some(Patterns::new(2, vec![0, 255, 255, 0, 0, 0]).unwrap());
            for profile in [Profile { patterns, ..plain.clone() }, seeds.on(&SkinLayout::default()).unwrap(), plain] {
                let text = toml::to_string(&profile).unwrap();
                assert_eq!(Profile::from_toml(&text).unwrap(), profile, "{text}");
            }
        }
    }

    #[test]
    fn a_text_of_signs_is_a_pattern() {
        let (_, ideal) = PROFILES[0];
        let profile = Profile::from_toml(&format!("patterns = \"\"\"\n+-+\n--+\n\"\"\"\n{ideal}")).unwrap();
        assert_eq!(profile.weights(Mode::Compressive, 3).unwrap().patterns().map(Patterns::period), Some(2));
        assert!(profile.weights(Mode::Compressive, 4).is_err());
        assert!(Profile::from_toml(&format!("patterns = \"+x\"\n{ideal}")).unwrap_err().to_string().contains("+x"));
    }
}
