//! An image by the unrolled network, from rows and samples to support, in the size that ships; the peer is the
//! non-negative Gaussian estimate of the same window.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::recover::{Gaussian, Layer, NnLmmse, Noise, Unrolled, UnrolledStep, UnrolledWeights};
use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};
use std::hint::black_box;
use std::sync::Arc;

const N: usize = 100;
const HIDDEN: usize = 160;
const MEMORY: usize = 48;

fn layer(rng: &mut ChaCha8Rng, inputs: usize, outputs: usize) -> Layer {
    let weights = (0..inputs * outputs).map(|_| rng.random_range(-0.1..0.1)).collect();
    Layer::new(weights, vec![0.0; outputs])
}

fn decode(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let steps = (0..3).map(|_| UnrolledStep {
        hidden: layer(&mut rng, 4 * N + MEMORY + 2, HIDDEN),
        change: layer(&mut rng, HIDDEN, N + MEMORY),
    });
    let steps: Vec<UnrolledStep> = steps.collect();
    let prior = |i: usize, j: usize| {
        let d = (i / 10).abs_diff(j / 10).pow(2) + (i % 10).abs_diff(j % 10).pow(2);
        1e-2 * (-0.2 * d as f64).exp()
    };
    let values = (0..N * N).map(|k| prior(k / N, k % N) + if k / N == k % N { 1e-3 } else { 0.0 });
    let prior = Matrix::from_rows(N, N, values.collect()).expect("N × N");
    let output = layer(&mut rng, MEMORY + N, N);
    let weights = UnrolledWeights::new(prior.clone(), 0.012, steps, output).expect("layers that fit");
    let network = Unrolled::new(weights);
    let gaussian = Gaussian::new(vec![0.0; N], prior).expect("a covariance");
    let peer = NnLmmse::new(Arc::new(gaussian), Noise::Relative(0.12)).expect("a noise");
    let mut group = c.benchmark_group("unrolled");
    for m in [7, 20, 50] {
        let values = (0..m * N).map(|_| if rng.random() { 1.0 } else { -1.0 });
        let rows = Matrix::from_rows(m, N, values.collect()).expect("M × N");
        let y: Vec<f64> = (0..m).map(|_| rng.random_range(-2.0..2.0)).collect();
        let (mut work, mut solution) = (Workspace::default(), Solution::default());
        let methods: [(&str, &dyn Recover); 2] = [("network", &network), ("nn_lmmse", &peer)];
        for (name, method) in methods {
            group.bench_function(BenchmarkId::new(name, m), |b| {
                b.iter(|| {
                    let problem = Problem::new(rows.view(), black_box(&y));
                    problem.and_then(|p| method.recover_into(&p, &mut work, &mut solution))
                });
            });
        }
    }
    group.finish();
}

criterion_group!(benches, decode);
criterion_main!(benches);
