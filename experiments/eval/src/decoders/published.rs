//! The decodes of the published evaluation, by name; each is a line of the table of algorithms.

use super::trained::TrainedDecoder;
use super::{Train, image};
use crate::training::{LearnError, Learned, TrainingData};
use serde::{Serialize, Serializer};

/// How the published evaluation turns a window of measurements into an image.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PublishedDecode {
    /// As the published script: weights {0, 1}, no offset, 20 atoms.
    ScriptS20,
    /// As the paper's text: weights {0, 1}, no offset, M/4 atoms.
    ScriptM4,
    /// Matched to the device: weights ±1, the idle mean removed, M/4 atoms.
    Matched,
}

impl PublishedDecode {
    /// Every decode.
    pub const ALL: [Self; 3] = [Self::ScriptS20, Self::ScriptM4, Self::Matched];

    /// Name in the table of algorithms.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ScriptS20 => "script_s20",
            Self::ScriptM4 => "script_m4",
            Self::Matched => "matched",
        }
    }

    /// The decoder with dictionary and library of `learned`.
    ///
    /// # Errors
    /// [`LearnError`] when it cannot use these.
    pub fn decoder(self, learned: &Learned) -> Result<TrainedDecoder, LearnError> {
        let train: Train = match self {
            Self::ScriptS20 => image::script_s20,
            Self::ScriptM4 => image::script_m4,
            Self::Matched => image::matched,
        };
        let data = TrainingData::given(learned);
        Ok(TrainedDecoder::of(train(&data)?.into(), &data))
    }

    /// All of them.
    ///
    /// # Errors
    /// [`LearnError`] when one of them cannot use what was learned.
    pub fn decoders(learned: &Learned) -> Result<Vec<(Self, TrainedDecoder)>, LearnError> {
        let each = Self::ALL.into_iter();
        each.map(|decode| Ok((decode, decode.decoder(learned)?))).collect()
    }
}

/// M/4 rounded half up, at least 1: the published rule for the number of atoms.
#[must_use]
pub fn quarter(m: usize) -> usize {
    ((m + 2) / 4).max(1)
}

impl Serialize for PublishedDecode {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}
