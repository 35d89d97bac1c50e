//! Against frames whose numbers are known in closed form, and against every support of small matrices.

use super::*;
use crate::matrix::Matrix;
use rand::SeedableRng as _;

/// Rounding of a sum of a few dozen products of numbers up to 1.
const ROUNDING: f64 = 1e-13;

fn rng() -> ChaCha8Rng {
    ChaCha8Rng::seed_from_u64(7)
}

/// Signs of Sylvester's Hadamard matrix of 2^`order` rows: an orthogonal basis.
fn hadamard(order: u32) -> Matrix {
    let n = 1_usize << order;
    let sign = |r: usize, c: usize| {
        if (r & c).count_ones().is_multiple_of(2) {
            1.0
        } else {
            -1.0
        }
    };
    Matrix::from_rows(n, n, (0..n * n).map(|i| sign(i / n, i % n)).collect()).unwrap()
}

/// n + 1 unit vectors of n numbers with the same angle between any two, cos = −1/n: the corners of a simplex about its
/// centre.
fn simplex(n: usize) -> Matrix {
    let corners = n + 1;
    let mut vectors: Vec<Vec<f64>> = Vec::new();
    for k in 0..corners {
        let mut v = vec![0.0; n];
        for i in 0..k.min(n) {
            let dot: f64 = vectors[i][..i].iter().zip(&v).map(|(a, b)| a * b).sum();
            v[i] = (-1.0 / n as f64 - dot) / vectors[i][i];
        }
        if k < n {
            v[k] = (1.0 - v.iter().map(|x| x * x).sum::<f64>()).sqrt();
        }
        vectors.push(v);
    }
    let slices: Vec<&[f64]> = vectors.iter().map(Vec::as_slice).collect();
    Matrix::from_column_slices(n, &slices)
}

fn random(m: usize, n: usize) -> Matrix {
    let mut rng = rng();
    Matrix::from_rows(m, n, (0..m * n).map(|_| rng.random_range(-1.0..1.0)).collect()).unwrap()
}

#[test]
fn an_orthogonal_basis_is_perfect() {
    let basis = hadamard(4);
    for found in [columns(basis.view()).unwrap(), rows(basis.view()).unwrap()] {
        assert!(found.max < ROUNDING && found.rms < ROUNDING, "{found:?}");
    }
    let spectrum = spectrum(basis.view()).unwrap();
    assert_eq!((spectrum.rank, spectrum.full), (16, 16));
    assert!((spectrum.condition - 1.0).abs() < ROUNDING);
    let search = IsometrySearch { random: 20, greedy: 2 };
    for sparsity in [1, 2, 5, 16] {
        let found = restricted_isometry(basis.view(), sparsity, search, &mut rng()).unwrap();
        assert!(found.delta.abs() < ROUNDING, "{found:?}");
        assert_eq!(found.support.len(), sparsity);
    }
}

#[test]
fn equiangular_frames_reach_the_bound_of_welch() {
    for n in [1, 2, 3, 7, 20] {
        let frame = simplex(n);
        let found = columns(frame.view()).unwrap();
        let expected = 1.0 / n as f64;
        assert!((welch_bound(n, n + 1) - expected).abs() < ROUNDING);
        assert!((found.max - expected).abs() < ROUNDING, "{n}: {found:?}");
        assert!((found.rms - expected).abs() < ROUNDING, "{n}: {found:?}");
    }
    // no frame is below it
    let frame = random(6, 30);
    assert!(columns(frame.view()).unwrap().max > welch_bound(6, 30));
    assert!(welch_bound(9, 9) < ROUNDING && welch_bound(0, 9) < ROUNDING);
}

/// Two unit vectors with cos = c have the Gram eigenvalues 1 ± c: δ₂ = c and a condition of √((1 + c)/(1 − c)). A
/// length does not change coherence or δ.
#[test]
fn two_directions_have_closed_forms() {
    for (angle, length) in [(0.3_f64, 1.0), (1.2, 1.0), (1.2, 1e-200), (2.8, 1e250)] {
        let (sin, cos) = angle.sin_cos();
        let a = Matrix::from_rows(2, 2, vec![1.0, length * cos, 0.0, length * sin]).unwrap();
        let c = cos.abs();
        assert!((columns(a.view()).unwrap().max - c).abs() < ROUNDING);
        let search = IsometrySearch { random: 1, greedy: 0 };
        let found = restricted_isometry(a.view(), 2, search, &mut rng()).unwrap();
        assert!((found.delta - c).abs() < ROUNDING, "{found:?}, expected {c}");
        if length.log10().abs() < 1.0 {
            let expected = ((1.0 + c) / (1.0 - c)).sqrt();
            let found = spectrum(a.view()).unwrap();
            assert!((found.condition / expected - 1.0).abs() < 1e-12 * expected, "{found:?}");
        }
    }
}

