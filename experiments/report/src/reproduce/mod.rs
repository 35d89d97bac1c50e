//! `spts reproduce`: simulate, learn, score, draw, report.

mod comparison;
mod dataset;
mod figures;
mod headline;
mod latency;
mod page;
mod results;
mod sheets;
mod tables;
mod tracking;

pub use headline::Headline;

use crate::animation::{MOTION_FIGURES, simulate_motion};
use crate::{Origin, PageFigure, html, per_object};
use comparison::ReadoutSection;
use dataset::SimulatedData;
use figures::Shown;
use headline::Facts;
use page::PageContent;
use results::{BothSkins, ReproductionSize, SkinResults, TimingRow, best, timings};
use serde::Serialize;
use spts::output::{OutputFolder, write_bytes, write_json, write_table};
use spts::progress::Progress;
use spts::provenance::Provenance;
use spts_eval::protocol::Protocol;
use spts_eval::training::{Learned, TrainingPresses};
use spts_eval::{PublishedSkin, ScoredSession, ScoredSkin};
use spts_input::Refusal;
use spts_models::Streams;
use spts_studies::per_object::{PerObjectReport, PerObjectStudy};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Simulated skins that the real one is held against, object by object.
const SKINS: u64 = 8;

/// Settings of the whole report that `spts reproduce` writes. [`Reproduction::run`] makes it.
#[derive(Debug, Clone)]
pub struct Reproduction {
    /// Root of every random number.
    pub seed: u64,
    /// Whether to make a short run of about a minute, with few presses and few numbers of measurements.
    pub quick: bool,
    /// Folder of recordings of the real skin, to score beside the twin; `None` to score the twin alone.
    pub recordings: Option<PathBuf>,
    /// Folder that the report is written to.
    pub out: PathBuf,
    /// Whether the twin's recordings are written, as session folders.
    pub save_recordings: bool,
}

/// What was scored.
#[derive(Clone, Copy)]
struct Scored<'a> {
    skins: &'a BothSkins<'a>,
    comparison: Option<&'a ReadoutSection>,
    per_object: Option<&'a PerObjectReport>,
    timings: &'a [TimingRow],
    /// Recordings of the real skin that are not there.
    missing: &'a [String],
}

/// What `summary.json` of a report holds: its most important numbers, and where they come from.
#[derive(Debug, Clone, Serialize)]
pub struct ReproductionSummary {
    /// The most important numbers.
    pub headline: Headline,
    /// Where they come from.
    pub provenance: Origin,
}

impl Reproduction {
    /// Runs it all, stage by stage as `progress` hears, and writes the report.
    ///
    /// # Errors
    /// [`Refusal`] when the recordings cannot be used, the simulation fails, or a file cannot be written.
    pub fn run(&self, progress: &dyn Progress) -> Result<ReproductionSummary, Refusal> {
        let begin = Instant::now();
        let size = if self.quick { ReproductionSize::quick() } else { ReproductionSize::full() };
        let mut out = OutputFolder::open(&self.out)?;
        progress.stage("reading recordings", None);
        let real = self.recordings.as_deref().map(PublishedSkin::open).transpose()?;
        progress.stage("simulating presses", Some(dataset::steps(&size)));
        let dataset = dataset::simulate(self.seed, &size, &|| progress.step())?;
        progress.stage("drawing what moves", None);
        simulate_motion(self.seed, &out.folder("figures")?).map_err(|error| out.unstaged(error))?;
        progress.stage("learning", None);
        let twin = self.twin_skin(&dataset, &size)?;
        progress.end();
        let missing = real.as_ref().map_or_else(Vec::new, |r| r.missing.clone());
        let (comparison, per_object) = match (&self.recordings, &real) {
            (Some(recordings), Some(real)) if !self.quick => {
                let study = PerObjectStudy { recordings, skins: SKINS, seed: self.seed, causes: false };
                let comparison = ReadoutSection::run(recordings, real, self.seed, progress)?;
                (Some(comparison), Some(study.run(progress)?))
            }
            _ => (None, None),
        };
        let real = real.map(|r| with_protocol(r.skin, size.real_protocol));
        let presses = twin.steps() + real.as_ref().map_or(0, ScoredSkin::steps);
        progress.stage("scoring presses", Some(presses));
        let done = || progress.step();
        let streams = Streams::new(self.seed);
        let of_twin = twin.sessions.iter();
        let of_twin = of_twin.filter_map(|s| TrainingPresses::within(s, &size.learning.presses));
        let of_twin = best(of_twin, dataset.cols, streams)?;
        let mut twin = SkinResults::new(twin, of_twin, &size.measurements, &size.localisation, &done)?;
        let real = real.map(|skin| {
            let unscored = skin.sessions.iter().filter_map(TrainingPresses::unscored);
            let of_real = best(unscored, skin.learned.cols, streams)?;
            SkinResults::new(skin, of_real, &size.measurements, &size.localisation, &done)
        });
        let mut real = real.transpose()?;
        progress.end();
        let common: Vec<String> =
            real.as_ref().map_or_else(Vec::new, |r| r.compressive_objects().map(str::to_owned).collect());
        twin.add_common_mean(&common);
        if let Some(real) = &mut real {
            real.add_common_mean(&common);
        }
        let skins = BothSkins { twin: &twin, real: real.as_ref() };
        progress.stage("timing and drawing", None);
        let results = Scored {
            timings: &timings(&twin, &size.measurements, size.timed_decodes)?,
            skins: &skins,
            comparison: comparison.as_ref(),
            per_object: per_object.as_ref(),
            missing: &missing,
        };
        let summary = self.write(&dataset, &results, begin, &mut out).map_err(|error| out.unstaged(error))?;
        out.commit()?;
        progress.end();
        Ok(summary)
    }

