//! Training data of decoders: raster images of sessions, of simulated skins, or of random shapes on a layout.

mod data;
mod gains;
mod network;
mod presses;
mod shapes;
mod skins;

pub use data::{Dictionary, Kinds, Learned, Learning, SHIFT_REACH, TrainingData};
pub use gains::{BAND_SD, GainCheck, SkinGains, gain_sds, on_skins_with, simulated_gain_sd};
pub use network::TrainedNetwork;
pub use presses::{TrainingPresses, library, prior_images, templates, training_images};
pub use shapes::{PoseKnowledge, PosedObject, SHAPES_SPEC, shape_images};
pub use skins::Skins;

use crate::session::ScoredSession;
use spts_models::TaxelGains;

/// Name of the dictionary and library published with the recordings.
pub const PUBLISHED: &str = "published";
/// Name of training data from raster presses of the scored recordings themselves.
pub const RASTER: &str = "raster";
/// Name of training data for a skin without usable recordings: random shapes on its layout.
pub const LAYOUT: &str = "layout";
/// Name of [`TrainingSource::Shapes`].
pub const SHAPES: &str = "shapes";
/// Name of [`TrainingSource::Calibrated`] with gains estimated from the scored recordings.
pub const CALIBRATED: &str = "calibrated";

/// What decoders learn from: the choices of `spts score --learn-from`.
#[derive(Debug, Clone)]
pub enum TrainingSource {
    /// Dictionary and library as published with the recordings, if they exist; everything else as
    /// [`TrainingSource::Raster`].
    Published,
    /// Raster presses of the scored recordings that are not scored themselves.
    Raster,
    /// Raster presses of other recordings.
    Other {
        /// Name on the board.
        name: String,
        /// The recordings.
        sessions: Vec<ScoredSession>,
        /// Whether all presses are used, as for a twin. For a real skin, presses that would be scored are excluded,
        /// because it may be the scored skin.
        all: bool,
        /// γ: relative standard deviation of the gains between that skin and the scored one; 0 for the same skin.
        gain_sd: f64,
    },
    /// Procedural shapes pressed in the simulation: no recording, and no scored object.
    Shapes,
    /// The objects, pressed in the simulation in all possible poses.
    Poses {
        /// Name on the board.
        name: String,
        /// The objects.
        objects: Vec<PosedObject>,
    },
    /// Raster presses simulated at gain 1, recorded on possible versions of the scored skin: gains are drawn from their
    /// posterior.
    Calibrated {
        /// Name on the board.
        name: String,
        /// The presses.
        simulated: Vec<ScoredSession>,
        /// The posterior; `None` to estimate it from the unscored raster presses of all objects but the scored one.
        gains: Option<TaxelGains>,
    },
}

impl TrainingSource {
    /// Name on the board.
    pub fn name(&self) -> &str {
        match self {
            Self::Published | Self::Raster => RASTER,
            Self::Shapes => SHAPES,
            Self::Other { name, .. } | Self::Poses { name, .. } | Self::Calibrated { name, .. } => name,
        }
    }
}
