//! Training data of decoders: raster images of sessions, of simulated skins, or of random shapes on a layout.

mod data;
mod dictionary;
mod error;
mod gains;
mod layout;
mod learned;
mod network;
mod poses;
mod presses;
mod shapes;
#[cfg(feature = "mujoco")]
mod skins;
mod source;

pub use data::TrainingData;
pub use dictionary::{Dictionary, Learning};
pub use error::LearnError;
pub(crate) use error::{in_gains, in_library, in_parameter, in_prior, in_range, in_rows, in_templates};
pub use gains::{BAND_SD, GainCheck, SkinGains, SkinGainsError, gain_sds, on_skins_with, simulated_gain_sd};
pub use learned::{Learned, SHIFT_REACH};
pub use network::{NetworkError, TrainedNetwork};
pub use poses::{PoseKnowledge, PosedObject};
pub use presses::{TrainingPresses, library, prior_images, templates, training_images};
pub use shapes::{SHAPES_SPEC, ShapesError, shape_images};
#[cfg(feature = "mujoco")]
pub use skins::{Skins, SkinsError};
pub use source::{CALIBRATED, LAYOUT, PUBLISHED, RASTER, SHAPES, TrainingSource};
