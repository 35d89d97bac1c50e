//! Sums over all taxels for many measurements at once: the inner loops of the readout.
//!
//! SIMD lanes are consecutive measurements. The sum of one measurement therefore has the same order of additions on
//! every machine and in a run of any length: taxels in fours, (t₀ + t₁) + (t₂ + t₃), one four after the other. No
//! product is fused with a sum. Results have the same bits whichever instruction set is chosen at run time.

use super::lcg::{ANALOG_SCALE, Jump, Seeding, Seeds};
use multiversion::multiversion;

/// Buffers of one number a measurement are padded to a multiple of this, so that no measurement is left to a slower
/// remainder loop.
pub(crate) const LANES: usize = 8;

/// Jumps from the seeds to the states of consecutive measurements, the 32-bit numbers widened.
#[derive(Debug, Clone, Default)]
pub(crate) struct Jumps {
    multipliers: Vec<u64>,
    increments: Vec<u64>,
}

impl Jumps {
    /// Goes to `len` jumps, the first one `first`, each one step further than the one before.
    pub(crate) fn go_to(&mut self, first: Jump, len: usize) {
        self.multipliers.clear();
        self.increments.clear();
        let mut jump = first;
        for _ in 0..len {
            self.multipliers.push(u64::from(jump.multiplier()));
            self.increments.push(u64::from(jump.increment()));
            jump = jump.then(Jump::ONE);
        }
    }

    /// Number of jumps.
    pub(crate) fn len(&self) -> usize {
        self.multipliers.len()
    }

    /// State of a generator with `seed` at measurement `i`.
    #[inline]
    pub(crate) fn state(&self, seed: u32, i: usize) -> u32 {
        #[expect(clippy::cast_possible_truncation, reason = "the state is the low half")]
        let state = wide_state(self.multipliers[i], u64::from(seed), self.increments[i]) as u32;
        state
    }
}

/// State of a generator in the low 32 bits.
#[inline(always)]
fn wide_state(multiplier: u64, seed: u64, increment: u64) -> u64 {
    // the mask tells the compiler that one 32-bit multiplication is enough
    (multiplier & 0xffff_ffff).wrapping_mul(seed).wrapping_add(increment)
}

/// Taxels `first..first + 4` of `values`, 0 past the end.
#[inline(always)]
fn values_of(values: &[f64], first: usize) -> [f64; 4] {
    std::array::from_fn(|j| values.get(first + j).copied().unwrap_or(0.0))
}

/// 2⁵¹: numbers from here to 2⁵² are multiples of 0.5, so that a byte shifted by one into its last bits is added to it.
const TWO_51: f64 = 2_251_799_813_685_248.0;

/// Sums over the taxels, one a measurement.
#[derive(Debug, Clone, Default)]
pub(crate) struct Sums {
    /// Σ wₖ·fromₖ for binary weights; 127.5 Σ wₖ·xₖ for analog ones.
    pub(crate) from: Vec<f64>,
    /// Σ wₖ·toₖ for binary weights.
    pub(crate) to: Vec<f64>,
    /// 127.5² Σ (wₖ·xₖ)² for analog weights.
    pub(crate) squares: Vec<f64>,
    pub(crate) gathered: Gathered,
}

/// Values and seeds of the taxels that may not be zero, in fours.
#[derive(Debug, Clone, Default)]
pub(crate) struct Gathered {
    pub(crate) from: Vec<f64>,
    pub(crate) to: Vec<f64>,
    pub(crate) seeds: Vec<u32>,
}

/// Straight lines through two sets of values: x = (1 − share)·`from` + share·`to`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lines<'a> {
    /// Values at share 0.
    pub(crate) from: &'a [f64],
    /// Values at share 1, as many; `None` if they do not change.
    pub(crate) to: Option<&'a [f64]>,
    /// Share of every measurement.
    pub(crate) share: &'a [f64],
    /// Fours outside which all values are zero, in order; `None`: any may be.
    pub(crate) fours: Option<&'a [u32]>,
}

