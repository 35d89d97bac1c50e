//! Seeds of the cells' generators.

use serde::{Deserialize, Serialize};

/// I²C address, and so the seed, of taxel 0.
pub const FIRST_ADDRESS: u32 = 8;

/// Rule that seeds the generator of a taxel.
///
/// ```
/// use spts_circuit::Seeding;
///
/// assert_eq!(Seeding::Address.seed(0), 8); // the I²C address
/// assert_eq!(Seeding::Address.seed(99), 107);
/// assert_ne!(Seeding::Mixed.seed(1).wrapping_sub(Seeding::Mixed.seed(0)), 1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Seeding {
    /// The cell's address 8, 9, …, as in the device. The states of all taxels in one row then form an arithmetic
    /// progression, which makes some binary rows constant.
    #[default]
    Address,
    /// A 32-bit non-linear mix of the address, which avoids constant rows. The published firmware cannot do this,
    /// because its seed is one byte.
    Mixed,
}

impl Seeding {
    /// Seed of taxel `taxel`.
    #[must_use]
    #[inline]
    pub fn seed(self, taxel: u32) -> u32 {
        let address = FIRST_ADDRESS.wrapping_add(taxel);
        match self {
            Self::Address => address,
            Self::Mixed => finalise(address),
        }
    }
}

/// 32-bit finaliser of MurmurHash3 (A. Appleby, public domain): a bijection in which every input bit reaches every
/// output bit.
#[inline]
pub(crate) fn finalise(mut h: u32) -> u32 {
    h ^= h >> 16;
    h = h.wrapping_mul(0x85eb_ca6b);
    h ^= h >> 13;
    h = h.wrapping_mul(0xc2b2_ae35);
    h ^ (h >> 16)
}

/// Seeds of all taxels of a skin.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Seeds<'a> {
    /// Seeds by a rule.
    Rule(Seeding),
    /// Given seeds, one a taxel.
    Given(&'a [u32]),
}

impl Seeds<'_> {
    /// Seed of taxel `taxel`; any number past the last one.
    #[inline]
    pub(crate) fn seed(self, taxel: usize) -> u32 {
        match self {
            #[expect(clippy::cast_possible_truncation, reason = "a skin has at most 2^32 taxels")]
            Self::Rule(seeding) => seeding.seed(taxel as u32),
            Self::Given(seeds) => seeds.get(taxel).copied().unwrap_or(0),
        }
    }
}
