//! Specifications of data sets.

mod check;
mod config;
mod draw;
mod frames;
mod objects;

pub(crate) use check::Timing;
pub use config::{
    DropConfig, FaultsConfig, Label, ObjectConfig, ObjectSource, PoseConfig, PoseOrigin, PressConfig, RecordConfig,
    RecordKind, SkinConfig, SpecConfig, SplitBy, SplitConfig,
};
pub use draw::Draw;
pub(crate) use draw::whole;
pub(crate) use frames::FramePress;
pub(crate) use objects::{Choice, Choices, SpecError};

use check::{check_draws, check_faults, check_frames, check_lasts, check_moving, check_name};
use draw::{Template, is_draw};
use frames::FrameSource;
use sha2::{Digest as _, Sha256};
use spts::chain::ChainConfig;
use spts::data::FrameLaw;
use spts::{Chain, Refusal};
use spts_circuit::{Mode, RecordingInfo};
use spts_contact::build_contact;
use spts_models::{SkinLayout, Streams, in_range, in_section, parsed, parsed_text};
use std::path::{Path, PathBuf};

/// The specifications that ship with the library, by name, as TOML.
pub const NAMED_SPECS: &[(&str, &str)] = &[
    ("presses-17", include_str!("../specs/presses-17.toml")),
    ("random-shapes", include_str!("../specs/random-shapes.toml")),
    ("courses", include_str!("../specs/courses.toml")),
    ("drops", include_str!("../specs/drops.toml")),
    ("unseen-shapes", include_str!("../specs/unseen-shapes.toml")),
    ("skins", include_str!("../specs/skins.toml")),
    ("faults", include_str!("../specs/faults.toml")),
    ("large-skin", include_str!("../specs/large-skin.toml")),
];

/// Most rows of a data set.
const MOST_ROWS: u64 = 1_000_000_000_000;
/// Pressure that the largest value of frames without a unit is taken for, Pa.
const PEAK_PA: f64 = 30e3;
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
/// Table of a spec with the transducer's parameters.
const TRANSDUCER: &str = "transducer";

/// A valid specification: every field is within its range, and all files that it names exist.
///
/// ```
/// use spts_dataset::Spec;
///
/// let spec = Spec::load("random-shapes", &toml::toml! { rows = 5000 })?;
/// assert_eq!((spec.config().rows, spec.skin().taxels()), (5000, 100));
/// let error = Spec::load("random-shapes", &toml::toml! { rows = 0 }).err().expect("no rows");
/// assert!(error.to_string().contains("`rows` = 0 is outside"));
/// # Ok::<(), spts::Refusal>(())
/// ```
#[derive(Debug, Clone)]
pub struct Spec {
    config: SpecConfig,
    /// The text that was read, with overrides applied, in normal order.
    text: String,
    skin: SkinLayout,
    contact: (String, toml::Table),
    choices: Choices,
    transducer: Template,
    recording: RecordingInfo,
    timing: Timing,
    /// Whether contacts are simulated in time.
    moving: bool,
    /// Frames: whether they are pressures, and how they become conductances.
    frames: Option<(bool, FrameLaw)>,
    rows_per_shard: u64,
    rows_per_shape: u64,
    rows_per_skin: u64,
    /// Folder to which paths are relative.
    folder: PathBuf,
    identity: String,
}

impl Spec {
    /// Reads the specification called `name` in [`NAMED_SPECS`], or in the file `name`, and applies `overrides`.
    ///
    /// # Errors
    /// [`Refusal`] if there is none, or it is not valid.
    pub fn load(name: &str, overrides: &toml::Table) -> Result<Self, Refusal> {
        if let Some((_, text)) = NAMED_SPECS.iter().find(|(known, _)| *known == name) {
            return Self::from_toml(text, overrides, Path::new("."));
        }
        let path = Path::new(name);
        if path.extension().is_none_or(|e| e != "toml") {
            let known: Vec<&str> = NAMED_SPECS.iter().map(|(name, _)| *name).collect();
            let known = known.join(", ");
            let problem = format!("is neither a spec file, which ends in `.toml`, nor one of {known}");
            return Err(Refusal::new(problem).at(name));
        }
        let text = spts_input::read_text(path, MAX_SPEC_BYTES);
        let text = text.map_err(|e| Refusal::from(e).at(path.display()))?;
        let folder = path.parent().unwrap_or(Path::new("."));
        Self::read(&text, overrides, folder).map_err(|error| match error {
            SpecError::Mesh(refusal) => refusal,
            SpecError::Folder(refusal) | SpecError::Refused(refusal) => refusal.at(name),
        })
    }

