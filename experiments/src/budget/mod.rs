//! `spts budget`: how much support accuracy, IoU and classification each effect of each stage costs.
//!
//! Objects are pressed once (`mechanics`). A skin (`skin`) is a contact model and the parts of the transducer that act: its raster
//! scans are the truth and what its decoder learns from. On every skin the presses are recorded with every readout that is
//! compared (`variants`) under the same noise, decoded and scored (`judge`); the differences are the budget (`table`).

pub(crate) mod estimate;
mod items;
mod judge;
mod mechanics;
mod plan;
mod sheet;
mod skin;
mod student;
mod table;
mod tally;
mod text;
mod variants;

pub use table::{EndPoint, Row};
pub use variants::Direction;

use crate::cli::{CliError, progress};
use crate::figures::save_bars;
use crate::learn::PUBLISHED_TAXELS;
use crate::output::{OutputFolder, Staged, write_bytes, write_json, write_table};
use crate::provenance::{Provenance, combined_hash, scene_hash};
use crate::score::Decode;
use crate::twin::{Chain, TwinError};
use estimate::Scores;
use indicatif::ProgressBar;
use items::Item;
use judge::Judge;
use mechanics::{Pressed, Setting};
use plan::Plan;
use rayon::prelude::*;
use serde::Serialize;
use skin::Skin;
use spts_circuit::Profile;
use spts_sim::objects::{OBJECTS, ObjectSpec, by_name};
use std::path::PathBuf;
use variants::{EVERYTHING, Variant, Variants};

/// Objects that the published recordings hold in both modes.
pub const DEFAULT_OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];
/// Numbers of measurements on the published skin; a larger one takes the same shares of its taxels.
pub const DEFAULT_MEASUREMENTS: [usize; 3] = [7, 20, 50];

/// What to take apart, and where to write it.
#[derive(Debug, Clone)]
pub struct Budget {
    /// Names of objects; "all" for every one, empty for [`DEFAULT_OBJECTS`].
    pub objects: Vec<String>,
    /// Readout profile: a name, or a file when it ends in `.toml`.
    pub readout: String,
    /// Numbers of measurements; empty for [`DEFAULT_MEASUREMENTS`] or the same shares of a larger skin's taxels.
    pub measurements: Vec<usize>,
    /// Decodes.
    pub decodes: Vec<Decode>,
    /// Taxels along one side of the skin. Range [10, 40].
    pub side: usize,
    /// Root of every random number.
    pub seed: u64,
    /// Few presses, little learning.
    pub quick: bool,
    /// Folder of the results.
    pub out: PathBuf,
}

/// The budget.
#[derive(Debug, Clone, Serialize)]
pub struct Report {
    /// One line an effect, direction, decode and M.
    pub rows: Vec<Row>,
    /// The whole chain, the ideal one and the scan that is the truth.
    pub end_points: Vec<EndPoint>,
    /// What they depend on.
    pub provenance: Provenance,
}

impl Budget {
    /// Presses, records and scores everything and writes tables and picture.
    ///
    /// # Errors
    /// [`CliError`] when an object or the readout cannot be used, the simulation fails, or a file cannot be written.
    pub fn run(&self) -> Result<Report, CliError> {
        OutputFolder::check(&self.out)?;
        let plan = if self.quick { Plan::quick() } else { Plan::full() };
        let keys = self.keys(&plan)?;
        let objects = self.objects()?;
        let setting = Setting {
            objects: &objects,
            readout: &self.readout,
            side: self.side,
            seed: self.seed,
        };
        let scenes = objects.iter().map(|object| setting.scene(object, &plan, false));
        let scenes = scenes.collect::<Result<Vec<_>, TwinError>>()?;
        let Some(first) = scenes.first() else {
            return Err(CliError::Usage("`--objects` names no object".to_owned()));
        };
        let profile = Chain::new(first)?.profile().clone();
        let hashes = scenes.iter().map(scene_hash).collect::<Result<Vec<_>, _>>();
        let hash = combined_hash(&hashes.map_err(TwinError::from)?);
        let items = items::items(&profile);
        let variants = Variants::new(&items);
        let bar = progress(2 * objects.len() * plan.presses(), "pressing");
        let pressed = [false, true].map(|layer| setting.press(&plan, layer, &|| bar.inc(1)));
        bar.finish_and_clear();
        let [columns, layer] = pressed;
        let study = Study {
            plan: &plan,
            profile: &profile,
            items: &items,
            keys: &keys,
            seed: self.seed,
            pressed: [columns?, layer?],
        };
        let (scores, scan) = study.score(&variants)?;
        let taxels = self.side * self.side;
        let report = Report {
            rows: table::rows(&variants, &scores, &keys, taxels),
            end_points: [table::end_points(&scores, &keys, taxels), table::scan(&scan, taxels)].concat(),
            provenance: Provenance::new(self.seed, hash),
        };
        let staged = OutputFolder::create(&self.out)?.stage()?;
        report.write(&staged).map_err(|error| error.unstaged(&staged))?;
        staged.commit()?;
        Ok(report)
    }

