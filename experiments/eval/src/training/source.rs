//! Where decoders get their training data from.

use super::poses::PosedObject;
use crate::session::ScoredSession;
use spts_models::TaxelGains;

/// Name of the dictionary and library that were published with the recordings.
pub const PUBLISHED: &str = "published";
/// Name of what was learned from raster presses of the scored recordings themselves.
pub const RASTER: &str = "raster";
/// Name of what is known of a skin that nothing may be learned from: random shapes on its layout.
pub const LAYOUT: &str = "layout";
/// Name of [`TrainingSource::Shapes`].
pub const SHAPES: &str = "shapes";
/// Name of [`TrainingSource::Calibrated`] with the scored recordings' own gains.
pub const CALIBRATED: &str = "calibrated";

/// Where decoders get their training data from.
#[derive(Debug, Clone)]
pub enum TrainingSource {
    /// Dictionary and library as published beside the recordings, where they are; everything else as
    /// [`TrainingSource::Raster`].
    Published,
    /// Raster presses of the scored recordings that are not scored.
    Raster,
    /// Raster presses of other recordings.
    Other {
        /// Name on the board.
        name: String,
        /// The recordings.
        sessions: Vec<ScoredSession>,
        /// Whether all presses are learned from, as of a twin. Of a real skin, presses that would be scored are not: it
        /// may be the scored skin.
        all: bool,
        /// γ: relative standard deviation of the gains between that skin and the scored one; 0 for the same skin.
        gain_sd: f64,
    },
    /// Procedural shapes pressed in the simulation: nothing recorded, and no object that is scored.
    Shapes,
    /// The objects pressed in the simulation in all the poses that they may have; the name on the board beside them.
    Poses {
        /// Name on the board.
        name: String,
        /// The objects.
        objects: Vec<PosedObject>,
    },
    /// Raster presses simulated at gain 1, on skins that may be the scored one: with gains drawn from their posterior.
    Calibrated {
        /// Name on the board.
        name: String,
        /// The presses.
        simulated: Vec<ScoredSession>,
        /// The posterior; `None` for that of the unscored raster presses of all objects but the scored one.
        gains: Option<TaxelGains>,
    },
}