impl<'a> Lines<'a> {
    /// Places of the values that may not be zero, in order.
    pub(crate) fn places(self) -> impl Iterator<Item = usize> + 'a {
        let count = self.from.len();
        let all = self.fours.is_none().then_some(0..count).into_iter().flatten();
        let of = move |four: &u32| 4 * *four as usize..(4 * *four as usize + 4).min(count);
        all.chain(self.fours.into_iter().flatten().flat_map(of))
    }

    /// The values of its fours alone, with their seeds: their sums have the same bits.
    pub(crate) fn gathered(self, seeds: Seeds<'_>, into: &'a mut Gathered) -> (Self, &'a [u32]) {
        into.from.clear();
        into.to.clear();
        into.seeds.clear();
        for four in self.fours.into_iter().flatten() {
            let first = 4 * *four as usize;
            into.from.extend(values_of(self.from, first));
            into.to.extend(self.to.into_iter().flat_map(|to| values_of(to, first)));
            into.seeds.extend((first..first + 4).map(|taxel| seeds.seed(taxel)));
        }
        (Self { from: &into.from, to: self.to.map(|_| &into.to[..]), fours: None, ..self }, &into.seeds)
    }

    /// Value `k` at measurement `i`.
    #[inline]
    pub(crate) fn at(&self, k: usize, i: usize) -> f64 {
        self.between(i, self.from[k], || self.to.map(|to| to[k]))
    }

    /// Value at measurement `i` of what is linear in the values, `from` at share 0 and `to` at share 1.
    #[inline]
    pub(crate) fn between(&self, i: usize, from: f64, to: impl FnOnce() -> Option<f64>) -> f64 {
        to().map_or(from, |to| (1.0 - self.share[i]) * from + self.share[i] * to)
    }
}

/// Levels of the taxels, four at a time, at consecutive measurements.
trait Levels: Copy {
    /// What the levels of four taxels follow from.
    type Four: Copy;
    /// Binary levels of four taxels at a measurement, for any number of products.
    type Signs: Copy;

    /// Number of measurements.
    fn len(self) -> usize;

    /// Taxels `first..first + 4`.
    fn four(self, first: usize) -> Self::Four;

    /// Their binary levels at measurement `i`.
    fn signs(self, four: Self::Four, i: usize) -> Self::Signs;

    /// The products of binary levels and values.
    fn signed(signs: Self::Signs, x: [f64; 4]) -> [f64; 4];

    /// 127.5 times their analog levels at measurement `i`.
    fn analog(self, four: Self::Four, i: usize) -> [f64; 4];
}

/// How the seeds of taxels follow each other.
trait SeedRule: Copy {
    /// Seed of a taxel.
    fn seed(self, taxel: usize) -> u32;

    /// States of four taxels with `seeds` after a jump, in the low 32 bits.
    fn states(multiplier: u64, increment: u64, seeds: [u64; 4]) -> [u64; 4];
}

/// [`Seeding::Address`].
#[derive(Debug, Clone, Copy)]
struct Consecutive;

impl SeedRule for Consecutive {
    #[inline(always)]
    fn seed(self, taxel: usize) -> u32 {
        Seeds::Rule(Seeding::Address).seed(taxel)
    }

    /// a·(s + j) + c = (a·s + c) + j·a: one multiplication for four states.
    #[inline(always)]
    fn states(multiplier: u64, increment: u64, seeds: [u64; 4]) -> [u64; 4] {
        let first = wide_state(multiplier, seeds[0], increment);
        let third = first.wrapping_add(multiplier << 1);
        [first, first.wrapping_add(multiplier), third, third.wrapping_add(multiplier)]
    }
}

/// Any seeds.
impl SeedRule for Seeds<'_> {
    #[inline(always)]
    fn seed(self, taxel: usize) -> u32 {
        Seeds::seed(self, taxel)
    }

    #[inline(always)]
    fn states(multiplier: u64, increment: u64, seeds: [u64; 4]) -> [u64; 4] {
        seeds.map(|seed| wide_state(multiplier, seed, increment))
    }
}

/// The cells' generators.
#[derive(Clone, Copy)]
struct Generated<'a, S> {
    multipliers: &'a [u64],
    increments: &'a [u64],
    rule: S,
}

impl<'a, S> Generated<'a, S> {
    #[inline(always)]
    fn new(jumps: &'a Jumps, rule: S) -> Self {
        // equal lengths known once: no bounds to check within the loops
        let multipliers = &jumps.multipliers[..];
        let increments = &jumps.increments[..multipliers.len()];
        Self { multipliers, increments, rule }
    }
}

