//! Sums over all taxels for many measurements at once: the inner loops of the readout.
//!
//! Lanes are consecutive measurements, so a measurement's own sum has the same order of additions on every machine and in a run of
//! any length: taxels in fours, (t₀ + t₁) + (t₂ + t₃), one four after the other. No product is fused with a sum. Results are
//! therefore the same bits whichever instruction set is chosen at run time.

use crate::lcg::Jump;
use crate::weights::Seeding;
use multiversion::multiversion;

/// Measurements in one step of a kernel.
pub(crate) const LANES: usize = 8;

/// One number a measurement.
pub(crate) type Lanes<T> = [T; LANES];

/// Jumps from the seeds to the states of `LANES` measurements, the 32-bit numbers widened.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Jumps {
    multiplier: Lanes<u64>,
    increment: Lanes<u64>,
}

impl Jumps {
    /// Jumps of `LANES` consecutive measurements, and the jump of the one after.
    pub(crate) fn from(first: Jump) -> (Self, Jump) {
        let mut jump = first;
        let mut jumps = Self {
            multiplier: [0; LANES],
            increment: [0; LANES],
        };
        for l in 0..LANES {
            jumps.multiplier[l] = u64::from(jump.multiplier());
            jumps.increment[l] = u64::from(jump.increment());
            jump = jump.then(Jump::ONE);
        }
        (jumps, jump)
    }

    /// State of a generator with `seed` at measurement `lane`, in the low 32 bits.
    #[inline(always)]
    pub(crate) fn state(&self, seed: u64, lane: usize) -> u64 {
        // the mask tells the compiler that one 32-bit multiplication is enough
        (self.multiplier[lane] & 0xffff_ffff)
            .wrapping_mul(seed)
            .wrapping_add(self.increment[lane])
    }
}

/// Taxels `first..first + 4` of `values`, 0 past the end.
#[inline(always)]
fn four(values: &[f64], first: usize) -> [f64; 4] {
    std::array::from_fn(|j| values.get(first + j).copied().unwrap_or(0.0))
}

/// Seeds of four taxels.
#[inline(always)]
fn four_seeds(seed: impl Fn(u32) -> u32, first: usize) -> [u64; 4] {
    #[expect(clippy::cast_possible_truncation, reason = "a skin has at most 2^32 taxels")]
    std::array::from_fn(|j| u64::from(seed((first + j) as u32)))
}

/// `sums[v]` += Σₖ ±`values[v][k]`, plus where the top bit of taxel k's state is set.
#[inline(always)]
pub(crate) fn signed_sums_of<const V: usize>(
    jumps: &[Jumps],
    seed: impl Fn(u32) -> u32,
    values: [&[f64]; V],
    sums: [&mut [Lanes<f64>]; V],
) {
    let sums = sums.map(|s| &mut s[..jumps.len()]);
    for first in (0..values[0].len()).step_by(4) {
        let seeds = four_seeds(&seed, first);
        let x = values.map(|values| four(values, first).map(f64::to_bits));
        for (c, jumps) in jumps.iter().enumerate() {
            let mut flip = [[0_u64; LANES]; 4];
            for (flip, seed) in flip.iter_mut().zip(seeds) {
                for (l, flip) in flip.iter_mut().enumerate() {
                    *flip = !(jumps.state(seed, l) << 32) & (1 << 63);
                }
            }
            for v in 0..V {
                for (l, sum) in sums[v][c].iter_mut().enumerate() {
                    let term = |j: usize| f64::from_bits(x[v][j] ^ flip[j][l]);
                    *sum += (term(0) + term(1)) + (term(2) + term(3));
                }
            }
        }
    }
}

/// 2⁵¹: numbers from here to 2⁵² are multiples of 0.5, so that a byte shifted by one into its last bits is added to it.
const TWO_51: f64 = 2_251_799_813_685_248.0;

/// Straight lines through two sets of values: x = `rest`·`from` + `share`·`to`, rest = 1 − share.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lines<'a> {
    /// Values at share 0.
    pub(crate) from: &'a [f64],
    /// Values at share 1, as many.
    pub(crate) to: &'a [f64],
    /// Share of every measurement.
    pub(crate) share: &'a [Lanes<f64>],
}

impl Lines<'_> {
    /// Value `k` at `share`.
    #[inline]
    pub(crate) fn at(&self, k: usize, share: f64) -> f64 {
        (1.0 - share) * self.from[k] + share * self.to[k]
    }
}

/// `sums` += Σₖ wₖ·xₖ and `squares` += Σₖ (wₖ·xₖ)², w = 127.5 times the analog level: top byte − 127.5.
#[inline(always)]
pub(crate) fn analog_sums_of(
    jumps: &[Jumps],
    seed: impl Fn(u32) -> u32,
    lines: Lines<'_>,
    sums: &mut [Lanes<f64>],
    squares: &mut [Lanes<f64>],
) {
    let (share, sums, squares) = (
        &lines.share[..jumps.len()],
        &mut sums[..jumps.len()],
        &mut squares[..jumps.len()],
    );
    for first in (0..lines.from.len()).step_by(4) {
        let seeds = four_seeds(&seed, first);
        let (from, to) = (four(lines.from, first), four(lines.to, first));
        for (c, jumps) in jumps.iter().enumerate() {
            let mut terms = [[0.0; LANES]; 4];
            for (j, terms) in terms.iter_mut().enumerate() {
                for (l, term) in terms.iter_mut().enumerate() {
                    let byte = (jumps.state(seeds[j], l) >> 24) & 0xff;
                    let level = f64::from_bits(TWO_51.to_bits() | (byte << 1)) - (TWO_51 + 127.5);
                    *term = level * ((1.0 - share[c][l]) * from[j] + share[c][l] * to[j]);
                }
            }
            for l in 0..LANES {
                let [a, b, c4, d] = [terms[0][l], terms[1][l], terms[2][l], terms[3][l]];
                sums[c][l] += (a + b) + (c4 + d);
                squares[c][l] += (a * a + b * b) + (c4 * c4 + d * d);
            }
        }
    }
}

