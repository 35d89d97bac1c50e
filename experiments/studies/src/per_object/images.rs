//! What the twin's recordings are of. Replacing the simulated images by the skin's own, one property at a time, shows
//! where a difference of twin and skin comes from.

use serde::Serialize;

/// Images that are read out by the twin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Images {
    /// The twin's own: simulated contact, taxels with gains drawn anew for every skin.
    Twin,
    /// Simulated contact, taxels with the gains of the real skin as raster presses of the OTHER objects tell them.
    TwinWithSkinGains,
    /// The real skin's raster image of the object, in both modes: shape and gains are real, and nothing changes between
    /// the raster and the compressive session.
    SkinRaster,
    /// The real skin's image in its compressive session, by least squares: shape, gains and mounting are real.
    SkinCompressive,
}

impl Images {
    /// In words.
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
