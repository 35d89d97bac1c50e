//! One skin: its conductance in every press, the training of its decoder, and its ground truths.

use super::estimate::ScoreTable;
use super::items::{PARTS, without_parts};
use super::mechanics::Pressed;
use super::score::PressScores;
use super::size::{BudgetSize, compressive_acquisition, raster_acquisition};
use spts_input::Refusal;

use rayon::prelude::*;
use spts::chain::{Acquisition, Chain, ChainConfig, ChainError};
use spts::record::TwinError;
use spts::scene::Scene;
use spts_circuit::{Interpolated, Recording};
use spts_contact::Frame;
use spts_eval::protocol::{Protocol, Truth};
use spts_eval::training::{LearnError, Learned};
use spts_eval::{ScoredSession, Tally};
use spts_models::Streams;
use spts_recon::Workspace;
use spts_recon::metrics::{SUPPORT_THRESHOLD, support};
use std::path::Path;

/// What may count as touched.
pub(super) const TRUTHS: [&str; 3] = ["raster", "image", "contact"];

/// The touched taxels of an object by every truth of [`TRUTHS`]: those of a raster frame, as published; of the
/// noiseless image of the same skin in the scan's session at the same instant; and of that image on a skin that has the
/// static law alone.
pub(super) type Masks = [Vec<bool>; 3];

/// A skin that has been pressed and learned from.
pub(super) struct LearnedSkin {
    /// Transducer and complete readout.
    pub(super) chain: Chain,
    /// Decoders, one for each compressive session. Training starts at random, so two dictionaries learned from the same
    /// scans have different scores.
    pub(super) learned: Vec<Learned>,
    /// Objects in order of the presses.
    pub(super) objects: Vec<LearnedObject>,
    /// Scored instants.
    pub(super) protocol: Protocol,
}

/// An object on a skin.
pub(super) struct LearnedObject {
    /// Name.
    pub(super) name: &'static str,
    /// Label.
    pub(super) label: usize,
    /// Conductance as a function of time, one source for each compressive session.
    pub(super) sources: Vec<Interpolated>,
    /// Ground truths.
    pub(super) masks: Masks,
    raster: Recording,
}

impl LearnedSkin {
    /// Presses all objects on a skin without the transducer's parts `off`, scans the first presses and learns from
    /// them.
    pub(super) fn prepare(pressed: &[Pressed], off: &[&str], size: &BudgetSize, seed: u64) -> Result<Self, Refusal> {
        let Some(first) = pressed.first() else {
            return Err(Refusal::new("`--objects` names no object"));
        };
        let chain = chain(&first.scene, off)?;
        let every_part: Vec<&str> = PARTS.iter().map(|(name, _)| *name).collect();
        let bare = self::chain(&first.scene, &every_part)?;
        let layout = first.scene.skin();
        let protocol = size.protocol(layout.taxels());
        let objects = pressed
            .par_iter()
            .map(|pressed| LearnedObject::new(pressed, &chain, &bare, size, &protocol))
            .collect::<Result<Vec<_>, TwinError>>()
            .map_err(Refusal::from_error)?;
        let sessions: Vec<ScoredSession> = objects.iter().map(|o| o.session(protocol)).collect();
        let streams = Streams::new(seed);
        let learned = (0..size.sessions).into_par_iter().map(|session| {
            let streams = streams.child("learning", session as u64);
            Learned::learn(&sessions, &size.learning, layout.cols(), streams)
        });
        let learned = learned
            .collect::<Result<Vec<_>, LearnError>>()
            .map_err(Refusal::from_error)?;
        Ok(Self {
            chain,
            learned,
            objects,
            protocol,
        })
    }

