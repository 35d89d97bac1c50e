//! Rows of ±1 computed from pseudorandom generators.

use crate::checks::within;
use crate::kernels::dot;
use crate::operator::{LinearOperator, SelectColumns};
use multiversion::multiversion;
use rayon::prelude::*;
use spts_input::Refusal;

/// Columns whose states and values stay in the first-level cache: 1024 · (4 + 8) bytes.
const BLOCK: usize = 1024 / LANES;

/// Fewest rows for which the states of all columns are jumped to anew.
const FEWEST_ROWS: usize = 64;

/// Linear congruential generator s ↦ a·s + c mod 2³². One bit of its state is the sign of a weight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SignGenerator {
    multiplier: u32,
    increment: u32,
    /// By how much a state is shifted to bring its bit to the sign of a number.
    shift: u32,
}

impl SignGenerator {
    /// A generator with `multiplier` a and `increment` c. A weight is +1 if bit `bit` of the state is set, and −1
    /// otherwise.
    ///
    /// # Errors
    /// [`Refusal`] for a `bit` beyond 31.
    pub fn new(multiplier: u32, increment: u32, bit: u32) -> Result<Self, Refusal> {
        within("bit", f64::from(bit), 0.0, 31.0)?;
        Ok(Self { multiplier, increment, shift: 63 - bit })
    }

    /// (a, c) of `steps` steps in one, by repeated squaring: O(log steps). The period divides 2³².
    fn jump(self, steps: u64) -> (u32, u32) {
        let then = |(a, c): (u32, u32), (b, d): (u32, u32)| (a.wrapping_mul(b), b.wrapping_mul(c).wrapping_add(d));
        let mut left = steps & 0xffff_ffff;
        let (mut jump, mut square) = ((1, 0), (self.multiplier, self.increment));
        while left > 0 {
            if left & 1 == 1 {
                jump = then(jump, square);
            }
            square = then(square, square);
            left >>= 1;
        }
        jump
    }
}

/// M × N matrix of ±1 that is never stored: column k is the sequence of one generator with its own seed. Row r (from 0)
/// holds the signs after `first_row + r + 1` steps from the seeds.
///
/// Memory is O(M + N). A product takes M·N generator steps, on all threads of the current rayon pool. Every sum has a
/// fixed order, so the bits are the same for any number of threads and any instruction set.
#[derive(Debug, Clone)]
pub struct SignOperator {
    generator: SignGenerator,
    seeds: Vec<u32>,
    first_row: u64,
    nrows: usize,
}

impl SignOperator {
    /// Rows `first_row..first_row + nrows` of generators with `seeds`, one for each column.
    pub fn new(generator: SignGenerator, seeds: Vec<u32>, first_row: u64, nrows: usize) -> Self {
        Self { generator, seeds, first_row, nrows }
    }

    /// Memory of the operator, bytes: a constant, and 4 for each column, whatever the number of rows.
    pub fn bytes(&self) -> usize {
        size_of::<Self>() + self.seeds.capacity() * size_of::<u32>()
    }

    /// States of a block of columns, ready for the step to row `row` (from 0); columns past the end get seed 0.
    fn states(&self, block: usize, row: usize) -> [[u32; LANES]; BLOCK] {
        let (a, c) = self.generator.jump(self.first_row.wrapping_add(row as u64));
        let mut states = [[0; LANES]; BLOCK];
        let seeds = &self.seeds[(block * BLOCK * LANES).min(self.seeds.len())..];
        for (state, seed) in states.as_flattened_mut().iter_mut().zip(seeds) {
            *state = a.wrapping_mul(*seed).wrapping_add(c);
        }
        states
    }

    /// `y[r]` for as many rows from `first` on as `y` holds.
    fn rows(&self, minus_x: &[[f64; LANES]], first: usize, y: &mut [f64]) {
        y.fill(0.0);
        for (block, minus_x) in minus_x.chunks(BLOCK).enumerate() {
            let mut states = self.states(block, first);
            add_rows(self.generator, &mut states[..minus_x.len()], minus_x, y);
        }
    }
}

impl LinearOperator for SignOperator {
    fn nrows(&self) -> usize {
        self.nrows
    }

    fn ncols(&self) -> usize {
        self.seeds.len()
    }

    fn apply(&self, x: &[f64], y: &mut [f64]) {
        super::check_shape(self, x, y);
        let mut minus_x = vec![[0.0; LANES]; x.len().div_ceil(LANES)];
        minus_x.as_flattened_mut().iter_mut().zip(x).for_each(|(m, x)| *m = -x);
        let tasks = 4 * rayon::current_num_threads();
        let rows = y.len().div_ceil(tasks).max(FEWEST_ROWS).next_multiple_of(4);
        y.par_chunks_mut(rows).enumerate().for_each(|(i, y)| self.rows(&minus_x, i * rows, y));
    }

