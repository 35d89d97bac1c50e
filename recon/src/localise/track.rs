//! A contact followed measurement by measurement: when it touches, where, how hard, and when it lets go.

use super::blob::{BlobEvidence, Estimate, Localiser};
use crate::checks::{RangeError, measurement, within};
use std::collections::VecDeque;

/// When a contact begins and ends, and how fast its amplitude may change.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackConfig {
    /// Standard deviation of a measurement with nothing on the sheet, in units of y, [1e-60, 1e60].
    pub idle_sd: f64,
    /// A contact is there while the root mean square of the last `envelope` measurements is above this many `idle_sd`, [1, 1e6].
    pub threshold: f64,
    /// Measurements of the moving root mean square, [2, 10000].
    pub envelope: usize,
    /// Measurements over which the amplitude counts as constant, [1, 10000]; their evidence is then carried on.
    pub window: usize,
    /// A contact has ended when the signal stayed below the threshold for so many measurements, [1, 1000000].
    pub gap: usize,
}

impl TrackConfig {
    /// Values for contacts of a few hundred measurements, on a wire whose idle noise is `idle_sd`.
    #[must_use]
    pub fn new(idle_sd: f64) -> Self {
        Self {
            idle_sd,
            threshold: 2.6,
            envelope: 16,
            window: 20,
            gap: 100,
        }
    }

    fn check(&self) -> Result<(), RangeError> {
        within("idle_sd", self.idle_sd, 1e-60, 1e60)?;
        within("threshold", self.threshold, 1.0, 1e6)?;
        within("envelope", self.envelope as f64, 2.0, 1e4)?;
        within("window", self.window as f64, 1.0, 1e4)?;
        within("gap", self.gap as f64, 1.0, 1e6)?;
        Ok(())
    }
}

/// One contact, as far as it is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// First measurement in contact, counted from the tracker's first.
    pub start: u64,
    /// One past the last measurement in contact, or the next measurement while it lasts.
    pub end: u64,
    /// Where it is, with all evidence since it began.
    pub place: Estimate,
    /// Largest amplitude of any full window so far, in units of y; 0 before the first.
    pub peak: f64,
    /// Whether it is still there.
    pub touching: bool,
}

impl Contact {
    /// Number of measurements in contact.
    #[must_use]
    pub fn measurements(&self) -> u64 {
        self.end - self.start
    }
}

/// Follows contacts one after another.
#[derive(Debug, Clone)]
pub struct Tracker {
    config: TrackConfig,
    localiser: Localiser,
    evidence: BlobEvidence,
    in_window: usize,
    squares: VecDeque<f64>,
    projected: Vec<f64>,
    count: u64,
    last_above: u64,
    contact: Option<Contact>,
}

impl Tracker {
    /// Tracker that has seen nothing.
    ///
    /// # Errors
    /// [`RangeError`] when a number of `config` is out of range.
    pub fn new(config: TrackConfig, localiser: Localiser) -> Result<Self, RangeError> {
        config.check()?;
        Ok(Self {
            evidence: localiser.evidence(),
            config,
            localiser,
            in_window: 0,
            squares: VecDeque::new(),
            projected: Vec::new(),
            count: 0,
            last_above: 0,
            contact: None,
        })
    }

    /// Takes the next measurement `y`, the idle output removed, with its row of weights. Returns the contact when there is one, and
    /// once more, `touching` being false, when it has ended.
    ///
    /// Both ends of the contact are put in the middle of the moving root mean square, where a step that reaches the threshold half-way
    /// would be.
    ///
    /// # Errors
    /// [`RangeError`] when `y` or a weight is not finite or too large, or there are not as many weights as taxels; the measurement then
    /// does not count.
    pub fn observe(&mut self, weights: &[f64], y: f64) -> Result<Option<Contact>, RangeError> {
        let y = measurement(y)?;
        self.localiser.project(weights, &mut self.projected)?;
        self.count += 1;
        let above = self.envelope(y) > self.config.threshold;
        if above {
            self.last_above = self.count;
        }
        let half = (self.config.envelope / 2) as u64;
        let Some(mut contact) = self.contact else {
            if above {
                self.begin(half, y)?;
            }
            return Ok(self.contact);
        };
        if self.count - self.last_above >= self.config.gap as u64 {
            contact.end = self.last_above.saturating_sub(half).max(contact.start + 1);
            contact.touching = false;
            self.contact = None;
            return Ok(Some(contact));
        }
        contact.end = self.count;
        // below the threshold there is nothing to be learned about the place
        if above {
            self.learn(&mut contact, y)?;
        }
        self.contact = Some(contact);
        Ok(self.contact)
    }

