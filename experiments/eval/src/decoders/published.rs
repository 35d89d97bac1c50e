//! The decoding variants of the published evaluation. Each is a line in the table of algorithms.

use super::trained::TrainedDecoder;
use super::{DecoderSpec, MATCHED, SCRIPT_M4, SCRIPT_S20};
use crate::training::{LearnError, Learned, TrainingData};
use serde::{Serialize, Serializer};

/// How the published evaluation turns a window of measurements into an image.
///
/// ```
/// use spts_eval::decoders::{PublishedDecode, find, quarter};
///
/// assert_eq!((quarter(20), quarter(50), quarter(1)), (5, 13, 1));
/// assert!(PublishedDecode::ALL.iter().all(|decode| find(decode.name()).is_some()));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PublishedDecode {
    /// As in the published script: weights {0, 1}, no offset, 20 atoms.
    ScriptS20,
    /// As in the paper's text: weights {0, 1}, no offset, M/4 atoms.
    ScriptM4,
    /// Adapted to the device: weights ±1, the idle mean subtracted, M/4 atoms.
    Matched,
}

impl PublishedDecode {
    /// Every variant.
    pub const ALL: [Self; 3] = [Self::ScriptS20, Self::ScriptM4, Self::Matched];

    /// Its line of the table of algorithms.
    fn line(self) -> &'static DecoderSpec {
        match self {
            Self::ScriptS20 => &SCRIPT_S20,
            Self::ScriptM4 => &SCRIPT_M4,
            Self::Matched => &MATCHED,
        }
    }

    /// Name in the table of algorithms.
    #[must_use]
    pub fn name(self) -> &'static str {
        self.line().name
    }

    /// The decoder of this variant, with dictionary and library of `learned`.
    ///
    /// # Errors
    /// [`LearnError`] if `learned` is not usable.
    pub fn decoder(self, learned: &Learned) -> Result<TrainedDecoder, LearnError> {
        TrainedDecoder::new(self.line(), &TrainingData::given(learned))
    }

    /// The decoders of all variants.
    ///
    /// # Errors
    /// [`LearnError`] if `learned` is not usable.
    pub fn decoders(learned: &Learned) -> Result<Vec<(Self, TrainedDecoder)>, LearnError> {
        let each = Self::ALL.into_iter();
        each.map(|decode| Ok((decode, decode.decoder(learned)?))).collect()
    }

    /// All of them, each beside its name.
    ///
    /// # Errors
    /// [`LearnError`] when one of them cannot use what was learned.
    pub fn named(learned: &Learned) -> Result<Vec<(&'static str, TrainedDecoder)>, LearnError> {
        let each = Self::ALL.into_iter();
        each.map(|decode| Ok((decode.name(), decode.decoder(learned)?)))
            .collect()
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
