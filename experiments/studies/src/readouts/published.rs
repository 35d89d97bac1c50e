//! Figures stated by published systems. They are listed for comparison and never mixed with measured results.

use serde::Serialize;

/// A published system.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct PublishedSystem {
    /// Name.
    pub name: &'static str,
    /// Taxels.
    pub taxels: usize,
    /// Images a second, as stated; for events, the inverse of the stated latency.
    pub frames_hz: f64,
    /// Signal wires, as text.
    pub wires: &'static str,
    /// The stated figure.
    pub stated: &'static str,
    /// Source.
    pub source: &'static str,
}

/// Published systems, from few taxels to many.
pub const PUBLISHED: &[PublishedSystem] = &[
    PublishedSystem {
        name: "CDMA skin",
        taxels: 16,
        frames_hz: 78.0,
        wires: "1",
        stated: "measured",
        source: "arXiv 2509.10888",
    },
    PublishedSystem {
        name: "SPTS",
        taxels: 100,
        frames_hz: 3500.0,
        wires: "1, and a bus",
        stated: "measured, M = 20",
        source: "arXiv 2511.16898",
    },
    PublishedSystem {
        name: "ACES",
        taxels: 240,
        frames_hz: 1000.0,
        wires: "1",
        stated: "measured, 1 ms an event",
        source: "Science Robotics 4 (2019) eaax2198",
    },
    PublishedSystem {
        name: "ACTS, adaptive",
        taxels: 1024,
        frames_hz: 1000.0,
        wires: "rows and columns",
        stated: "measured, the most",
        source: "arXiv 2410.13847",
    },
    PublishedSystem {
        name: "ACTS, raster",
        taxels: 1024,
        frames_hz: 56.0,
        wires: "rows and columns",
        stated: "measured",
        source: "arXiv 2410.13847",
    },
    PublishedSystem {
        name: "Hollis",
        taxels: 4096,
        frames_hz: 100.0,
        wires: "not stated",
        stated: "simulated, M = 1024, at least",
        source: "arXiv 1705.05247",
    },
    PublishedSystem {
        name: "TUM H1",
        taxels: 7560,
        frames_hz: 250.0,
        wires: "47 patches",
        stated: "measured, sensors of several kinds",
        source: "G. Cheng et al., Proc. IEEE 107 (2019) 2034",
    },
    PublishedSystem {
        name: "BYU fabric",
        taxels: 8000,
        frames_hz: 50.0,
        wires: "SPI, daisy-chained",
        stated: "measured, at least, on 1 m²",
        source: "arXiv 2508.20959",
    },
];
