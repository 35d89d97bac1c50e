//! Timing of several images.

use super::cells::EmulatedCells;
use super::error::FirmwareError;
use super::late::LateUpdates;
use super::timing::ModeTiming;
use serde::Serialize;
use spts::progress::Progress;
use spts_firmware::SKIN_EDGE_HZ;

/// Rates of the clock at which lost edges are counted, kHz.
const RATES_KHZ: std::ops::RangeInclusive<u32> = 50..=600;
/// Step of them, kHz.
const RATE_STEP_KHZ: usize = 10;
/// Steps of progress of one image: modes, late updates, lost edges.
const STAGES: usize = 3;

/// How fast one firmware image is: latency, largest clock rate, late updates and lost edges.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ImageTiming {
    /// Name of the image.
    pub image: String,
    /// Latency and largest clock rate, by mode.
    pub modes: Vec<ModeTiming>,
    /// Late updates in binary mode at the skin's rate.
    pub late: LateUpdates,
    /// Edges that a binary cell misses with increasing clock rates.
    pub lost: Vec<LostEdges>,
}

/// Share of the clock edges that a cell misses at one clock rate.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LostEdges {
    /// Rate of the edges, Hz.
    pub edge_hz: f64,
    /// Share of missed edges; `None` if the output is not part of the cell's sequence.
    pub share: Option<f64>,
}

/// Measures the timing of every image.
///
/// # Errors
/// [`FirmwareError`] if a cell does not answer, puts out codes that differ from the twin's, or follows no clock.
pub fn time_images(images: &[EmulatedCells], progress: &dyn Progress) -> Result<Vec<ImageTiming>, FirmwareError> {
    progress.stage("timing the cells", Some(STAGES * images.len()));
    let timings = images.iter().map(|cells| ImageTiming::of(cells, progress));
    let timings = timings.collect::<Result<_, _>>()?;
    progress.end();
    Ok(timings)
}

impl ImageTiming {
    /// Times one cell of `cells`.
    fn of(cells: &EmulatedCells, progress: &dyn Progress) -> Result<Self, FirmwareError> {
        let modes = cells.timing()?;
        progress.step();
        let late = cells.lateness(SKIN_EDGE_HZ)?;
        progress.step();
        let rates = RATES_KHZ.step_by(RATE_STEP_KHZ).map(|khz| f64::from(khz) * 1e3);
        let lost = rates.map(|edge_hz| {
            let share = cells.lost_share(edge_hz)?;
            Ok(LostEdges { edge_hz, share })
        });
        let lost = lost.collect::<Result<_, FirmwareError>>()?;
        progress.step();
        Ok(Self {
            image: cells.image_name.clone(),
            modes,
            late,
            lost,
        })
    }
}