    fn objects(&self) -> Result<Vec<&'static ObjectSpec>, CliError> {
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
                return Err(CliError::Usage(format!(
                    "`--objects`: `{name}` is not all or one of {}",
                    known.join(", ")
                )));
            };
            if objects.iter().any(|o| o.name == object.name) {
                return Err(CliError::Usage(format!("`--objects`: `{name}` is there twice")));
            }
            objects.push(object);
        }
        Ok(objects)
    }

    /// Every decode with every M. An M of which no vote fits into a press is refused.
    fn keys(&self, plan: &Plan) -> Result<Vec<(Decode, usize)>, CliError> {
        let taxels = self.side * self.side;
        let share = |m: usize| (m * taxels).div_ceil(PUBLISHED_TAXELS);
        let measurements = if self.measurements.is_empty() {
            DEFAULT_MEASUREMENTS.map(share).to_vec()
        } else {
            self.measurements.clone()
        };
        let most = plan.most_measurements(taxels);
        if let Some(m) = measurements.iter().find(|&&m| m > most) {
            return Err(CliError::Usage(format!(
                "`--measurements`: {m} is outside [1, {most}] on a skin of {taxels} taxels: a press has no room for a vote of windows of {m}"
            )));
        }
        let of_decode = |&decode| measurements.iter().map(move |&m| (decode, m)).collect::<Vec<_>>();
        Ok(self.decodes.iter().flat_map(of_decode).collect())
    }
}

/// What the scores of all chains are made from.
struct Study<'a> {
    plan: &'a Plan,
    profile: &'a Profile,
    items: &'a [Item],
    keys: &'a [(Decode, usize)],
    seed: u64,
    /// On columns, on the elastic layer.
    pressed: [Vec<Pressed>; 2],
}

impl Study<'_> {
    /// Scores of every chain, in their order, and of the whole chain's scan.
    fn score(&self, variants: &Variants) -> Result<(Vec<Scores>, Scores), CliError> {
        let objects = self.pressed[0].len();
        let jobs = variants.list.len() * objects * self.plan.sessions;
        let bar = progress(jobs, "recording and scoring");
        let mut scores: Vec<Scores> = vec![Vec::new(); variants.list.len()];
        let mut scan = Scores::new();
        for index in 0..variants.list.len() {
            if !scores[index].is_empty() {
                continue;
            }
            // skin by skin: what a skin has learned is used by all its readouts and then dropped
            let alike = |v: &Variant| self.skin_of(v) == self.skin_of(&variants.list[index]);
            let members: Vec<usize> = (0..variants.list.len()).filter(|&i| alike(&variants.list[i])).collect();
            let (layer, off) = self.skin_of(&variants.list[index]);
            let skin = Skin::prepare(&self.pressed[usize::from(layer)], &off, self.plan, self.seed)?;
            if index == EVERYTHING {
                scan = skin.scan();
            }
            let profiles: Vec<Profile> = members.iter().map(|&i| self.readout(&variants.list[i])).collect();
            for (&i, found) in members.iter().zip(self.score_skin(&skin, &profiles, &bar)?) {
                scores[i] = found;
            }
        }
        bar.finish_and_clear();
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
    fn score_skin(&self, skin: &Skin, profiles: &[Profile], bar: &ProgressBar) -> Result<Vec<Scores>, TwinError> {
        let judge = Judge::new(skin, self.keys, self.plan);
        let (objects, sessions) = (skin.objects.len(), self.plan.sessions);
        let flat = (0..profiles.len() * objects * sessions)
            .into_par_iter()
            .map(|job| {
                let (profile, press) = (job / (objects * sessions), job % (objects * sessions));
                let found = judge.score(&profiles[profile], press / sessions, press % sessions);
                bar.inc(1);
                found
            })
            .collect::<Result<Vec<_>, TwinError>>()?;
        let of_profile = |presses: &[_]| presses.chunks(sessions).map(<[_]>::to_vec).collect();
        Ok(flat.chunks(objects * sessions).map(of_profile).collect())
    }
}

impl Report {
    /// The end points and the change of the IoU with every effect, as tables to read.
    #[must_use]
    pub fn text(&self) -> String {
        text::overview(self)
    }

    /// The row of an effect, if it was measured.
    fn find(&self, (stage, effect): (&str, &str), direction: Direction, (decode, m): (&str, usize)) -> Option<&Row> {
        let found =
            |r: &&Row| (r.stage, r.effect, r.mode, r.decode, r.m) == (stage, effect, direction.name(), decode, m);
        self.rows.iter().find(found)
    }

    /// Stage and effect of every line, each once.
    fn effects(&self) -> Vec<(&'static str, &'static str)> {
        unique(self.rows.iter().map(|r| (r.stage, r.effect)))
    }

    fn decodes(&self) -> Vec<&'static str> {
        unique(self.rows.iter().map(|r| r.decode))
    }

    fn measurements(&self) -> Vec<usize> {
        unique(self.rows.iter().map(|r| r.m))
    }

    fn write(&self, staged: &Staged) -> Result<(), CliError> {
        write_table(&staged.path("budget.csv"), &self.rows)?;
        write_table(&staged.path("end_points.csv"), &self.end_points)?;
        write_bytes(&staged.path("summary.md"), text::markdown(self).as_bytes())?;
        let figures = staged.folder("figures")?;
        for decode in self.decodes() {
            for (name, truth, iou) in [
                ("budget", "truth from the raster scan", text::iou as text::Change),
                ("contact", "truth from the contact alone", text::iou_contact),
            ] {
                let chart = sheet::bars(self, decode, truth, iou);
                save_bars(&chart, &figures, &format!("{name}_{decode}"))?;
            }
        }
        write_json(&staged.path("provenance.json"), &self.provenance)?;
        Ok(())
    }
}

/// `values` in their order, each once.
fn unique<T: PartialEq>(values: impl Iterator<Item = T>) -> Vec<T> {
    let mut found = Vec::new();
    for value in values {
        if !found.contains(&value) {
            found.push(value);
        }
    }
    found
}
