//! Builds a valid specification from what is written.

use super::check::{check_draws, check_faults, check_frames, check_moving, check_name};
use super::template::is_draw;
use super::{
    Choices, NAMED_SPECS, RecordKind, Spec, SpecConfig, SpecError, SplitBy, TRANSDUCER, Template, Timing, chain_config,
    hex, model_of,
};
use sha2::{Digest as _, Sha256};
use spts_circuit::Mode;
use spts_contact::build_contact;
use spts_input::Refusal;
use spts_models::{SkinLayout, explain_toml, in_range, in_section};
use std::path::Path;

/// Most rows of a data set.
const MOST_ROWS: u64 = 1_000_000_000_000;
/// Most rows of a file.
const MOST_SHARD_ROWS: u64 = 1_000_000;
/// Default rows of a file, least and most, and the share of all rows that it is.
const SHARD_ROWS: [u64; 2] = [100, 10_000];
const SHARDS: u64 = 16;
/// Default rows that share a shape or a skin, before they are a whole number of presses.
const SHARED_ROWS: u64 = 100;
/// Largest spec file, bytes.
const MAX_SPEC_BYTES: u64 = 1 << 21;
/// Contact field of a spec that names none: of presses, and of drops.
const DEFAULT_CONTACT: [&str; 2] = ["footprint", "winkler"];

impl Spec {
    /// Reads the specification called `name` in [`NAMED_SPECS`], or in the file `name`, and applies `overrides`.
    ///
    /// # Errors
    /// [`SpecError`] if there is none, or it is not valid.
    pub fn load(name: &str, overrides: &toml::Table) -> Result<Self, SpecError> {
        if let Some((_, text)) = NAMED_SPECS.iter().find(|(known, _)| *known == name) {
            return Self::from_toml(text, overrides, Path::new("."));
        }
        let path = Path::new(name);
        if path.extension().is_none_or(|e| e != "toml") {
            let known: Vec<&str> = NAMED_SPECS.iter().map(|(name, _)| *name).collect();
            return Err(SpecError::Choice(format!(
                "{name}: is neither a spec file, which ends in `.toml`, nor one of {}",
                known.join(", ")
            )));
        }
        let text = spts_input::read_text(path, MAX_SPEC_BYTES).map_err(|source| SpecError::Unreadable {
            path: path.to_owned(),
            source,
        })?;
        let folder = path.parent().unwrap_or(Path::new("."));
        Self::from_toml(&text, overrides, folder).map_err(|error| match error {
            SpecError::Unreadable { .. } | SpecError::Mesh(_) => error,
            error => SpecError::Choice(format!("{name}: {error}")),
        })
    }

    /// Reads a specification from `text` and applies `overrides`. Files that it names are looked up in `folder`. A
    /// table in `overrides` replaces only the keys that it has; a distribution replaces the whole value.
    ///
    /// # Errors
    /// [`SpecError`] if the specification is not valid.
    pub fn from_toml(text: &str, overrides: &toml::Table, folder: &Path) -> Result<Self, SpecError> {
        let mut table: toml::Table =
            toml::from_str(text).map_err(|e| SpecError::Syntax(e.to_string().trim_end().replace('\n', "; ")))?;
        merge(&mut table, overrides);
        if let Some(toml::Value::Table(transducer)) = table.get_mut(TRANSDUCER) {
            spts::chain::read_gains(transducer, folder)?;
        }
        let written = table.to_string();
        let config: SpecConfig = table.try_into().map_err(|e| SpecError::Syntax(explain_toml(&e)))?;
        Self::new(config, written, folder)
    }

