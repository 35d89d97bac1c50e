//! Compares the published recording with simulated bent skins, through the same code.

use super::statistics::{STATISTICS, StatisticOf, TouchStatistics};
use super::text;
use crate::calibrate::predicted;
use rand::RngExt as _;
use rayon::prelude::*;
use serde::Serialize;
use spts::data::SessionSet;
use spts::progress::Progress;
use spts::record::Twin;
use spts::session::{Event, Session};
use spts::simulate::{Request, SimulateError};
use spts_circuit::{Mode, Recording};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use std::path::Path;

/// Scene of the twin.
const SCENE: &str = "arm";
/// Touches of a recording.
const TOUCHES: usize = 6;
/// Touches keep this distance from the outer taxels, taxels.
const MARGIN: usize = 1;

/// Settings of `spts compare --arm`: simulated skins bent round a robot's arm, beside a recording of a real one that is
/// touched by a finger.
#[derive(Debug, Clone, Copy)]
pub struct ArmStudy<'a> {
    /// Folder of the recordings; its first session of touches is compared.
    pub recordings: &'a Path,
    /// Number of simulated skins.
    pub skins: u64,
    /// Seed of the first skin; the others have the following seeds.
    pub seed: u64,
}

/// One statistic of the real skin and of the simulated ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArmBand {
    /// Name.
    pub statistic: &'static str,
    /// Unit; empty for a number.
    pub unit: &'static str,
    /// The real skin's value.
    pub real: f64,
    /// Mean over the simulated skins.
    pub twin: f64,
    /// Lower end of the band, in which a further simulated skin lies with a probability of 90 %.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
    /// Whether the real skin lies in the band.
    pub inside: bool,
}

/// Results of `spts compare --arm`: every statistic of the real bent skin, beside the band of the simulated ones.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ArmReport {
    /// Name of the recorded session.
    pub session: String,
    /// Touches found in it.
    pub touches: usize,
    /// Number of simulated skins.
    pub skins: u64,
    /// Every statistic.
    pub statistics: Vec<ArmBand>,
}

impl ArmStudy<'_> {
    /// Simulates and compares. The result depends only on the recordings and the seed.
    ///
    /// # Errors
    /// [`Refusal`] without a recording of touches on a preloaded skin, or if the simulation fails.
    pub fn run(&self, progress: &dyn Progress) -> Result<ArmReport, Refusal> {
        let set = SessionSet::open(self.recordings).map_err(Refusal::from_error)?;
        let of_touches = |session: &&Session| session.event == Event::Touch;
        let measured = |session: &Session| {
            let recording = session.compressive()?;
            let found = TouchStatistics::of(recording)?;
            Some((session.name.clone(), *recording.layout(), found))
        };
        let real = set.sessions.iter().filter(of_touches).find_map(measured);
        let Some((session, layout, real)) = real else {
            return Err(Refusal::new(format!(
                "{}: no compressive session of touches in which the skin is under preload; such sessions lie in robot_arm/",
                self.recordings.display()
            )));
        };
        let skins = usize::try_from(self.skins).unwrap_or(usize::MAX);
        progress.stage("touching simulated skins", Some(skins));
        let twins = (0..self.skins).into_par_iter().map(|k| {
            // a seed is a whole number below 2^63
            let seed = self.seed.wrapping_add(k) & (u64::MAX >> 1);
            let found = TouchStatistics::of(&touched(&layout, seed)?)
                .ok_or_else(|| Refusal::new(format!("no touch was found on the simulated skin of seed {seed}")));
            progress.step();
            found
        });
        let twins = twins.collect::<Result<Vec<TouchStatistics>, Refusal>>()?;
        progress.end();
        Ok(ArmReport {
            session,
            touches: real.touches,
            skins: self.skins,
            statistics: bands(&real, &twins),
        })
    }
}

impl ArmReport {
    /// The statistics as a text table.
    #[must_use]
    pub fn text(&self) -> String {
        text::table(self)
    }
}

/// Compressive recording of a bent skin of this `layout` that follows from `seed`, touched at places that follow from
/// it too.
fn touched(layout: &SkinLayout, seed: u64) -> Result<Recording, Refusal> {
    let mut rng = Streams::new(seed).rng("arm/places", 0);
    let mut within = |taxels: usize| {
        let margin = MARGIN.min((taxels - 1) / 2);
        rng.random_range(margin..taxels - margin)
    };
    let places = (0..TOUCHES).map(|_| format!("[{}, {}]", within(layout.rows()), within(layout.cols())));
    let places: Vec<String> = places.collect();
    let assignments = [
        format!("seed={seed}"),
        format!("press.places=[{}]", places.join(", ")),
        format!("skin.rows={}", layout.rows()),
        format!("skin.cols={}", layout.cols()),
        format!("skin.pitch_m={:?}", layout.pitch_m()),
        format!("skin.electrode_m={:?}", layout.electrode_m()),
    ];
    let assignments = assignments.iter().map(|text| text.parse());
    let request = Request {
        scene: SCENE.to_owned(),
        assignments: assignments
            .collect::<Result<_, _>>()
            .map_err(SimulateError::from)
            .map_err(Refusal::from_error)?,
    };
    let twin = Twin::new(&request.prepare().map_err(Refusal::from_error)?.scene).map_err(Refusal::from_error)?;
    let presses = twin.presses(0..TOUCHES, &|| ()).map_err(Refusal::from_error)?;
    Ok(twin
        .recorded(&presses, &twin.acquisition(Mode::Compressive))
        .map_err(Refusal::from_error)?
        .recording)
}

fn bands(real: &TouchStatistics, twins: &[TouchStatistics]) -> Vec<ArmBand> {
    let band = |(statistic, unit, value): &StatisticOf| {
        let values: Vec<f64> = twins.iter().map(value).collect();
        let (low, high) = predicted(&values)?;
        let real = value(real);
        Some(ArmBand {
            statistic,
            unit,
            real,
            twin: values.iter().sum::<f64>() / values.len() as f64,
            low,
            high,
            inside: low <= real && real <= high,
        })
    };
    STATISTICS.iter().filter_map(band).collect()
}
