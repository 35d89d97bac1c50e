//! Compares readouts with few wires: skins, touches, amplifier, noise, converter and clock are the same for all.
//!
//! A [`WireReadout`] requests measurements from a [`WireSession`] and returns images. [`READOUTS`] is the table of
//! readouts, and a conformance suite checks every line. [`ReadoutsStudy`] measures them; docs/readouts.md describes the
//! protocol.
//!
//! ```no_run
//! use spts_studies::readouts::{READOUTS, ReadoutsStudy};
//!
//! let study = ReadoutsStudy {
//!     readouts: READOUTS.iter().collect(),
//!     sides: vec![10],
//!     repetitions: 2,
//!     shapes: 4,
//!     seed: 1,
//! };
//! assert_eq!(study.run(&())?.rows.len(), READOUTS.len());
//! # Ok::<(), spts_input::Refusal>(())
//! ```

use adaptive::Adaptive;
use events::Events;
use rows::{CodeDivision, Raster, designed_signs, random_signs};
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use spts_models::{SkinLayout, Streams};
use spts_recon::recover::{Gaussian, ImagePrior};
use std::sync::{Arc, OnceLock};

mod adaptive;
mod decode;
mod events;
mod rows;
mod study;
mod wire;

pub use study::{GOOD_IOU, PublishedSystem, ReadoutRow, ReadoutTrial, ReadoutsReport, ReadoutsStudy, SizeWire};
pub use wire::{SkinWire, WireFrame, WireSession};

/// Shares of the taxels that readouts with a free number of measurements are tried with.
const SHARES: [f64; 6] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5];
/// Fewest and most measurements of those.
const MEASUREMENTS: std::ops::RangeInclusive<usize> = 5..=2000;

/// A method to read a skin over few wires, such as a raster scan or random signs, with everything computed that depends
/// only on the skin; `spts readouts` compares them.
///
/// ```
/// use spts_studies::readouts::{READOUTS, readout};
///
/// assert_eq!(readout("raster").map(|line| line.label), Some("raster scan"));
/// assert_eq!(READOUTS.len(), 6);
/// ```
pub trait WireReadout: Send + Sync {
    /// Largest magnitude of Σ wₖ·gₖ, S, over all its measurements of a skin with the conductances `conductance_s`, idle
    /// measurements included. The feedback resistance is chosen for it.
    fn largest_sum_s(&self, conductance_s: &[f64]) -> f64;

    /// Reads the touch that is held on `wire`. Returns one reading for every number of measurements with which this
    /// readout is tested, in increasing order; every touch has the same number of readings.
    ///
    /// # Errors
    /// [`Refusal`] if the wire cannot be measured, or an image cannot be recovered.
    fn read(&self, wire: &mut WireSession<'_>) -> Result<Vec<Reading>, Refusal>;
}

/// What a readout method answers for one touch and one number of measurements: the image, and how soon the touch was
/// noticed and placed.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// Number of measurements for the image.
    pub measurements: usize,
    /// One value a taxel, in any unit.
    pub image: Vec<f64>,
    /// Mean number of measurements from the onset of the touch, at a random moment, to the first sample beyond the
    /// alarm threshold; `None` if there is no such sample.
    pub noticed: Option<f64>,
    /// Mean number of measurements from the onset until the place of the touch is known; `None` if it never is.
    pub placed: Option<f64>,
}

/// The skin that readout methods are prepared for.
pub struct ReadoutSkin {
    /// Rows, columns and pitch.
    pub layout: SkinLayout,
    /// Root of random numbers.
    pub streams: Streams,
    prior: OnceLock<Arc<Gaussian>>,
}

impl ReadoutSkin {
    /// A skin of this layout. `seed` determines the random numbers that readouts need for preparation.
    pub fn new(layout: SkinLayout, seed: u64) -> Self {
        Self { layout, streams: Streams::new(seed), prior: OnceLock::new() }
    }

    /// Prior of the images on this skin without any recording: random shapes anywhere.
    ///
    /// # Errors
    /// [`Refusal`] for a skin of more than [`TrainingData::MOST_TAXELS`].
    pub fn prior(&self) -> Result<Arc<Gaussian>, Refusal> {
        if let Some(prior) = self.prior.get() {
            return Ok(Arc::clone(prior));
        }
        let prior = TrainingData::for_layout(&self.layout, self.streams)?.prior(ImagePrior::UNSEEN)?;
        Ok(Arc::clone(self.prior.get_or_init(|| prior)))
    }

    /// Numbers of measurements for a readout that can choose them: 1 to 50 % of the taxels, at least 5 and at most
    /// 2000.
    pub fn measurements(&self) -> Vec<usize> {
        #[expect(clippy::cast_possible_truncation, reason = "skins have far fewer than 2^52 taxels")]
        let rounded = |share: &f64| (share * self.layout.taxels() as f64).round() as usize;
        let counts = SHARES.iter().map(rounded);
        counts.filter(|count| MEASUREMENTS.contains(count)).collect()
    }

