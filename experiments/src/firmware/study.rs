//! Timing of several images, as files.

use super::late::Lateness;
use super::picture::charts;
use super::plan::Plan;
use super::timing::ModeTiming;
use crate::cli::CliError;
use crate::figures::save_charts;
use crate::output::{OutputFolder, write_csv, write_json};
use serde::Serialize;
use spts_firmware::SKIN_EDGE_HZ;
use std::path::Path;

/// Rates of the clock at which lost edges are counted, kHz.
const RATES_KHZ: std::ops::RangeInclusive<u32> = 50..=600;
/// Step of them, kHz.
const RATE_STEP_KHZ: usize = 10;
/// Stages of one image, as [`ImageStudy::of`] counts them.
pub const STAGES: usize = 3;

/// Timing of one image.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImageStudy {
    /// Name of the image.
    pub image: String,
    /// Latency and largest clock rate, by mode.
    pub modes: Vec<ModeTiming>,
    /// Updates that come late, binary mode, at the skin's rate.
    pub late: Lateness,
    /// Edges that a binary cell loses of faster and faster clocks.
    pub lost: Vec<Lost>,
}

/// Edges that are lost at one rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Lost {
    /// Rate of the edges, Hz.
    pub edge_hz: f64,
    /// Share of them that is lost; none when what the cell puts out is no part of its sequence.
    pub share: Option<f64>,
}

impl ImageStudy {
    /// Times the cells of `plan`. `tick` is called after every one of [`STAGES`] stages.
    ///
    /// # Errors
    /// [`CliError::Usage`] when a cell does not answer, or follows no clock.
    pub fn of(plan: &Plan, tick: &dyn Fn()) -> Result<Self, CliError> {
        let modes = plan.timing()?;
        tick();
        let late = plan.lateness(SKIN_EDGE_HZ)?;
        tick();
        let rates = RATES_KHZ.step_by(RATE_STEP_KHZ).map(|khz| f64::from(khz) * 1e3);
        let lost = rates.map(|edge_hz| {
            let share = plan.lost_share(edge_hz)?;
            Ok(Lost { edge_hz, share })
        });
        let lost = lost.collect::<Result<_, CliError>>()?;
        tick();
        Ok(Self {
            image: plan.image_name.clone(),
            modes,
            late,
            lost,
        })
    }
}

/// A line of `timing.csv`, in the order of the fields of [`ModeTiming`].
type Line<'a> = (&'a str, ModeTiming);

/// Header of `timing.csv`.
const HEADER: [&str; 7] = [
    "image",
    "mode",
    "latency_cycles",
    "latency_cycles_min",
    "least_period_cycles",
    "max_edge_hz",
    "margin_at_72_khz",
];

/// Writes `timing.csv`, `timing.json` and `figures/firmware` into the folder `out`: all of them, or none.
///
/// # Errors
/// [`CliError`] when a file cannot be written.
pub fn write_studies(studies: &[ImageStudy], out: &Path) -> Result<(), CliError> {
    let staged = OutputFolder::create(out)?.stage()?;
    let write = || -> Result<(), CliError> {
        write_csv(&staged.path("timing.csv"), &HEADER, lines(studies))?;
        write_json(&staged.path("timing.json"), &studies)?;
        save_charts(&charts(studies), &staged.folder("figures")?, "firmware")?;
        Ok(())
    };
    write().map_err(|error| error.unstaged(&staged))?;
    staged.commit()?;
    Ok(())
}

fn lines(studies: &[ImageStudy]) -> impl Iterator<Item = Line<'_>> {
    let of_image = studies.iter().map(|study| (study.image.as_str(), &study.modes));
    of_image.flat_map(|(image, modes)| modes.iter().map(move |mode| (image, *mode)))
}
