//! A session prepared for scoring: number of its class, scored blocks and frames, and true images.

use crate::protocol::{Protocol, Truth};
use crate::truth::{PressTruth, may_be_fitted};
use spts::Session;
use spts::session::Event;
use spts_circuit::{Interpolated, Recording};

/// Both recordings of an object, with the number of its class and the scored blocks and frames.
#[derive(Debug, Clone)]
pub struct ScoredSession {
    /// Name of the session.
    pub name: String,
    /// Name of the object, which is its class.
    pub object: String,
    /// Number of the class.
    pub label: usize,
    /// Whether an earlier session of the set has the same object.
    pub again: bool,
    /// Whether the raster recording is that of an earlier session. It is then used only once for training.
    pub shared_raster: bool,
    /// Raster recording; `None` if there is none.
    pub raster: Option<Recording>,
    /// Compressive recording; `None` if there is none.
    pub compressive: Option<Recording>,
    /// Scored blocks and frames of the compressive recording.
    pub protocol: Protocol,
    /// Scored blocks and frames of the raster recording. These blocks are not used for training.
    pub raster_protocol: Protocol,
    /// Whether the contact is known to be steady while it is scored, so that one image is the truth of all windows.
    pub held: bool,
    /// True image of every block of the compressive recording, if a simulation knows it.
    pub simulated: Vec<Option<Vec<f64>>>,
    /// Conductances over the time of every block, if it was simulated just now.
    pub courses: Vec<Option<Interpolated>>,
}

impl ScoredSession {
    /// Prepares `session`, whose class has the number `label`.
    pub fn new(session: Session, label: usize) -> Self {
        let protocol = session.compressive.as_ref().map(|r| Protocol::of(r, session.hold_s));
        let raster_protocol = session.raster.as_ref().map(|r| Protocol::of(r, session.hold_s));
        let presses = session.compressive.as_ref().map_or(&[][..], |r| &r.presses);
        // touches are at places of their own, and what a preload adds is no part of them: they have no true image
        let touches = session.event == Event::Touch;
        let true_image = |facts: &spts::session::PressFacts| facts.conductance.as_ref().map(|g| g.values().to_vec());
        Self {
            label,
            again: false,
            shared_raster: false,
            held: session.hold_s.is_some() && !touches,
            protocol: protocol.or(raster_protocol).unwrap_or_default(),
            raster_protocol: raster_protocol.or(protocol).unwrap_or_default(),
            simulated: presses.iter().filter(|_| !touches).map(true_image).collect(),
            courses: presses.iter().map(|facts| facts.course.clone()).collect(),
            raster: session.raster.map(|r| r.recording),
            compressive: session.compressive.map(|r| r.recording),
            name: session.name,
            object: session.object,
        }
    }

    /// What is known of the true image of block `block` of the compressive recording.
    pub fn truth(&self, block: usize) -> Option<PressTruth> {
        PressTruth::of(self, block)
    }

    /// A frame of the raster scan of the object, of another press; `None` without a scan of a steady contact.
    pub fn raster_truth(&self) -> Option<Truth> {
        let raster = self.raster.as_ref().filter(|_| self.held)?;
        Some(Truth::new(raster, &self.raster_protocol))
    }

    /// Name in score tables: the object's; for a further session of the same object, the session's own.
    pub fn title(&self) -> &str {
        if self.again { &self.name } else { &self.object }
    }

    /// Whether there is a compressive recording and a true image for it.
    pub fn scorable(&self) -> bool {
        let known = |block: usize| self.simulated.get(block).is_some_and(Option::is_some);
        self.scored().any(|block| self.held && self.raster.is_some() || known(block))
    }

    /// Whether there is a compressive recording alone, of a hold that an image may be fitted to.
    pub fn without_scan(&self) -> bool {
        let fitted = |r: &Recording| may_be_fitted(r, self.protocol.measurements(r).len());
        self.held && !self.scorable() && self.compressive.as_ref().is_some_and(fitted)
    }

    /// Scored blocks of the compressive recording.
    pub fn scored(&self) -> std::ops::Range<usize> {
        self.compressive.as_ref().map_or(0..0, |c| self.protocol.presses_of(c))
    }
}