    /// Root mean square of the last measurements, in idle standard deviations.
    fn envelope(&mut self, y: f64) -> f64 {
        if self.squares.len() == self.config.envelope {
            self.squares.pop_front();
        }
        self.squares.push_back((y / self.config.idle_sd).powi(2));
        (self.squares.iter().sum::<f64>() / self.config.envelope as f64).sqrt()
    }

    fn begin(&mut self, half: u64, y: f64) -> Result<(), RangeError> {
        self.evidence.clear();
        self.in_window = 0;
        let mut contact = Contact {
            start: self.count.saturating_sub(half),
            end: self.count,
            place: self.localiser.estimate(&mut self.evidence),
            peak: 0.0,
            touching: true,
        };
        self.learn(&mut contact, y)?;
        self.contact = Some(contact);
        Ok(())
    }

    fn learn(&mut self, contact: &mut Contact, y: f64) -> Result<(), RangeError> {
        self.evidence.observe(&self.projected, y)?;
        contact.place = self.localiser.estimate(&mut self.evidence);
        self.in_window += 1;
        if self.in_window == self.config.window {
            contact.peak = contact.peak.max(contact.place.amplitude);
            self.localiser.next_window(&mut self.evidence);
            self.in_window = 0;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::localise::{BlobConfig, distance};
    use rand::{RngExt as _, SeedableRng as _};
    use rand_chacha::ChaCha8Rng;

    /// A half-sine bounce of 500 measurements between stretches of idle noise.
    #[test]
    fn follows_a_planted_bounce() {
        let localiser = Localiser::new(&BlobConfig::new(8, 8)).unwrap();
        let mut tracker = Tracker::new(TrackConfig::new(0.05), localiser).unwrap();
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let (centre, peak): ([f64; 2], f64) = ([2.7, 4.4], 1.6);
        let mut ended = Vec::new();
        let mut early = f64::NAN;
        for n in 0..1500_u32 {
            let weights: Vec<f64> = (0..64).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect();
            let force = if (400..900).contains(&n) {
                peak * (f64::from(n - 400) / 500.0 * std::f64::consts::PI).sin()
            } else {
                0.0
            };
            let blob = (0..8).flat_map(|r| (0..8).map(move |c| distance([f64::from(r), f64::from(c)], centre)));
            let signal: f64 = blob.zip(&weights).map(|(d, w)| w * (-d * d / (2.0 * 0.81)).exp()).sum();
            let noise = 0.05 * ((0..12).map(|_| rng.random::<f64>()).sum::<f64>() - 6.0);
            let contact = tracker.observe(&weights, force * signal + noise).unwrap();
            if let Some(c) = contact {
                assert!(n > 380, "a contact in idle noise at {n}");
                if n == 440 {
                    early = distance(c.place.position_px, centre);
                }
                if !c.touching {
                    ended.push(c);
                }
            }
        }
        assert_eq!(ended.len(), 1, "{ended:?}");
        let c = ended[0];
        // the noise is small: the nearest centre of the grid is .11 away
        assert!(distance(c.place.position_px, centre) < 0.15, "{c:?}");
        assert!(early < 0.5, "{early} after 40 measurements of contact");
        // the envelope rises over the threshold of 2.6·.05 V at a force of about .1: 10 measurements in, and 16 late at most
        assert!(c.start.abs_diff(400) <= 30 && c.end.abs_diff(900) <= 30, "{c:?}");
        assert!((c.peak / peak - 1.0).abs() < 0.1, "{c:?}");
        assert!(c.measurements() == c.end - c.start);
    }

    #[test]
    fn refuses_bad_input_and_goes_on() {
        let localiser = Localiser::new(&BlobConfig::new(3, 3)).unwrap();
        for bad in [
            TrackConfig {
                window: 0,
                ..TrackConfig::new(1.0)
            },
            TrackConfig {
                gap: 0,
                ..TrackConfig::new(1.0)
            },
            TrackConfig {
                envelope: 1,
                ..TrackConfig::new(1.0)
            },
            TrackConfig {
                threshold: f64::NAN,
                ..TrackConfig::new(1.0)
            },
            TrackConfig::new(0.0),
        ] {
            assert!(Tracker::new(bad, localiser.clone()).is_err(), "{bad:?}");
        }
        let mut tracker = Tracker::new(TrackConfig::new(1.0), localiser).unwrap();
        assert!(tracker.observe(&[1.0; 9], f64::NAN).is_err());
        assert!(tracker.observe(&[1.0; 8], 1.0).is_err());
        assert_eq!(tracker.count, 0);
        assert_eq!(tracker.observe(&[1.0; 9], 0.0), Ok(None));
        // one enormous sample is a contact of its own, with finite numbers
        let c = tracker.observe(&[1.0; 9], 1e79).unwrap().unwrap();
        assert!(c.place.position_px.iter().all(|v| v.is_finite()));
    }
}
