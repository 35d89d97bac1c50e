//! One contact of the ball or of a finger, as recorded or with relabelled taxels.

use super::bounces::{RecordedBounce, contact_image};
use super::touches::RecordedTouch;
use crate::windows::Press;
use spts_circuit::Recording;
use spts_recon::localise::centre_of_mass;
use spts_recon::metrics::SUPPORT_THRESHOLD;

/// A relabelled contact's centre keeps this distance from the outer taxels, taxels.
const MARGIN_PX: f64 = 1.2;

/// Measurements of a touch in which it is located: some hundred windows of the usual sizes.
const TOUCH_MEASUREMENTS: usize = 2000;

/// Measurements and true centre.
pub(super) struct Contact {
    shape: [usize; 2],
    centre: [f64; 2],
    press: Press,
}

impl Contact {
    /// `None` when a sample is lost or the contact has no image.
    pub(super) fn new(recording: &Recording, bounce: &RecordedBounce, shape: [usize; 2]) -> Option<Self> {
        let centre = centre_of_mass(&contact_image(recording, bounce)?, shape[1], SUPPORT_THRESHOLD)?;
        let press = Press::within(recording, bounce.block, bounce.start..bounce.end, bounce.idle);
        Some(Self { shape, centre, press })
    }

    /// The middle of a touch, at most [`TOUCH_MEASUREMENTS`]; its centre is the touched taxel. `None` without an image.
    pub(super) fn of_touch(recording: &Recording, touch: &RecordedTouch, shape: [usize; 2]) -> Option<Self> {
        let taxel = touch.taxel(recording)?;
        Some(Self {
            shape,
            centre: [taxel / shape[1], taxel % shape[1]].map(|at| at as f64),
            press: touch.press(recording, TOUCH_MEASUREMENTS),
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
    pub(super) fn relabelled(&self, shift: [usize; 2]) -> Press {
        let [rows, cols] = self.shape;
        self.press
            .renamed(|k| (k / cols + shift[0]) % rows * cols + (k % cols + shift[1]) % cols)
    }
}
