//! `spts budget`: how much support accuracy, IoU and classification each effect of each stage costs.
//!
//! Objects are pressed once. A skin is a contact model with the active parts of the transducer; its raster scans are
//! the ground truth and the training data of its decoder. On every skin the presses are recorded with every readout to
//! be compared, under the same noise, decoded and scored. The paired differences of the scores are the budget.

use rayon::prelude::*;
use spts::chain::{Acquisition, Chain, ChainConfig, ChainError};
use spts::progress::Progress;
use spts::provenance::{Provenance, combined_hash};
use spts::record::{TwinError, press_frames};
use spts::scene::{MechanicsError, PressConfig, Scene, SceneConfig, SceneError};
use spts_circuit::{EFFECTS, FAULTS, Interpolated, Mode, Profile, Recording};
use spts_contact::Frame;
use spts_contact::objects::{OBJECTS, ObjectSpec, by_name};
use spts_eval::decoders::{PublishedDecode, TrainedDecoder};
use spts_eval::protocol::{PUBLISHED_TAXELS, Protocol, Truth};
use spts_eval::training::{LearnError, Learned, Learning};
use spts_eval::{Press, RASTER, ScoreError, ScoredSession, Scorer, Tally, Window, idle_mean, unique};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Workspace;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use spts_recon::statistics::{Sample, mean, two_sided};
use spts_sim::fidelity::change_model;
use std::path::Path;

/// Objects that the published recordings contain in both modes.
pub const DEFAULT_OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];
/// Numbers of measurements on the published skin. A larger skin uses the same shares of its taxels.
pub const DEFAULT_MEASUREMENTS: [usize; 3] = [7, 20, 50];

/// Settings of `spts budget`, which measures how much each imperfection of transducer, readout and contact costs in
/// image quality.
#[derive(Debug, Clone)]
pub struct BudgetStudy {
    /// Names of objects; "all" for every object, empty for [`DEFAULT_OBJECTS`].
    pub objects: Vec<String>,
    /// Readout profile: a name, or a file that ends in `.toml`.
    pub readout: String,
    /// Numbers of measurements; empty for [`DEFAULT_MEASUREMENTS`], or the same shares of a larger skin's taxels.
    pub measurements: Vec<usize>,
    /// Decoding variants.
    pub decodes: Vec<PublishedDecode>,
    /// Number of taxels along one side of the skin. Range [10, 40].
    pub side: usize,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether to simulate few presses and train little.
    pub quick: bool,
}

impl BudgetStudy {
    /// Presses, records and scores everything.
    ///
    /// # Errors
    /// [`Refusal`] if an object, a number of measurements or the readout is not valid, or the simulation fails.
    pub fn run(&self, progress: &dyn Progress) -> Result<BudgetReport, Refusal> {
        let size = if self.quick {
            BudgetSize::quick()
        } else {
            BudgetSize::full()
        };
        let keys = self.keys(&size)?;
        let objects = self.objects()?;
        let setup = PressSetup {
            objects: &objects,
            readout: &self.readout,
            side: self.side,
            seed: self.seed,
        };
        let scenes = objects.iter().map(|object| setup.scene(object, &size, false));
        let scenes = scenes
            .collect::<Result<Vec<_>, TwinError>>()
            .map_err(Refusal::from_error)?;
        let Some(first) = scenes.first() else {
            return Err(Refusal::new("`--objects` names no object"));
        };
        let profile = first.chain().profile().clone();
        let hashes = scenes.iter().map(spts::Scene::hash).collect::<Result<Vec<_>, _>>();
        let hash = combined_hash(&hashes.map_err(Refusal::from_error)?);
        let items = items(&profile);
        let variants = Variants::new(&items);
        progress.stage("pressing", Some(2 * objects.len() * size.presses()));
        let pressed = [false, true].map(|layer| setup.press(&size, layer, progress));
        progress.end();
        let [columns, layer] = pressed;
        let chains = Chains {
            size: &size,
            profile: &profile,
            items: &items,
            keys: &keys,
            seed: self.seed,
            pressed: [
                columns.map_err(Refusal::from_error)?,
                layer.map_err(Refusal::from_error)?,
            ],
        };
        let (scores, scan) = chains.score(&variants, progress)?;
        let taxels = self.side * self.side;
        let each_key = || keys.iter().enumerate();
        let rows = variants.comparisons.iter().flat_map(|line| {
            let (after, before) = (&scores[line.variant], &scores[line.reference]);
            each_key().map(move |(key, (decode, m))| BudgetRow {
                stage: line.stage,
                effect: line.effect,
                mode: line.mode,
                decode: decode.name(),
                m: *m,
                taxels,
                changes: CHANGED.map(|score| mean_score(after, Some(before), key, score)),
            })
        });
        let ends = [("everything", EVERYTHING), ("ideal", IDEAL)].into_iter();
        let ends = ends.flat_map(|(chain, index)| {
            let scores = &scores[index];
            each_key().flat_map(move |(key, (decode, m))| end_points(chain, (decode.name(), *m), taxels, (scores, key)))
        });
        let scanned = end_points(SCAN, (RASTER, taxels), taxels, (&scan, 0));
        Ok(BudgetReport {
            rows: rows.collect(),
            end_points: ends.chain(scanned).collect(),
            provenance: Provenance::new(self.seed, hash),
        })
    }

