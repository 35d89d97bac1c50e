//! `spts reproduce`: simulate, learn, score, draw, report.

mod comparison;
mod curves;
mod dataset;
mod headline;
mod images;
mod latency;
mod onset;
mod page;
mod plan;
mod results;
mod sheets;
mod tables;
mod timing;
mod tracking;

pub use headline::Headline;

use crate::cli::{CliError, progress, spinner};
use crate::figures::{save_charts, save_sheet};
use crate::learn::learn;
use crate::output::{OutputFolder, Staged, write_bytes, write_json, write_table};
use crate::provenance::{Machine, Provenance};
use crate::real::load;
use crate::report::html;
use crate::score::Arm;
use comparison::ReadoutSection;
use curves::Arms;
use dataset::Dataset;
use plan::Plan;
use results::ArmResults;
use serde::Serialize;
use spts_models::Streams;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// What to reproduce, and where to.
#[derive(Debug, Clone)]
pub struct Reproduction {
    /// Root of every random number.
    pub seed: u64,
    /// Short run.
    pub quick: bool,
    /// Recordings of the real skin.
    pub recordings: Option<PathBuf>,
    /// Folder of the report.
    pub out: PathBuf,
    /// Whether the twin's recordings are written as arrays.
    pub save_recordings: bool,
}

/// What was scored.
#[derive(Clone, Copy)]
struct Results<'a> {
    arms: &'a Arms<'a>,
    comparison: Option<&'a ReadoutSection>,
    /// Recordings of the real skin that are not there.
    missing: &'a [String],
}

/// The machine-readable end of a report.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// Headline figures.
    pub headline: Headline,
    /// Where they come from.
    pub provenance: Origin,
}

/// What the results depend on, and the machine that made them, which they do not depend on.
#[derive(Debug, Clone, Serialize)]
pub struct Origin {
    /// Seed, scenes, versions.
    #[serde(flatten)]
    pub provenance: Provenance,
    /// Processor and threads.
    #[serde(flatten)]
    pub machine: Machine,
}

impl Reproduction {
    /// Runs it all and writes the report.
    ///
    /// # Errors
    /// [`CliError`] when the recordings cannot be used, the simulation fails, or a file cannot be written.
    pub fn run(&self) -> Result<Summary, CliError> {
        let begin = Instant::now();
        let plan = if self.quick { Plan::quick() } else { Plan::full() };
        OutputFolder::check(&self.out)?;
        let reading = spinner("reading recordings");
        let real = self.recordings.as_deref().map(load).transpose()?;
        drop(reading);
        let bar = progress(dataset::steps(&plan), "simulating presses");
        let dataset = dataset::simulate(self.seed, &plan, &|| bar.inc(1))?;
        bar.finish_and_clear();
        let learning = spinner("learning");
        let twin = self.twin_arm(&dataset, &plan)?;
        drop(learning);
        let missing = real.as_ref().map_or_else(Vec::new, |r| r.missing.clone());
        let comparison = match (&self.recordings, &real) {
            (Some(recordings), Some(real)) if !self.quick => Some(ReadoutSection::run(recordings, real, self.seed)?),
            _ => None,
        };
        let real = real.map(|r| Arm {
            protocol: plan.real_protocol,
            raster_protocol: plan.real_protocol,
            ..r.arm
        });
        let bar = progress(twin.steps() + real.as_ref().map_or(0, Arm::steps), "scoring presses");
        let done = || bar.inc(1);
        let mut twin = ArmResults::new(twin, &plan.measurements, &plan.localisation, &done);
        let mut real = real.map(|arm| ArmResults::new(arm, &plan.measurements, &plan.localisation, &done));
        bar.finish_and_clear();
        let common: Vec<String> = real
            .as_ref()
            .map_or_else(Vec::new, |r| r.compressive_objects().map(str::to_owned).collect());
        twin.add_common_mean(&common);
        if let Some(real) = &mut real {
            real.add_common_mean(&common);
        }
        let arms = Arms {
            twin: &twin,
            real: real.as_ref(),
        };
        let results = Results {
            arms: &arms,
            comparison: comparison.as_ref(),
            missing: &missing,
        };
        let staged = OutputFolder::create(&self.out)?.stage()?;
        let summary = self
            .write(&plan, &dataset, &results, begin, &staged)
            .map_err(|error| error.unstaged(&staged))?;
        // tables of the real skin that an earlier run has left would stand beside a twin they were not scored with
        let of_real = |name: &str| {
            let table = name.strip_prefix("tables/");
            table.is_some_and(|t| t.ends_with("_real.csv") || t == "raster_correlation.csv")
        };
        staged.commit_replacing(&of_real)?;
        Ok(summary)
    }

