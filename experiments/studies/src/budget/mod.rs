//! `spts budget`: how much support accuracy, IoU and classification each effect of each stage costs.
//!
//! Objects are pressed once (`mechanics`). A skin (`skin`) is a contact model with the active parts of the transducer;
//! its raster scans are the ground truth and the training data of its decoder. On every skin the presses are recorded
//! with every readout to be compared (`variants`) under the same noise, decoded and scored (`scorer`). The differences
//! are the budget (`table`).

pub(crate) mod estimate;
mod items;
mod mechanics;
mod report;
mod score;
mod scorer;
mod size;
mod skin;
mod table;
mod text;
mod variants;

pub use estimate::MeanWithError;
pub use items::CONTACT;
pub use report::BudgetReport;
pub use table::{BudgetRow, Change, EndPoint};
pub use variants::{Direction, WHOLE_STAGE};

use estimate::ScoreTable;
use items::BudgetItem;
use mechanics::{PressSetup, Pressed};
use rayon::prelude::*;
use scorer::PressScorer;
use size::BudgetSize;
use skin::LearnedSkin;
use spts::progress::Progress;
use spts::provenance::{Provenance, combined_hash};
use spts::record::TwinError;
use spts_circuit::Profile;
use spts_contact::objects::{OBJECTS, ObjectSpec, by_name};
use spts_eval::decoders::PublishedDecode;
use spts_eval::protocol::PUBLISHED_TAXELS;
use spts_input::Refusal;
use variants::{EVERYTHING, Variant, Variants};

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
        let hash = combined_hash(&hashes.map_err(TwinError::from).map_err(Refusal::from_error)?);
        let items = items::items(&profile);
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
        Ok(BudgetReport {
            rows: table::rows(&variants, &scores, &keys, taxels),
            end_points: [table::end_points(&scores, &keys, taxels), table::scan(&scan, taxels)].concat(),
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
        let off = parts.filter(|(item, acts)| item.stage == items::TRANSDUCER && !**acts);
        (variant.layer, off.map(|(item, _)| item.name).collect())
    }

    /// The profile with the effects that act in a chain.
    fn readout(&self, variant: &Variant) -> Profile {
        let mut profile = self.profile.clone();
        let items = self.items.iter().zip(&variant.acts);
        let off = items.filter(|(item, acts)| item.stage != items::TRANSDUCER && !**acts);
        for (item, _) in off {
            items::take_away(*item, &mut profile);
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
