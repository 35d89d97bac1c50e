//! The table of readouts. A new one has a file beside this one and a line here.

use super::adaptive::Adaptive;
use super::code_division::CodeDivision;
use super::designed::DesignedSigns;
use super::events::Events;
use super::random::RandomSigns;
use super::raster::Raster;
use super::readout::WireReadout;

/// A readout method in the table [`READOUTS`]: its names, what it demands of a cell, and how it is built.
///
/// ```
/// use spts_studies::readouts::readout;
///
/// let designed = readout("designed").expect("in the table");
/// assert_eq!(designed.wires, 1);
/// assert!(readout("telepathy").is_none());
/// ```
#[derive(Clone, Copy)]
pub struct ReadoutLine {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in figures and printed tables.
    pub label: &'static str,
    /// Requirements on a cell.
    pub cell: &'static str,
    /// Publication of the method.
    pub source: &'static str,
    /// Number of measured wires, without those of the supply and of the bus or clock for the cells.
    pub wires: usize,
    /// Builds the readout.
    pub build: fn() -> Box<dyn WireReadout>,
}

/// Every readout.
pub const READOUTS: &[ReadoutLine] = &[
    ReadoutLine {
        name: "raster",
        label: "raster scan",
        cell: "level 1 in its own slot, the neutral level in all others: the published cell in raster mode",
        source: "A. Slepyan et al., arXiv 2511.16898 (SPTS)",
        wires: 1,
        build: || Box::new(Raster),
    },
    ReadoutLine {
        name: "random",
        label: "random signs",
        cell: "pseudorandom levels of ±1: the published cell, with a 32-bit seed",
        source: "A. Slepyan et al., arXiv 2511.16898 (SPTS)",
        wires: 1,
        build: || Box::new(RandomSigns),
    },
    ReadoutLine {
        name: "designed",
        label: "designed signs",
        cell: "a stored pattern of ±1, M bits: our firmware holds 64, more take more memory",
        source: "docs/rows.md",
        wires: 1,
        build: || Box::new(DesignedSigns),
    },
    ReadoutLine {
        name: "code_division",
        label: "code division",
        cell: "a Walsh function, from a counter and its own number: ±1",
        source: "arXiv 2509.10888 (CDMA skin)",
        wires: 1,
        build: || Box::new(CodeDivision),
    },
    ReadoutLine {
        name: "adaptive",
        label: "adaptive sub-sampling",
        cell: "level 1 when it is called, the neutral level otherwise: a call by address before every measurement",
        source: "A. Slepyan et al., arXiv 2410.13847 (ACTS)",
        wires: 1,
        build: || Box::new(Adaptive),
    },
    ReadoutLine {
        name: "events",
        label: "asynchronous events",
        cell: "a converter for its own taxel, an output of its own of −1, +1 or switched off, and a stored signature",
        source: "W. W. Lee et al., Science Robotics 4 (2019) eaax2198 (ACES)",
        wires: 1,
        build: || Box::new(Events),
    },
];

/// The readout called `name`.
#[must_use]
pub fn readout(name: &str) -> Option<&'static ReadoutLine> {
    READOUTS.iter().find(|line| line.name == name)
}
