//! The cells' pseudorandom generator, jumps ahead, and its seeds.

use serde::{Deserialize, Serialize};
use spts_models::SkinLayout;

/// Multiplier of the cells' generator.
pub const MULTIPLIER: u32 = 1_664_525;
/// Increment of the cells' generator.
pub const INCREMENT: u32 = 1_013_904_223;

/// Affine map s ↦ a·s + c mod 2³², which performs any number of generator steps at once.
///
/// The generator is s ↦ 1664525·s + 1013904223 mod 2³² (W. H. Press et al., *Numerical Recipes*, §7.1, "quick and
/// dirty"), as in the device's published firmware.
///
/// ```
/// use spts_circuit::{INCREMENT, Jump, MULTIPLIER};
///
/// let step = |state: u32| state.wrapping_mul(MULTIPLIER).wrapping_add(INCREMENT);
/// let slowly = (0..1000).fold(8, |state, _| step(state));
/// assert_eq!(Jump::new(1000).apply(8), slowly);
/// assert_eq!(Jump::new(600).then(Jump::new(400)), Jump::new(1000));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Jump {
    multiplier: u32,
    increment: u32,
}

impl Jump {
    /// No step.
    pub(crate) const NONE: Self = Self { multiplier: 1, increment: 0 };
    /// One step.
    pub const ONE: Self = Self { multiplier: MULTIPLIER, increment: INCREMENT };

    /// `steps` steps, by repeated squaring: O(log steps). The generator's period is 2³², so only `steps` mod 2³²
    /// matters.
    pub const fn new(steps: u64) -> Self {
        let mut left = steps & 0xffff_ffff;
        let mut jump = Self::NONE;
        let mut square = Self::ONE;
        while left > 0 {
            if left & 1 == 1 {
                jump = jump.then(square);
            }
            square = square.then(square);
            left >>= 1;
        }
        jump
    }

    /// This jump followed by `next`.
    pub const fn then(self, next: Self) -> Self {
        Self {
            multiplier: self.multiplier.wrapping_mul(next.multiplier),
            increment: next.multiplier.wrapping_mul(self.increment).wrapping_add(next.increment),
        }
    }

    /// a of s ↦ a·s + c.
    pub const fn multiplier(self) -> u32 {
        self.multiplier
    }

    /// c of s ↦ a·s + c.
    pub const fn increment(self) -> u32 {
        self.increment
    }

    /// State after the jump from `state`.
    #[inline]
    pub const fn apply(self, state: u32) -> u32 {
        self.multiplier.wrapping_mul(state).wrapping_add(self.increment)
    }
}

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
    /// The rule for a skin of which nothing else is said: the addresses for as many taxels of the same pitch as the
    /// published skin has, which cannot do otherwise, and the mix for any other.
    ///
    /// ```
    /// use spts_circuit::Seeding;
    /// use spts_models::SkinLayout;
    ///
    /// assert_eq!(Seeding::usual(&SkinLayout::default()), Seeding::Address);
    /// assert_eq!(Seeding::usual(&SkinLayout::new(20, 20, 0.0075, 0.005)?), Seeding::Mixed);
    /// # Ok::<(), spts_input::Refusal>(())
    /// ```
    pub fn usual(layout: &SkinLayout) -> Self {
        let of = |layout: &SkinLayout| (layout.taxels(), layout.pitch_m().to_bits());
        if of(layout) == of(&SkinLayout::default()) { Self::Address } else { Self::Mixed }
    }

    /// Seed of taxel `taxel`.
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

/// Half the largest DAC code: code (1 + level)·this.
pub(crate) const ANALOG_SCALE: f64 = 127.5;

/// Level of the top byte as a DAC code.
#[inline(always)]
pub(crate) fn analog(state: u32) -> f64 {
    (f64::from(state >> 24) - ANALOG_SCALE) / ANALOG_SCALE
}

/// ±1 from the top bit: +1.0 with the sign bit set where the top bit of the state is clear.
#[inline(always)]
pub(crate) fn binary(state: u32) -> f64 {
    f64::from_bits(0x3ff0_0000_0000_0000 | (u64::from(!state >> 31) << 63))
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn jump_equals_stepping(seed in any::<u32>(), steps in 0_u64..3000) {
            let stepped = (0..steps).fold(seed, |s, _| Jump::ONE.apply(s));
            prop_assert_eq!(Jump::new(steps).apply(seed), stepped);
        }

        #[test]
        fn jumps_compose(seed in any::<u32>(), a in any::<u32>(), b in any::<u32>()) {
            let (a, b) = (u64::from(a), u64::from(b));
            prop_assert_eq!(Jump::new(a + b).apply(seed), Jump::new(b).apply(Jump::new(a).apply(seed)));
        }
    }

    #[test]
    fn period_is_full() {
        assert_eq!(Jump::new(1 << 32), Jump::NONE);
    }
}