    /// The twin as an arm of the board, its decoder learned from its own raster images.
    fn twin_arm(&self, dataset: &Dataset, plan: &Plan) -> Result<Arm, CliError> {
        let sessions: Vec<_> = dataset.objects.iter().map(|o| o.session.clone()).collect();
        let learned = learn(&sessions, &plan.learning, dataset.cols, Streams::new(self.seed))
            .map_err(|e| CliError::Usage(e.to_string()))?;
        Ok(Arm {
            sessions,
            bounces: Some(dataset.bounces.clone()),
            learned,
            cols: dataset.cols,
            protocol: plan.protocol,
            raster_protocol: plan.raster_protocol,
        })
    }

    fn write(
        &self,
        plan: &Plan,
        dataset: &Dataset,
        results: &Results<'_>,
        begin: Instant,
        staged: &Staged,
    ) -> Result<Summary, CliError> {
        let Results {
            arms,
            comparison,
            missing,
        } = *results;
        let correlations = arms
            .real
            .map_or_else(Vec::new, |real| tables::correlations(arms.twin, real));
        let timings = timing::timings(arms.twin, &plan.measurements, plan.timed_decodes);
        let folder = staged.folder("tables")?;
        tables::write_arm(&folder, "twin", arms.twin)?;
        tables::write_mechanics(&folder, dataset)?;
        if let Some(real) = arms.real {
            tables::write_arm(&folder, "real", real)?;
            write_table(&folder.join("raster_correlation.csv"), &correlations)?;
        }
        write_table(&staged.path("timings.csv"), &timings)?;
        let arrays = staged.folder("arrays")?;
        tables::write_arrays(&arrays, dataset, arms.twin)?;
        if self.save_recordings {
            tables::write_recordings(&arrays, dataset)?;
        }
        let figures = staged.folder("figures")?;
        draw(&figures, dataset, arms, &correlations, &timings)?;
        if let Some(comparison) = comparison {
            comparison.write(&folder, &figures)?;
        }
        let wall_s = begin.elapsed().as_secs_f64();
        let headline = Headline::new(dataset, arms.twin, arms.real, &correlations, &timings, wall_s);
        let summary = Summary {
            headline,
            provenance: Origin {
                provenance: Provenance::new(self.seed, dataset.scene_hash.clone()),
                machine: Machine::here(),
            },
        };
        let means = page::means_table(arms);
        let mut page = page::page(&summary, means, &correlations, self.quick, missing);
        page.sections.extend(comparison.map(ReadoutSection::section));
        write_bytes(&staged.path("index.html"), html(&page).as_bytes())?;
        write_json(&staged.path("summary.json"), &summary)?;
        Ok(summary)
    }
}

fn draw(
    dir: &Path,
    dataset: &Dataset,
    arms: &Arms<'_>,
    correlations: &[tables::CorrelationRow],
    timings: &[timing::TimingRow],
) -> Result<(), CliError> {
    save_sheet(&sheets::objects(dataset, arms, correlations), dir, "s5_objects")?;
    save_charts(&arms.fig_3b(), dir, "3b_classification")?;
    save_charts(&arms.fig_3c(), dir, "3c_support")?;
    save_charts(&arms.fig_3d(timings), dir, "3d_frequency")?;
    save_charts(&arms.fig_3e(), dir, "3e_latency")?;
    save_sheet(&sheets::adaptive(arms, dataset.cols), dir, "4_adaptive")?;
    let (change, peaks) = arms.fig_5();
    save_charts(&change, dir, "5b_change")?;
    save_charts(&peaks, dir, "5c_peak")?;
    save_charts(&arms.fig_6(), dir, "6_localisation")?;
    save_sheet(&sheets::examples(arms, dataset.cols), dir, "s4_examples")?;
    save_sheet(&sheets::dictionaries(arms, dataset.cols), dir, "s6_dictionary")?;
    Ok(())
}
