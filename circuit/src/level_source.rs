//! Where the levels of the cells come from.

use crate::patterns::Patterns;
use crate::seeding::{Seeding, Seeds};
use std::sync::Arc;

/// Where the levels of [`Weights`](crate::Weights) come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LevelSource {
    /// The cells' generators, seeded by a rule.
    Seeding(Seeding),
    /// The cells' generators, with a given seed for each taxel.
    Seeds(Arc<[u32]>),
    /// Given codes.
    Patterns(Arc<Patterns>),
}

impl LevelSource {
    /// Seeds of the taxels; `None` when the levels come from a pattern.
    #[inline]
    pub(crate) fn seeds(&self) -> Option<Seeds<'_>> {
        match self {
            Self::Seeding(seeding) => Some(Seeds::Rule(*seeding)),
            Self::Seeds(seeds) => Some(Seeds::Given(seeds)),
            Self::Patterns(_) => None,
        }
    }
}
