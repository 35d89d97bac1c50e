//! Amount of simulation and scoring.

use spts::chain::Acquisition;
use spts_circuit::Mode;
use spts_eval::protocol::{PUBLISHED_TAXELS, Protocol};
use spts_eval::training::Learning;

/// Size of a budget.
#[derive(Debug, Clone)]
pub(super) struct BudgetSize {
    /// Number of raster presses of an object. The last is the ground truth; the earlier ones are training data.
    pub(super) raster_presses: usize,
    /// Training data of the decoder.
    pub(super) learning: Learning,
    /// Number of compressive sessions of an object. Each has one press, its own noise, and its own learned dictionary.
    pub(super) sessions: usize,
    /// Largest number of votes in a press, spread evenly over the plateau.
    pub(super) votes: usize,
}

impl BudgetSize {
    /// The budget that ships.
    pub(super) fn full() -> Self {
        Self {
            raster_presses: 5,
            learning: Learning {
                presses: 0..4,
                training_images: 1500,
                sweeps: 15,
            },
            sessions: 10,
            votes: 6,
        }
    }

    /// A look in a few seconds.
    pub(super) fn quick() -> Self {
        Self {
            raster_presses: 3,
            learning: Learning {
                presses: 0..2,
                training_images: 300,
                sweeps: 4,
            },
            sessions: 3,
            votes: 3,
        }
    }

    /// Presses of an object in both modes.
    pub(super) fn presses(&self) -> usize {
        self.raster_presses + self.sessions
    }

    /// Most measurements M of which a vote still fits into a press on a skin of `taxels` taxels.
    pub(super) fn most_measurements(&self, taxels: usize) -> usize {
        let protocol = self.protocol(taxels);
        protocol.frames * taxels / protocol.vote
    }

    /// The published protocol at the same instants, for a skin of `taxels` taxels: its frames last longer or shorter.
    pub(super) fn protocol(&self, taxels: usize) -> Protocol {
        let published = Protocol::default();
        let own = |frame: usize| frame * PUBLISHED_TAXELS / taxels;
        Protocol {
            first_press: 0,
            presses: 1,
            first_frame: own(published.first_frame),
            frames: own(published.frames),
            truth: (self.raster_presses - 1, own(published.truth.1)),
            ..published
        }
    }
}

/// Sessions of an object that are kept apart by their numbers.
const SESSIONS: u64 = 1000;

/// Acquisition of the raster session of the object with the label `label`. Its number is even, those of compressive
/// sessions are odd.
pub(super) fn raster_acquisition(label: usize) -> Acquisition {
    Acquisition::presses(Mode::Raster, 2 * label as u64)
}

/// Acquisition of the compressive session `session` in [0, 1000) of the object with the label `label`: every one begins
/// elsewhere in the weights' sequence, and has its own number and with it its own noise and its own gains of the
/// taxels.
pub(super) fn compressive_acquisition(label: usize, session: usize) -> Acquisition {
    let base = Acquisition::presses(Mode::Compressive, 2 * (label as u64 * SESSIONS + session as u64) + 1);
    Acquisition {
        lead_frames: base.lead_frames + 1000 * session as u64,
        ..base
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Sessions of the scan and of all compressive recordings are numbered apart, so that each has noise and gains of
    /// its own.
    #[test]
    fn every_session_has_a_number_of_its_own() {
        let size = BudgetSize::full();
        let mut numbers: Vec<u64> = (0..17)
            .flat_map(|label| {
                let compressive = (0..size.sessions).map(move |k| compressive_acquisition(label, k).session);
                compressive.chain([raster_acquisition(label).session])
            })
            .collect();
        numbers.sort_unstable();
        let count = numbers.len();
        numbers.dedup();
        assert_eq!(numbers.len(), count);
    }

    /// The defaults, half the taxels at most, fit into every press, and so does the largest M that is allowed, but no
    /// larger one.
    #[test]
    fn a_vote_fits_into_every_press() {
        let size = BudgetSize::full();
        for side in 10..=40 {
            let taxels = side * side;
            let (most, press) = (size.most_measurements(taxels), size.protocol(taxels).frames * taxels);
            assert!(most >= taxels.div_ceil(2), "{taxels}");
            assert!(press / (20 * most) >= 1 && press / (20 * (most + 1)) == 0, "{taxels}");
        }
    }
}