/// Every support of 3 of 12 columns, one by one: random and greedy supports never exceed the constant, and the greedy
/// ones find it.
#[test]
fn the_isometry_constant_is_that_of_all_supports() {
    let a = random(8, 12);
    let gram = Gram::of_columns(&scaled(a.view()).unwrap());
    let mut exact = f64::NEG_INFINITY;
    for i in 0..12 {
        for j in 0..i {
            for k in 0..j {
                exact = exact.max(gram.deviation(&[i, j, k]));
            }
        }
    }
    let delta = |random, greedy| {
        let search = IsometrySearch { random, greedy };
        restricted_isometry(a.view(), 3, search, &mut rng()).unwrap()
    };
    let drawn = delta(30, 0).delta;
    assert!(drawn <= exact + ROUNDING, "{drawn} is above {exact}");
    let found = delta(1, 12);
    assert!((found.delta - exact).abs() < ROUNDING, "{found:?}, expected {exact}");
    assert!((gram.deviation(&found.support) - exact).abs() < ROUNDING);
}

#[test]
fn what_no_measurement_shows_is_as_bad_as_it_gets() {
    // columns: twice the same, and one of zeros
    let a = Matrix::from_rows(2, 4, vec![1.0, 0.0, 2.0, 0.0, 0.0, 1.0, 0.0, 0.0]).unwrap();
    assert!((columns(a.view()).unwrap().max - 1.0).abs() < ROUNDING);
    let found = restricted_isometry(a.view(), 2, IsometrySearch { random: 1, greedy: 4 }, &mut rng()).unwrap();
    assert!((found.delta - 1.0).abs() < ROUNDING, "{found:?}");
    let flat = Matrix::from_rows(2, 2, vec![1.0, 2.0, 2.0, 4.0]).unwrap();
    let found = spectrum(flat.view()).unwrap();
    assert_eq!((found.rank, found.condition.is_infinite()), (1, true));
    let nothing = Matrix::zeros(3, 3);
    assert_eq!(spectrum(nothing.view()).unwrap().rank, 0);
    assert!((rows(nothing.view()).unwrap().rms - 1.0).abs() < ROUNDING);
}

#[test]
fn scale_is_of_no_meaning() {
    let a = random(5, 9);
    let expected = (columns(a.view()).unwrap(), spectrum(a.view()).unwrap());
    for factor in [2.0_f64.powi(-1000), 2.0_f64.powi(1000)] {
        let scaled = Matrix::from_rows(5, 9, a.view().values().iter().map(|v| v * factor).collect()).unwrap();
        let found = (columns(scaled.view()).unwrap(), spectrum(scaled.view()).unwrap());
        assert!(
            (found.0.max - expected.0.max).abs() < ROUNDING
                && (found.1.condition / expected.1.condition - 1.0).abs() < 1e-12,
            "{found:?}, expected {expected:?}"
        );
    }
}

#[test]
fn what_cannot_be_judged_is_refused() {
    let empty = Matrix::zeros(0, 3);
    assert_eq!(columns(empty.view()), Err(CoherenceError::Empty { rows: 0, cols: 3 }));
    for value in [f64::NAN, f64::INFINITY] {
        let a = Matrix::from_rows(1, 3, vec![1.0, value, 1.0]).unwrap();
        let error = spectrum(a.view()).unwrap_err();
        assert!(
            matches!(error, CoherenceError::NotFinite { row: 0, col: 1, .. }),
            "{error}"
        );
    }
    let search = IsometrySearch { random: 1, greedy: 1 };
    for sparsity in [0, 5] {
        let error = restricted_isometry(hadamard(2).view(), sparsity, search, &mut rng()).unwrap_err();
        assert_eq!(
            error.to_string(),
            format!("`sparsity` = {sparsity}e0 is outside [1e0, 4e0]")
        );
    }
}