/// Steps 64 generators once a row and packs their top bits, generator l into bit l of `out[first]`, `out[first + stride]`, …
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
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn signed_sums(jumps: &[Jumps], seeding: Seeding, values: &[f64], sums: &mut [Lanes<f64>]) {
    match seeding {
        Seeding::Address => signed_sums_of(jumps, |k| Seeding::Address.seed(k), [values], [sums]),
        Seeding::Mixed => signed_sums_of(jumps, |k| Seeding::Mixed.seed(k), [values], [sums]),
    }
}

/// [`signed_sums_of`] two sets of values, with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn signed_sums_2(jumps: &[Jumps], seeding: Seeding, values: [&[f64]; 2], sums: [&mut [Lanes<f64>]; 2]) {
    match seeding {
        Seeding::Address => signed_sums_of(jumps, |k| Seeding::Address.seed(k), values, sums),
        Seeding::Mixed => signed_sums_of(jumps, |k| Seeding::Mixed.seed(k), values, sums),
    }
}

/// [`analog_sums_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn analog_sums(
    jumps: &[Jumps],
    seeding: Seeding,
    lines: Lines<'_>,
    sums: &mut [Lanes<f64>],
    squares: &mut [Lanes<f64>],
) {
    match seeding {
        Seeding::Address => analog_sums_of(jumps, |k| Seeding::Address.seed(k), lines, sums, squares),
        Seeding::Mixed => analog_sums_of(jumps, |k| Seeding::Mixed.seed(k), lines, sums, squares),
    }
}

/// [`top_bits_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f+avx512dq+avx512vl+avx512bw", "x86_64+avx2", "aarch64+neon"))]
pub(crate) fn top_bits(states: &mut [u32; 64], out: &mut [u64], first: usize, stride: usize) {
    top_bits_of(states, out, first, stride);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn jumps(chunks: usize) -> Vec<Jumps> {
        let mut next = Jump::new(123_456);
        let step = |next: &mut Jump| {
            let (jumps, after) = Jumps::from(*next);
            *next = after;
            jumps
        };
        (0..chunks).map(|_| step(&mut next)).collect()
    }

    /// Values of many magnitudes, so that another order of additions would round differently.
    fn values(n: usize, phase: f64) -> Vec<f64> {
        (0_i32..)
            .map(|k| (0.37 * f64::from(k) + phase).sin().abs() * 10_f64.powi(k % 7))
            .take(n)
            .collect()
    }

    fn bits(sums: &[Lanes<f64>]) -> Vec<u64> {
        sums.iter().flatten().map(|v| v.to_bits()).collect()
    }

    /// The chosen instructions against the ones that every machine has.
    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        for n in [1, 3, 4, 100, 1001] {
            for seeding in [Seeding::Address, Seeding::Mixed] {
                let jumps = jumps(5);
                let (from, to) = (values(n, 0.0), values(n, 1.0));
                let zero = || vec![[0.0; LANES]; 5];
                let (mut a, mut b, mut c) = (zero(), zero(), zero());
                signed_sums_2(&jumps, seeding, [&from, &to], [&mut a, &mut b]);
                let (mut a1, mut b1) = (zero(), zero());
                signed_sums_of(&jumps, |k| seeding.seed(k), [&from, &to], [&mut a1, &mut b1]);
                signed_sums(&jumps, seeding, &from, &mut c);
                assert_eq!(
                    (bits(&a), bits(&b), bits(&c)),
                    (bits(&a1), bits(&b1), bits(&a1)),
                    "{n} taxels"
                );

                let share = vec![[0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7]; 5];
                let lines = Lines {
                    from: &from,
                    to: &to,
                    share: &share,
                };
                let [mut a, mut b, mut a1, mut b1] = [zero(), zero(), zero(), zero()];
                analog_sums(&jumps, seeding, lines, &mut a, &mut b);
                analog_sums_of(&jumps, |k| seeding.seed(k), lines, &mut a1, &mut b1);
                assert_eq!((bits(&a), bits(&b)), (bits(&a1), bits(&b1)), "{n} taxels");
            }
        }
        let (mut states, mut states1) = ([0; 64], [0; 64]);
        for (l, state) in (0_u32..).zip(&mut states) {
            *state = Seeding::Mixed.seed(l);
        }
        states1.copy_from_slice(&states);
        let (mut out, mut out1) = ([0; 300], [0; 300]);
        top_bits(&mut states, &mut out, 1, 3);
        top_bits_of(&mut states1, &mut out1, 1, 3);
        assert_eq!((out, states), (out1, states1));
    }
}
