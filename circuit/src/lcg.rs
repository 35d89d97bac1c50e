//! The cells' pseudorandom generator, and jumps ahead.

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
    pub const NONE: Self = Self {
        multiplier: 1,
        increment: 0,
    };
    /// One step.
    pub const ONE: Self = Self {
        multiplier: MULTIPLIER,
        increment: INCREMENT,
    };

    /// `steps` steps, by repeated squaring: O(log steps). The generator's period is 2³², so only `steps` mod 2³²
    /// matters.
    #[must_use]
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
    #[must_use]
    pub const fn then(self, next: Self) -> Self {
        Self {
            multiplier: self.multiplier.wrapping_mul(next.multiplier),
            increment: next
                .multiplier
                .wrapping_mul(self.increment)
                .wrapping_add(next.increment),
        }
    }

    /// a of s ↦ a·s + c.
    #[must_use]
    pub const fn multiplier(self) -> u32 {
        self.multiplier
    }

    /// c of s ↦ a·s + c.
    #[must_use]
    pub const fn increment(self) -> u32 {
        self.increment
    }

    /// State after the jump from `state`.
    #[must_use]
    #[inline]
    pub const fn apply(self, state: u32) -> u32 {
        self.multiplier.wrapping_mul(state).wrapping_add(self.increment)
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
