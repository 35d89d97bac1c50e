//! The network against its formula, written with nalgebra in double precision.

use super::*;
use crate::matrix::{Matrix, MatrixView};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;

const N: usize = 12;
const HIDDEN: usize = 20;
const MEMORY: usize = 5;
const STEPS: usize = 2;
const NOISE: f64 = 0.02;

fn layer(rng: &mut ChaCha8Rng, inputs: usize, outputs: usize) -> Layer {
    let scale = 1.0 / (inputs as f32).sqrt();
    let mut draw = |count: usize| (0..count).map(|_| scale * rng.random_range(-1.5..1.5_f32)).collect();
    Layer::new(draw(inputs * outputs), draw(outputs))
}

fn weights(rng: &mut ChaCha8Rng) -> UnrolledWeights {
    let factor = DMatrix::from_fn(N, N, |_, _| rng.random_range(-0.2..0.3_f64));
    let prior = &factor * factor.transpose() / 1.5 + DMatrix::identity(N, N) * 1e-3;
    let steps = (0..STEPS).map(|_| UnrolledStep {
        hidden: layer(rng, 4 * N + MEMORY + 2, HIDDEN),
        change: layer(rng, HIDDEN, N + MEMORY),
    });
    let steps = steps.collect();
    UnrolledWeights::new(Matrix::from(&prior), NOISE, steps, layer(rng, MEMORY + N, N)).unwrap()
}

fn dense(layer: &Layer, inputs: &DVector<f64>) -> DVector<f64> {
    let outputs = layer.bias.len();
    // tiles of 64, 16, 4 outputs and one, each inputs × width
    let mut w = DMatrix::zeros(outputs, inputs.len());
    let (mut first, mut left) = (0, layer.weights.iter());
    while first < outputs {
        let width = [64, 16, 4, 1].into_iter().find(|w| first + w <= outputs).unwrap();
        for i in 0..inputs.len() {
            (first..first + width).for_each(|o| w[(o, i)] = f64::from(*left.next().unwrap()));
        }
        first += width;
    }
    w * inputs + DVector::from_iterator(outputs, layer.bias.iter().map(|b| f64::from(*b)))
}

/// Image before it is made to agree with the support, and probabilities, as the documentation of [`Unrolled`] has them.
fn formula(w: &UnrolledWeights, phi: &DMatrix<f64>, y: &DVector<f64>) -> (DVector<f64>, DVector<f64>) {
    let m = phi.nrows();
    let k = DMatrix::from_row_slice(N, N, w.prior.view().values());
    let s = phi * &k * phi.transpose() + DMatrix::identity(m, m) * NOISE;
    let l = s.cholesky().unwrap().l();
    let white = |b: &DVector<f64>| l.solve_lower_triangular(b).unwrap();
    let v = l.solve_lower_triangular(&(phi * &k)).unwrap();
    let scale = white(y).norm() / (m as f64).sqrt();
    let y = y / scale;
    let linear = v.transpose() * white(&y);
    let left = DVector::from_fn(N, |i, _| (k[(i, i)] - v.column(i).norm_squared()).max(0.0).sqrt());
    let mut x = linear.map(|v| v.max(0.0));
    let mut h = DVector::zeros(MEMORY);
    for step in &w.steps {
        let e = white(&(&y - phi * &x));
        let inputs: Vec<f64> = [&x, &(v.transpose() * &e), &linear, &left, &h]
            .into_iter()
            .flat_map(|part| part.iter().copied().collect::<Vec<_>>())
            .chain([(m as f64 / 20.0).ln(), e.norm() / (m as f64).sqrt()])
            .collect();
        let z = dense(
            &step.change,
            &dense(&step.hidden, &DVector::from_vec(inputs)).map(|v| v.max(0.0)),
        );
        x = DVector::from_fn(N, |i, _| (x[i] + z[i]).max(0.0));
        h = DVector::from_fn(MEMORY, |i, _| z[N + i].tanh());
    }
    let all = DVector::from_iterator(N + MEMORY, h.iter().chain(x.iter()).copied());
    (x * scale, dense(&w.output, &all).map(|z| 1.0 / (1.0 + (-z).exp())))
}

/// Single precision in the network leaves 24 bits of numbers near 1 that add up a hundred at a time: 1e-5 is ten times
/// what that leaves.
#[test]
fn the_network_is_its_formula() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    for m in [1, 5, 9, 30] {
        let weights = weights(&mut rng);
        let phi = DMatrix::from_fn(m, N, |_, _| if rng.random() { 1.0 } else { -1.0 });
        let y = DVector::from_fn(m, |_, _| rng.random_range(-2.0..2.0));
        let (expected, touched) = formula(&weights, &phi, &y);
        let rows = Matrix::from(&phi);
        let (mut image, mut probabilities) = (Vec::new(), Vec::new());
        let problem = Problem::new(rows.view(), y.as_slice()).unwrap();
        let network = Unrolled::new(weights);
        let found = network.estimate(&problem, &mut Workspace::default(), &mut image, &mut probabilities);
        let found = found.unwrap();
        for (p, expected) in probabilities.iter().zip(&touched) {
            assert!((p - expected).abs() < 1e-5, "M = {m}: {p}, expected {expected}");
        }
        // the support is that of the probabilities, so that the image is compared where both agree about it
        let mut order = Vec::new();
        let (count, iou) = support::best_support(touched.as_slice(), &mut order);
        assert_eq!(found.taxels, count, "M = {m}");
        assert!((found.expected_iou - iou).abs() < 1e-5);
        let mut expected = expected.as_slice().to_vec();
        support::agree(&mut expected, &order, count);
        let largest = expected.iter().fold(0.0_f64, |most, v| most.max(*v));
        for (x, expected) in image.iter().zip(&expected) {
            assert!(
                (x - expected).abs() < 1e-5 * largest,
                "M = {m}: {x}, expected {expected}"
            );
        }
    }
}

/// Rows that are not ±1 are scaled to a root mean square of 1: those of another size give the same image, as large as y
/// and they say.
#[test]
fn the_size_of_rows_and_samples_is_taken_out() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let network = Unrolled::new(weights(&mut rng));
    let values: Vec<f64> = (0..6 * N).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
    let y: Vec<f64> = (0..6).map(|_| rng.random_range(-1.0..1.0)).collect();
    let solve = |rows: f64, samples: f64| {
        let scaled: Vec<f64> = values.iter().map(|v| v * rows).collect();
        let y: Vec<f64> = y.iter().map(|v| v * samples).collect();
        let (mut image, mut touched) = (Vec::new(), Vec::new());
        let problem = Problem::new(MatrixView::new(6, N, &scaled).unwrap(), &y).unwrap();
        network
            .estimate(&problem, &mut Workspace::default(), &mut image, &mut touched)
            .map(|_| image)
    };
    let one = solve(1.0, 1.0).unwrap();
    for (rows, samples) in [(0.3, 1.0), (1e-150, 1e-150), (1e150, 7.0), (1e300, 1e300)] {
        for (other, x) in solve(rows, samples).unwrap().iter().zip(&one) {
            let expected = x * (samples / rows);
            // another size of the rows goes past the look-ups, which are in single precision
            assert!(
                (other - expected).abs() <= 1e-5 * (samples / rows),
                "{rows:e}, {samples:e}: {other} {expected}"
            );
        }
    }
    assert!(matches!(solve(1e-300, 1e300), Err(RecoverError::Overflow { .. })));
    assert!(solve(1.0, 0.0).unwrap().iter().all(|x| *x == 0.0));
    assert!(solve(0.0, 1.0).unwrap().iter().all(|x| *x == 0.0));
}
