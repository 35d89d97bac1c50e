//! Everything the report says of one skin, scored by the published decoders and by the ones that do best; how much is
//! simulated and scored; and how long a decode takes, the only result that depends on the machine.

use super::latency::{LatencyRow, latency};
use super::tracking::{TraceRow, TrackingRow, traces, tracking};
use crate::figures::Stroke;
use serde::Serialize;
use spts_eval::decoders::{TrainedDecoder, find, published};
use spts_eval::place::{PlaceRow, RecordedBounce, find_bounces};
use spts_eval::protocol::{MEASUREMENTS, Protocol};
use spts_eval::training::{Learning, TrainingData, TrainingPresses};
use spts_eval::{BaselineRow, Press, ScoredSkin, SkinScores, decode_us, mean_rows};
use spts_input::Refusal;
use spts_models::Streams;
use spts_recon::metrics::median;

/// Name of the mean over the objects that both skins were recorded with.
pub(super) const MEAN_COMMON: &str = "mean_common";

/// Mean of baseline rows, or `None` without one.
fn mean_baseline(rows: &[BaselineRow], baseline: &'static str) -> Option<BaselineRow> {
    let mean = |get: fn(&BaselineRow) -> f64| rows.iter().map(get).sum::<f64>() / rows.len() as f64;
    (!rows.is_empty()).then(|| BaselineRow {
        object: MEAN_COMMON.to_owned(),
        baseline,
        support: mean(|r| r.support),
        iou: mean(|r| r.iou),
        f1: mean(|r| r.f1),
        balanced_accuracy: mean(|r| r.balanced_accuracy),
    })
}

/// Scores and curves of a skin.
pub(super) struct SkinResults {
    /// The skin.
    pub(super) skin: ScoredSkin,
    /// Its scores.
    pub(super) scores: SkinScores,
    /// Its published decoder in the pictures.
    pub(super) matched: TrainedDecoder,
    /// Its best decoders, each beside its name.
    pub(super) best: Vec<(&'static str, TrainedDecoder)>,
    /// Classification over time.
    pub(super) latency: Vec<LatencyRow>,
    /// Contacts of the ball.
    pub(super) bounces: Vec<RecordedBounce>,
    /// Peak of every reconstructed frame of every contact.
    pub(super) traces: Vec<TraceRow>,
    /// Where the ball is by every locator.
    pub(super) places: Vec<PlaceRow>,
    /// What the number of measurements a frame does to it.
    pub(super) tracking: Vec<TrackingRow>,
}

impl SkinResults {
    /// Scores `skin`, by the published decoders and by its `best` ones.
    ///
    /// # Errors
    /// [`Refusal`] when what was learned does not fit the skin.
    pub(super) fn new(
        skin: ScoredSkin,
        best: Vec<(&'static str, TrainedDecoder)>,
        measurements: &[usize],
        localisation: &[usize],
        done: &(dyn Fn() + Sync),
    ) -> Result<Self, Refusal> {
        let scores = skin.score(measurements, localisation, &best, done)?;
        let matched = published("matched", &skin.learned)?;
        let latency = latency(&skin, &matched)?;
        let places = skin.ball_places(localisation)?;
        let (mut bounces, mut traces) = (Vec::new(), Vec::new());
        if let Some(recording) = &skin.bounces {
            bounces = find_bounces(recording);
            let matched = published("matched", &skin.learned.at_all_places())?;
            traces = self::traces(recording, &bounces, &matched)?;
        }
        let tracking = tracking(&bounces, &traces);
        Ok(Self { skin, scores, matched, best, latency, places, bounces, traces, tracking })
    }

    /// Objects with a compressive session.
    pub(super) fn compressive_objects(&self) -> impl Iterator<Item = &str> {
        let with = self.skin.sessions.iter().filter(|s| s.compressive.is_some());
        with.map(|s| s.object.as_str())
    }

    /// Adds the means over `objects` to the board, as object [`MEAN_COMMON`].
    pub(super) fn add_common_mean(&mut self, objects: &[String]) {
        if objects.is_empty() {
            return;
        }
        for baseline in ["empty", "mean_image"] {
            let found = self.scores.baselines.iter().filter(|b| b.baseline == baseline);
            let of: Vec<BaselineRow> = found.filter(|b| objects.contains(&b.object)).cloned().collect();
            self.scores.baselines.extend(mean_baseline(&of, baseline));
        }
        let rows: Vec<_> = self.scores.rows.iter().filter(|r| objects.contains(&r.object)).cloned().collect();
        self.scores.rows.extend(mean_rows(&rows).into_iter().map(|mut row| {
            MEAN_COMMON.clone_into(&mut row.object);
            row
        }));
    }

    /// Median duration of the ball's contacts as the recording shows them, ms.
    pub(super) fn contact_ms(&self) -> Option<f64> {
        let recording = self.skin.bounces.as_ref()?;
        let durations: Vec<f64> = self.bounces.iter().map(|b| b.duration_s(recording) * 1e3).collect();
        median(&durations)
    }

    /// Mean distance of the middle of the skin from the ball in the contacts that windows of `m` measurements fit into,
    /// taxels.
    pub(super) fn middle_px(&self, m: usize) -> Option<f64> {
        let middle = |r: &&PlaceRow| r.decoder == "middle" && !r.relabelled && r.m == m;
        self.places.iter().find(middle).map(|r| r.mean_px)
    }

    /// The decoder in the pictures beside the published one: its name and itself.
    pub(super) fn shown(&self) -> Option<(&'static str, &TrainedDecoder)> {
        let found = self.best.iter().find(|(name, _)| *name == SHOWN);
        found.map(|(name, decoder)| (*name, decoder))
    }
}

/// The best in both tasks, images and classes of objects that were learned; and the best image of any object.
pub(super) const BEST: [&str; 2] = ["evidence", "nn_lmmse"];
/// The one in the pictures.
pub(super) const SHOWN: &str = BEST[0];

/// The decoders of [`BEST`], each beside its name, after they have learned from `presses` of a sheet of `cols` columns;
/// none without presses.
///
/// # Errors
/// [`Refusal`] when the presses cannot be learned from.
pub(super) fn best<'a>(
    presses: impl Iterator<Item = TrainingPresses<'a>>,
    cols: usize,
    streams: Streams,
) -> Result<Vec<(&'static str, TrainedDecoder)>, Refusal> {
    let presses: Vec<_> = presses.filter(|p| !p.is_empty()).collect();
    if presses.is_empty() {
        return Ok(Vec::new());
    }
    let data = TrainingData::new(&presses, cols, Vec::new(), streams)?;
    let specs = BEST.iter().filter_map(|name| find(name));
    specs.map(|spec| Ok((spec.name, TrainedDecoder::new(spec, &data)?))).collect()
}

/// Size of a reproduction.
#[derive(Debug, Clone)]
pub(super) struct ReproductionSize {
    /// Presses of an object's raster session.
    pub(super) raster_presses: usize,
    /// What the decoder learns from; the control is scored on the other raster presses.
    pub(super) learning: Learning,
    /// Presses of an object's compressive session.
    pub(super) compressive_presses: usize,
    /// Numbers of measurements on the board.
    pub(super) measurements: Vec<usize>,
    /// Numbers of measurements of the localisation board.
    pub(super) localisation: Vec<usize>,
    /// Decodes that are timed.
    pub(super) timed_decodes: usize,
    /// Protocol of the twin's compressive sessions.
    pub(super) protocol: Protocol,
    /// Protocol of the twin's raster sessions.
    pub(super) raster_protocol: Protocol,
    /// Protocol of the real sessions.
    pub(super) real_protocol: Protocol,
}

impl ReproductionSize {
    /// The whole reproduction: ten presses an object in either mode.
    pub(super) fn full() -> Self {
        let protocol = Protocol::default();
        Self {
            raster_presses: 10,
            learning: Learning { presses: 0..5, training_images: 1500, sweeps: 15 },
            compressive_presses: 10,
            measurements: MEASUREMENTS.to_vec(),
            localisation: MEASUREMENTS.to_vec(),
            timed_decodes: 2000,
            protocol: Protocol { first_press: 0, ..protocol },
            raster_protocol: protocol,
            real_protocol: protocol,
        }
    }

