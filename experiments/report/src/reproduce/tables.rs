//! Results as CSV tables and arrays. Nothing in them depends on the machine, the time or the number of threads.

use super::dataset::SimulatedData;
use super::results::SkinResults;
use super::tracking::{CourseRow, TRACKING_MEASUREMENTS, over_bounces};
use serde::Serialize;
use spts::output::{OutputFolder, write_npy, write_table};
use spts_circuit::Recording;
use spts_eval::Table;
use spts_eval::protocol::PLATEAU;
use spts_input::Refusal;
use spts_recon::metrics::{median, pearson};
use std::path::Path;

/// Step between the frames that enter the median.
const STRIDE: usize = 10;

/// Median raster image over the plateau frames of all presses but the first, which conditions the foam (a single press
/// is taken as it is), V.
pub(super) fn median_image(raster: &Recording) -> Vec<f64> {
    let presses = raster.blocks().len();
    let first = usize::from(presses > 1);
    let frames: Vec<&[f64]> = (first..presses)
        .flat_map(|press| PLATEAU.step_by(STRIDE).map(move |frame| (press, frame)))
        .filter(|(_, frame)| *frame < raster.frames())
        .map(|(press, frame)| raster.volts(press, frame))
        .collect();
    (0..raster.taxels())
        .map(|taxel| median(&frames.iter().map(|f| f[taxel]).collect::<Vec<_>>()).unwrap_or(0.0))
        .collect()
}

/// Correlation of an object's simulated raster image with the recorded one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct CorrelationRow {
    /// Object.
    pub(super) object: String,
    /// Pearson's r over the taxels.
    pub(super) pearson_r: f64,
}

/// Correlations of all objects that were recorded.
pub(super) fn correlations(twin: &SkinResults, real: &SkinResults) -> Vec<CorrelationRow> {
    let pairs = twin.skin.sessions.iter().filter_map(|t| {
        let r = real.skin.sessions.iter().find(|r| r.object == t.object)?;
        Some(CorrelationRow {
            object: t.object.clone(),
            pearson_r: pearson(&median_image(t.raster.as_ref()?), &median_image(r.raster.as_ref()?))?,
        })
    });
    pairs.collect()
}

/// The twin in the names of tables.
pub(super) const TWIN: &str = "twin";
/// The real skin in the names of tables.
pub(super) const REAL: &str = "real";

/// File of the table `name` of the skin `whose`, [`TWIN`] or [`REAL`].
pub(super) fn skin_file(name: &str, whose: &str) -> String {
    format!("{name}_{whose}.csv")
}

/// Writes the tables of one skin, named by `whose`, [`TWIN`] or [`REAL`].
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub(super) fn write_skin(dir: &Path, whose: &str, results: &SkinResults) -> Result<(), Refusal> {
    let path = |name: &str| dir.join(skin_file(name, whose));
    write_table(&path("scores"), &results.scores.rows)?;
    write_table(&path("localisation"), &results.scores.localisation)?;
    write_table(&path("baselines"), &results.scores.baselines)?;
    write_table(&path("latency"), &results.latency)?;
    write_table(&path("places"), &results.places)?;
    write_table(&path("bounce_traces"), &results.traces)?;
    let courses: Vec<CourseRow> =
        TRACKING_MEASUREMENTS.iter().flat_map(|&m| over_bounces(&results.traces, m)).collect();
    write_table(&path("bounce_courses"), &courses)?;
    write_table(&path("bounce_tracking"), &results.tracking)
}

/// Writes the tables of the mechanics.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub(super) fn write_mechanics(dir: &Path, dataset: &SimulatedData) -> Result<(), Refusal> {
    let presses = dataset.objects.iter().flat_map(|object| {
        let each = object.courses.iter().enumerate();
        each.map(move |(press, course)| (&object.session.object, press, course.as_ref()))
    });
    Table::new("", presses)
        .file("object", |(object, ..)| object)
        .file("press", |(_, press, _)| press)
        .file("onset_s", |(.., c)| c.map(|c| c.onset_s))
        .file("rise_s", |(.., c)| c.map(|c| c.rise_s))
        .file("plateau_n", |(.., c)| c.map(|c| c.plateau_n))
        .file("plateau_error_n", |(.., c)| c.map(|c| c.plateau_error_n))
        .file("overshoot", |(.., c)| c.map(|c| c.overshoot))
        .file("lift_s", |(.., c)| c.map(|c| c.lift_s))
        .file("fall_s", |(.., c)| c.map(|c| c.fall_s))
        .file("imbalance", |(.., c)| c.map(|c| c.imbalance))
        .write_csv(&dir.join("presses_twin.csv"))?;
    let bounces = dataset.drops.iter().enumerate().flat_map(|(drop, ball)| {
        let each = ball.bounces.iter().enumerate();
        each.map(move |(bounce, b)| (drop, bounce, b, ball.imbalance))
    });
    Table::new("", bounces)
        .file("drop", |(drop, ..)| drop)
        .file("bounce", |(_, bounce, ..)| bounce)
        .file("start_s", |(.., b, _)| b.start_s)
        .file("contact_ms", |(.., b, _)| b.contact_s * 1e3)
        .file("speed_in_m_per_s", |(.., b, _)| b.speed_in_m_per_s)
        .file("restitution", |(.., b, _)| b.restitution())
        .file("peak_force_n", |(.., b, _)| b.peak_force_n)
        .file("imbalance", |(.., imbalance)| imbalance)
        .write_csv(&dir.join("bounces_twin.csv"))
}

/// Writes the arrays: pressure maps, median raster images, dictionary and library.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub(super) fn write_arrays(dir: &Path, dataset: &SimulatedData, twin: &SkinResults) -> Result<(), Refusal> {
    let cols = dataset.cols;
    let stack = |name: &str, maps: Vec<Vec<f64>>| -> Result<(), Refusal> {
        let taxels = maps.first().map_or(0, Vec::len);
        write_npy(&dir.join(name), &[maps.len(), taxels / cols, cols], &maps.concat())
    };
    stack("pressure_pa.npy", dataset.objects.iter().map(|o| o.pressure_pa.clone()).collect())?;
    let rasters = dataset.objects.iter().filter_map(|o| o.session.raster().map(median_image));
    stack("median_raster_v.npy", rasters.collect())?;
    let dictionary = &twin.skin.learned.dictionary.atoms;
    let images = twin.skin.learned.classifier.library().images();
    for (name, matrix) in [("dictionary.npy", dictionary), ("library.npy", images)] {
        write_npy(&dir.join(name), &[matrix.nrows(), matrix.ncols()], matrix.view().values())?;
    }
    let labels = twin.skin.learned.classifier.library().labels();
    let labels: Vec<f64> = labels.iter().map(|&label| label as f64).collect();
    write_npy(&dir.join("library_labels.npy"), &[labels.len()], &labels)
}

/// Writes every session of the twin into a folder of its own.
///
/// # Errors
/// [`Refusal`] when a file cannot be written.
pub(super) fn write_sessions(out: &OutputFolder, dataset: &SimulatedData) -> Result<(), Refusal> {
    let sessions = dataset.objects.iter().map(|o| &o.session).chain([&dataset.bounces]);
    for session in sessions {
        session.write_files(&out.folder(&format!("sessions/{}", session.name))?)?;
    }
    Ok(())
}
