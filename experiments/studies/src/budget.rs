//! `spts budget`: how much support accuracy, IoU and classification each effect of each stage costs.
//!
//! Objects are pressed once. A skin is a contact model with the active parts of the transducer; its raster scans are
//! the ground truth and the training data of its decoder. On every skin the presses are recorded with every readout to
//! be compared, under the same noise, decoded and scored. The paired differences of the scores are the budget.

use rayon::prelude::*;
use spts::chain::{Acquisition, Chain, ChainConfig};
use spts::progress::Progress;
use spts::provenance::{Provenance, combined_hash};
use spts::record::{PressFrames, Twin};
use spts::scene::{PressConfig, Scene, SceneConfig};
use spts_circuit::{EFFECTS, FAULTS, Interpolated, Mode, Profile, Recording};
use spts_contact::Frame;
use spts_contact::objects::{OBJECTS, ObjectSpec, by_name};
use spts_eval::decoders::{TrainedDecoder, published};
use spts_eval::protocol::{PUBLISHED_TAXELS, Protocol, Truth};
use spts_eval::training::{Learned, Learning};
use spts_eval::{Press, RASTER, ScoredSession, Scorer, Tally, Window, idle_mean, unique};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::Workspace;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use spts_recon::statistics::{Sample, mean, two_sided};
use spts_sim::fidelity::change_model;
use std::path::Path;

/// Objects that the published recordings contain in both modes.
const DEFAULT_OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];
/// Numbers of measurements on the published skin. A larger skin uses the same shares of its taxels.
const DEFAULT_MEASUREMENTS: [usize; 3] = [7, 20, 50];

/// Settings of `spts budget`, which measures how much each imperfection of transducer, readout and contact costs in
/// image quality.
#[derive(Debug, Clone)]
pub struct BudgetStudy {
    /// Names of objects; "all" for every object, empty for those that the published recordings have in both modes.
    pub objects: Vec<String>,
    /// Readout profile: a name, or a file that ends in `.toml`.
    pub readout: String,
    /// Numbers of measurements; empty for 7, 20 and 50, or the same shares of a larger skin's taxels.
    pub measurements: Vec<usize>,
    /// Decoding variants.
    pub decodes: Vec<&'static str>,
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
        let size = if self.quick { BudgetSize::quick() } else { BudgetSize::full() };
        let taxels = self.side * self.side;
        let measurements = self.fitting(&size)?;
        let objects = self.objects()?;
        let scenes = |layer: bool| -> Result<Vec<Scene>, Refusal> {
            let scenes = objects.iter().map(|object| self.scene(object, &size, layer));
            scenes.collect()
        };
        let (columns, layers) = (scenes(false)?, scenes(true)?);
        progress.stage("pressing", Some(2 * objects.len() * size.presses()));
        let press = |scenes: Vec<Scene>| {
            let pressed = objects.par_iter().zip(scenes).map(|(&object, scene)| {
                let presses = Twin::new(&scene)?.presses(0..size.presses(), &|| progress.step())?;
                Ok(Pressed { object, scene, presses })
            });
            pressed.collect::<Result<Vec<_>, Refusal>>()
        };
        let pressed = [press(columns)?, press(layers)?];
        progress.end();
        let hashes = pressed[0].iter().map(|p| p.scene.hash()).collect::<Result<Vec<_>, _>>()?;
        let whole = pressed[0][0].scene.chain().profile();
        let items = items(whole);
        let comparisons = comparisons(&items);
        let [everything, ideal] = [items, Vec::new()].map(|acts| Variant { layer: false, acts });
        let compared = comparisons.iter().map(|line| &line.variant);
        let variants = unique([&everything, &ideal].into_iter().chain(compared));
        progress.stage("recording and scoring", Some(variants.len() * objects.len() * size.sessions));
        let mut scores = vec![ScoreTable::new(); variants.len()];
        let mut scan = ScoreTable::new();
        // skin by skin: what a skin has learned is used by all its readouts and then dropped
        for skin in unique(variants.iter().map(|variant| variant.skin())) {
            let learned = LearnedSkin::prepare(&pressed[usize::from(skin.0)], &skin.1, &size, self)?;
            if skin == everything.skin() {
                scan = learned.scan();
            }
            let of_skin = scores.par_iter_mut().zip(&variants).filter(|(_, variant)| variant.skin() == skin);
            of_skin.try_for_each(|(scores, variant)| {
                *scores = learned.score(&variant.readout(whole), &measurements, progress)?;
                Ok::<_, Refusal>(())
            })?;
        }
        progress.end();
        let scores_of = |variant: &Variant| {
            let place = variants.iter().position(|v| *v == variant);
            &scores[place.unwrap_or_default()]
        };
        let each_m = |&decode: &&'static str| measurements.iter().map(|&m| (decode, m)).collect::<Vec<_>>();
        let keys: Vec<(&'static str, usize)> = self.decodes.iter().flat_map(each_m).collect();
        let (mut rows, mut ends) = (Vec::new(), Vec::new());
        for line in &comparisons {
            let before = scores_of(match line.mode {
                Direction::Ablation => &everything,
                Direction::Addition => &ideal,
            });
            let after = scores_of(&line.variant);
            rows.extend(keys.iter().enumerate().map(|(key, &(decode, m))| BudgetRow {
                stage: line.stage,
                effect: line.effect,
                mode: line.mode,
                decode,
                m,
                taxels,
                changes: CHANGED.map(|score| mean_score(after, Some(before), key, score)),
            }));
        }
        for (chain, variant) in [("everything", &everything), ("ideal", &ideal)] {
            for (key, at) in keys.iter().enumerate() {
                ends.extend(end_points(chain, *at, taxels, scores_of(variant), key));
            }
        }
        ends.extend(end_points(SCAN, (RASTER, taxels), taxels, &scan, 0));
        Ok(BudgetReport { rows, end_points: ends, provenance: Provenance::new(self.seed, combined_hash(&hashes)) })
    }