    /// Reads a specification from `text` and applies `overrides`. Files that it names are looked up in `folder`. A
    /// table in `overrides` replaces only the keys that it has; a distribution replaces the whole value.
    ///
    /// # Errors
    /// [`Refusal`] if the specification is not valid.
    pub fn from_toml(text: &str, overrides: &toml::Table, folder: &Path) -> Result<Self, Refusal> {
        Ok(Self::read(text, overrides, folder)?)
    }

    /// The same, with the files that cannot be read told apart.
    pub(crate) fn read(text: &str, overrides: &toml::Table, folder: &Path) -> Result<Self, SpecError> {
        let mut table: toml::Table = parsed_text(text)?;
        merge(&mut table, overrides);
        if let Some(toml::Value::Table(transducer)) = table.get_mut(TRANSDUCER) {
            spts::chain::read_gains(transducer, folder)?;
        }
        let frames = FrameSource::open(&table, folder)?;
        if let Some(frames) = &frames {
            frames.fill(&mut table);
        }
        let written = table.to_string();
        Self::new(parsed(table)?, written, folder, frames.as_ref())
    }

    fn new(
        mut config: SpecConfig,
        text: String,
        folder: &Path,
        frames: Option<&FrameSource>,
    ) -> Result<Self, SpecError> {
        check_name(&config.name)?;
        let lasts_s = frames.map(FrameSource::lasts_s);
        let timing = Timing::of(&config, lasts_s.map(|[_, frames_s]| frames_s))?;
        let windows = timing.windows;
        let mut choices = Choices::new(&config.object, config.pose.about, folder, frames)?;
        if let Some(frames) = frames {
            frames.check(&config)?;
            if !frames.rows_given {
                config.rows = choices.count() * windows;
            }
        }
        let rows = (1..=MOST_ROWS).contains(&config.rows);
        in_range("rows", config.rows as f64, rows, "[1, 10^12]")?;
        in_range("seed", config.seed as f64, i64::try_from(config.seed).is_ok(), "[0, 2^63)")?;
        let s = &config.skin;
        let electrode_m = s.electrode_m.unwrap_or(SkinLayout::usual_electrode_m(s.pitch_m));
        let skin = SkinLayout::new(s.rows, s.cols, s.pitch_m, electrode_m);
        let skin = skin.map_err(|e| Refusal::new(in_section("skin", &e.to_string())))?;
        let drops = timing.what == RecordKind::Drop;
        let (model, parameters) = model_of(&config.contact, "contact", DEFAULT_CONTACT[usize::from(drops)])?;
        let mut field = build_contact(&model, parameters.clone(), &skin)?;
        let balances = field.quasi_static().is_some();
        if drops && balances {
            let problem = format!(
                "`contact.model` = \"{model}\" finds balances under a force, and a falling ball has none; valid for drops: \
                 \"winkler\", \"layer\", \"half_space\""
            );
            return Err(Refusal::new(problem).into());
        }
        let moving = timing.what != RecordKind::Hold || !balances || frames.is_some();
        let transducer = Template::new(config.transducer.clone());
        let by_default = config.rows.div_ceil(SHARDS).clamp(SHARD_ROWS[0], SHARD_ROWS[1]);
        let by_default = by_default.next_multiple_of(windows);
        let rows_per_shard = config.rows_per_shard.unwrap_or(by_default);
        let valid = (1..=MOST_SHARD_ROWS).contains(&rows_per_shard);
        in_range("rows_per_shard", rows_per_shard as f64, valid, "[1, 10^6]")?;
        let shared = |rows: Option<u64>| rows.unwrap_or_else(|| SHARED_ROWS.next_multiple_of(windows));
        let rows_per_shape = shared(config.object.rows_per_shape.or(frames.map(|_| windows)));
        let rows_per_skin = shared(config.skin.rows_per_skin);
        for (field, count) in [
            ("rows_per_shard", rows_per_shard),
            ("object.rows_per_shape", rows_per_shape),
            ("skin.rows_per_skin", rows_per_skin),
        ] {
            if count == 0 || count % windows != 0 {
                let valid = format!("whole numbers of presses, which have `record.windows` = {windows} rows");
                return Err(Refusal::new(format!("`{field}` = {count}; valid: {valid}")).into());
            }
        }
        check_draws(&config, &skin, &timing, moving)?;
        if moving && frames.is_none() {
            check_moving(&config)?;
        }
        check_faults(&config)?;
        take_turns(&mut config);
        // a chain shows what transducer, readout and weights are refused for
        let [least, most] = transducer.ends(TRANSDUCER)?;
        let chain_of = |parameters| {
            let chain = chain_config(&config, &parameters, &[])?;
            Chain::new(&chain, &skin, 0, folder).map_err(|error| {
                // the sections of a spec in place of a scene's
                let message = error.to_string().replace("`rows.", "`weights.");
                Refusal::new(message.replace("`transducer_parameters", "`transducer"))
            })
        };
        chain_of(most)?;
        let chain = chain_of(least)?;
        let timing = timing.at_rate(chain.sample_rate_hz())?;
        match lasts_s {
            Some(lasts_s) => check_lasts(&timing, lasts_s)?,
            None if moving => check_frames(&config, &skin, &timing)?,
            None => {}
        }
        let law =
            frames.map(|frames| frames.law(&chain, config.object.peak_pa.unwrap_or(PEAK_PA)).map(|l| (frames, l)));
        let law = law.transpose()?.map(|(frames, (law, said))| {
            choices.notes.extend(said);
            (frames.are_pressures(), law)
        });
        let wire = chain.readout(Mode::Compressive, 0)?;
        let mut identity = Sha256::new();
        identity.update(text.as_bytes());
        choices.digest(&mut identity);
        if let Some(frames) = frames {
            frames.digest(&mut identity);
        }
        let files = [chain.profile_file().map(|f| &f.text), chain.rows_file().map(|f| &f.text)];
        for text in files.into_iter().flatten() {
            identity.update(text.as_bytes());
        }
        let identity = identity.finalize();
        let spec = Self {
            skin,
            contact: (model, parameters),
            choices,
            transducer,
            recording: wire.info().clone(),
            timing,
            moving,
            frames: law,
            rows_per_shard,
            rows_per_shape,
            rows_per_skin,
            folder: folder.to_owned(),
            text,
            identity: identity.iter().map(|b| format!("{b:02x}")).collect(),
            config,
        };
        if spec.split_by() == SplitBy::Object && !spec.choices.are_procedural() && spec.most_objects() > 1 {
            let problem = "`split.by` = \"object\" needs `object.count` = 1 here: of several objects at once, each is in \
                           every split";
            return Err(Refusal::new(problem).into());
        }
        Ok(spec)
    }