    fn new(mut config: SpecConfig, text: String, folder: &Path) -> Result<Self, SpecError> {
        check_name(&config.name)?;
        let rows = config.rows as f64;
        in_range("rows", rows, (1..=MOST_ROWS).contains(&config.rows), "[1, 10^12]")?;
        in_range(
            "seed",
            config.seed as f64,
            i64::try_from(config.seed).is_ok(),
            "[0, 2^63)",
        )?;
        let timing = Timing::of(&config)?;
        let windows = timing.windows;
        let s = &config.skin;
        let electrode_m = s
            .electrode_m
            .unwrap_or_else(|| SkinLayout::usual_electrode_m(s.pitch_m));
        let skin = SkinLayout::new(s.rows, s.cols, s.pitch_m, electrode_m).map_err(in_skin)?;
        let [of_presses, of_drops] = DEFAULT_CONTACT;
        let drops = timing.what == RecordKind::Drop;
        let default = if drops { of_drops } else { of_presses };
        let (model, parameters) = model_of(&config.contact, "contact", default)?;
        let balances = build_contact(&model, parameters.clone(), &skin)?
            .quasi_static()
            .is_some();
        if drops && balances {
            return Err(SpecError::Choice(format!(
                "`contact.model` = \"{model}\" finds balances under a force, and a falling ball has none; valid for drops: \
                 \"winkler\", \"layer\", \"half_space\""
            )));
        }
        let moving = timing.what != RecordKind::Hold || !balances;
        let choices = Choices::new(&config.object, config.pose.about, folder)?;
        let transducer = Template::new(config.transducer.clone());
        let by_default = config
            .rows
            .div_ceil(SHARDS)
            .clamp(SHARD_ROWS[0], SHARD_ROWS[1])
            .next_multiple_of(windows);
        let rows_per_shard = config.rows_per_shard.unwrap_or(by_default);
        let valid = (1..=MOST_SHARD_ROWS).contains(&rows_per_shard);
        in_range("rows_per_shard", rows_per_shard as f64, valid, "[1, 10^6]")?;
        let shared = |rows: Option<u64>| rows.unwrap_or_else(|| SHARED_ROWS.next_multiple_of(windows));
        let rows_per_shape = shared(config.object.rows_per_shape);
        let rows_per_skin = shared(config.skin.rows_per_skin);
        for (field, count) in [
            ("rows_per_shard", rows_per_shard),
            ("object.rows_per_shape", rows_per_shape),
            ("skin.rows_per_skin", rows_per_skin),
        ] {
            if count == 0 || count % windows != 0 {
                return Err(SpecError::Choice(format!(
                    "`{field}` = {count}; valid: whole numbers of presses, which have `record.windows` = {windows} rows"
                )));
            }
        }
        check_draws(&config, &skin, &timing, moving)?;
        if moving {
            check_moving(&config)?;
        }
        check_faults(&config)?;
        take_turns(&mut config);
        // a chain shows what transducer, readout and weights are refused for
        let [least, most] = transducer.ends(TRANSDUCER)?;
        let chain_of = |parameters| {
            let chain = chain_config(&config, &parameters, &[])?;
            spts::Chain::new(&chain, &skin, 0, folder).map_err(SpecError::chain)
        };
        chain_of(most)?;
        let chain = chain_of(least)?;
        let timing = timing.at_rate(chain.sample_rate_hz())?;
        if moving {
            check_frames(&config, &skin, &timing)?;
        }
        let wire = chain.readout(Mode::Compressive, 0)?;
        let mut identity = Sha256::new();
        identity.update(text.as_bytes());
        choices.digest(&mut identity);
        let files = [
            chain.profile_file().map(|f| &f.text),
            chain.rows_file().map(|f| &f.text),
        ];
        for text in files.into_iter().flatten() {
            identity.update(text.as_bytes());
        }
        let spec = Self {
            skin,
            contact: (model, parameters),
            choices,
            transducer,
            recording: wire.info().clone(),
            timing,
            moving,
            rows_per_shard,
            rows_per_shape,
            rows_per_skin,
            folder: folder.to_owned(),
            text,
            identity: hex(&identity.finalize()),
            config,
        };
        if spec.split_by() == SplitBy::Object && !spec.choices.are_procedural() && spec.most_objects() > 1 {
            return Err(SpecError::Choice(
                "`split.by` = \"object\" needs `object.count` = 1 here: of several objects at once, each is in every split"
                    .to_owned(),
            ));
        }
        Ok(spec)
    }
}

impl SpecError {
    /// The error of a chain, with the section of a spec in place of a scene's.
    fn chain(error: Refusal) -> Self {
        let message = error.to_string();
        let of_spec = message
            .replace("`rows.", "`weights.")
            .replace("`transducer_parameters", "`transducer");
        if of_spec == message {
            Self::Value(error)
        } else {
            Self::Choice(of_spec)
        }
    }
}

/// Puts the values of `from` in place of those of `into`, section by section.
fn merge(into: &mut toml::Table, from: &toml::Table) {
    for (key, value) in from {
        match (into.get_mut(key), value) {
            (Some(toml::Value::Table(section)), toml::Value::Table(with)) if !is_draw(section) && !is_draw(with) => {
                merge(section, with);
            }
            _ => {
                into.insert(key.clone(), value.clone());
            }
        }
    }
}

fn in_skin(error: Refusal) -> Refusal {
    Refusal::new(in_section("skin", &error.to_string()))
}

/// Gives the grids of presses and those of skins their turns.
fn take_turns(config: &mut SpecConfig) {
    let (pose, press) = (&mut config.pose, &mut config.press);
    let mut turn = 1;
    for draw in [
        &mut config.object.count,
        &mut pose.x_share,
        &mut pose.y_share,
        &mut pose.x_m,
        &mut pose.y_m,
        &mut pose.rotation_deg,
        &mut pose.tilt_x_deg,
        &mut pose.tilt_y_deg,
        &mut press.force_n,
        &mut press.hold_s,
        &mut press.rise_s,
        &mut press.fall_s,
        &mut config.skin.presses_before,
    ] {
        draw.take_turn(&mut turn);
    }
    if let Some(stiffness) = &mut press.stiffness_pa_per_m {
        stiffness.take_turn(&mut turn);
    }
    if let Some(drop) = &mut config.drop {
        for draw in [
            &mut drop.height_m,
            &mut drop.mass_kg,
            &mut drop.radius_m,
            &mut drop.stiffness_pa_per_m,
        ] {
            draw.take_turn(&mut turn);
        }
    }
    let mut turn = 1;
    config.faults.count.take_turn(&mut turn);
    if let Some(seed) = &mut config.skin.seed {
        seed.take_turn(&mut turn);
    }
}