    fn objects(&self) -> Result<Vec<&'static ObjectSpec>, Refusal> {
        if self.objects.iter().any(|name| name == "all") {
            return Ok(OBJECTS.iter().collect());
        }
        let default = DEFAULT_OBJECTS.map(str::to_owned);
        let names: &[String] = if self.objects.is_empty() {
            &default
        } else {
            &self.objects
        };
        let mut objects: Vec<&'static ObjectSpec> = Vec::new();
        for name in names {
            let Some(object) = by_name(name) else {
                let known: Vec<&str> = OBJECTS.iter().map(|o| o.name).collect();
                return Err(Refusal::new(format!(
                    "`--objects`: `{name}` is neither \"all\" nor one of {}",
                    known.join(", ")
                )));
            };
            if objects.iter().any(|o| o.name == object.name) {
                return Err(Refusal::new(format!("`--objects`: `{name}` is there twice")));
            }
            objects.push(object);
        }
        Ok(objects)
    }

    /// Every decode with every M. An M of which no vote fits into a press is refused.
    fn keys(&self, size: &BudgetSize) -> Result<Vec<(PublishedDecode, usize)>, Refusal> {
        let taxels = self.side * self.side;
        let share = |m: usize| (m * taxels).div_ceil(PUBLISHED_TAXELS);
        let measurements = if self.measurements.is_empty() {
            DEFAULT_MEASUREMENTS.map(share).to_vec()
        } else {
            self.measurements.clone()
        };
        let most = size.most_measurements(taxels);
        if let Some(&m) = measurements.iter().find(|&&m| m > most) {
            return Err(Refusal::new(format!(
                "`--measurements`: {m} is outside [1, {most}] on a skin of {taxels} taxels: a press has no room for a vote of windows of {m}"
            )));
        }
        let of_decode = |&decode| measurements.iter().map(move |&m| (decode, m)).collect::<Vec<_>>();
        Ok(self.decodes.iter().flat_map(of_decode).collect())
    }
}

/// Cost of one effect with one decoding variant and M: scores of the modified chain minus those of the reference chain,
/// each with its standard error over the sessions.
#[derive(Debug, Clone, PartialEq)]
pub struct BudgetRow {
    /// Stage: contact, transducer, faults, drive, amplifier, noise or converter.
    pub stage: &'static str,
    /// Effect; `whole_stage` for all effects of the stage together; `layer` for another contact model.
    pub effect: &'static str,
    /// How the cost is found.
    pub mode: Direction,
    /// Decoding variant.
    pub decode: &'static str,
    /// Number of measurements, M.
    pub m: usize,
    /// Number of taxels, N.
    pub taxels: usize,
    /// Change of every score of [`CHANGES`].
    pub changes: [MeanWithError; CHANGES.len()],
}

/// Names of the scores whose changes are a row: support accuracy, IoU, shares of single windows and of votes of 20
/// windows classified correctly, and IoU with the image of a skin that has only the static law, at the same instant.
/// The transducer cannot change this last ground truth.
pub const CHANGES: [&str; 5] = ["support", "iou", "class_single", "class_vote20", "iou_contact"];

/// Places of [`CHANGES`] in the scores of a press.
const CHANGED: [usize; CHANGES.len()] = [SUPPORT, IOU, CLASSES[0], CLASSES[1], IOU + 2];

/// Scores of a chain that the effects are compared with, such as the ideal one, against one ground truth.
#[derive(Debug, Clone, PartialEq)]
pub struct EndPoint {
    /// "everything", "ideal", or "scan" for the raster frames to which the ground truth belongs.
    pub chain: &'static str,
    /// Decoding variant; "raster" for the scan.
    pub decode: &'static str,
    /// Number of measurements, M.
    pub m: usize,
    /// Number of taxels, N.
    pub taxels: usize,
    /// Ground truth: "raster" is the scan's own frame, as in the publication; "image" the noiseless image of the same
    /// skin at that instant; "contact" that of a skin with only the static law.
    pub truth: &'static str,
    /// Support accuracy, IoU, and the shares of single windows and of votes of 20 windows classified correctly. Nothing
    /// votes in the scan, which is one press: how much another would differ is not known.
    pub scores: [MeanWithError; 4],
}

impl EndPoint {
    /// Whether this is the scan.
    pub fn is_scan(&self) -> bool {
        self.chain == SCAN
    }
}

/// Name of the raster frames to which the ground truth belongs.
const SCAN: &str = "scan";

/// The chain `chain` with the scores `scores` of one key, by every truth.
fn end_points<'a>(
    chain: &'static str,
    (decode, m): (&'static str, usize),
    taxels: usize,
    (scores, key): (&'a ScoreTable, usize),
) -> impl Iterator<Item = EndPoint> + 'a {
    TRUTHS.into_iter().enumerate().map(move |(place, truth)| EndPoint {
        chain,
        decode,
        m,
        taxels,
        truth,
        scores: [SUPPORT + place, IOU + place, CLASSES[0], CLASSES[1]]
            .map(|score| mean_score(scores, None, key, score)),
    })
}

/// Results of `spts budget`: what every effect costs, and the scores of the chains that are compared.
#[derive(Debug, Clone)]
pub struct BudgetReport {
    /// One row for each effect, direction, decoding variant and M.
    pub rows: Vec<BudgetRow>,
    /// Scores of the whole chain, of the ideal chain, and of the scan that is the ground truth.
    pub end_points: Vec<EndPoint>,
    /// Provenance of the numbers.
    pub provenance: Provenance,
}

/// What the scores of all chains are made from.
struct Chains<'a> {
    size: &'a BudgetSize,
    profile: &'a Profile,
    items: &'a [BudgetItem],
    keys: &'a [(PublishedDecode, usize)],
    seed: u64,
    /// On columns, on the elastic layer.
    pressed: [Vec<Pressed>; 2],
}

