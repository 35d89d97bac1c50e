//! The images of the twin's recordings. Replacing the simulated images by the skin's own, one property at a time, shows
//! the cause of a difference between twin and skin.

use serde::Serialize;

/// Images that the twin's readout records, to see where a difference between twin and skin comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ReadoutImages {
    /// The twin's own: simulated contact, with gains drawn for every skin.
    Twin,
    /// Simulated contact, with the gains of the real skin as estimated from raster presses of the OTHER objects.
    TwinWithSkinGains,
    /// The real skin's raster image of the object, in both modes: shape and gains are real, and do not change between
    /// the raster and the compressive session.
    SkinRaster,
    /// The real skin's image in its compressive session, by least squares: shape, gains and mounting are real.
    SkinCompressive,
}

impl ReadoutImages {
    /// The kind of images in words.
    #[must_use]
    pub const fn label(self) -> &'static str {
        match self {
            Self::Twin => "twin",
            Self::TwinWithSkinGains => "twin, gains of the skin",
            Self::SkinRaster => "raster image of the skin",
            Self::SkinCompressive => "compressive image of the skin",
        }
    }
}
