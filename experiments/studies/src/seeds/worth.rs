//! Benefit of a set of seeds: the same images, rows and noise for every set.

use super::analysis::SPAN_ROWS;
use super::error::SeedError;
use super::images::Images;
use super::set::SeedSet;
use crate::budget::estimate::estimate;
use rand::RngExt as _;
use rand_distr::{Distribution as _, StandardNormal};
use rayon::prelude::*;
use serde::Serialize;
use spts::progress::Progress;
use spts_circuit::WeightMode;
use spts_eval::decoders::{TrainedDecoder, find};
use spts_eval::training::{LearnError, Learned, TrainingData};
use spts_eval::{Press, PressRows, ScoreError, Scorer, Tally};
use spts_models::Streams;
use spts_recon::Matrix;
use spts_recon::classify::Library;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use std::sync::Arc;

/// Windows an image is measured with.
const WINDOWS: usize = 4;

/// Decoders of the table that are compared.
const DECODERS: [&str; 2] = ["omp", "nn_lasso"];

/// Image quality with one set of seeds, one decoder and one M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorthRow {
    /// Source of the images: synthetic or recorded.
    pub images: &'static str,
    /// Standard deviation of a measurement's noise relative to ‖x‖₂.
    pub noise: f64,
    /// Decoder.
    pub decoder: &'static str,
    /// Number of measurements M.
    pub m: usize,
    /// Name of the set.
    pub seeds: String,
    /// Intersection over union of the supports, mean over the images.
    pub iou: f64,
    /// Its standard error, over the images.
    pub iou_se: f64,
    /// IoU minus that of the first set, image by image.
    pub gain: f64,
    /// Its standard error, over the images.
    pub gain_se: f64,
}

/// What is decoded how.
pub(super) struct SeedComparison<'a> {
    pub(super) sets: &'a [SeedSet],
    pub(super) mode: WeightMode,
    pub(super) measurements: &'a [usize],
    /// Noise levels, relative to ‖x‖₂.
    pub(super) noises: &'a [f64],
    pub(super) streams: Streams,
}

impl SeedComparison<'_> {
    /// Rows for all sets, noises, decoders and M. An image is a step of `progress`.
    pub(super) fn run(&self, images: &Images, progress: &dyn Progress) -> Result<Vec<WorthRow>, SeedError> {
        let streams = self.streams.child(images.source, 0);
        let decoders = decoders(images)?;
        let scored: Vec<Vec<f64>> = (0..images.images.len())
            .into_par_iter()
            .map(|index| {
                let scores = self.score(&images.images[index], &decoders, streams.rng("windows", index as u64));
                progress.step();
                scores
            })
            .collect::<Result<_, SeedError>>()?;
        let column = |key: usize| -> Vec<f64> { scored.iter().map(|scores| scores[key]).collect() };
        let mut rows = Vec::new();
        for (key, (noise, decoder, m, set)) in self.keys().into_iter().enumerate() {
            let own = column(key);
            // sets are the fastest to change
            let first = column(key - key % self.sets.len());
            let iou = estimate(std::slice::from_ref(&own));
            let gain = estimate(&[own.iter().zip(&first).map(|(a, b)| a - b).collect()]);
            rows.push(WorthRow {
                images: images.source,
                noise,
                decoder: DECODERS[decoder],
                m,
                seeds: set.name.clone(),
                iou: iou.mean,
                iou_se: iou.se,
                gain: gain.mean,
                gain_se: gain.se,
            });
        }
        Ok(rows)
    }

    /// Everything that an image is scored by, in order: noise, place of the decoder in [`DECODERS`], M and set.
    fn keys(&self) -> Vec<(f64, usize, usize, &SeedSet)> {
        let mut keys = Vec::new();
        for &noise in self.noises {
            for decoder in 0..DECODERS.len() {
                for &m in self.measurements {
                    keys.extend(self.sets.iter().map(|set| (noise, decoder, m, set)));
                }
            }
        }
        keys
    }

    /// IoU of one image by every key, mean over its windows.
    fn score(
        &self,
        image: &[f64],
        decoders: &[TrainedDecoder],
        mut rng: impl rand::Rng,
    ) -> Result<Vec<f64>, SeedError> {
        let most = self.measurements.iter().copied().max().unwrap_or(0);
        let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut truth = Vec::new();
        support(image, SUPPORT_THRESHOLD, &mut truth);
        let keys = self.keys();
        let mut scorers: Vec<Scorer<'_>> = decoders.iter().map(Scorer::new).collect();
        let mut tallies = vec![Tally::default(); keys.len()];
        for _ in 0..WINDOWS {
            let start = rng.random_range(0..SPAN_ROWS);
            let deviates: Vec<f64> = (0..most).map(|_| StandardNormal.sample(&mut rng)).collect();
            let seen: Vec<Seen> = self
                .sets
                .iter()
                .map(|set| Seen::new(&set.rows(self.mode, start, most), image))
                .collect();
            for (key, (tally, &(noise, decoder, m, _))) in tallies.iter_mut().zip(&keys).enumerate() {
                let press = seen[key % self.sets.len()].press(noise * length, &deviates);
                let window: Vec<_> = press.window(0, m).into_iter().collect();
                for answer in scorers[decoder].answers(&window).map_err(ScoreError::from)? {
                    tally.image(&answer.image, &truth);
                }
            }
        }
        Ok(tallies.iter().map(|t| t.scores().iou.unwrap_or(0.0)).collect())
    }
}

/// The decoders of [`DECODERS`] with the dictionary of `images`.
fn decoders(images: &Images) -> Result<Vec<TrainedDecoder>, SeedError> {
    let dictionary = &images.dictionary;
    // classes are not asked for; a library has to have one
    let library = Library::new(dictionary, &vec![0; dictionary.ncols()]).map_err(LearnError::from)?;
    let data = TrainingData::given(&Learned::new(
        dictionary.clone(),
        Some(dictionary.clone()),
        library,
        images.side,
    ));
    let trained = DECODERS.iter().filter_map(|name| find(name));
    Ok(trained
        .map(|spec| TrainedDecoder::new(spec, &data))
        .collect::<Result<_, _>>()?)
}

/// A window of one set: rows of weights and Φ·x.
struct Seen {
    rows: Arc<PressRows>,
    y: Vec<f64>,
}

impl Seen {
    fn new(rows: &Matrix, image: &[f64]) -> Self {
        let sum = |r| rows.row(r).iter().zip(image).map(|(w, x)| w * x).sum();
        Self {
            y: (0..rows.nrows()).map(sum).collect(),
            rows: Arc::new(PressRows::of_matrix(rows)),
        }
    }

    /// The measurements with noise of the standard deviation `sd`.
    fn press(&self, sd: f64, deviates: &[f64]) -> Press {
        let volts = self.y.iter().zip(deviates).map(|(y, z)| y + sd * z);
        Press::on(Arc::clone(&self.rows), volts.collect(), 0.0)
    }
}
