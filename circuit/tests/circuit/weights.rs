//! Structure of the device's weight matrix.

use nalgebra::DMatrix;
use spts_circuit::{Seeding, WeightMode, Weights};

fn matrix(seeding: Seeding, rows: usize) -> Vec<Vec<f64>> {
    let mut values = vec![0.0; rows * 100];
    Weights::new(WeightMode::Binary, seeding, 100).fill_rows(0, &mut values);
    // {0, 1} as the published scripts decode
    values
        .chunks(100)
        .map(|row| row.iter().map(|w| 0.5 * (w + 1.0)).collect())
        .collect()
}

/// Singular values of matrices with entries 0 and 1 and a norm below 150 that are zero come out below 150·100·ε =
/// 3e-12; the smallest other ones lie far above this.
const RANK_TOLERANCE: f64 = 1e-9;

#[test]
fn the_first_hundred_rows_have_rank_97() {
    let rank = |seeding, rows| {
        let matrix = matrix(seeding, rows);
        DMatrix::from_fn(rows, 100, |r, c| matrix[r][c]).rank(RANK_TOLERANCE)
    };
    assert_eq!(rank(Seeding::Address, 100), 97);
    assert_eq!(rank(Seeding::Address, 150), 100);
    assert_eq!(rank(Seeding::Mixed, 100), 100);
}

/// 0-based; counted from 1 these are 1, 46, 63, 483, 528, 819 and 928. There the state aⁿ·address + K(n), a sawtooth
/// over the addresses, stays within one half of 2³² for all of them.
#[test]
fn seven_of_the_first_thousand_rows_are_constant() {
    let constant: Vec<usize> = matrix(Seeding::Address, 1000)
        .iter()
        .enumerate()
        .filter(|(_, row)| row.iter().all(|w| w.to_bits() == row[0].to_bits()))
        .map(|(r, _)| r)
        .collect();
    assert_eq!(constant, [0, 45, 62, 482, 527, 818, 927]);
    assert!(
        matrix(Seeding::Mixed, 1000)
            .iter()
            .all(|row| row.iter().any(|w| w.to_bits() != row[0].to_bits()))
    );
}