    /// The largest of them.
    fn most_measurements(&self) -> usize {
        self.measurements().last().copied().unwrap_or(1)
    }
}

/// Mean number of measurements from the onset of a touch to the first sample beyond the alarm threshold. `beyond` says
/// of every measurement of a frame whether its sample is beyond the threshold. The frame is measured over and over, and
/// the onset is at a uniformly distributed moment, so that half a measurement passes on average before the next one
/// begins. `None` if no sample is beyond the threshold.
pub(crate) fn until_noticed(beyond: &[bool]) -> Option<f64> {
    let first = beyond.iter().position(|b| *b)?;
    let count = beyond.len();
    // backwards from the first one, once around
    let (mut distance, mut sum) = (0_usize, 0_usize);
    for step in 0..count {
        let at = (first + count - step) % count;
        distance = if beyond[at] { 1 } else { distance + 1 };
        sum += distance;
    }
    Some(sum as f64 / count as f64 - 0.5)
}

/// A readout method in the table [`READOUTS`]: its names, what it demands of a cell, and how it is built.
///
/// ```
/// use spts_studies::readouts::readout;
///
/// let designed = readout("designed").expect("in the table");
/// assert_eq!(designed.wires, 1);
/// assert!(readout("telepathy").is_none());
/// ```
#[derive(Debug, Clone, Copy)]
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
    /// Builds the readout of a skin: rows, gains and everything else that depends only on it.
    pub build: fn(&ReadoutSkin) -> Result<Box<dyn WireReadout>, Refusal>,
}

/// Every readout.
pub const READOUTS: &[ReadoutLine] = &[
    ReadoutLine {
        name: "raster",
        label: "raster scan",
        cell: "level 1 in its own slot, the neutral level in all others: the published cell in raster mode",
        source: "A. Slepyan et al., arXiv 2511.16898 (SPTS)",
        wires: 1,
        build: |skin| {
            let cols = skin.layout.cols();
            Ok(Box::new(Raster { cols }))
        },
    },
    ReadoutLine {
        name: "random",
        label: "random signs",
        cell: "pseudorandom levels of ±1: the published cell, with a 32-bit seed",
        source: "A. Slepyan et al., arXiv 2511.16898 (SPTS)",
        wires: 1,
        build: |skin| Ok(Box::new(random_signs(skin)?)),
    },
    ReadoutLine {
        name: "designed",
        label: "designed signs",
        cell: "a stored pattern of ±1, M bits: our firmware holds 64, more take more memory",
        source: "docs/rows.md",
        wires: 1,
        build: |skin| Ok(Box::new(designed_signs(skin)?)),
    },
    ReadoutLine {
        name: "code_division",
        label: "code division",
        cell: "a Walsh function, from a counter and its own number: ±1",
        source: "arXiv 2509.10888 (CDMA skin)",
        wires: 1,
        build: |skin| {
            let taxels = skin.layout.taxels();
            Ok(Box::new(CodeDivision { taxels }))
        },
    },
    ReadoutLine {
        name: "adaptive",
        label: "adaptive sub-sampling",
        cell: "level 1 when it is called, the neutral level otherwise: a call by address before every measurement",
        source: "A. Slepyan et al., arXiv 2410.13847 (ACTS)",
        wires: 1,
        build: |skin| Ok(Box::new(Adaptive::new(skin))),
    },
    ReadoutLine {
        name: "events",
        label: "asynchronous events",
        cell: "a converter for its own taxel, an output of its own of −1, +1 or switched off, and a stored signature",
        source: "W. W. Lee et al., Science Robotics 4 (2019) eaax2198 (ACES)",
        wires: 1,
        build: |skin| Ok(Box::new(Events::new(skin))),
    },
];