    /// The specification as written, with defaults filled in.
    pub fn config(&self) -> &SpecConfig {
        &self.config
    }

    /// The text of the specification with overrides applied; it is a complete specification.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// What was repaired in the mesh files that it names, with the file before each.
    pub fn notes(&self) -> &[String] {
        &self.choices.notes
    }

    /// SHA-256 of the specification and of the files that it names. Data sets with the same value have the same rows if
    /// the same version of this library made them.
    pub fn identity(&self) -> &str {
        &self.identity
    }

    /// The skin.
    pub fn skin(&self) -> &SkinLayout {
        &self.skin
    }

    /// Name and parameters of the contact model.
    pub fn contact(&self) -> (&str, &toml::Table) {
        (&self.contact.0, &self.contact.1)
    }

    /// Number of rows in a file; the last file may have fewer.
    pub fn rows_per_shard(&self) -> u64 {
        self.rows_per_shard
    }

    /// Number of consecutive rows with the same shape.
    pub fn rows_per_shape(&self) -> u64 {
        self.rows_per_shape
    }

    /// Number of consecutive rows with the same skin.
    pub(crate) fn rows_per_skin(&self) -> u64 {
        self.rows_per_skin
    }

    /// Number of rows of a press or drop.
    pub fn windows(&self) -> u64 {
        self.timing.windows
    }

    /// When windows are recorded.
    pub(crate) fn timing(&self) -> &Timing {
        &self.timing
    }

