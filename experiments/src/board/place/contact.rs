//! One contact of the ball, as recorded or with its taxels relabelled.

use crate::score::{Bounce, contact_image};
use spts_circuit::Recording;
use spts_recon::localise::centre_of_mass;
use spts_recon::metrics::SUPPORT_THRESHOLD;

/// A relabelled contact's centre keeps this distance from the outer taxels, taxels.
const MARGIN_PX: f64 = 1.2;

/// Rows of weights, samples and true centre.
pub(super) struct Contact {
    shape: [usize; 2],
    centre: [f64; 2],
    phi: Vec<f64>,
    binary: bool,
    volts: Vec<f64>,
    idle: f64,
}

/// A contact's measurements, with the taxels shifted cyclically.
pub(super) struct Moved {
    /// Weights, each in [−1, 1], one row a measurement.
    pub(super) phi: Vec<f64>,
    /// Binary weights as bits, ⌈taxels/64⌉ words a measurement.
    pub(super) signs: Option<Vec<u64>>,
    /// Output, V.
    pub(super) volts: Vec<f64>,
    /// The same without the output of the untouched skin, V.
    pub(super) y: Vec<f64>,
}

impl Contact {
    /// `None` when a sample is lost or the contact has no image.
    pub(super) fn new(recording: &Recording, bounce: &Bounce, shape: [usize; 2]) -> Option<Self> {
        let centre = centre_of_mass(&contact_image(recording, bounce)?, shape[1], SUPPORT_THRESHOLD)?;
        let volts = recording.blocks()[bounce.block].volts[bounce.start..bounce.end].to_vec();
        let rows = recording.rows(bounce.block, bounce.start..bounce.end);
        Some(Self {
            shape,
            centre,
            phi: rows.to_vec(),
            binary: rows.sign_bits().is_some(),
            volts,
            idle: bounce.idle,
        })
    }

    /// The centre after a cyclic shift by whole taxels.
    pub(super) fn moved(&self, shift: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|k| (self.centre[k] + shift[k] as f64) % self.shape[k] as f64)
    }

    /// Shifts that leave the centre far enough from the edge.
    pub(super) fn shifts(&self) -> Vec<[usize; 2]> {
        let all = (0..self.shape[0]).flat_map(|r| (0..self.shape[1]).map(move |c| [r, c]));
        let inside = |k: usize, at: f64| (MARGIN_PX..=self.shape[k] as f64 - 1.0 - MARGIN_PX).contains(&at);
        all.filter(|&s| {
            let [r, c] = self.moved(s);
            inside(0, r) && inside(1, c)
        })
        .collect()
    }

    /// The contact with taxel (r, c) called (r + shift₀, c + shift₁), cyclically.
    pub(super) fn relabelled(&self, shift: [usize; 2]) -> Moved {
        let [rows, cols] = self.shape;
        let taxels = rows * cols;
        let words = taxels.div_ceil(64);
        let mut phi = vec![0.0; self.phi.len()];
        let mut signs = vec![0; self.volts.len() * words];
        for ((to, from), bits) in phi
            .chunks_exact_mut(taxels)
            .zip(self.phi.chunks_exact(taxels))
            .zip(signs.chunks_exact_mut(words))
        {
            for (i, w) in from.iter().enumerate() {
                let k = (i / cols + shift[0]) % rows * cols + (i % cols + shift[1]) % cols;
                to[k] = *w;
                bits[k / 64] |= u64::from(*w > 0.0) << (k % 64);
            }
        }
        Moved {
            phi,
            signs: self.binary.then_some(signs),
            y: self.volts.iter().map(|v| v - self.idle).collect(),
            volts: self.volts.clone(),
        }
    }
}
