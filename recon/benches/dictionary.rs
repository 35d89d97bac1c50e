//! Learning a dictionary with the published and with the fast settings, on the same images. The race against SPAMS, the
//! peer, is `scripts/oracles/dictionary_speed.py`.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::dictionary::Ksvd;
use std::hint::black_box;

/// Values of an image, images, atoms, atoms of a code, sweeps.
const SHAPE: [usize; 5] = [100, 300, 50, 6, 2];

fn learn(c: &mut Criterion) {
    let [n, images, atoms, sparsity, sweeps] = SHAPE;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    // squares of contact on a sheet of ten by ten
    let images: Vec<Vec<f64>> = (0..images)
        .map(|_| {
            let (row, col, side) = (rng.random_range(0..8), rng.random_range(0..8), rng.random_range(1..5));
            let inside = |i: usize| (row..row + side).contains(&(i / 10)) && (col..col + side).contains(&(i % 10));
            (0..n)
                .map(|i| f64::from(inside(i)) + rng.random_range(-0.05..0.05))
                .collect()
        })
        .collect();
    let mut group = c.benchmark_group("learn a dictionary");
    group.sample_size(10);
    group.throughput(Throughput::Elements((images.len() * sweeps) as u64));
    for (name, settings) in [("published", Ksvd::default()), ("fast", Ksvd::fast())] {
        let ksvd = Ksvd {
            n_components: atoms,
            n_nonzero_coefs: sparsity,
            n_iter: sweeps,
            ..settings
        };
        group.bench_function(BenchmarkId::new(name, images.len()), |b| {
            b.iter(|| ksvd.learn(black_box(&images), &mut ChaCha8Rng::seed_from_u64(1)));
        });
    }
    group.finish();
}

criterion_group!(benches, learn);
criterion_main!(benches);
