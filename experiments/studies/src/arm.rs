//! A skin wrapped round a robot's arm and touched by a finger: compares the published recording with the twin's bent
//! skin (`spts simulate arm`), statistic by statistic.
//!
//! A bent skin is under a preload, so that some taxels have an output without a touch. The size of that output and the
//! number of such taxels show whether the twin's preload is like the real one. The size of a touch, and how accurately
//! it is located, show whether the rest is.

use crate::compare::{Banded, POSITIVE, SHARE, UNLIMITED};
use rand::RngExt as _;
use rayon::prelude::*;
use spts::data::SessionSet;
use spts::progress::Progress;
use spts::record::Twin;
use spts::session::{Event, Session};
use spts::simulate::Request;
use spts_circuit::{Mode, Recording};
use spts_eval::place::{RecordedTouch, find_touches, touch_errors_px};
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::metrics::{median, pearson};
use spts_recon::statistics::mean;
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
#[derive(Debug, Clone, PartialEq)]
pub struct ArmBand {
    /// Name.
    pub statistic: &'static str,
    /// Unit; empty for a number.
    pub unit: &'static str,
    /// Value and band.
    pub of: Banded,
}

/// Results of `spts compare --arm`: every statistic of the real bent skin, beside the band of the simulated ones.
#[derive(Debug, Clone, PartialEq)]
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
        let set = SessionSet::open(self.recordings)?;
        let of_touches = |session: &&Session| session.event == Event::Touch;
        let measured = |session: &Session| {
            let recording = session.compressive()?;
            let found = statistics(recording)?;
            Some((session.name.clone(), *recording.layout(), found))
        };
        let real = set.sessions.iter().filter(of_touches).find_map(measured);
        let Some((session, layout, (touches, real))) = real else {
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
            let found = statistics(&touched(&layout, seed)?)
                .ok_or_else(|| Refusal::new(format!("no touch was found on the simulated skin of seed {seed}")));
            progress.step();
            Ok(found?.1)
        });
        let twins = twins.collect::<Result<Vec<[f64; STATISTICS.len()]>, Refusal>>()?;
        progress.end();
        let bands = STATISTICS.iter().enumerate().filter_map(|(k, &(statistic, unit, limits))| {
            let twins: Vec<f64> = twins.iter().map(|twin| twin[k]).collect();
            let of = Banded::of(real[k], &twins, limits)?;
            Some(ArmBand { statistic, unit, of })
        });
        Ok(ArmReport { session, touches, skins: self.skins, statistics: bands.collect() })
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
    let request = Request { scene: SCENE.to_owned(), assignments: assignments.collect::<Result<_, _>>()? };
    let twin = Twin::new(&request.prepare()?.scene)?;
    let presses = twin.presses(0..TOUCHES, &|| ())?;
    Ok(twin.recorded(&presses, &twin.acquisition(Mode::Compressive))?.recording)
}

/// Output above which a taxel of an untouched skin counts as loaded, V: five times the error of a taxel estimated from
/// 2000 measurements with a noise of 0.15 V, and a fifth of the largest value on the published skin.
const LOADED_V: f64 = 0.1;

/// Numbers of measurements for locating touches.
const MEASUREMENTS: [usize; 3] = [7, 10, 25];

/// Label, unit and limits of every statistic that is compared.
///
/// Means over the blocks, without a touch: number of taxels above [`LOADED_V`], sum of the image, its largest taxel,
/// and the correlation of the images of consecutive blocks. Medians over the touches: share of the sum at rest that the
/// loaded taxels lose, largest taxel minus the preload, and its share in the sum of squares. Means over the windows:
/// distance of the located from the touched taxel, for each of [`MEASUREMENTS`].
const STATISTICS: [(&str, &str, [f64; 2]); 10] = [
    ("loaded taxels at rest", "", POSITIVE),
    ("sum at rest", "V", UNLIMITED),
    ("largest taxel at rest", "V", UNLIMITED),
    ("rest, block to block", "r", [-1.0, 1.0]),
    ("rest, lost in a touch", "share", UNLIMITED),
    ("touch, largest taxel", "V", UNLIMITED),
    ("touch in one taxel", "share", SHARE),
    ("located at M = 7", "px", POSITIVE),
    ("located at M = 10", "px", POSITIVE),
    ("located at M = 25", "px", POSITIVE),
];

/// Number of touches in `recording`, whose blocks must begin without one, and every statistic of [`STATISTICS`]; `None`
/// if no touch of a skin under preload is found.
fn statistics(recording: &Recording) -> Option<(usize, [f64; STATISTICS.len()])> {
    let touches = find_touches(recording);
    let rest: Vec<&Vec<f64>> = touches.iter().filter_map(|t| t.untouched.image.as_ref()).collect();
    let changes: Vec<Vec<f64>> = touches.iter().filter_map(|t| t.image(recording)).collect();
    let over_rest = |of: &dyn Fn(&Vec<f64>) -> f64| mean(rest.iter().map(|image| of(image)));
    let over_touches = |of: &dyn Fn(&Vec<f64>) -> f64| median(&changes.iter().map(of).collect::<Vec<_>>());
    let lost: Vec<f64> = touches.iter().filter_map(|touch| lost(touch, recording)).collect();
    let errors = touch_errors_px(recording, &touches, &MEASUREMENTS);
    let [at_7, at_10, at_25] = errors[..] else { return None };
    let statistics = [
        over_rest(&|image| image.iter().filter(|v| **v > LOADED_V).count() as f64)?,
        over_rest(&|image| image.iter().sum())?,
        over_rest(&|image| largest(image))?,
        mean(rest.windows(2).filter_map(|pair| pearson(pair[0], pair[1])))?,
        median(&lost)?,
        over_touches(&|image| largest(image))?,
        over_touches(&|image| largest(image).powi(2) / image.iter().map(|v| v * v).sum::<f64>())?,
        at_7?,
        at_10?,
        at_25?,
    ];
    Some((touches.len(), statistics))
}

/// Share of the sum of the loaded taxels that those which are not touched lose in `touch`.
fn lost(touch: &RecordedTouch, recording: &Recording) -> Option<f64> {
    let (rest, change) = (touch.untouched.image.as_ref()?, touch.image(recording)?);
    let touched = touch.taxel(recording)?;
    let loaded = |k: &usize| *k != touched && rest[*k] > LOADED_V;
    let sum = |of: &[f64]| (0..of.len()).filter(loaded).map(|k| of[k]).sum::<f64>();
    let loaded_v = sum(rest);
    (loaded_v > 0.0).then(|| -sum(&change) / loaded_v)
}

fn largest(image: &[f64]) -> f64 {
    image.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}