/// The readout called `name`.
pub fn readout(name: &str) -> Option<&'static ReadoutLine> {
    READOUTS.iter().find(|line| line.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touches::{Touch, TouchScore};
    use spts_models::ConductanceMap;

    /// IoU with the most measurements, of a contact that stands out, at least: two thirds of the taxels are right.
    const LEAST_IOU: f64 = 0.6;

    /// Rows and columns of the skins: one that is decoded under a prior of whole images, and a larger one.
    const SKINS: [[usize; 2]; 2] = [[12, 9], [24, 20]];

    /// A plate of 4 × 3 taxels pressed on a skin, or nothing.
    fn plate(layout: &SkinLayout, pressed_s: f64) -> Touch {
        let (rows, cols) = (layout.rows(), layout.cols());
        let inside = |k: usize| (5..9).contains(&(k / cols)) && (2..5).contains(&(k % cols));
        let values = (0..rows * cols).map(|k| if inside(k) { pressed_s } else { 0.0 }).collect();
        Touch {
            name: Arc::from("plate"),
            conductance_s: ConductanceMap::from_values(rows, cols, values),
            support: (0..rows * cols).map(inside).collect(),
            centre_px: Some([6.5, 3.0]),
        }
    }

    /// Checks a readout on skins that are not square. Numbers of measurements must increase; images must have one
    /// finite value ≥ 0 for each taxel; times must be positive and in order. A strong contact must be shown and
    /// noticed, and an untouched skin must not be. Equal wires must give equal readings, in any order of touches.
    fn conformance(line: &ReadoutLine) {
        SKINS.iter().for_each(|skin| on_skin(line, *skin));
    }

    fn on_skin(line: &ReadoutLine, [rows, cols]: [usize; 2]) {
        let name = line.name;
        let layout = SkinLayout::with_pitch(rows, cols, 15e-3).expect("a skin");
        let skin = ReadoutSkin::new(layout, 7);
        let readout = (line.build)(&skin).expect(name);
        let (touch, nothing) = (plate(&layout, 150e-6), plate(&layout, 0.0));
        let wire = SkinWire::new(layout, touch.conductance_s.values()).expect(name);
        let largest_sum_s = wire.largest_sum_s(&*readout, &touch);
        let all_s: f64 = 12.0 * 150e-6 + layout.taxels() as f64 * wire.electronics.skin.idle_s;
        assert!(largest_sum_s > 0.0 && largest_sum_s <= all_s + 1e-12, "{name}: {largest_sum_s} S of {all_s} S");
        let session = || wire.session(largest_sum_s, Streams::new(11)).expect(name);

        let mut first = session();
        let readings = readout.read(first.hold(&touch, 0)).expect(name);
        assert!(!readings.is_empty(), "{name}: no reading");
        for pair in readings.windows(2) {
            assert!(pair[0].measurements < pair[1].measurements, "{name}: measurements rise");
        }
        for reading in &readings {
            assert!(reading.measurements > 0 && reading.image.len() == layout.taxels(), "{name}");
            assert!(reading.image.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}: {:?}", reading.image);
            if let (Some(noticed), Some(placed)) = (reading.noticed, reading.placed) {
                assert!(0.5 <= noticed && noticed <= placed, "{name}: noticed {noticed}, placed {placed}");
            }
        }
        let best = readings.last().expect("one reading");
        let score = TouchScore::of(&best.image, &touch, &layout);
        assert!(score.iou >= LEAST_IOU, "{name}: IoU {}", score.iou);
        assert!(score.place_px.is_some_and(|place| place < 1.0), "{name}: place {:?}", score.place_px);
        assert!(best.noticed.is_some(), "{name}: a contact is not noticed");

        let idle = readout.read(first.hold(&nothing, 1)).expect(name);
        assert_eq!(idle.len(), readings.len(), "{name}: as many readings of nothing");
        assert!(idle.iter().all(|reading| reading.noticed.is_none()), "{name}: noticed nothing");

        let mut second = session();
        let before = readout.read(second.hold(&nothing, 1)).expect(name);
        let again = readout.read(second.hold(&touch, 0)).expect(name);
        assert!(before == idle && again == readings, "{name}: the order of touches shows");
        let other = readout.read(second.hold(&touch, 2)).expect(name);
        assert!(other != readings, "{name}: no noise");
    }

    /// By hand: with one sample of four beyond, 1, 2, 3 or 4 measurements, less the half that passes before the first.
    #[test]
    fn waiting_times_are_means_over_the_onset() {
        let close = |found: Option<f64>, expected: f64| (found.unwrap() - expected).abs() < 1e-12;
        assert!(close(until_noticed(&[false, true, false, false]), 2.0));
        assert!(close(until_noticed(&[true; 5]), 0.5));
        // (1 + 2 + 1 + 2)/4 − ½
        assert!(close(until_noticed(&[true, false, true, false]), 1.0));
        assert_eq!(until_noticed(&[false; 3]), None);
        assert_eq!(until_noticed(&[]), None);
    }

    #[test]
    fn numbers_of_measurements_are_shares_of_the_taxels() {
        let counts = |side: usize| {
            let layout = SkinLayout::with_pitch(side, side, 15e-3).unwrap();
            ReadoutSkin::new(layout, 1).measurements()
        };
        assert_eq!(counts(10), [5, 10, 20, 50]);
        assert_eq!(counts(32), [10, 20, 51, 102, 205, 512]);
        assert_eq!(counts(100), [100, 200, 500, 1000, 2000]);
    }

    #[test]
    fn every_readout_conforms() {
        for line in READOUTS {
            conformance(line);
        }
    }
}