impl Chains<'_> {
    /// Scores of every chain, in their order, and of the whole chain's scan.
    fn score(&self, variants: &Variants, progress: &dyn Progress) -> Result<(Vec<ScoreTable>, ScoreTable), Refusal> {
        let objects = self.pressed[0].len();
        let jobs = variants.list.len() * objects * self.size.sessions;
        progress.stage("recording and scoring", Some(jobs));
        let mut scores: Vec<ScoreTable> = vec![Vec::new(); variants.list.len()];
        let mut scan = ScoreTable::new();
        for index in 0..variants.list.len() {
            if !scores[index].is_empty() {
                continue;
            }
            // skin by skin: what a skin has learned is used by all its readouts and then dropped
            let alike = |v: &Variant| self.skin_of(v) == self.skin_of(&variants.list[index]);
            let members: Vec<usize> = (0..variants.list.len()).filter(|&i| alike(&variants.list[i])).collect();
            let (layer, off) = self.skin_of(&variants.list[index]);
            let skin = LearnedSkin::prepare(&self.pressed[usize::from(layer)], &off, self.size, self.seed)?;
            if index == EVERYTHING {
                scan = skin.scan();
            }
            let profiles: Vec<Profile> = members.iter().map(|&i| self.readout(&variants.list[i])).collect();
            for (&i, found) in members.iter().zip(self.score_skin(&skin, &profiles, progress)?) {
                scores[i] = found;
            }
        }
        progress.end();
        Ok((scores, scan))
    }

    /// Contact model of a chain, and the parts of the transducer that do not act in it.
    fn skin_of(&self, variant: &Variant) -> (bool, Vec<&'static str>) {
        let parts = self.items.iter().zip(&variant.acts);
        let off = parts.filter(|(item, acts)| item.stage == TRANSDUCER && !**acts);
        (variant.layer, off.map(|(item, _)| item.name).collect())
    }

    /// The profile with the effects that act in a chain.
    fn readout(&self, variant: &Variant) -> Profile {
        let mut profile = self.profile.clone();
        let items = self.items.iter().zip(&variant.acts);
        let off = items.filter(|(item, acts)| item.stage != TRANSDUCER && !**acts);
        for (item, _) in off {
            take_away(*item, &mut profile);
        }
        profile
    }

    /// Scores of every profile on one skin.
    fn score_skin(
        &self,
        skin: &LearnedSkin,
        profiles: &[Profile],
        progress: &dyn Progress,
    ) -> Result<Vec<ScoreTable>, Refusal> {
        let scorer = PressScorer::new(skin, self.keys, self.size)?;
        let (objects, sessions) = (skin.objects.len(), self.size.sessions);
        let flat = (0..profiles.len() * objects * sessions)
            .into_par_iter()
            .map(|job| {
                let (profile, press) = (job / (objects * sessions), job % (objects * sessions));
                let found = scorer.score(&profiles[profile], press / sessions, press % sessions);
                progress.step();
                found
            })
            .collect::<Result<Vec<_>, Refusal>>()?;
        let of_profile = |presses: &[_]| presses.chunks(sessions).map(<[_]>::to_vec).collect();
        Ok(flat.chunks(objects * sessions).map(of_profile).collect())
    }
}

/// Name of the stage between mechanics and transducer.
pub const CONTACT: &str = "contact";
/// Name of the stage between pressure and conductance.
const TRANSDUCER: &str = "transducer";
/// Name of the stage of the faults of single cells.
const CELLS: &str = "faults";
/// Stage of a readout effect that [`READOUT_STAGES`] does not list.
const OTHER: &str = "other";

/// Parts of the transducer, each with the parameters (TOML) that take it away.
const PARTS: &[(&str, &str)] = &[
    ("spread", "spread_log_sd = 0.0"),
    ("session", "session_log_sd = 0.0"),
    ("hysteresis", "hysteresis.operators = 0"),
    ("creep", "creep = { per_decade = 0.0, instant = 1.0 }"),
    ("conditioning", "conditioning = { first = 1.0, per_ln_press = 0.0 }"),
];

/// Stages of the readout in signal order, and their effects.
const READOUT_STAGES: &[(&str, &[&str])] = &[
    ("drive", &["missed_clocks", "late_updates", "dac", "drive_offset"]),
    ("amplifier", &["memory", "clock_pattern", "amplifier", "rails"]),
    ("noise", &["contact_noise", "idle_noise"]),
    ("converter", &["adc", "clamp"]),
];

/// One part that can be taken away: of the transducer, all faults of one name, or an effect of the readout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct BudgetItem {
    /// Its stage.
    stage: &'static str,
    /// Its name.
    name: &'static str,
}

/// Everything that acts on a compressive recording with `profile`: the transducer's parts, then the faults, then the
/// effects, stage by stage.
fn items(profile: &Profile) -> Vec<BudgetItem> {
    let parts = PARTS.iter().map(|&(name, _)| BudgetItem {
        stage: TRANSDUCER,
        name,
    });
    let listed = EFFECTS
        .iter()
        .filter(|(name, _)| profile.compressive.contains_key(*name));
    let mut effects: Vec<BudgetItem> = listed
        .map(|&(name, _)| BudgetItem {
            stage: stage_of(name),
            name,
        })
        .collect();
    // stable: signal order within a stage
    effects.sort_by_key(|item| READOUT_STAGES.iter().position(|(stage, _)| *stage == item.stage));
    let present = FAULTS
        .iter()
        .filter(|(name, _)| profile.faults.iter().any(|f| f.name == *name));
    let faults = present.map(|&(name, _)| BudgetItem { stage: CELLS, name });
    parts.chain(faults).chain(effects).collect()
}

/// Takes an item of the readout out of a profile's compressive mode.
fn take_away(item: BudgetItem, profile: &mut Profile) {
    if item.stage == CELLS {
        profile.faults.retain(|fault| fault.name != item.name);
    } else {
        profile.compressive.remove(item.name);
    }
}

/// Stages of `items`, each once, in their order.
fn stages(items: &[BudgetItem]) -> Vec<&'static str> {
    unique(items.iter().map(|item| item.stage))
}