impl<S: SeedRule> Levels for Generated<'_, S> {
    type Four = [u64; 4];
    /// The sign bit where the top bit of the state is clear.
    type Signs = [u64; 4];

    #[inline(always)]
    fn len(self) -> usize {
        self.multipliers.len()
    }

    #[inline(always)]
    fn four(self, first: usize) -> [u64; 4] {
        std::array::from_fn(|j| u64::from(self.rule.seed(first + j)))
    }

    #[inline(always)]
    fn signs(self, seeds: [u64; 4], i: usize) -> [u64; 4] {
        S::states(self.multipliers[i], self.increments[i], seeds).map(|state| !(state << 32) & (1 << 63))
    }

    #[inline(always)]
    fn signed(signs: [u64; 4], x: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|j| f64::from_bits(x[j].to_bits() ^ signs[j]))
    }

    #[inline(always)]
    fn analog(self, seeds: [u64; 4], i: usize) -> [f64; 4] {
        S::states(self.multipliers[i], self.increments[i], seeds).map(|state| {
            let byte = (state >> 24) & 0xff;
            f64::from_bits(TWO_51.to_bits() | (byte << 1)) - (TWO_51 + ANALOG_SCALE)
        })
    }
}

/// Levels that are given, taxel-major, `len` measurements a taxel, for at least as many taxels as there are values, in
/// fours. A product with ±1 is the value or its negative, as the generators' kernel has it; both add zeros of either
/// sign after the last taxel, which do not change a sum that starts at +0.
#[derive(Clone, Copy)]
struct Given<'a> {
    drives: &'a [f64],
    len: usize,
}

impl<'a> Levels for Given<'a> {
    type Four = [&'a [f64]; 4];
    type Signs = [f64; 4];

    #[inline(always)]
    fn len(self) -> usize {
        self.len
    }

    #[inline(always)]
    fn four(self, first: usize) -> [&'a [f64]; 4] {
        let four = &self.drives[first * self.len..];
        std::array::from_fn(|j| &four[j * self.len..(j + 1) * self.len])
    }

    #[inline(always)]
    fn signs(self, four: [&'a [f64]; 4], i: usize) -> [f64; 4] {
        four.map(|drives| drives[i])
    }

    #[inline(always)]
    fn signed(signs: [f64; 4], x: [f64; 4]) -> [f64; 4] {
        std::array::from_fn(|j| signs[j] * x[j])
    }

    #[inline(always)]
    fn analog(self, four: [&'a [f64]; 4], i: usize) -> [f64; 4] {
        four.map(|drives| drives[i])
    }
}

/// `sums[v]` += Σₖ ±`values[v][k]`, with the signs of the binary levels.
#[expect(clippy::needless_range_loop, reason = "one counter for slices of equal length is what is made SIMD of")]
#[inline(always)]
fn signed_sums_of<L: Levels, const V: usize>(levels: L, values: [&[f64]; V], sums: [&mut [f64]; V]) {
    let len = levels.len();
    let sums = sums.map(|s| &mut s[..len]);
    for first in (0..values[0].len()).step_by(4) {
        let taxels = levels.four(first);
        let x = values.map(|values| values_of(values, first));
        for i in 0..len {
            let signs = levels.signs(taxels, i);
            for v in 0..V {
                let [a, b, c, d] = L::signed(signs, x[v]);
                sums[v][i] += (a + b) + (c + d);
            }
        }
    }
}

/// `sums` += Σₖ wₖ·xₖ and `squares` += Σₖ (wₖ·xₖ)², w = 127.5 times the analog level: top byte − 127.5.
#[inline(always)]
fn analog_sums_of<L: Levels>(levels: L, lines: Lines<'_>, sums: &mut [f64], squares: &mut [f64]) {
    let len = levels.len();
    let (share, sums, squares) = (&lines.share[..len], &mut sums[..len], &mut squares[..len]);
    for first in (0..lines.from.len()).step_by(4) {
        let taxels = levels.four(first);
        let (from, to) = (values_of(lines.from, first), values_of(lines.to.unwrap_or(lines.from), first));
        for i in 0..len {
            let level = levels.analog(taxels, i);
            let [a, b, c, d] = std::array::from_fn(|j| level[j] * ((1.0 - share[i]) * from[j] + share[i] * to[j]));
            sums[i] += (a + b) + (c + d);
            squares[i] += (a * a + b * b) + (c * c + d * d);
        }
    }
}

/// Where the levels of a run of measurements come from.
#[derive(Clone, Copy)]
pub(crate) enum Drives<'a> {
    /// The cells' generators.
    Generator(&'a Jumps, Seeds<'a>),
    /// Levels, times 127.5 in analog mode, and the number of measurements: see [`Given`].
    Codes(&'a [f64], usize),
}

/// A kernel on the levels of [`Drives`].
macro_rules! with_levels {
    ($drives:expr, $levels:ident => $kernel:expr) => {
        match $drives {
            Drives::Generator(jumps, Seeds::Rule(Seeding::Address)) => {
                let $levels = Generated::new(jumps, Consecutive);
                $kernel
            }
            Drives::Generator(jumps, seeds) => {
                let $levels = Generated::new(jumps, seeds);
                $kernel
            }
            Drives::Codes(drives, len) => {
                let $levels = Given { drives, len };
                $kernel
            }
        }
    };
}

/// [`signed_sums_of`] one set of values, with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn signed_sums(drives: Drives<'_>, values: &[f64], sums: &mut [f64]) {
    with_levels!(drives, levels => signed_sums_of(levels, [values], [sums]));
}

/// [`signed_sums_of`] two sets of values, with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn signed_sums_2(drives: Drives<'_>, values: [&[f64]; 2], sums: [&mut [f64]; 2]) {
    with_levels!(drives, levels => signed_sums_of(levels, values, sums));
}

/// [`analog_sums_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn analog_sums(drives: Drives<'_>, lines: Lines<'_>, sums: &mut [f64], squares: &mut [f64]) {
    with_levels!(drives, levels => analog_sums_of(levels, lines, sums, squares));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of many magnitudes, so that another order of additions would round differently.
    fn values(n: usize, phase: f64) -> Vec<f64> {
        (0_i32..).map(|k| (0.37 * f64::from(k) + phase).sin().abs() * 10_f64.powi(k % 7)).take(n).collect()
    }