    /// A look at everything in a minute: fewer presses, windows and numbers of measurements.
    pub(super) fn quick() -> Self {
        let few = Protocol { presses: 2, max_windows: 30, support_stride: 20, ..Protocol::default() };
        Self {
            raster_presses: 3,
            learning: Learning { presses: 0..2, training_images: 500, sweeps: 5 },
            compressive_presses: 1,
            measurements: vec![5, 10, 20, 25, 50],
            localisation: vec![10, 25, 50],
            timed_decodes: 500,
            protocol: Protocol { first_press: 0, presses: 1, ..few },
            raster_protocol: Protocol { first_press: 2, ..few },
            real_protocol: few,
        }
    }
}

/// Time of a matched decode.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub(super) struct TimingRow {
    /// Number of measurements.
    pub(super) m: usize,
    /// Median time of one decode on one thread, Φ·D and image included, µs.
    pub(super) decode_us_median: f64,
    /// Time to acquire the measurements, µs.
    pub(super) acquire_us: f64,
}

/// Times the matched decode at every M on one press of the twin.
///
/// # Errors
/// [`Refusal`] when the decoder does not fit the recording.
pub(super) fn timings(twin: &SkinResults, measurements: &[usize], decodes: usize) -> Result<Vec<TimingRow>, Refusal> {
    let Some((recording, block, protocol)) = twin.skin.sessions.iter().find_map(|s| {
        let recording = s.compressive.as_ref()?;
        Some((recording, s.scored().next()?, s.protocol))
    }) else {
        return Ok(Vec::new());
    };
    let press = Press::new(recording, block, &protocol);
    let mut rows = Vec::new();
    for &m in measurements {
        if let Some(decode_us_median) = decode_us(&twin.matched, &press, m, decodes)? {
            rows.push(TimingRow { m, decode_us_median, acquire_us: m as f64 / recording.sample_rate_hz() * 1e6 });
        }
    }
    Ok(rows)
}

/// Both skins; the real one only when recordings were given.
pub(super) struct BothSkins<'a> {
    /// The twin.
    pub(super) twin: &'a SkinResults,
    /// The real skin.
    pub(super) real: Option<&'a SkinResults>,
}

impl BothSkins<'_> {
    /// Objects that the curves are means over: those both skins recorded compressively, or all of the twin's.
    pub(super) fn common(&self) -> &'static str {
        if self.real.is_some() { MEAN_COMMON } else { "mean" }
    }

    /// The skins with the ending of their names in a legend and the stroke of their curves. Without recordings there is
    /// one, and it needs no name.
    pub(super) fn named(&self) -> Vec<(&SkinResults, &'static str, Stroke)> {
        match self.real {
            None => vec![(self.twin, "", Stroke::Solid)],
            Some(real) => vec![(self.twin, ", twin", Stroke::Solid), (real, ", real skin", Stroke::Dashed)],
        }
    }
}
