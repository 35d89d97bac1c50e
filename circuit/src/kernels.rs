//! Sums over all taxels for many measurements at once: the inner loops of the readout.
//!
//! SIMD lanes are consecutive measurements. The sum of one measurement therefore has the same order of additions on
//! every machine and in a run of any length: taxels in fours, (t₀ + t₁) + (t₂ + t₃), one four after the other. No
//! product is fused with a sum. Results have the same bits whichever instruction set is chosen at run time.

use crate::lcg::Jump;
use crate::mode::ANALOG_SCALE;
use crate::seeding::{Seeding, Seeds};
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
pub(crate) fn four(values: &[f64], first: usize) -> [f64; 4] {
    std::array::from_fn(|j| values.get(first + j).copied().unwrap_or(0.0))
}

/// How the seeds of taxels follow each other.
pub(crate) trait SeedRule: Copy {
    /// Seed of a taxel.
    fn seed(self, taxel: usize) -> u32;

    /// States of four taxels with `seeds` after a jump, in the low 32 bits.
    fn states(multiplier: u64, increment: u64, seeds: [u64; 4]) -> [u64; 4];
}

/// [`Seeding::Address`].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Consecutive;

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
        [
            first,
            first.wrapping_add(multiplier),
            third,
            third.wrapping_add(multiplier),
        ]
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

/// Seeds of four taxels.
#[inline(always)]
fn four_seeds<S: SeedRule>(rule: S, first: usize) -> [u64; 4] {
    std::array::from_fn(|j| u64::from(rule.seed(first + j)))
}

/// `sums[v]` += Σₖ ±`values[v][k]`, plus where the top bit of taxel k's state is set.
#[inline(always)]
pub(crate) fn signed_sums_of<S: SeedRule, const V: usize>(
    jumps: &Jumps,
    rule: S,
    values: [&[f64]; V],
    sums: [&mut [f64]; V],
) {
    // equal lengths known once: no bounds to check within the loop
    let multipliers = &jumps.multipliers[..];
    let increments = &jumps.increments[..multipliers.len()];
    let sums = sums.map(|s| &mut s[..multipliers.len()]);
    for first in (0..values[0].len()).step_by(4) {
        let seeds = four_seeds(rule, first);
        let mut x = [[0; 4]; V];
        for (x, values) in x.iter_mut().zip(values) {
            *x = four(values, first).map(f64::to_bits);
        }
        for i in 0..multipliers.len() {
            let flip = S::states(multipliers[i], increments[i], seeds).map(|state| !(state << 32) & (1 << 63));
            for v in 0..V {
                let term = |j: usize| f64::from_bits(x[v][j] ^ flip[j]);
                sums[v][i] += (term(0) + term(1)) + (term(2) + term(3));
            }
        }
    }
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
}

impl Lines<'_> {
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

/// `sums` += Σₖ wₖ·xₖ and `squares` += Σₖ (wₖ·xₖ)², w = 127.5 times the analog level: top byte − 127.5.
#[inline(always)]
pub(crate) fn analog_sums_of<S: SeedRule>(
    jumps: &Jumps,
    rule: S,
    lines: Lines<'_>,
    sums: &mut [f64],
    squares: &mut [f64],
) {
    // equal lengths known once: no bounds to check within the loop
    let multipliers = &jumps.multipliers[..];
    let increments = &jumps.increments[..multipliers.len()];
    let share = &lines.share[..multipliers.len()];
    let sums = &mut sums[..multipliers.len()];
    let squares = &mut squares[..multipliers.len()];
    for first in (0..lines.from.len()).step_by(4) {
        let seeds = four_seeds(rule, first);
        let (from, to) = (four(lines.from, first), four(lines.to.unwrap_or(lines.from), first));
        for i in 0..multipliers.len() {
            let states = S::states(multipliers[i], increments[i], seeds);
            let [a, b, c, d] = std::array::from_fn(|j| {
                let byte = (states[j] >> 24) & 0xff;
                let level = f64::from_bits(TWO_51.to_bits() | (byte << 1)) - (TWO_51 + ANALOG_SCALE);
                level * ((1.0 - share[i]) * from[j] + share[i] * to[j])
            });
            sums[i] += (a + b) + (c + d);
            squares[i] += (a * a + b * b) + (c * c + d * d);
        }
    }
}