fn stage_of(effect: &str) -> &'static str {
    let found = READOUT_STAGES.iter().find(|(_, effects)| effects.contains(&effect));
    found.map_or(OTHER, |(stage, _)| stage)
}

/// Transducer parameters without the parts called `off`.
fn without_parts(off: &[&str]) -> Result<toml::Table, toml::de::Error> {
    let texts = PARTS.iter().filter(|(name, _)| off.contains(name));
    let text: Vec<&str> = texts.map(|(_, text)| *text).collect();
    toml::from_str(&text.join("\n"))
}

/// How the cost of an effect is found: by taking it out of the whole chain, or by adding it to the ideal one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The chain without the effect, compared with the whole chain: a positive change is the cost of the effect.
    Ablation,
    /// The ideal chain with the effect, compared with the ideal chain: a negative change is the cost of the effect.
    Addition,
}

impl Direction {
    /// Name in the tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ablation => "ablation",
            Self::Addition => "addition",
        }
    }
}

/// Name of the row for a whole stage.
pub const WHOLE_STAGE: &str = "whole_stage";
/// Name of the line of the contact model.
const LAYER: &str = "layer";

/// A chain: the contact model, and which of the items act.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Variant {
    /// Whether the foam is an elastic layer instead of columns.
    layer: bool,
    /// Which items are active.
    acts: Vec<bool>,
}

/// One line of the budget: `variant` less `reference`, by their places in the list of variants.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ChainComparison {
    stage: &'static str,
    effect: &'static str,
    mode: Direction,
    reference: usize,
    variant: usize,
}

/// Every chain that is scored, each once, and what is compared.
#[derive(Debug, Clone)]
struct Variants {
    list: Vec<Variant>,
    comparisons: Vec<ChainComparison>,
}

/// Place of the whole chain in the list.
const EVERYTHING: usize = 0;
/// Place of the ideal chain in the list: the transducer's static law alone, and y = Φx.
const IDEAL: usize = 1;

impl Variants {
    /// Ablation and addition of every item and of every stage; the contact model is exchanged in the whole chain.
    fn new(items: &[BudgetItem]) -> Self {
        let chain = |layer: bool, acts: &dyn Fn(&BudgetItem) -> bool| Variant {
            layer,
            acts: items.iter().map(acts).collect(),
        };
        let mut all = Self {
            list: vec![chain(false, &|_| true), chain(false, &|_| false)],
            comparisons: Vec::new(),
        };
        let whole = |layer| chain(layer, &|_| true);
        all.compare(CONTACT, LAYER, Direction::Ablation, EVERYTHING, whole(true));
        for stage in stages(items) {
            let of_stage = |i: &BudgetItem| i.stage == stage;
            all.compare_both(stage, WHOLE_STAGE, &|chosen| chain(false, &|i| of_stage(i) == chosen));
            for item in items.iter().filter(|i| of_stage(i)) {
                all.compare_both(stage, item.name, &|chosen| chain(false, &|i| (i == item) == chosen));
            }
        }
        all
    }

    /// `with(false)` is the chain without what is looked at, `with(true)` the chain of that alone.
    fn compare_both(&mut self, stage: &'static str, effect: &'static str, with: &dyn Fn(bool) -> Variant) {
        self.compare(stage, effect, Direction::Ablation, EVERYTHING, with(false));
        self.compare(stage, effect, Direction::Addition, IDEAL, with(true));
    }

    fn compare(
        &mut self,
        stage: &'static str,
        effect: &'static str,
        mode: Direction,
        reference: usize,
        variant: Variant,
    ) {
        let found = self.list.iter().position(|v| *v == variant);
        let variant = found.unwrap_or_else(|| {
            self.list.push(variant);
            self.list.len() - 1
        });
        self.comparisons.push(ChainComparison {
            stage,
            effect,
            mode,
            reference,
            variant,
        });
    }
}

/// Size of a budget.
#[derive(Debug, Clone)]
struct BudgetSize {
    /// Number of raster presses of an object. The last is the ground truth; the earlier ones are training data.
    raster_presses: usize,
    /// Training data of the decoder.
    learning: Learning,
    /// Number of compressive sessions of an object. Each has one press, its own noise, and its own learned dictionary.
    sessions: usize,
    /// Largest number of votes in a press, spread evenly over the plateau.
    votes: usize,
}

impl BudgetSize {
    /// The budget that ships.
    fn full() -> Self {
        Self {
            raster_presses: 5,
            learning: Learning {
                presses: 0..4,
                training_images: 1500,
                sweeps: 15,
            },
            sessions: 10,
            votes: 6,
        }
    }

    /// A look in a few seconds.
    fn quick() -> Self {
        Self {
            raster_presses: 3,
            learning: Learning {
                presses: 0..2,
                training_images: 300,
                sweeps: 4,
            },
            sessions: 3,
            votes: 3,
        }
    }

    /// Presses of an object in both modes.
    fn presses(&self) -> usize {
        self.raster_presses + self.sessions
    }

    /// Most measurements M of which a vote still fits into a press on a skin of `taxels` taxels.
    fn most_measurements(&self, taxels: usize) -> usize {
        let protocol = self.protocol(taxels);
        protocol.frames * taxels / protocol.vote
    }

    /// The published protocol at the same instants, for a skin of `taxels` taxels: its frames last longer or shorter.
    fn protocol(&self, taxels: usize) -> Protocol {
        let published = Protocol::default();
        let own = |frame: usize| frame * PUBLISHED_TAXELS / taxels;
        Protocol {
            first_press: 0,
            presses: 1,
            first_frame: own(published.first_frame),
            frames: own(published.frames),
            truth: (self.raster_presses - 1, own(published.truth.1)),
            ..published
        }
    }
}

/// Sessions of an object that are kept apart by their numbers.
const SESSIONS: u64 = 1000;