    fn bits(sums: &[f64]) -> Vec<u64> {
        sums.iter().map(|v| v.to_bits()).collect()
    }

    /// The chosen instructions against the ones that every machine has.
    fn assert_same_bits<S: SeedRule>(rule: S, seeds: Seeds<'_>) {
        for n in [1, 3, 4, 100, 1001] {
            let mut jumps = Jumps::default();
            jumps.go_to(Jump::new(123_456), 37);
            let (from, to) = (values(n, 0.0), values(n, 1.0));
            let (levels, drives) = (Generated::new(&jumps, rule), Drives::Generator(&jumps, seeds));
            let zero = || vec![0.0; 37];
            let (mut a, mut b, mut c) = (zero(), zero(), zero());
            signed_sums_2(drives, [&from, &to], [&mut a, &mut b]);
            signed_sums(drives, &from, &mut c);
            let (mut a1, mut b1) = (zero(), zero());
            signed_sums_of(levels, [&from, &to], [&mut a1, &mut b1]);
            assert_eq!((bits(&a), bits(&b)), (bits(&a1), bits(&b1)), "{n} taxels");
            assert_eq!(bits(&c), bits(&a1), "{n} taxels");

            let share: Vec<f64> = (0..37).map(|i| f64::from(i) / 37.0).collect();
            let lines = Lines { from: &from, to: Some(&to), share: &share, fours: None };
            let [mut a, mut b, mut a1, mut b1] = [zero(), zero(), zero(), zero()];
            analog_sums(drives, lines, &mut a, &mut b);
            analog_sums_of(levels, lines, &mut a1, &mut b1);
            assert_eq!((bits(&a), bits(&b)), (bits(&a1), bits(&b1)), "{n} taxels");
        }
    }

    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let [address, mixed] = [Seeding::Address, Seeding::Mixed].map(Seeds::Rule);
        assert_same_bits(Consecutive, address);
        // one multiplication a state in place of one for four
        assert_same_bits(address, address);
        assert_same_bits(mixed, mixed);
        let given: Vec<u32> = (0..1001).map(|taxel| mixed.seed(taxel)).collect();
        assert_same_bits(mixed, Seeds::Given(&given));
    }
}
