//! Decoding one window, Φ·D given, and classifying the image: the hot paths of every board. The peer is the same
//! pursuit written with nalgebra's pseudo-inverse, as the published code does it.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{Library, Src};
use spts_recon::recover::{BatchOmp, RECOVER};
use spts_recon::{Matrix, Problem, SignTables, Solution, Workspace};
use std::hint::black_box;

/// Atoms of the dictionary.
const ATOMS: usize = 100;

fn pseudo_inverse_pursuit(a: &DMatrix<f64>, y: &DVector<f64>, sparsity: usize) -> DVector<f64> {
    let (mut support, mut alpha, mut residual) = (Vec::new(), DVector::zeros(0), y.clone());
    for _ in 0..sparsity {
        support.push((a.tr_mul(&residual)).iamax());
        let sub = a.select_columns(&support);
        alpha = sub.clone().pseudo_inverse(1e-12).expect("a positive tolerance") * y;
        residual = y - sub * &alpha;
    }
    alpha
}

fn decode(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut group = c.benchmark_group("decode");
    for (m, sparsity) in [(7, 2), (25, 6), (100, 25)] {
        let a = DMatrix::from_fn(m, ATOMS, |_, _| rng.random_range(-1.0..1.0));
        let y = DVector::from_fn(m, |_, _| rng.random_range(-1.0..1.0));
        let (rows, mut work) = (Matrix::from(&a), Workspace::default());
        let mut solution = Solution::default();
        for (name, build) in RECOVER {
            let algorithm = build(sparsity);
            group.bench_function(BenchmarkId::new(*name, m), |b| {
                b.iter(|| {
                    let problem = Problem::new(rows.view(), black_box(y.as_slice()));
                    problem.and_then(|p| algorithm.recover_into(&p, &mut work, &mut solution))
                });
            });
        }
        let shared = BatchOmp::new(rows.view(), sparsity).expect("a finite matrix");
        group.bench_function(BenchmarkId::new("omp, shared operator", m), |b| {
            b.iter(|| shared.recover_into(black_box(y.as_slice()), &mut work, &mut solution));
        });
        group.bench_function(BenchmarkId::new("nalgebra pseudo-inverse", m), |b| {
            b.iter(|| pseudo_inverse_pursuit(&a, black_box(&y), sparsity));
        });
    }
    group.finish();
}

/// Φ·D of a window of ±1 weights, by look-up and as a product.
fn form(c: &mut Criterion) {
    let (n, m) = (100, 25);
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let dictionary = DMatrix::from_fn(n, ATOMS, |_, _| rng.random_range(-1.0..1.0));
    let phi = DMatrix::from_fn(m, n, |_, _| if rng.random() { 1.0 } else { -1.0 });
    let signs: Vec<u64> = (0..m * n.div_ceil(64)).map(|_| rng.random()).collect();
    let mut rows = vec![0.0; m * ATOMS];
    let mut group = c.benchmark_group("form");
    let (double, single) = (
        SignTables::<f64>::new(Matrix::from(&dictionary).view()),
        SignTables::<f32>::new(Matrix::from(&dictionary).view()),
    );
    group.bench_function("f64 tables", |b| {
        b.iter(|| double.fill_rows(black_box(&signs), &mut rows))
    });
    group.bench_function("f32 tables", |b| {
        b.iter(|| single.fill_rows(black_box(&signs), &mut rows))
    });
    group.bench_function("nalgebra product", |b| b.iter(|| black_box(&phi) * &dictionary));
    group.finish();
}

fn classify(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let images = Matrix::from(&DMatrix::from_fn(100, 170, |_, _| rng.random_range(0.0..1.0)));
    let labels: Vec<usize> = (0..170).map(|k| k / 10).collect();
    let library = Library::new(&images, &labels).expect("labels fit");
    let (image, mut work) = (
        images
            .column(42)
            .iter()
            .zip(images.column(93))
            .map(|(a, b)| a + 0.3 * b)
            .collect::<Vec<_>>(),
        Workspace::default(),
    );
    let classifier = Src::new(library, Src::PUBLISHED_SPARSITY);
    c.bench_function("classify", |b| {
        b.iter(|| classifier.classify(black_box(&image), &mut work))
    });
}

criterion_group!(benches, form, decode, classify);
criterion_main!(benches);