/// Steps 64 generators once a row and packs their top bits, generator l into bit l of `out[first]`, `out[first +
/// stride]`, …
#[inline(always)]
pub(crate) fn top_bits_of(states: &mut [u32; 64], out: &mut [u64], first: usize, stride: usize) {
    for word in out.iter_mut().skip(first).step_by(stride) {
        for state in states.iter_mut() {
            *state = Jump::ONE.apply(*state);
        }
        *word = 0;
        for (l, state) in states.iter().enumerate() {
            *word |= u64::from(*state >> 31) << l;
        }
    }
}

/// [`signed_sums_of`] one set of values, with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn signed_sums(jumps: &Jumps, seeds: Seeds<'_>, values: &[f64], sums: &mut [f64]) {
    match seeds {
        Seeds::Rule(Seeding::Address) => signed_sums_of(jumps, Consecutive, [values], [sums]),
        other => signed_sums_of(jumps, other, [values], [sums]),
    }
}

/// [`signed_sums_of`] two sets of values, with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn signed_sums_2(jumps: &Jumps, seeds: Seeds<'_>, values: [&[f64]; 2], sums: [&mut [f64]; 2]) {
    match seeds {
        Seeds::Rule(Seeding::Address) => signed_sums_of(jumps, Consecutive, values, sums),
        other => signed_sums_of(jumps, other, values, sums),
    }
}

/// [`analog_sums_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn analog_sums(jumps: &Jumps, seeds: Seeds<'_>, lines: Lines<'_>, sums: &mut [f64], squares: &mut [f64]) {
    match seeds {
        Seeds::Rule(Seeding::Address) => analog_sums_of(jumps, Consecutive, lines, sums, squares),
        other => analog_sums_of(jumps, other, lines, sums, squares),
    }
}

/// [`top_bits_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn top_bits(states: &mut [u32; 64], out: &mut [u64], first: usize, stride: usize) {
    top_bits_of(states, out, first, stride);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of many magnitudes, so that another order of additions would round differently.
    fn values(n: usize, phase: f64) -> Vec<f64> {
        (0_i32..)
            .map(|k| (0.37 * f64::from(k) + phase).sin().abs() * 10_f64.powi(k % 7))
            .take(n)
            .collect()
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
            let zero = || vec![0.0; 37];
            let (mut a, mut b, mut c) = (zero(), zero(), zero());
            signed_sums_2(&jumps, seeds, [&from, &to], [&mut a, &mut b]);
            signed_sums(&jumps, seeds, &from, &mut c);
            let (mut a1, mut b1) = (zero(), zero());
            signed_sums_of(&jumps, rule, [&from, &to], [&mut a1, &mut b1]);
            assert_eq!((bits(&a), bits(&b)), (bits(&a1), bits(&b1)), "{n} taxels");
            assert_eq!(bits(&c), bits(&a1), "{n} taxels");

            let share: Vec<f64> = (0..37).map(|i| f64::from(i) / 37.0).collect();
            let lines = Lines {
                from: &from,
                to: Some(&to),
                share: &share,
            };
            let [mut a, mut b, mut a1, mut b1] = [zero(), zero(), zero(), zero()];
            analog_sums(&jumps, seeds, lines, &mut a, &mut b);
            analog_sums_of(&jumps, rule, lines, &mut a1, &mut b1);
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
        let mut states = [0; 64];
        for (l, state) in (0_u32..).zip(&mut states) {
            *state = Seeding::Mixed.seed(l);
        }
        let mut states1 = states;
        let (mut out, mut out1) = ([0; 300], [0; 300]);
        top_bits(&mut states, &mut out, 1, 3);
        top_bits_of(&mut states1, &mut out1, 1, 3);
        assert_eq!((out, states), (out1, states1));
    }
}
