//! What a set of seeds is worth: the same images, rows and noise through every set.

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
use spts_models::Streams;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::recover::{NnLasso, Omp, Penalty};
use spts_recon::{Matrix, Problem, Recover, Workspace};

/// Share of the largest correlation that the penalty of the lasso has.
const PENALTY: f64 = 0.1;

/// Windows an image is measured with.
const WINDOWS: usize = 4;

/// A decoder by name, for windows of M measurements.
type Decoder = (&'static str, fn(usize) -> Result<Box<dyn Recover>, SeedError>);

/// Decoders that are compared: pursuit with normalised columns and M/4 atoms, rounded, and the non-negative lasso.
const DECODERS: [Decoder; 2] = [
    ("omp", |m| Ok(Box::new(Omp::new(((m + 2) / 4).max(1))))),
    ("nn_lasso", |_| {
        let lasso = NnLasso::new(Penalty::Relative(PENALTY))?;
        Ok(Box::new(lasso.with_normalised_columns()))
    }),
];

/// IoU of one set with one decoder and M.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WorthRow {
    /// What the images are: synthetic or recorded.
    pub images: &'static str,
    /// Standard deviation of the noise of a measurement as a share of ‖x‖₂.
    pub noise: f64,
    /// Decoder.
    pub decoder: &'static str,
    /// Measurements M.
    pub m: usize,
    /// Name of the set.
    pub seeds: String,
    /// Intersection over union of the supports, mean over the images.
    pub iou: f64,
    /// Its standard error, over the images.
    pub iou_se: f64,
    /// IoU more than with the first set, image by image.
    pub gain: f64,
    /// Its standard error, over the images.
    pub gain_se: f64,
}

/// What is decoded how.
pub(super) struct Comparison<'a> {
    pub(super) sets: &'a [SeedSet],
    pub(super) mode: WeightMode,
    pub(super) measurements: &'a [usize],
    /// Noises, shares of ‖x‖₂.
    pub(super) noises: &'a [f64],
    pub(super) streams: Streams,
}

impl Comparison<'_> {
    /// Rows for all sets, noises, decoders and M. An image is a step of `progress`.
    pub(super) fn run(&self, images: &Images, progress: &dyn Progress) -> Result<Vec<WorthRow>, SeedError> {
        let streams = self.streams.child(images.source, 0);
        let scored: Vec<Vec<f64>> = (0..images.images.len())
            .into_par_iter()
            .map(|index| {
                let scores = self.score(images, index, streams);
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
                decoder: decoder.0,
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

    /// Everything that an image is scored by, in order.
    fn keys(&self) -> Vec<(f64, &'static Decoder, usize, &SeedSet)> {
        let mut keys = Vec::new();
        for &noise in self.noises {
            for decoder in &DECODERS {
                for &m in self.measurements {
                    keys.extend(self.sets.iter().map(|set| (noise, decoder, m, set)));
                }
            }
        }
        keys
    }

    /// IoU of one image by every key, mean over its windows.
    fn score(&self, images: &Images, index: usize, streams: Streams) -> Result<Vec<f64>, SeedError> {
        let (image, dictionary) = (&images.images[index], &images.dictionary);
        let mut rng = streams.rng("windows", index as u64);
        let most = self.measurements.iter().copied().max().unwrap_or(0);
        let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mut truth = Vec::new();
        support(image, SUPPORT_THRESHOLD, &mut truth);
        let mut scorer = Scorer {
            dictionary,
            truth,
            work: Workspace::default(),
            image: vec![0.0; image.len()],
            mask: Vec::new(),
        };
        let keys = self.keys();
        let mut sums = vec![0.0; keys.len()];
        for _ in 0..WINDOWS {
            let start = rng.random_range(0..SPAN_ROWS);
            let deviates: Vec<f64> = (0..most).map(|_| StandardNormal.sample(&mut rng)).collect();
            let seen: Vec<Seen> = self
                .sets
                .iter()
                .map(|set| Seen::new(&set.rows(self.mode, start, most), image, dictionary))
                .collect();
            for (key, (sum, &(noise, decoder, m, _))) in sums.iter_mut().zip(&keys).enumerate() {
                let seen = &seen[key % self.sets.len()];
                let y: Vec<f64> = (0..m).map(|i| seen.y[i] + noise * length * deviates[i]).collect();
                *sum += scorer.iou(&*decoder.1(m)?, &seen.operator, &y);
            }
        }
        Ok(sums.into_iter().map(|sum| sum / WINDOWS as f64).collect())
    }
}

/// A window of one set: Φ·D and Φ·x.
struct Seen {
    operator: Matrix,
    y: Vec<f64>,
}

impl Seen {
    fn new(rows: &Matrix, image: &[f64], dictionary: &Matrix) -> Self {
        let mut operator = Matrix::zeros(rows.nrows(), dictionary.ncols());
        let mut y = Vec::with_capacity(rows.nrows());
        for r in 0..rows.nrows() {
            dictionary.accumulate_row(rows.row(r), operator.row_mut(r));
            y.push(rows.row(r).iter().zip(image).map(|(w, x)| w * x).sum());
        }
        Self { operator, y }
    }
}

/// Decodes and scores against one truth, with memory that is used again.
struct Scorer<'a> {
    dictionary: &'a Matrix,
    truth: Vec<bool>,
    work: Workspace,
    image: Vec<f64>,
    mask: Vec<bool>,
}

impl Scorer<'_> {
    /// IoU of what `decoder` makes of the measurements `y`; an answer that it cannot give is an empty image.
    fn iou(&mut self, decoder: &dyn Recover, operator: &Matrix, y: &[f64]) -> f64 {
        let window = operator.view().rows(0, y.len());
        let found = Problem::new(window, y).and_then(|problem| decoder.recover(&problem, &mut self.work));
        found
            .unwrap_or_default()
            .synthesise(self.dictionary.view(), &mut self.image);
        support(&self.image, SUPPORT_THRESHOLD, &mut self.mask);
        SupportScore::new(&self.mask, &self.truth).iou
    }
}
