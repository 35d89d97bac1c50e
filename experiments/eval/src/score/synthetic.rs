//! Compressive windows made from raster images that may be learned from: what probabilities are calibrated on.

use super::protocol::Protocol;
use crate::score::PLATEAU;
use rand::RngExt as _;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution as _, StandardNormal};
use spts::Session;
use spts_models::Streams;

/// A window of ±1 weights and measurements.
pub(super) struct SyntheticWindow {
    /// Rows of weights, one after the other.
    pub(super) weights: Vec<f64>,
    /// Measurements, V.
    pub(super) y: Vec<f64>,
}

/// Range of the strength of one session as a share of another's, as measured on the device.
const GAIN: std::ops::Range<f64> = 0.5..1.4;

/// Deviation of a taxel from one session to another, as a share of itself: what neighbours (within [`LENGTH_PX`]) have in common, and
/// what each has of its own: those of the classes themselves, 0.22 with a smooth share of 0.8.
const DEVIATIONS: [f64; 2] = [0.2, 0.1];

/// Correlation length of the common deviation, taxels.
const LENGTH_PX: f64 = 2.0;

/// Noise of a measurement, V: idle, and as a share of ‖x‖₂ in contact, as measured on the device.
const NOISE: [f64; 2] = [0.1, 0.06];

/// Step of the compressive converter, V.
const STEP_V: f64 = 0.063;

/// Presses of the raster session that may be learned from.
fn learned_presses(session: &Session, protocol: &Protocol) -> impl Iterator<Item = usize> {
    let scored = protocol.presses_of(&session.raster);
    (0..session.raster.blocks().len()).filter(move |p| !scored.contains(p))
}

/// `count` windows of `m` measurements of the object of `session`, on a grid of `cols` columns; none without a press to learn from.
pub(super) fn synthetic_windows(
    session: &Session,
    protocol: &Protocol,
    cols: usize,
    m: usize,
    count: usize,
    streams: Streams,
) -> Vec<SyntheticWindow> {
    let presses: Vec<usize> = learned_presses(session, protocol).collect();
    let frames = PLATEAU.start.min(session.raster.frames())..PLATEAU.end.min(session.raster.frames());
    if presses.is_empty() || frames.is_empty() {
        return Vec::new();
    }
    let mut rng = streams.rng("synthetic windows", session.label as u64);
    let one = |_| {
        let press = presses[rng.random_range(0..presses.len())];
        let seen = session.raster.volts(press, rng.random_range(frames.clone()));
        let image = another_session(seen, cols, &mut rng);
        measure(&image, m, &mut rng)
    };
    (0..count).map(one).collect()
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// The image as another session of the same object might have it.
fn another_session(seen: &[f64], cols: usize, rng: &mut ChaCha8Rng) -> Vec<f64> {
    let white: Vec<f64> = seen.iter().map(|_| normal(rng)).collect();
    let gain = rng.random_range(GAIN);
    let place = |i: usize| [(i / cols.max(1)) as f64, (i % cols.max(1)) as f64];
    let common = |i: usize| {
        let (mut sum, mut square) = (0.0, 0.0);
        for (j, w) in white.iter().enumerate() {
            let ([r, c], [s, d]) = (place(i), place(j));
            // white noise through a kernel of width ℓ/√2 is correlated over ℓ
            let k = (-((r - s).powi(2) + (c - d).powi(2)) / LENGTH_PX.powi(2)).exp();
            sum += k * w;
            square += k * k;
        }
        sum / f64::sqrt(square)
    };
    let taxels = seen.iter().enumerate();
    taxels
        .map(|(i, v)| {
            let deviation = 1.0 + DEVIATIONS[0] * common(i) + DEVIATIONS[1] * normal(rng);
            gain * v.max(0.0) * deviation.max(0.0)
        })
        .collect()
}

fn measure(image: &[f64], m: usize, rng: &mut ChaCha8Rng) -> SyntheticWindow {
    let length = image.iter().map(|v| v * v).sum::<f64>().sqrt();
    let noise = NOISE[0].hypot(NOISE[1] * length);
    let weights: Vec<f64> = (0..m * image.len())
        .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
        .collect();
    let y = weights.chunks_exact(image.len().max(1)).map(|row| {
        let signal: f64 = row.iter().zip(image).map(|(w, v)| w * v).sum();
        ((signal + noise * normal(rng)) / STEP_V).round() * STEP_V
    });
    let y = y.collect();
    SyntheticWindow { weights, y }
}