/// Acquisition of the raster session of the object with the label `label`. Its number is even, those of compressive
/// sessions are odd.
fn raster_acquisition(label: usize) -> Acquisition {
    Acquisition::presses(Mode::Raster, 2 * label as u64)
}

/// Acquisition of the compressive session `session` in [0, 1000) of the object with the label `label`: every one begins
/// elsewhere in the weights' sequence, and has its own number and with it its own noise and its own gains of the
/// taxels.
fn compressive_acquisition(label: usize, session: usize) -> Acquisition {
    let base = Acquisition::presses(Mode::Compressive, 2 * (label as u64 * SESSIONS + session as u64) + 1);
    Acquisition {
        lead_frames: base.lead_frames + 1000 * session as u64,
        ..base
    }
}

/// What is pressed, on which skin.
#[derive(Debug, Clone, Copy)]
struct PressSetup<'a> {
    objects: &'a [&'static ObjectSpec],
    readout: &'a str,
    /// Taxels along one side of the skin.
    side: usize,
    seed: u64,
}

/// An object and the frames of all its presses.
#[derive(Debug, Clone)]
struct Pressed {
    object: &'static ObjectSpec,
    scene: Scene,
    presses: Vec<Vec<Frame>>,
}

impl PressSetup<'_> {
    /// Scene of an object: on the published skin at its own place, on a larger one as far from the middle. `layer` puts
    /// the elastic layer, solved at the frames, in place of the columns.
    fn scene(&self, object: &ObjectSpec, size: &BudgetSize, layer: bool) -> Result<Scene, TwinError> {
        let published = SkinLayout::default();
        let skin = SkinLayout::new(self.side, self.side, published.pitch_m(), published.electrode_m())
            .map_err(|e| SceneError::from(MechanicsError::from(e)))?;
        let shift = 0.5 * (self.side as f64 - published.rows() as f64);
        let press = PressConfig {
            object: Some(object.name.to_owned()),
            row: Some(object.placement.row + shift),
            col: Some(object.placement.col + shift),
            presses: size.presses(),
            ..PressConfig::default()
        };
        let mut config = SceneConfig {
            seed: self.seed,
            readout: Some(self.readout.to_owned()),
            skin,
            press: Some(press),
            ..SceneConfig::default()
        };
        if layer {
            change_model(&mut config.contact, "layer");
            config.contact.insert("coupled".to_owned(), false.into());
        }
        Scene::new(config, Path::new(""))
    }

    /// Runs every press of every object and reports each to `progress`.
    fn press(&self, size: &BudgetSize, layer: bool, progress: &dyn Progress) -> Result<Vec<Pressed>, TwinError> {
        let of_object = |&object: &&'static ObjectSpec| {
            let scene = self.scene(object, size, layer)?;
            let presses = (0..size.presses()).into_par_iter().map(|index| {
                let frames = press_frames(&scene, index)?.frames;
                progress.step();
                Ok(frames)
            });
            Ok(Pressed {
                object,
                presses: presses.collect::<Result<_, TwinError>>()?,
                scene,
            })
        };
        self.objects.par_iter().map(of_object).collect()
    }
}

/// What may count as touched.
const TRUTHS: [&str; 3] = ["raster", "image", "contact"];

/// The touched taxels of an object by every truth of [`TRUTHS`]: those of a raster frame, as published; of the
/// noiseless image of the same skin in the scan's session at the same instant; and of that image on a skin that has the
/// static law alone.
type Masks = [Vec<bool>; 3];

/// A skin that has been pressed and learned from.
struct LearnedSkin {
    /// Transducer and complete readout.
    chain: Chain,
    /// Decoders, one for each compressive session. Training starts at random, so two dictionaries learned from the same
    /// scans have different scores.
    learned: Vec<Learned>,
    /// Objects in order of the presses.
    objects: Vec<LearnedObject>,
    /// Scored instants.
    protocol: Protocol,
}

/// An object on a skin.
struct LearnedObject {
    /// Name.
    name: &'static str,
    /// Label.
    label: usize,
    /// Conductance as a function of time, one source for each compressive session.
    sources: Vec<Interpolated>,
    /// Ground truths.
    masks: Masks,
    raster: Recording,
}

impl LearnedSkin {
    /// Presses all objects on a skin without the transducer's parts `off`, scans the first presses and learns from
    /// them.
    fn prepare(pressed: &[Pressed], off: &[&str], size: &BudgetSize, seed: u64) -> Result<Self, Refusal> {
        let Some(first) = pressed.first() else {
            return Err(Refusal::new("`--objects` names no object"));
        };
        let chain = self::chain(&first.scene, off)?;
        let every_part: Vec<&str> = PARTS.iter().map(|(name, _)| *name).collect();
        let bare = self::chain(&first.scene, &every_part)?;
        let layout = first.scene.skin();
        let protocol = size.protocol(layout.taxels());
        let objects = pressed
            .par_iter()
            .map(|pressed| LearnedObject::new(pressed, &chain, &bare, size, &protocol))
            .collect::<Result<Vec<_>, TwinError>>()
            .map_err(Refusal::from_error)?;
        let sessions: Vec<ScoredSession> = objects.iter().map(|o| o.session(protocol)).collect();
        let streams = Streams::new(seed);
        let learned = (0..size.sessions).into_par_iter().map(|session| {
            let streams = streams.child("learning", session as u64);
            Learned::learn(&sessions, &size.learning, layout.cols(), streams)
        });
        let learned = learned
            .collect::<Result<Vec<_>, LearnError>>()
            .map_err(Refusal::from_error)?;
        Ok(Self {
            chain,
            learned,
            objects,
            protocol,
        })
    }

