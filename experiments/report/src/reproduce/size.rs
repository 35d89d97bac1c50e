//! How much is simulated and scored.

use spts_eval::protocol::{MEASUREMENTS, Protocol};
use spts_eval::training::Learning;

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
    #[must_use]
    pub(super) fn full() -> Self {
        let protocol = Protocol::default();
        Self {
            raster_presses: 10,
            learning: Learning {
                presses: 0..5,
                training_images: 1500,
                sweeps: 15,
            },
            compressive_presses: 10,
            measurements: MEASUREMENTS.to_vec(),
            localisation: MEASUREMENTS.to_vec(),
            timed_decodes: 2000,
            protocol: Protocol {
                first_press: 0,
                ..protocol
            },
            raster_protocol: protocol,
            real_protocol: protocol,
        }
    }

    /// A look at everything in a minute: fewer presses, windows and numbers of measurements.
    #[must_use]
    pub(super) fn quick() -> Self {
        let few = Protocol {
            presses: 2,
            max_windows: 60,
            support_stride: 20,
            ..Protocol::default()
        };
        Self {
            raster_presses: 3,
            learning: Learning {
                presses: 0..2,
                training_images: 500,
                sweeps: 5,
            },
            compressive_presses: 2,
            measurements: vec![5, 10, 20, 25, 50, 100],
            localisation: vec![5, 7, 10, 15, 20, 25, 50, 100],
            timed_decodes: 500,
            protocol: Protocol { first_press: 0, ..few },
            raster_protocol: Protocol { first_press: 2, ..few },
            real_protocol: few,
        }
    }
}
