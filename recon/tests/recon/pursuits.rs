//! Supports of 1,000 random problems against scikit-learn: `scripts/oracles/pursuits.py` wrote what they
//! found.

use spts_recon::recover::{BatchOmp, Omp, ReferenceOmp};
use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};

/// (M, K, S), and the share of noise, as in `scripts/oracles/problems.py`.
const SHAPES: [(usize, usize, usize); 7] = [
    (10, 40, 3),
    (25, 100, 6),
    (50, 100, 20),
    (7, 100, 2),
    (20, 100, 5),
    (13, 60, 4),
    (40, 24, 8),
];
const NOISE: f64 = 0.1;

/// SplitMix64: numbers in [-1, 1) from the top 53 bits.
fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let mut state = seed;
    (0..count)
        .map(|_| {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = state;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / 2.0_f64.powi(52) - 1.0
        })
        .collect()
}

/// (A, y, S) number `index`.
fn problem(index: usize) -> (Matrix, Vec<f64>, usize) {
    let (m, k, s) = SHAPES[index % SHAPES.len()];
    let values = uniform(1_000_003 * index as u64, m * k + m + k);
    let (matrix, rest) = values.split_at(m * k);
    let (noise, draws) = rest.split_at(m);
    let a = Matrix::from_rows(m, k, matrix.to_vec()).unwrap();
    if index.is_multiple_of(2) {
        return (a, noise.to_vec(), s);
    }
    let mut order: Vec<usize> = (0..k).collect();
    order.sort_by(|&i, &j| draws[j].abs().total_cmp(&draws[i].abs()));
    let mut y: Vec<f64> = noise.iter().map(|v| NOISE * v).collect();
    for (r, y) in y.iter_mut().enumerate() {
        *y += order[..s].iter().map(|&c| a.row(r)[c] * draws[c]).sum::<f64>();
    }
    (a, y, s)
}

/// Supports of one program, by problem.
fn oracle(program: &str) -> Vec<Vec<usize>> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../tests/oracles/pursuits.json");
    let text = std::fs::read_to_string(path).unwrap();
    let values: serde_json::Value = serde_json::from_str(&text).unwrap();
    let supports: Vec<Vec<usize>> = serde_json::from_value(values[program].clone()).unwrap();
    assert_eq!(supports.len(), 1000, "{program}");
    supports
}

fn sorted(solution: &Solution) -> Vec<usize> {
    let mut support = solution.support.clone();
    support.sort_unstable();
    support
}

fn assert_supports(program: &str, build: impl Fn(usize) -> Box<dyn Recover>) {
    let mut work = Workspace::default();
    for (index, expected) in oracle(program).iter().enumerate() {
        let (a, y, s) = problem(index);
        let problem = Problem::new(a.view(), &y).unwrap();
        let solution = build(s).recover(&problem, &mut work).unwrap();
        assert_eq!(&sorted(&solution), expected, "{program}: problem {index}");
    }
}

#[test]
fn omp_finds_the_supports_of_scikit_learn() {
    assert_supports("omp_normalized", |s| Box::new(Omp::new(s)));
    assert_supports("omp", |s| Box::new(ReferenceOmp::new(s)));
}

/// A Gram matrix squares the condition of the chosen columns, which is below 1e3 here: 1e6·ε with a margin of 1000.
fn assert_same(got: &Solution, own: &Solution, index: usize) {
    assert_eq!(got.support, own.support, "problem {index}");
    for (g, e) in got.coefficients.iter().zip(&own.coefficients) {
        assert!(
            (g - e).abs() <= 1e-7 * e.abs().max(1.0),
            "problem {index}: {g}, expected {e}"
        );
    }
    assert!((got.residual_norm - own.residual_norm).abs() <= 1e-7, "problem {index}");
}

#[test]
fn gram_matrices_give_the_supports_of_scikit_learn() {
    let (mut work, mut solution) = (Workspace::default(), Solution::default());
    for (index, expected) in oracle("omp_normalized").iter().enumerate() {
        let (a, y, s) = problem(index);
        let own = Omp::new(s)
            .recover(&Problem::new(a.view(), &y).unwrap(), &mut work)
            .unwrap();
        let pursuit = BatchOmp::new(a.view(), s).unwrap();
        pursuit.recover_into(&y, &mut work, &mut solution).unwrap();
        assert_eq!(&sorted(&solution), expected, "problem {index}");
        assert_same(&solution, &own, index);
    }
}