    /// Scores of the scan that the truth is taken from: its frames are windows of a session of their own. The library
    /// is the same for every decoder.
    fn scan(&self) -> ScoreTable {
        let mut work = Workspace::default();
        let of_object = |object: &LearnedObject| {
            let (mut tallies, mut decisions): ([Tally; 3], _) = (Default::default(), Vec::new());
            let last = (self.protocol.first_frame + self.protocol.frames).min(object.raster.frames());
            for frame in self.protocol.first_frame..last {
                let image = object.raster.volts(self.protocol.truth.0, frame);
                for (tally, truth) in tallies.iter_mut().zip(&object.masks) {
                    tally.image(image, truth);
                }
                let decision = self.learned.first().map(|l| l.classifier.classify(image, &mut work));
                decisions.push(decision.and_then(Result::unwrap_or_default));
            }
            tallies[0].decisions(&decisions, object.label, self.protocol.vote);
            vec![vec![press_scores(&tallies)]]
        };
        self.objects.iter().map(of_object).collect()
    }
}

/// Chain of `scene` without the transducer's parts `off`.
fn chain(scene: &Scene, off: &[&str]) -> Result<Chain, Refusal> {
    let config = ChainConfig {
        transducer_parameters: without_parts(off).map_err(Refusal::from_error)?,
        ..scene.config().chain()
    };
    let chain = Chain::new(&config, scene.skin(), scene.seed(), Path::new(""));
    chain.map_err(Refusal::from_error)
}

impl LearnedObject {
    fn new(
        pressed: &Pressed,
        chain: &Chain,
        bare: &Chain,
        size: &BudgetSize,
        protocol: &Protocol,
    ) -> Result<Self, TwinError> {
        let presses: Vec<&[Frame]> = pressed.presses.iter().map(Vec::as_slice).collect();
        let label = usize::from(pressed.object.label);
        let scan = raster_acquisition(label);
        let (scans, read) = presses.split_at(size.raster_presses);
        let mut scanned = chain.conductance(scans, &scan)?;
        let raster = chain.record_sources(&mut scanned, pressed.scene.duration_s(), &scan)?;
        let time_s = raster.time_s(protocol.truth.1.min(raster.frames() - 1));
        let sources = read.par_iter().enumerate().map(|(session, &press)| {
            // every session has gains of its own, on a sheet that was pressed as often as the scanned one
            let sums = Acquisition {
                conditioning_presses: size.raster_presses,
                ..compressive_acquisition(label, session)
            };
            chain.conductance(&[press], &sums)
        });
        let sources = sources.collect::<Result<Vec<_>, ChainError>>()?.concat();
        Ok(Self {
            name: pressed.object.name,
            label,
            sources,
            masks: [
                Truth::new(&raster, protocol).support,
                touched(chain, scans, scan.session, time_s)?,
                touched(bare, scans, scan.session, time_s)?,
            ],
            raster,
        })
    }

    fn session(&self, protocol: Protocol) -> ScoredSession {
        ScoredSession {
            name: self.name.to_owned(),
            object: self.name.to_owned(),
            label: self.label,
            again: false,
            shared_raster: false,
            raster: Some(self.raster.clone()),
            compressive: None,
            protocol,
            raster_protocol: protocol,
            held: true,
            simulated: Vec::new(),
        }
    }
}

/// Support of the conductance at `time_s` of the last of `presses`, above that of the untouched skin.
fn touched(chain: &Chain, presses: &[&[Frame]], session: u64, time_s: f64) -> Result<Vec<bool>, TwinError> {
    let mut mask = Vec::new();
    let maps = chain.conductance_maps(presses, session).pop().unwrap_or_default();
    let after = presses
        .last()
        .map_or(0, |frames| frames.partition_point(|f| f.time_s < time_s));
    if let (Some(idle), Some(map)) = (maps.first(), maps.get(after).or(maps.last())) {
        let pairs = map.values().iter().zip(idle.values());
        let image: Vec<f64> = pairs.map(|(g, g0)| g - g0).collect();
        support(&image, SUPPORT_THRESHOLD, &mut mask);
    }
    Ok(mask)
}

/// Scores of one press with one decode and M: support accuracy by every truth of [`TRUTHS`], IoU by every truth, and
/// the shares of single windows and of votes of 20 windows that are classified correctly.
type PressScores = [f64; 8];

/// Place of the support accuracy by the first truth in [`PressScores`], that of the IoU, and those of the classes.
const SUPPORT: usize = 0;
const IOU: usize = TRUTHS.len();
const CLASSES: [usize; 2] = [6, 7];

/// Scores of a chain: `[object][session][key]`.
type ScoreTable = Vec<Vec<Vec<PressScores>>>;

/// Scores of the images by every truth, and of the classes that are counted in the first tally; 0 where nothing was
/// counted.
fn press_scores(tallies: &[Tally; 3]) -> PressScores {
    let [a, b, c] = tallies.each_ref().map(Tally::scores);
    let scores = [
        a.support,
        b.support,
        c.support,
        a.iou,
        b.iou,
        c.iou,
        a.class_single,
        a.class_vote20,
    ];
    scores.map(|score| score.unwrap_or(0.0))
}

/// What all readouts of a skin share: its decoders, one set a session.
struct PressScorer<'a> {
    skin: &'a LearnedSkin,
    keys: &'a [(PublishedDecode, usize)],
    votes: usize,
    decoders: Vec<Vec<(PublishedDecode, TrainedDecoder)>>,
}

impl<'a> PressScorer<'a> {
    /// Scores presses on `skin` by every decode and M of `keys`.
    ///
    /// # Errors
    /// [`Refusal`] when a decode cannot use what was learned.
    fn new(skin: &'a LearnedSkin, keys: &'a [(PublishedDecode, usize)], size: &BudgetSize) -> Result<Self, Refusal> {
        let decoders = skin.learned.iter().map(PublishedDecode::decoders);
        Ok(Self {
            skin,
            keys,
            votes: size.votes,
            decoders: decoders.collect::<Result<_, _>>().map_err(Refusal::from_error)?,
        })
    }