    /// Whether a ball falls.
    pub fn drops(&self) -> bool {
        self.timing.what == RecordKind::Drop
    }

    /// Whether rows have this ground truth.
    pub(crate) fn has(&self, label: Label) -> bool {
        self.config.record.labels.contains(&label)
    }

    /// What is never divided between two splits.
    pub(crate) fn split_by(&self) -> SplitBy {
        let files = self.config.object.from == ObjectSource::Meshes && self.most_objects() == 1;
        let usual = if self.choices.are_procedural() || files { SplitBy::Object } else { SplitBy::Press };
        self.config.split.by.unwrap_or(usual)
    }

    /// Whether what is pressed is followed in time, step by step or frame by frame, and not only balanced.
    pub(crate) fn is_moving(&self) -> bool {
        self.moving
    }

    /// How frames become conductances; `None` for objects that are simulated.
    pub(crate) fn frame_law(&self) -> Option<FrameLaw> {
        self.frames.map(|(_, law)| law)
    }

    /// Whether the pressure on the skin is known.
    pub(crate) fn knows_pressure(&self) -> bool {
        self.frames.is_none_or(|(are_pressures, _)| are_pressures)
    }

    /// Number of files.
    pub fn shards(&self) -> u64 {
        self.config.rows.div_ceil(self.rows_per_shard)
    }

    /// Largest number of objects in a press.
    pub fn most_objects(&self) -> usize {
        whole(self.config.object.count.range()[1])
    }

    /// Root of the random streams of the data set.
    pub fn streams(&self) -> Streams {
        Streams::new(self.config.seed).child("dataset", 0)
    }

    /// What can be pressed.
    pub(crate) fn choices(&self) -> &Choices {
        &self.choices
    }

    /// Folder that paths are relative to.
    pub(crate) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Transducer, readout and weights of skin number `skin`, with these faults.
    pub(crate) fn chain_config(&self, skin: u64, faults: &[toml::Table]) -> Result<ChainConfig, Refusal> {
        let transducer = self.transducer.of(self.streams(), TRANSDUCER, skin)?;
        chain_config(&self.config, &transducer, faults)
    }

    /// Metadata of the recordings: layout, weights, rate and converter.
    pub fn recording(&self) -> &RecordingInfo {
        &self.recording
    }
}

/// The chain of `config` with the parameters `transducer`.
fn chain_config(config: &SpecConfig, transducer: &toml::Table, faults: &[toml::Table]) -> Result<ChainConfig, Refusal> {
    let (transducer, transducer_parameters) = model_of(transducer, TRANSDUCER, spts::chain::DEFAULT_TRANSDUCER)?;
    Ok(ChainConfig {
        transducer: Some(transducer),
        transducer_parameters,
        profile: None,
        readout: Some(config.readout.clone()),
        rows: config.weights.clone(),
        weights: None,
        faults: faults.to_vec(),
        wires: Vec::new(),
    })
}

/// The entry `model` of `table` and the others.
fn model_of(table: &toml::Table, section: &str, default: &str) -> Result<(String, toml::Table), Refusal> {
    let mut parameters = table.clone();
    match parameters.remove("model") {
        None => Ok((default.to_owned(), parameters)),
        Some(toml::Value::String(model)) => Ok((model, parameters)),
        Some(other) => Err(Refusal::new(format!("`{section}.model` = {other}: a text is needed"))),
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

/// Gives the grids of presses and those of skins their turns.
fn take_turns(config: &mut SpecConfig) {
    let (pose, press) = (&mut config.pose, &mut config.press);
    let of_presses = [
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
    ];
    let mut turn = 1;
    let of_presses = of_presses.into_iter().chain(&mut press.stiffness_pa_per_m);
    of_presses.for_each(|draw| draw.take_turn(&mut turn));
    if let Some(drop) = &mut config.drop {
        let draws = [&mut drop.height_m, &mut drop.mass_kg, &mut drop.radius_m];
        let draws = draws.into_iter().chain([&mut drop.stiffness_pa_per_m]);
        draws.for_each(|draw| draw.take_turn(&mut turn));
    }
    let mut turn = 1;
    let of_skins = [&mut config.faults.count].into_iter().chain(&mut config.skin.seed);
    of_skins.for_each(|draw| draw.take_turn(&mut turn));
}