    /// The twin's skin, its decoder learned from its own raster images.
    fn twin_skin(&self, dataset: &SimulatedData, size: &ReproductionSize) -> Result<ScoredSkin, Refusal> {
        let scored = |object: &dataset::SimulatedObject| ScoredSession {
            protocol: size.protocol,
            raster_protocol: size.raster_protocol,
            // against a scan, as the real skin
            simulated: Vec::new(),
            ..ScoredSession::new(object.session.clone(), object.label)
        };
        let sessions: Vec<ScoredSession> = dataset.objects.iter().map(scored).collect();
        let learned = Learned::learn(&sessions, &size.learning, dataset.cols, Streams::new(self.seed))?;
        Ok(ScoredSkin { sessions, bounces: dataset.bounces.compressive().cloned(), learned })
    }

    fn write(
        &self,
        dataset: &SimulatedData,
        results: &Scored<'_>,
        begin: Instant,
        out: &mut OutputFolder,
    ) -> Result<ReproductionSummary, Refusal> {
        let Scored { skins, comparison, per_object, timings, missing } = *results;
        let correlations = skins.real.map_or_else(Vec::new, |real| tables::correlations(skins.twin, real));

        let folder = out.folder("tables")?;
        tables::write_skin(&folder, tables::TWIN, skins.twin)?;
        tables::write_mechanics(&folder, dataset)?;
        if let Some(real) = skins.real {
            tables::write_skin(&folder, tables::REAL, real)?;
            write_table(&folder.join("raster_correlation.csv"), &correlations)?;
        }
        write_table(&out.timed_path("timings.csv"), timings)?;
        let arrays = out.folder("arrays")?;
        tables::write_arrays(&arrays, dataset, skins.twin)?;
        if self.save_recordings {
            tables::write_sessions(out, dataset)?;
        }
        let figures = out.folder("figures")?;
        let shown = Shown { dataset, skins, correlations: &correlations, timings };
        figures::draw(&figures, &shown)?;
        if let Some(comparison) = comparison {
            comparison.write(&folder, &figures)?;
        }
        if let Some(objects) = per_object {
            per_object::write_tables(objects, |name| folder.join(name))?;
            per_object::draw(objects, &figures)?;
        }
        let wall_s = begin.elapsed().as_secs_f64();
        let headline =
            Headline::new(&Facts { dataset, skins, per_object, correlations: &correlations, timings, wall_s });
        let summary = ReproductionSummary {
            headline,
            provenance: Origin::here(Provenance::new(self.seed, dataset.scene_hash.clone())),
        };
        let mut page = page::page(&PageContent {
            summary: &summary,
            skins,
            correlations: &correlations,
            missing,
            quick: self.quick,
            per_object: per_object.map(per_object::section),
            animations: motion(&figures),
        });
        // the readout comes after what the skins are compared in
        page.sections.extend(comparison.map(ReadoutSection::section));
        write_bytes(&out.timed_path("index.html"), html(&page).as_bytes())?;
        write_json(&out.timed_path("summary.json"), &summary)?;
        Ok(summary)
    }
}

/// The moving pictures that are in the folder `figures`.
fn motion(figures: &Path) -> Vec<PageFigure> {
    let there = MOTION_FIGURES.iter().filter(|m| figures.join(m.file).is_file());
    let each =
        there.map(|m| PageFigure { still: Some(m.still.to_owned()), ..PageFigure::new(m.file, m.alt, m.caption) });
    each.collect()
}

/// `skin` with the real skin's presses scored as in the published evaluation.
fn with_protocol(mut skin: ScoredSkin, protocol: Protocol) -> ScoredSkin {
    for session in &mut skin.sessions {
        (session.protocol, session.raster_protocol) = (protocol, protocol);
    }
    skin
}