    /// Records compressive session `session` of object `object` with `profile` and scores it, key by key. Noise depends
    /// on object and session alone, so that two profiles are compared under the same noise.
    fn score(&self, profile: &Profile, object: usize, session: usize) -> Result<Vec<PressScores>, Refusal> {
        let (skin, object) = (self.skin, &self.skin.objects[object]);
        let chain = skin.chain.with_profile(profile.clone()).map_err(Refusal::from_error)?;
        let frames = skin.protocol.first_frame + skin.protocol.frames;
        let mut sources = [object.sources[session].clone()];
        let taxels = skin.learned[session].dictionary.atoms.nrows();
        let duration_s = (frames * taxels) as f64 / chain.sample_rate_hz();
        let recording = chain
            .record_sources(
                &mut sources,
                duration_s,
                &compressive_acquisition(object.label, session),
            )
            .map_err(Refusal::from_error)?;
        let per_frame = recording.measurements_per_frame();
        let (idle_v, vote) = (idle_mean(&recording, 0), skin.protocol.vote);
        let [first, end] =
            [skin.protocol.first_frame.min(recording.frames()), recording.frames()].map(|f| f * per_frame);
        let score = |&(decode, m): &(PublishedDecode, usize)| {
            let mut tallies: [Tally; 3] = Default::default();
            for (_, decoder) in self.decoders[session].iter().filter(|(d, _)| *d == decode) {
                let mut scorer = Scorer::new(decoder);
                for start in self.starts(end - first, m).map(|start| first + start) {
                    // vote by vote, because the weights of a whole press on a large skin fill the memory
                    let press = Press::within(&recording, 0, start..start + vote * m, idle_v);
                    let windows: Vec<Window<'_>> = press.windows(0..press.len(), m, m).map(|(_, w)| w).collect();
                    let answers = scorer
                        .answers(&windows)
                        .map_err(ScoreError::from)
                        .map_err(Refusal::from_error)?;
                    for answer in &answers {
                        for (tally, truth) in tallies.iter_mut().zip(&object.masks) {
                            tally.image(&answer.image, truth);
                        }
                    }
                    let decisions: Vec<Option<usize>> = answers.iter().map(|a| scorer.class(a)).collect();
                    tallies[0].decisions(&decisions, object.label, vote);
                }
            }
            Ok(press_scores(&tallies))
        };
        self.keys.iter().map(score).collect()
    }

    /// First measurements of the votes, spread evenly over a press of `len` measurements.
    fn starts(&self, len: usize, m: usize) -> impl Iterator<Item = usize> {
        let vote_len = self.skin.protocol.vote * m;
        let votes = self.votes.min(len / vote_len);
        (0..votes).map(move |vote| vote * (len - vote_len) / votes.saturating_sub(1).max(1))
    }
}

/// Probability with which a mean of nothing but chance is taken to stand out.
pub const CHANCE: f64 = 0.01;

/// A mean over the sessions of a study, and its standard error.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeanWithError {
    /// Mean.
    pub mean: f64,
    /// Its standard error.
    pub se: f64,
    /// Number of sessions S.
    pub sessions: usize,
}

impl MeanWithError {
    /// Whether the mean is further from zero than chance brings it once in 1/[`CHANCE`]: by Student's t test with S − 1
    /// degrees of freedom; and where all sessions have the same value, so that there is no error to measure it by, by
    /// the test of signs, p = 2^(1 − S).
    pub fn stands_out(self) -> bool {
        let freedom = u32::try_from(self.sessions.saturating_sub(1)).unwrap_or(u32::MAX);
        if self.mean.abs() <= 0.0 || freedom == 0 {
            return false;
        }
        // equal values leave the rounding of their mean
        let chance = if self.se > 1e-12 * self.mean.abs() {
            two_sided(self.mean / self.se, freedom)
        } else {
            (-f64::from(freedom)).exp2()
        };
        chance < CHANCE
    }

    /// Whether chance alone could make it stand out: it is not zero in every session.
    pub fn can_stand_out(self) -> bool {
        self.mean.abs() > 0.0 || self.se > 0.0
    }
}

/// Mean over sessions and objects of `values[object][session]`, with its standard error s/√S: s is the standard
/// deviation of the S sessions' means over the objects.
///
/// Every session has presses, noise and a learned dictionary of its own, so sessions are independent; the objects of
/// one session share the dictionary and are not. The objects are the ones that were asked about, not a sample of
/// others.
fn estimate(values: &[Vec<f64>]) -> MeanWithError {
    let sessions = values.iter().map(Vec::len).min().unwrap_or(0);
    let of_session = |k: usize| mean(values.iter().map(|v| v[k])).unwrap_or_default();
    let means: Vec<f64> = (0..sessions).map(of_session).collect();
    Sample::of(&means).map_or_else(MeanWithError::default, |sample| MeanWithError {
        mean: sample.mean,
        se: sample.standard_error(),
        sessions,
    })
}