    fn apply_adjoint(&self, y: &[f64], x: &mut [f64]) {
        super::check_shape(self, x, y);
        x.par_chunks_mut(BLOCK * LANES).enumerate().for_each(|(block, x)| {
            let mut states = self.states(block, 0);
            let mut sums = [[0.0; LANES]; BLOCK];
            let groups = x.len().div_ceil(LANES);
            add_columns(self.generator, &mut states[..groups], y, &mut sums[..groups]);
            x.copy_from_slice(&sums.as_flattened()[..x.len()]);
        });
    }
}

impl SelectColumns for SignOperator {
    type Selected = Self;

    fn select_columns(&self, columns: &[usize]) -> Self {
        Self { seeds: columns.iter().map(|&k| self.seeds[k]).collect(), ..*self }
    }

    fn chance_variance(&self, r: &[f64], variance: &mut [f64]) {
        super::check_shape(self, variance, r);
        variance.fill(dot(r, r));
    }
}

/// Columns that are worked on side by side.
pub(super) const LANES: usize = 16;

/// Rows for which a group of columns stays in registers.
const ROWS: usize = 4;

/// Sign of an `f64`.
const SIGN: u64 = 1 << 63;

impl SignGenerator {
    /// Moves the generators on; −`v` where the sign's bit is clear, `v` where it is set, for `minus_v` = −`v`.
    #[inline(always)]
    fn signed(self, state: &mut u32, minus_v: f64) -> f64 {
        *state = state.wrapping_mul(self.multiplier).wrapping_add(self.increment);
        f64::from_bits(minus_v.to_bits() ^ ((u64::from(*state) << self.shift) & SIGN))
    }
}

/// Sums of `R` rows over the columns that `states` and `minus_x` hold.
#[inline(always)]
fn rows<const R: usize>(generator: SignGenerator, states: &mut [[u32; LANES]], minus_x: &[[f64; LANES]]) -> [f64; R] {
    let mut sums = [[0.0; LANES]; R];
    for (states, minus_x) in states.iter_mut().zip(minus_x) {
        // a copy stays in registers
        let mut now = *states;
        for sums in &mut sums {
            for lane in 0..LANES {
                sums[lane] += generator.signed(&mut now[lane], minus_x[lane]);
            }
        }
        *states = now;
    }
    sums.map(|mut sums| {
        let mut width = LANES / 2;
        while width > 0 {
            let (low, high) = sums.split_at_mut(width);
            low.iter_mut().zip(high).for_each(|(low, high)| *low += *high);
            width /= 2;
        }
        sums[0]
    })
}

/// `y[r]` += Σₖ ±xₖ over a block of columns, one row after the other.
#[inline(always)]
fn add_rows_of(generator: SignGenerator, states: &mut [[u32; LANES]], minus_x: &[[f64; LANES]], y: &mut [f64]) {
    let (fours, rest) = y.as_chunks_mut::<ROWS>();
    for out in fours {
        let sums: [f64; ROWS] = rows(generator, states, minus_x);
        out.iter_mut().zip(sums).for_each(|(out, sum)| *out += sum);
    }
    for out in rest {
        let [sum] = rows(generator, states, minus_x);
        *out += sum;
    }
}

/// `x[k]` += ±`y[r]` for `R` rows.
#[inline(always)]
fn columns<const R: usize>(
    generator: SignGenerator,
    states: &mut [[u32; LANES]],
    y: &[f64; R],
    x: &mut [[f64; LANES]],
) {
    for (states, x) in states.iter_mut().zip(x) {
        let (mut now, mut sums) = (*states, *x);
        for y in y {
            for lane in 0..LANES {
                sums[lane] += generator.signed(&mut now[lane], -y);
            }
        }
        (*states, *x) = (now, sums);
    }
}

/// `x[k]` += Σᵣ ±`y[r]` over a block of columns.
#[inline(always)]
fn add_columns_of(generator: SignGenerator, states: &mut [[u32; LANES]], y: &[f64], x: &mut [[f64; LANES]]) {
    let (fours, rest) = y.as_chunks::<ROWS>();
    for y in fours {
        columns(generator, states, y, x);
    }
    for y in rest {
        columns(generator, states, &[*y], x);
    }
}

/// [`add_rows_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_rows(generator: SignGenerator, states: &mut [[u32; LANES]], minus_x: &[[f64; LANES]], y: &mut [f64]) {
    add_rows_of(generator, states, minus_x, y);
}

