//! Inner loops of [`SignOperator`](super::SignOperator): weights computed directly from the generators.
//!
//! Lanes are columns. A row is summed group by group of lanes, a column row by row, and no product is fused with a sum.
//! Results have the same bits whichever instruction set is chosen, and for any division of the rows among calls.

use multiversion::multiversion;

/// Columns that are worked on side by side.
pub(super) const LANES: usize = 16;

/// Rows for which a group of columns stays in registers.
const ROWS: usize = 4;

/// Sign of an `f64`.
const SIGN: u64 = 1 << 63;

/// One step of the generators, s ↦ a·s + c mod 2³², and the place of the bit that is the sign.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Step {
    /// a.
    pub(super) multiplier: u32,
    /// c.
    pub(super) increment: u32,
    /// Shift that brings the sign's bit of a widened state to bit 63.
    pub(super) shift: u32,
}

impl Step {
    /// Moves the generators on; −`v` where the sign's bit is clear, `v` where it is set, for `minus_v` = −`v`.
    #[inline(always)]
    fn signed(self, state: &mut u32, minus_v: f64) -> f64 {
        *state = state.wrapping_mul(self.multiplier).wrapping_add(self.increment);
        f64::from_bits(minus_v.to_bits() ^ ((u64::from(*state) << self.shift) & SIGN))
    }
}

/// Sums of `R` rows over the columns that `states` and `minus_x` hold.
#[inline(always)]
fn rows<const R: usize>(step: Step, states: &mut [[u32; LANES]], minus_x: &[[f64; LANES]]) -> [f64; R] {
    let mut sums = [[0.0; LANES]; R];
    for (states, minus_x) in states.iter_mut().zip(minus_x) {
        // a copy stays in registers
        let mut now = *states;
        for sums in &mut sums {
            for lane in 0..LANES {
                sums[lane] += step.signed(&mut now[lane], minus_x[lane]);
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
fn add_rows_of(step: Step, states: &mut [[u32; LANES]], minus_x: &[[f64; LANES]], y: &mut [f64]) {
    let (fours, rest) = y.as_chunks_mut::<ROWS>();
    for out in fours {
        let sums: [f64; ROWS] = rows(step, states, minus_x);
        out.iter_mut().zip(sums).for_each(|(out, sum)| *out += sum);
    }
    for out in rest {
        let [sum] = rows(step, states, minus_x);
        *out += sum;
    }
}

/// `x[k]` += ±`y[r]` for `R` rows.
#[inline(always)]
fn columns<const R: usize>(step: Step, states: &mut [[u32; LANES]], y: &[f64; R], x: &mut [[f64; LANES]]) {
    for (states, x) in states.iter_mut().zip(x) {
        let (mut now, mut sums) = (*states, *x);
        for y in y {
            for lane in 0..LANES {
                sums[lane] += step.signed(&mut now[lane], -y);
            }
        }
        (*states, *x) = (now, sums);
    }
}

/// `x[k]` += Σᵣ ±`y[r]` over a block of columns.
#[inline(always)]
fn add_columns_of(step: Step, states: &mut [[u32; LANES]], y: &[f64], x: &mut [[f64; LANES]]) {
    let (fours, rest) = y.as_chunks::<ROWS>();
    for y in fours {
        columns(step, states, y, x);
    }
    for y in rest {
        columns(step, states, &[*y], x);
    }
}

/// [`add_rows_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_rows(step: Step, states: &mut [[u32; LANES]], minus_x: &[[f64; LANES]], y: &mut [f64]) {
    add_rows_of(step, states, minus_x, y);
}

/// [`add_columns_of`] with the best instructions of this machine.
#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
pub(super) fn add_columns(step: Step, states: &mut [[u32; LANES]], y: &[f64], x: &mut [[f64; LANES]]) {
    add_columns_of(step, states, y, x);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn states() -> Vec<[u32; LANES]> {
        let state = |k: usize| u32::try_from(k).unwrap().wrapping_mul(0x9e37_79b9);
        (0..7)
            .map(|group| std::array::from_fn(|l| state(group * LANES + l)))
            .collect()
    }

    /// The chosen instructions against the ones that every machine has.
    #[test]
    fn every_instruction_set_gives_the_same_bits() {
        let step = Step {
            multiplier: 1_664_525,
            increment: 1_013_904_223,
            shift: 32,
        };
        let value = |k: usize| (0.37 * k as f64).sin() * 10_f64.powf((k % 7) as f64);
        let minus_x: Vec<[f64; LANES]> = (0..7).map(|g| std::array::from_fn(|l| value(g * LANES + l))).collect();
        let y: Vec<f64> = (0..43).map(value).collect();
        let (mut a, mut b) = (states(), states());
        let (mut out_a, mut out_b) = (vec![0.0; 43], vec![0.0; 43]);
        add_rows(step, &mut a, &minus_x, &mut out_a);
        add_rows_of(step, &mut b, &minus_x, &mut out_b);
        assert!(a == b && out_a.iter().zip(&out_b).all(|(a, b)| a.to_bits() == b.to_bits()));
        let (mut out_a, mut out_b) = (minus_x.clone(), minus_x.clone());
        add_columns(step, &mut a, &y, &mut out_a);
        add_columns_of(step, &mut b, &y, &mut out_b);
        let bits = |v: &[[f64; LANES]]| -> Vec<u64> { v.iter().flatten().map(|v| v.to_bits()).collect() };
        assert!(a == b && bits(&out_a) == bits(&out_b));
    }
}