/// Mean of the score with the place `score` at the key with the place `key`, or of its change from `reference`, press
/// by press: noise that both share cancels.
fn mean_score(scores: &ScoreTable, reference: Option<&ScoreTable>, key: usize, score: usize) -> MeanWithError {
    let of_object = |(object, sessions): (usize, &Vec<Vec<PressScores>>)| {
        let before = |session: usize| reference.map_or(0.0, |r| r[object][session][key][score]);
        let sessions = sessions.iter().enumerate();
        sessions
            .map(|(session, keys)| keys[key][score] - before(session))
            .collect()
    };
    estimate(&scores.iter().enumerate().map(of_object).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;
    use spts_circuit::PROFILES;
    use spts_models::build_transducer;

    #[test]
    fn every_effect_has_a_stage() {
        for (name, _) in EFFECTS {
            assert_ne!(stage_of(name), OTHER, "{name}");
        }
    }

    #[test]
    fn the_transducer_knows_every_part() {
        for (name, _) in PARTS {
            let parameters = without_parts(&[name]).unwrap();
            build_transducer("velostat", parameters, &SkinLayout::default(), Streams::new(0)).unwrap();
        }
        let off: Vec<&str> = PARTS.iter().map(|(name, _)| *name).collect();
        assert_eq!(without_parts(&off).unwrap().len(), PARTS.len());
    }

    #[test]
    fn stages_stand_in_signal_order() {
        let (_, text) = PROFILES.iter().find(|(name, _)| *name == "as_built").unwrap();
        let faults = "[[faults]]\nname = \"dead\"\ntaxel = 4\n[[faults]]\nname = \"dead\"\ntaxel = 7\n";
        let mut profile = Profile::from_toml(&format!("{text}\n{faults}")).unwrap();
        let found = items(&profile);
        assert_eq!(
            stages(&found),
            [TRANSDUCER, CELLS, "drive", "amplifier", "noise", "converter"]
        );
        assert_eq!(found.iter().filter(|item| item.stage == CELLS).count(), 1);
        for &item in found.iter().filter(|item| item.stage != TRANSDUCER) {
            take_away(item, &mut profile);
        }
        assert!(profile.faults.is_empty() && profile.compressive.is_empty() && !profile.raster.is_empty());
    }

    /// Two stages with two items and one: 1 exchange of the contact, 2 × (2 stages + 3 items) comparisons. A stage of
    /// one item is that item: chains all, none, layer, 2 × (first stage + 3 items).
    #[test]
    fn every_chain_is_scored_once() {
        let item = |stage, name| BudgetItem { stage, name };
        let items = [item("a", "x"), item("a", "y"), item("b", "z")];
        let variants = Variants::new(&items);
        assert_eq!(variants.comparisons.len(), 1 + 2 * 5);
        // all less the first stage is the second stage alone, and the other way round
        assert_eq!(variants.list.len(), 3 + 2 + 3 + 3 - 2);
        let line = |effect, mode| {
            let found = |c: &&ChainComparison| c.effect == effect && c.mode == mode;
            let line = variants.comparisons.iter().find(found).unwrap();
            (line.reference, variants.list[line.variant].acts.clone())
        };
        assert_eq!(line("y", Direction::Ablation), (EVERYTHING, vec![true, false, true]));
        assert_eq!(line("y", Direction::Addition), (IDEAL, vec![false, true, false]));
    }

    /// Sessions of the scan and of all compressive recordings are numbered apart, so that each has noise and gains of
    /// its own.
    #[test]
    fn every_session_has_a_number_of_its_own() {
        let size = BudgetSize::full();
        let mut numbers: Vec<u64> = (0..17)
            .flat_map(|label| {
                let compressive = (0..size.sessions).map(move |k| compressive_acquisition(label, k).session);
                compressive.chain([raster_acquisition(label).session])
            })
            .collect();
        numbers.sort_unstable();
        let count = numbers.len();
        numbers.dedup();
        assert_eq!(numbers.len(), count);
    }

    /// The defaults, half the taxels at most, fit into every press, and so does the largest M that is allowed, but no
    /// larger one.
    #[test]
    fn a_vote_fits_into_every_press() {
        let size = BudgetSize::full();
        for side in 10..=40 {
            let taxels = side * side;
            let (most, press) = (size.most_measurements(taxels), size.protocol(taxels).frames * taxels);
            assert!(most >= taxels.div_ceil(2), "{taxels}");
            assert!(press / (20 * most) >= 1 && press / (20 * (most + 1)) == 0, "{taxels}");
        }
    }

    /// Two objects in three sessions: means over the objects 1, 3 and 5, of mean 3 and variance 4, whatever the objects
    /// differ by.
    #[test]
    fn sessions_are_the_sample() {
        let found = estimate(&[vec![-9.0, 3.0, 7.0], vec![11.0, 3.0, 3.0]]);
        assert_relative_eq!(found.mean, 3.0, max_relative = 1e-15);
        assert_relative_eq!(found.se, (4.0_f64 / 3.0).sqrt(), max_relative = 1e-15);
    }

    /// A shift that is the same in every press has no error, however much the presses differ.
    #[test]
    fn paired_changes_cancel_what_is_shared() {
        let before: ScoreTable = vec![vec![vec![[0.25; 8]], vec![[0.75; 8]]]];
        let after: ScoreTable = vec![vec![vec![[0.375; 8]], vec![[0.875; 8]]]];
        let found = mean_score(&after, Some(&before), 0, IOU);
        assert_relative_eq!(found.mean, 0.125, max_relative = 1e-15);
        assert!(found.se <= 0.0);
        assert!(mean_score(&before, None, 0, IOU).se > 0.2);
    }

    /// Student's quantiles at 1 % are 9.925 for 3 sessions and 3.250 for 10; equal values stand out by their signs,
    /// from the eighth session on: 2⁻⁷ < 1 % < 2⁻⁶.
    #[test]
    fn few_sessions_need_a_larger_distance() {
        let stands_out = |mean: f64, se: f64, sessions: usize| MeanWithError { mean, se, sessions }.stands_out();
        assert!(!stands_out(-9.8, 1.0, 3) && stands_out(-10.0, 1.0, 3));
        assert!(!stands_out(3.2, 1.0, 10) && stands_out(3.3, 1.0, 10));
        assert!(!stands_out(0.1, 0.0, 7) && stands_out(0.1, 0.0, 8));
        assert!(!stands_out(0.0, 0.0, 10) && !stands_out(1.0, 0.0, 1));
    }
}
