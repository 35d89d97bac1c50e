//! Decoding one window, Φ·D given, and classifying the image: the hot paths of every board. The peer is the same
//! pursuit written with nalgebra's pseudo-inverse, as the published code does it.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{Library, Src};
use spts_recon::recover::{BatchOmp, ImagePrior, NnLmmse, Noise, RECOVER};
use spts_recon::{Matrix, Problem, Recover as _, SignTables, Solution, Workspace};
use std::hint::black_box;
use std::sync::Arc;

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

/// Images of four blobs on 10 × 10 pixels, as a touch leaves them.
fn blobs(rng: &mut ChaCha8Rng, count: usize) -> Matrix {
    let images = DMatrix::from_fn(count, 4, |_, _| {
        (rng.random_range(2.0..7.0), rng.random_range(2.0..7.0))
    });
    Matrix::from(&DMatrix::from_fn(100, count, |pixel, n| {
        let (row, col) = ((pixel / 10) as f64, (pixel % 10) as f64);
        let blob = |&(r, c): &(f64, f64)| (-0.5 * ((row - r).powi(2) + (col - c).powi(2))).exp();
        images.row(n).iter().map(blob).sum::<f64>()
    }))
}

/// The most probable non-negative image, with the prior of images alike, from windows of ±1 weights; cold, and from the
/// answer to the measurements before.
fn most_probable(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let prior = ImagePrior::UNSEEN.learn(&blobs(&mut rng, 60), 10).expect("images");
    let method = NnLmmse::new(Arc::new(prior), Noise::Relative(0.12)).expect("a share above zero");
    let image = blobs(&mut rng, 1).column(0);
    let mut group = c.benchmark_group("nn_lmmse");
    for m in [7, 13, 20, 25, 50] {
        let values = (0..m * 100).map(|_| if rng.random() { 1.0 } else { -1.0 }).collect();
        let phi = Matrix::from_rows(m, 100, values).expect("m rows of 100");
        let mut y = |noise: f64| -> Vec<f64> {
            let clean = |r| phi.row(r).iter().zip(&image).map(|(w, x)| w * x).sum::<f64>();
            (0..m).map(|r| clean(r) + noise * rng.random_range(-1.0..1.0)).collect()
        };
        let (before, y) = (y(0.3), y(0.3));
        let (mut work, mut solution) = (Workspace::default(), Solution::default());
        let problem = |y| Problem::new(phi.view(), y).expect("m measurements");
        let start = method.recover(&problem(&before), &mut work).expect("a solution");
        group.bench_function(BenchmarkId::new("cold", m), |b| {
            b.iter(|| method.recover_into(&problem(black_box(&y)), &mut work, &mut solution));
        });
        group.bench_function(BenchmarkId::new("warm", m), |b| {
            b.iter(|| method.recover_from_into(&problem(black_box(&y)), &start, &mut work, &mut solution));
        });
    }
    group.finish();
}

fn classify(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let images = Matrix::from(&DMatrix::from_fn(100, 170, |_, _| rng.random_range(0.0..1.0)));
    let labels: Vec<usize> = (0..170).map(|k| k / 10).collect();
    let library = Library::new(&images, &labels).expect("labels fit");
    let prepared = Src::prepared(library.clone(), Src::PUBLISHED_SPARSITY).expect("finite images");
    let (image, mut work) = (
        images
            .column(42)
            .iter()
            .zip(images.column(93))
            .map(|(a, b)| a + 0.3 * b)
            .collect::<Vec<_>>(),
        Workspace::default(),
    );
    for (name, classifier) in [
        ("published", Src::new(library, Src::PUBLISHED_SPARSITY)),
        ("prepared", prepared),
    ] {
        c.bench_function(&format!("classify/{name}"), |b| {
            b.iter(|| classifier.classify(black_box(&image), &mut work))
        });
    }
}

criterion_group!(benches, form, decode, most_probable, classify);
criterion_main!(benches);