    fn objects(&self) -> Result<Vec<&'static ObjectSpec>, Refusal> {
        if self.objects.iter().any(|name| name == "all") {
            return Ok(OBJECTS.iter().collect());
        }
        let default = DEFAULT_OBJECTS.map(str::to_owned);
        let names: &[String] = if self.objects.is_empty() { &default } else { &self.objects };
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

    /// The numbers of measurements. An M of which no vote fits into a press is refused.
    fn fitting(&self, size: &BudgetSize) -> Result<Vec<usize>, Refusal> {
        let taxels = self.side * self.side;
        let share = |m: usize| (m * taxels).div_ceil(PUBLISHED_TAXELS);
        let measurements = if self.measurements.is_empty() {
            DEFAULT_MEASUREMENTS.map(share).to_vec()
        } else {
            self.measurements.clone()
        };
        let most = size.most_measurements(taxels);
        match measurements.iter().find(|&&m| m > most) {
            None => Ok(measurements),
            Some(m) => Err(Refusal::new(format!(
                "`--measurements`: {m} is outside [1, {most}] on a skin of {taxels} taxels: a press has no room for a vote of windows of {m}"
            ))),
        }
    }

    /// Scene of an object: on the published skin at its own place, on a larger one as far from the middle. `layer` puts
    /// the elastic layer, solved at the frames, in place of the columns.
    fn scene(&self, object: &ObjectSpec, size: &BudgetSize, layer: bool) -> Result<Scene, Refusal> {
        let published = SkinLayout::default();
        let shift = 0.5 * (self.side as f64 - published.rows() as f64);
        let mut config = SceneConfig {
            seed: self.seed,
            readout: Some(self.readout.clone()),
            skin: SkinLayout::new(self.side, self.side, published.pitch_m(), published.electrode_m())?,
            press: Some(PressConfig {
                object: Some(object.name.to_owned()),
                row: Some(object.placement.row + shift),
                col: Some(object.placement.col + shift),
                presses: size.presses(),
                ..PressConfig::default()
            }),
            ..SceneConfig::default()
        };
        if layer {
            change_model(&mut config.contact, "layer");
            config.contact.insert("coupled".to_owned(), false.into());
        }
        Scene::new(config, Path::new(""))
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
    pub changes: [Sample; CHANGES.len()],
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
    pub scores: [Sample; 4],
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
fn end_points(
    chain: &'static str,
    (decode, m): (&'static str, usize),
    taxels: usize,
    scores: &ScoreTable,
    key: usize,
) -> [EndPoint; 3] {
    [0, 1, 2].map(|place| EndPoint {
        chain,
        decode,
        m,
        taxels,
        truth: TRUTHS[place],
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
    ("session", "session_log_sd = 0.0\nsession_tilt_log_sd = 0.0"),
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
    let item = |stage, name| BudgetItem { stage, name };
    let parts = PARTS.iter().map(|(name, _)| item(TRANSDUCER, name));
    let present = FAULTS.iter().filter(|(name, _)| profile.faults.iter().any(|f| f.name == *name));
    let listed = EFFECTS.iter().filter(|(name, _)| profile.compressive.contains_key(*name));
    let mut effects: Vec<BudgetItem> = listed.map(|(name, _)| item(stage_of(name), name)).collect();
    // stable: signal order within a stage
    effects.sort_by_key(|item| READOUT_STAGES.iter().position(|(stage, _)| *stage == item.stage));
    parts.chain(present.map(|(name, _)| item(CELLS, name))).chain(effects).collect()
}

fn stage_of(effect: &str) -> &'static str {
    let found = READOUT_STAGES.iter().find(|(_, effects)| effects.contains(&effect));
    found.map_or(OTHER, |(stage, _)| stage)
}

/// Transducer parameters with the parts called `acting` alone.
fn with_parts(acting: &[&str]) -> Result<toml::Table, Refusal> {
    let off = PARTS.iter().filter(|(name, _)| !acting.contains(name));
    let text: Vec<&str> = off.map(|(_, text)| *text).collect();
    toml::from_str(&text.join("\n")).map_err(Refusal::from_error)
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

/// A chain: the contact model, and the items that act. Without any it is the ideal one: the transducer's static law
/// alone, and y = Φx.
#[derive(Debug, Clone, PartialEq, Eq)]
struct Variant {
    /// Whether the foam is an elastic layer instead of columns.
    layer: bool,
    /// The active items.
    acts: Vec<BudgetItem>,
}

impl Variant {
    /// What the skin follows from: whether it has an elastic layer, and the acting parts of the transducer.
    fn skin(&self) -> (bool, Vec<&'static str>) {
        let parts = self.acts.iter().filter(|item| item.stage == TRANSDUCER);
        (self.layer, parts.map(|item| item.name).collect())
    }

    /// The profile `whole` with the effects and faults that act.
    fn readout(&self, whole: &Profile) -> Profile {
        let acts = |name: &str, fault: bool| {
            let mut of_readout = self.acts.iter().filter(|item| item.stage != TRANSDUCER);
            of_readout.any(|item| item.name == name && (item.stage == CELLS) == fault)
        };
        let mut profile = whole.clone();
        profile.faults.retain(|fault| acts(&fault.name, true));
        profile.compressive.retain(|name, _| acts(name, false));
        profile
    }
}

/// One line of the budget: a chain that is compared with the whole or with the ideal one.
#[derive(Debug, Clone, PartialEq, Eq)]
struct ChainComparison {
    stage: &'static str,
    effect: &'static str,
    mode: Direction,
    variant: Variant,
}

/// Ablation and addition of every item and of every stage; the contact model is exchanged in the whole chain.
fn comparisons(items: &[BudgetItem]) -> Vec<ChainComparison> {
    let mut all = Vec::new();
    let mut compare = |stage, effect, mode, layer, acts: &dyn Fn(&BudgetItem) -> bool| {
        let acts = items.iter().copied().filter(acts).collect();
        all.push(ChainComparison { stage, effect, mode, variant: Variant { layer, acts } });
    };
    compare(CONTACT, LAYER, Direction::Ablation, true, &|_| true);
    for stage in unique(items.iter().map(|item| item.stage)) {
        let of_stage = items.iter().map(|item| (item.stage, item.name));
        let effects = [(stage, WHOLE_STAGE)].into_iter().chain(of_stage.filter(|of| of.0 == stage));
        for (_, effect) in effects {
            let own = |item: &BudgetItem| item.stage == stage && (effect == WHOLE_STAGE || item.name == effect);
            compare(stage, effect, Direction::Ablation, false, &|item| !own(item));
            compare(stage, effect, Direction::Addition, false, &own);
        }
    }
    all
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
            learning: Learning { presses: 0..4, training_images: 1500, sweeps: 15 },
            sessions: 10,
            votes: 6,
        }
    }

    /// A look in a few seconds.
    fn quick() -> Self {
        Self {
            raster_presses: 3,
            learning: Learning { presses: 0..2, training_images: 300, sweeps: 4 },
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
    Acquisition { lead_frames: base.lead_frames + 1000 * session as u64, ..base }
}

/// An object and all its presses.
struct Pressed {
    object: &'static ObjectSpec,
    scene: Scene,
    presses: Vec<PressFrames>,
}

/// What may count as touched.
const TRUTHS: [&str; 3] = ["raster", "image", "contact"];

/// A skin that has been pressed and learned from.
struct LearnedSkin<'a> {
    size: &'a BudgetSize,
    /// Transducer and complete readout.
    chain: Chain,
    /// What is learned for each compressive session, and its decoders. Training starts at random, so two dictionaries
    /// learned from the same scans have different scores.
    learned: Vec<(Learned, Vec<TrainedDecoder>)>,
    /// Objects in order of the presses.
    objects: Vec<LearnedObject>,
    /// Scored instants.
    protocol: Protocol,
}

/// An object on a skin.
struct LearnedObject {
    /// Label.
    label: usize,
    /// Conductance as a function of time, one source for each compressive session.
    sources: Vec<Interpolated>,
    /// The touched taxels by every truth of [`TRUTHS`]: those of a raster frame, as published; of the noiseless image
    /// of the same skin in the scan's session at the same instant; and of that image on a skin that has the static law
    /// alone.
    masks: [Vec<bool>; 3],
    raster: Recording,
}

impl<'a> LearnedSkin<'a> {
    /// Presses all objects on a skin with the transducer's parts `acting`, scans the first presses and learns from
    /// them.
    fn prepare(
        pressed: &[Pressed],
        acting: &[&str],
        size: &'a BudgetSize,
        study: &BudgetStudy,
    ) -> Result<Self, Refusal> {
        let scene = &pressed[0].scene;
        let (chain, bare) = (chain(scene, acting)?, chain(scene, &[])?);
        let protocol = size.protocol(scene.skin().taxels());
        let objects = pressed.par_iter().map(|pressed| LearnedObject::new(pressed, &chain, &bare, size, &protocol));
        let objects = objects.collect::<Result<Vec<_>, Refusal>>()?;
        let scanned = pressed.iter().zip(&objects).map(|(pressed, object)| ScoredSession {
            name: pressed.object.name.to_owned(),
            object: pressed.object.name.to_owned(),
            label: object.label,
            again: false,
            shared_raster: false,
            raster: Some(object.raster.clone()),
            compressive: None,
            protocol,
            raster_protocol: protocol,
            held: true,
            simulated: Vec::new(),
            courses: Vec::new(),
        });
        let scanned: Vec<ScoredSession> = scanned.collect();
        let learned = (0..size.sessions).into_par_iter().map(|session| {
            let streams = Streams::new(study.seed).child("learning", session as u64);
            let learned = Learned::learn(&scanned, &size.learning, scene.skin().cols(), streams)?;
            let decoders = study.decodes.iter().map(|decode| published(decode, &learned));
            Ok((decoders.collect::<Result<Vec<_>, _>>()?, learned))
        });
        let learned = learned.map(|found| found.map(|(decoders, learned)| (learned, decoders)));
        Ok(Self { size, learned: learned.collect::<Result<_, Refusal>>()?, chain, objects, protocol })
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
                object.tally(&mut tallies, image);
                let decision = self.learned.first().map(|(l, _)| l.classifier.classify(image, &mut work));
                decisions.push(decision.and_then(Result::unwrap_or_default));
            }
            tallies[0].decisions(&decisions, object.label, self.protocol.vote);
            vec![vec![press_scores(&tallies)]]
        };
        self.objects.iter().map(of_object).collect()
    }

    /// Records all compressive sessions with `profile` and scores them. Noise depends on object and session alone, so
    /// that two profiles are compared under the same noise.
    fn score(&self, profile: &Profile, measurements: &[usize], progress: &dyn Progress) -> Result<ScoreTable, Refusal> {
        let chain = self.chain.with_profile(profile.clone())?;
        let of_object = |object: &LearnedObject| {
            let sessions = (0..self.size.sessions).into_par_iter().map(|session| {
                let scores = self.score_press(&chain, object, session, measurements);
                progress.step();
                scores
            });
            sessions.collect::<Result<Vec<_>, Refusal>>()
        };
        self.objects.par_iter().map(of_object).collect()
    }

    /// Records compressive session `session` of `object` with `chain` and scores it by every decoder and M.
    fn score_press(
        &self,
        chain: &Chain,
        object: &LearnedObject,
        session: usize,
        measurements: &[usize],
    ) -> Result<Vec<PressScores>, Refusal> {
        let Protocol { first_frame, frames, vote, .. } = self.protocol;
        let mut source = [object.sources[session].clone()];
        let duration_s = ((first_frame + frames) * object.raster.taxels()) as f64 / chain.sample_rate_hz();
        let acquisition = compressive_acquisition(object.label, session);
        let recording = chain.record_sources(&mut source, duration_s, &acquisition)?;
        let idle_v = idle_mean(&recording, 0);
        let [first, end] =
            [first_frame.min(recording.frames()), recording.frames()].map(|f| f * recording.measurements_per_frame());
        let mut all = Vec::new();
        for decoder in &self.learned[session].1 {
            for &m in measurements {
                let mut tallies: [Tally; 3] = Default::default();
                let mut scorer = Scorer::new(decoder);
                for start in starts(self.size.votes, end - first, vote * m) {
                    // vote by vote, because the weights of a whole press on a large skin fill the memory
                    let start = first + start;
                    let press = Press::within(&recording, 0, start..start + vote * m, idle_v);
                    let windows: Vec<Window<'_>> = press.windows(0..press.len(), m, m).map(|(_, w)| w).collect();
                    let answers = scorer.answers(&windows)?;
                    answers.iter().for_each(|answer| object.tally(&mut tallies, &answer.image));
                    let decisions: Vec<Option<usize>> = answers.iter().map(|a| scorer.class(a)).collect();
                    tallies[0].decisions(&decisions, object.label, vote);
                }
                all.push(press_scores(&tallies));
            }
        }
        Ok(all)
    }
}

/// First measurements of the votes of `vote_len` measurements, at most `most`, spread evenly over a press of `len`.
fn starts(most: usize, len: usize, vote_len: usize) -> impl Iterator<Item = usize> {
    let votes = most.min(len / vote_len);
    (0..votes).map(move |vote| vote * (len - vote_len) / votes.saturating_sub(1).max(1))
}

/// Chain of `scene` with the transducer's parts `acting` alone.
fn chain(scene: &Scene, acting: &[&str]) -> Result<Chain, Refusal> {
    let config = ChainConfig { transducer_parameters: with_parts(acting)?, ..scene.config().chain() };
    Chain::new(&config, scene.skin(), scene.seed(), Path::new(""))
}

impl LearnedObject {
    fn new(
        pressed: &Pressed,
        chain: &Chain,
        bare: &Chain,
        size: &BudgetSize,
        protocol: &Protocol,
    ) -> Result<Self, Refusal> {
        let presses: Vec<&[Frame]> = pressed.presses.iter().map(|press| press.frames.as_slice()).collect();
        let label = usize::from(pressed.object.label);
        let scan = raster_acquisition(label);
        let (scans, read) = presses.split_at(size.raster_presses);
        let mut scanned = chain.conductance(scans, &scan)?;
        let raster = chain.record_sources(&mut scanned, pressed.scene.duration_s(), &scan)?;
        let time_s = raster.time_s(protocol.truth.1.min(raster.frames() - 1));
        let sources = read.par_iter().enumerate().map(|(session, &press)| {
            // every session has gains of its own, on a sheet that was pressed as often as the scanned one
            let sums =
                Acquisition { conditioning_presses: size.raster_presses, ..compressive_acquisition(label, session) };
            chain.conductance(&[press], &sums)
        });
        Ok(Self {
            label,
            sources: sources.collect::<Result<Vec<_>, Refusal>>()?.concat(),
            masks: [
                Truth::new(&raster, protocol).support,
                touched(chain, scans, scan.session, time_s),
                touched(bare, scans, scan.session, time_s),
            ],
            raster,
        })
    }

    /// Scores `image` by every truth.
    fn tally(&self, tallies: &mut [Tally; 3], image: &[f64]) {
        for (tally, truth) in tallies.iter_mut().zip(&self.masks) {
            tally.image(image, truth);
        }
    }
}

/// Support of the conductance at `time_s` of the last of `presses`, above that of the untouched skin.
fn touched(chain: &Chain, presses: &[&[Frame]], session: u64, time_s: f64) -> Vec<bool> {
    let mut mask = Vec::new();
    let maps = chain.conductance_maps(presses, session).pop().unwrap_or_default();
    let after = presses.last().map_or(0, |frames| frames.partition_point(|f| f.time_s < time_s));
    if let (Some(idle), Some(map)) = (maps.first(), maps.get(after).or(maps.last())) {
        let pairs = map.values().iter().zip(idle.values());
        let image: Vec<f64> = pairs.map(|(g, g0)| g - g0).collect();
        support(&image, SUPPORT_THRESHOLD, &mut mask);
    }
    mask
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
    let scores = [a.support, b.support, c.support, a.iou, b.iou, c.iou, a.class_single, a.class_vote20];
    scores.map(|score| score.unwrap_or(0.0))
}

/// Probability with which a mean of nothing but chance is taken to stand out.
pub const CHANCE: f64 = 0.01;

/// Whether the mean over sessions is further from zero than chance brings it once in 1/[`CHANCE`]: by Student's t test
/// with S − 1 degrees of freedom; and where all sessions have the same value, so that there is no error to measure it
/// by, by the test of signs, p = 2^(1 − S).
pub fn stands_out(sample: &Sample) -> bool {
    let freedom = u32::try_from(sample.count.saturating_sub(1)).unwrap_or(u32::MAX);
    if sample.mean.abs() <= 0.0 || freedom == 0 {
        return false;
    }
    let se = sample.standard_error();
    // equal values leave the rounding of their mean
    let chance = if se > 1e-12 * sample.mean.abs() {
        two_sided(sample.mean / se, freedom)
    } else {
        (-f64::from(freedom)).exp2()
    };
    chance < CHANCE
}

/// The score with the place `score` at the key with the place `key`, or its change from `reference` press by press, so
/// that noise which both share cancels: mean over the objects, session by session.
///
/// Every session has presses, noise and a learned dictionary of its own, so sessions are independent; the objects of
/// one session share the dictionary and are not. The objects are the ones that were asked about, not a sample of
/// others.
fn mean_score(scores: &ScoreTable, reference: Option<&ScoreTable>, key: usize, score: usize) -> Sample {
    let sessions = scores.iter().map(Vec::len).min().unwrap_or(0);
    let of_session = |session: usize| {
        let before = |object: usize| reference.map_or(0.0, |r| r[object][session][key][score]);
        let objects = scores.iter().enumerate();
        mean(objects.map(|(object, sessions)| sessions[session][key][score] - before(object))).unwrap_or_default()
    };
    let means: Vec<f64> = (0..sessions).map(of_session).collect();
    let none = Sample { count: 0, mean: 0.0, variance: 0.0 };
    Sample::of(&means).unwrap_or(none)
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
            let others: Vec<&str> = PARTS.iter().map(|(other, _)| *other).filter(|other| other != name).collect();
            let parameters = with_parts(&others).unwrap();
            build_transducer("velostat", parameters, &SkinLayout::default(), Streams::new(0)).unwrap();
        }
        let parameters: usize = PARTS.iter().map(|(_, text)| text.lines().count()).sum();
        assert_eq!(with_parts(&[]).unwrap().len(), parameters);
    }