    /// Scores of the scan that the truth is taken from: its frames are windows of a session of their own. The library
    /// is the same for every decoder.
    pub(super) fn scan(&self) -> ScoreTable {
        let mut work = Workspace::default();
        let of_object = |object: &LearnedObject| {
            let (mut tallies, mut decisions): ([Tally; 3], _) = (Default::default(), Vec::new());
            let last = (self.protocol.first_frame + self.protocol.frames).min(object.raster.frames());
            for frame in self.protocol.first_frame..last {
                let image = object.raster.volts(self.protocol.truth.0, frame);
                for (tally, truth) in tallies.iter_mut().zip(&object.masks) {
                    tally.image(image, truth);
                }
                let decision = self.learned.first().map(|l| l.classifier.classify(image, &mut work));
                decisions.push(decision.and_then(Result::unwrap_or_default));
            }
            tallies[0].decisions(&decisions, object.label, self.protocol.vote);
            vec![vec![PressScores::new(&tallies)]]
        };
        self.objects.iter().map(of_object).collect()
    }
}

/// Chain of `scene` without the transducer's parts `off`.
fn chain(scene: &Scene, off: &[&str]) -> Result<Chain, Refusal> {
    let config = ChainConfig {
        transducer_parameters: without_parts(off).map_err(Refusal::from_error)?,
        ..scene.config().chain()
    };
    let chain = Chain::new(&config, scene.skin(), scene.seed(), Path::new(""));
    Ok(chain.map_err(TwinError::from).map_err(Refusal::from_error)?)
}

impl LearnedObject {
    fn new(
        pressed: &Pressed,
        chain: &Chain,
        bare: &Chain,
        size: &BudgetSize,
        protocol: &Protocol,
    ) -> Result<Self, TwinError> {
        let presses: Vec<&[Frame]> = pressed.presses.iter().map(Vec::as_slice).collect();
        let label = usize::from(pressed.object.label);
        let scan = raster_acquisition(label);
        let (scans, read) = presses.split_at(size.raster_presses);
        let mut scanned = chain.conductance(scans, &scan)?;
        let raster = chain.record_sources(&mut scanned, pressed.scene.duration_s(), &scan)?;
        let time_s = raster.time_s(protocol.truth.1.min(raster.frames() - 1));
        let sources = read.par_iter().enumerate().map(|(session, &press)| {
            // every session has gains of its own, on a sheet that was pressed as often as the scanned one
            let sums = Acquisition {
                conditioning_presses: size.raster_presses,
                ..compressive_acquisition(label, session)
            };
            chain.conductance(&[press], &sums)
        });
        let sources = sources.collect::<Result<Vec<_>, ChainError>>()?.concat();
        Ok(Self {
            name: pressed.object.name,
            label,
            sources,
            masks: [
                Truth::new(&raster, protocol).support,
                touched(chain, scans, scan.session, time_s)?,
                touched(bare, scans, scan.session, time_s)?,
            ],
            raster,
        })
    }

    fn session(&self, protocol: Protocol) -> ScoredSession {
        ScoredSession {
            name: self.name.to_owned(),
            object: self.name.to_owned(),
            label: self.label,
            again: false,
            shared_raster: false,
            raster: Some(self.raster.clone()),
            compressive: None,
            protocol,
            raster_protocol: protocol,
            held: true,
            simulated: Vec::new(),
        }
    }
}

/// Support of the conductance at `time_s` of the last of `presses`, above that of the untouched skin.
fn touched(chain: &Chain, presses: &[&[Frame]], session: u64, time_s: f64) -> Result<Vec<bool>, TwinError> {
    let mut mask = Vec::new();
    let maps = chain.conductance_maps(presses, session).pop().unwrap_or_default();
    let after = presses
        .last()
        .map_or(0, |frames| frames.partition_point(|f| f.time_s < time_s));
    if let (Some(idle), Some(map)) = (maps.first(), maps.get(after).or(maps.last())) {
        let pairs = map.values().iter().zip(idle.values());
        let image: Vec<f64> = pairs.map(|(g, g0)| g - g0).collect();
        support(&image, SUPPORT_THRESHOLD, &mut mask);
    }
    Ok(mask)
}
