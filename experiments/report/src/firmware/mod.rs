//! Files and figures of `spts firmware`.

mod picture;

use super::{ReportError, write_all_or_none};
use crate::figures::save_charts;
use spts::output::{NpyFile, OutputError, OutputFolder, write_csv, write_json};
use spts::progress::Progress;
use spts_studies::firmware::{EmulatedWeights, ImageTiming, ModeTiming};
use std::io;
use std::path::Path;

/// A line of `timing.csv`: image, mode, bits of a pattern, cycles, rate and margin, as in [`ModeTiming`].
type Line<'a> = (&'a str, &'a str, Option<usize>, [u64; 3], [f64; 2]);

/// Header of `timing.csv`.
const HEADER: [&str; 8] = [
    "image",
    "mode",
    "period",
    "latency_cycles",
    "latency_cycles_min",
    "least_period_cycles",
    "max_edge_hz",
    "margin_at_72_khz",
];

/// Files outside of folders of their own.
pub const FILES: &[&str] = &["timing.csv", "timing.json"];

/// Writes `timing.csv`, `timing.json` and `figures/firmware` into the folder `out`: all of them, or none.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub fn write_timing(images: &[ImageTiming], out: OutputFolder) -> Result<(), ReportError> {
    write_all_or_none(out, |out| {
        write_csv(&out.path("timing.csv"), &HEADER, lines(images))?;
        write_json(&out.timed_path("timing.json"), &images)?;
        save_charts(&picture::charts(images), &out.folder("figures")?, "firmware")?;
        Ok(())
    })
}

fn lines(images: &[ImageTiming]) -> impl Iterator<Item = Line<'_>> {
    let of_image = images.iter().map(|timing| (timing.image.as_str(), &timing.modes));
    of_image.flat_map(|(image, modes)| modes.iter().map(move |timing| line(image, timing)))
}

fn line<'a>(image: &'a str, timing: &ModeTiming) -> Line<'a> {
    let cycles = [
        timing.latency_cycles,
        timing.latency_cycles_min,
        u64::from(timing.least_period_cycles),
    ];
    let rate = [timing.max_edge_hz, timing.margin_at_72_khz];
    (image, timing.task.mode(), timing.task.period(), cycles, rate)
}

/// Writes the levels that cells put out to the NumPy file `path`, shape (edges, cells), as doubles: row r holds the
/// weights of measurement r.
///
/// # Errors
/// [`ReportError`] when the cells cannot be clocked or the file cannot be written.
pub fn write_weights(mut weights: EmulatedWeights, path: &Path, progress: &dyn Progress) -> Result<(), ReportError> {
    progress.stage("clocking the cells", Some(weights.blocks()));
    let mut file = NpyFile::create(path, &weights.shape())?;
    let failed = |error| OutputError::Write {
        path: path.to_owned(),
        source: io::Error::other(error),
    };
    while let Some(levels) = weights.next_block().map_err(failed)? {
        file.push(levels.iter().copied())?;
        progress.step();
    }
    file.finish()?;
    progress.end();
    Ok(())
}