    #[test]
    fn stages_stand_in_signal_order() {
        let (_, text) = PROFILES.iter().find(|(name, _)| *name == "as_built").unwrap();
        let faults = "[[faults]]\nname = \"dead\"\ntaxel = 4\n[[faults]]\nname = \"dead\"\ntaxel = 7\n";
        let profile = Profile::from_toml(&format!("{text}\n{faults}")).unwrap();
        let acts = items(&profile);
        assert_eq!(
            unique(acts.iter().map(|item| item.stage)),
            [TRANSDUCER, CELLS, "drive", "amplifier", "noise", "converter"]
        );
        assert_eq!(acts.iter().filter(|item| item.stage == CELLS).count(), 1);
        let [whole, ideal] = [acts, Vec::new()].map(|acts| Variant { layer: false, acts }.readout(&profile));
        assert_eq!(whole, profile);
        assert!(ideal.faults.is_empty() && ideal.compressive.is_empty() && !ideal.raster.is_empty());
    }

    /// Two stages with two items and one: 1 exchange of the contact, 2 × (2 stages + 3 items) comparisons. A stage of
    /// one item is that item: chains all, none, layer, 2 × (first stage + 3 items).
    #[test]
    fn every_chain_is_compared() {
        let item = |stage, name| BudgetItem { stage, name };
        let items = [item("a", "x"), item("a", "y"), item("b", "z")];
        let lines = comparisons(&items);
        assert_eq!(lines.len(), 1 + 2 * 5);
        // all less the first stage is the second stage alone, and the other way round
        assert_eq!(unique(lines.iter().map(|line| &line.variant)).len(), 1 + 3 + 3);
        let acts = |effect, mode| {
            let line = lines.iter().find(|c| c.effect == effect && c.mode == mode).unwrap();
            line.variant.acts.iter().map(|item| item.name).collect::<String>()
        };
        assert_eq!((acts("y", Direction::Ablation), acts("y", Direction::Addition)), ("xz".to_owned(), "y".to_owned()));
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
    /// differ by; and a shift that is the same in every press has no error, however much the presses differ.
    #[test]
    fn sessions_are_the_sample_and_changes_are_paired() {
        let table = |add: f64| [[-9.0, 3.0, 7.0], [11.0, 3.0, 3.0]].map(|of| of.map(|v| vec![[v + add; 8]]).to_vec());
        let (before, after) = (table(0.0).to_vec(), table(0.125).to_vec());
        let found = mean_score(&before, None, 0, IOU);
        assert_relative_eq!(found.mean, 3.0, max_relative = 1e-15);
        assert_relative_eq!(found.standard_error(), (4.0_f64 / 3.0).sqrt(), max_relative = 1e-15);
        let change = mean_score(&after, Some(&before), 0, IOU);
        assert_relative_eq!(change.mean, 0.125, max_relative = 1e-15);
        assert!(change.variance <= 0.0);
    }

    /// Student's quantiles at 1 % are 9.925 for 3 sessions and 3.250 for 10; equal values stand out by their signs,
    /// from the eighth session on: 2⁻⁷ < 1 % < 2⁻⁶.
    #[test]
    fn few_sessions_need_a_larger_distance() {
        let of = |mean: f64, se: f64, count: usize| {
            let variance = se * se * count as f64;
            stands_out(&Sample { count, mean, variance })
        };
        assert!(!of(-9.8, 1.0, 3) && of(-10.0, 1.0, 3));
        assert!(!of(3.2, 1.0, 10) && of(3.3, 1.0, 10));
        assert!(!of(0.1, 0.0, 7) && of(0.1, 0.0, 8));
        assert!(!of(0.0, 0.0, 10) && !of(1.0, 0.0, 1));
    }
}