/// [`add_columns_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_columns(generator: SignGenerator, states: &mut [[u32; LANES]], y: &[f64], x: &mut [[f64; LANES]]) {
    add_columns_of(generator, states, y, x);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::operator::check_operator;
    use proptest::prelude::*;

    const STEP: (u32, u32) = (1_664_525, 1_013_904_223);

    fn operator(n: usize, first_row: u64, nrows: usize, bit: u32) -> SignOperator {
        let seeds = (0..n).map(|k| u32::try_from(k).unwrap().wrapping_mul(0x85eb_ca6b)).collect();
        SignOperator::new(SignGenerator::new(STEP.0, STEP.1, bit).unwrap(), seeds, first_row, nrows)
    }

    /// Weight by weight, one step after the other.
    fn weight(seed: u32, row: u64, bit: u32) -> f64 {
        let state = (0..=row).fold(seed, |s, _| s.wrapping_mul(STEP.0).wrapping_add(STEP.1));
        if state >> bit & 1 == 1 { 1.0 } else { -1.0 }
    }

    proptest! {
        #[test]
        fn columns_are_the_sequences(n in 1_usize..70, first_row in 0_u64..300, nrows in 1_usize..40, bit in 0_u32..32) {
            let a = operator(n, first_row, nrows, bit);
            check_operator(&a);
            let k = n / 2;
            let mut x = vec![0.0; n];
            x[k] = 1.0;
            let mut column = vec![f64::NAN; nrows];
            a.apply(&x, &mut column);
            let expected: Vec<f64> = (0..nrows as u64).map(|r| weight(a.seeds[k], first_row + r, bit)).collect();
            prop_assert_eq!(column, expected);
        }

        #[test]
        fn selected_columns_are_the_columns(n in 1_usize..70, nrows in 1_usize..40) {
            let a = operator(n, 5, nrows, 31);
            let columns: Vec<usize> = (0..n).rev().step_by(3).collect();
            let y: Vec<f64> = (0..nrows).map(|r| (r as f64).sin()).collect();
            let (mut all, mut some) = (vec![0.0; n], vec![0.0; columns.len()]);
            a.apply_adjoint(&y, &mut all);
            a.select_columns(&columns).apply_adjoint(&y, &mut some);
            for (some, &k) in some.iter().zip(&columns) {
                prop_assert_eq!(some.to_bits(), all[k].to_bits());
            }
        }
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bits() {
        let a = operator(3000, 7, 1001, 31);
        let x: Vec<f64> = (0..3000).map(|k| (k as f64).sin()).collect();
        let mut answers = Vec::new();
        for threads in [1, 2, 3, 7] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            let (mut y, mut back) = (vec![0.0; 1001], vec![0.0; 3000]);
            pool.install(|| {
                a.apply(&x, &mut y);
                a.apply_adjoint(&y, &mut back);
            });
            answers.push(y.iter().chain(&back).map(|v| v.to_bits()).collect::<Vec<u64>>());
        }
        assert!(answers.windows(2).all(|pair| pair[0] == pair[1]));
    }

    fn states() -> Vec<[u32; LANES]> {
        let state = |k: usize| u32::try_from(k).unwrap().wrapping_mul(0x9e37_79b9);
        (0..7).map(|group| std::array::from_fn(|l| state(group * LANES + l))).collect()
    }

    /// The chosen instructions against the ones that every machine has.
    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let generator = SignGenerator { multiplier: 1_664_525, increment: 1_013_904_223, shift: 32 };
        let value = |k: usize| (0.37 * k as f64).sin() * 10_f64.powf((k % 7) as f64);
        let minus_x: Vec<[f64; LANES]> = (0..7).map(|g| std::array::from_fn(|l| value(g * LANES + l))).collect();
        let y: Vec<f64> = (0..43).map(value).collect();
        let (mut a, mut b) = (states(), states());
        let (mut out_a, mut out_b) = (vec![0.0; 43], vec![0.0; 43]);
        add_rows(generator, &mut a, &minus_x, &mut out_a);
        add_rows_of(generator, &mut b, &minus_x, &mut out_b);
        assert!(a == b && out_a.iter().zip(&out_b).all(|(a, b)| a.to_bits() == b.to_bits()));
        let (mut out_a, mut out_b) = (minus_x.clone(), minus_x.clone());
        add_columns(generator, &mut a, &y, &mut out_a);
        add_columns_of(generator, &mut b, &y, &mut out_b);
        let bits = |v: &[[f64; LANES]]| -> Vec<u64> { v.iter().flatten().map(|v| v.to_bits()).collect() };
        assert!(a == b && bits(&out_a) == bits(&out_b));
    }
}
