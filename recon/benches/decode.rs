//! Decoding one window, Φ·D given, and classifying the image: the hot paths of every board. The peer is the same
//! pursuit written with nalgebra's pseudo-inverse, as the published code does it.

use criterion::measurement::WallTime;
use criterion::{BenchmarkGroup, BenchmarkId, Criterion, criterion_group, criterion_main};
use nalgebra::{DMatrix, DVector};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{Library, Src};
use spts_recon::recover::{
    Fixed, ImagePrior, Lmmse, NnLmmse, Noise, RECOVER, Unrolled, UnrolledBlock, UnrolledWeights,
};
use spts_recon::{Matrix, Problem, Recover, Solution, Workspace};
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
        group.bench_function(BenchmarkId::new("nalgebra pseudo-inverse", m), |b| {
            b.iter(|| pseudo_inverse_pursuit(&a, black_box(&y), sparsity));
        });
    }
    group.finish();
}

fn classify(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let images = Matrix::from(&DMatrix::from_fn(100, 170, |_, _| rng.random_range(0.0..1.0)));
    let labels: Vec<usize> = (0..170).map(|k| k / 10).collect();
    let library = Library::new(&images, &labels).expect("labels fit");
    let (image, mut work) = (
        images.column(42).iter().zip(images.column(93)).map(|(a, b)| a + 0.3 * b).collect::<Vec<_>>(),
        Workspace::default(),
    );
    let classifier = Src::new(library, Src::PUBLISHED_SPARSITY);
    c.bench_function("classify", |b| b.iter(|| classifier.classify(black_box(&image), &mut work)));
}

/// Twenty ±1 measurements of discs and bars on 10 × 10 taxels: the estimates that are given Φ with every window, and
/// the same with one Φ that was there before.
fn fixed(c: &mut Criterion) {
    let (m, cols) = (20, 10);
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let images = Matrix::from(&DMatrix::from_columns(&(0..200).map(|k| touch(k, cols)).collect::<Vec<_>>()));
    let prior = Arc::new(ImagePrior::UNSEEN.learn(&images, cols).expect("images"));
    let phi = Matrix::from(&DMatrix::from_fn(m, cols * cols, |_, _| if rng.random() { 1.0 } else { -1.0 }));
    let windows: Vec<Vec<f64>> = (0..64)
        .map(|k| {
            let image = touch(1000 + k, cols);
            let sums = (0..m).map(|r| phi.row(r).iter().zip(&image).map(|(w, x)| w * x).sum::<f64>());
            sums.map(|y| y * (1.0 + rng.random_range(-0.05..0.05))).collect()
        })
        .collect();
    let mut group = c.benchmark_group("fixed");
    let mut work = (Workspace::default(), Solution::default());
    let each = |group: &mut BenchmarkGroup<'_, WallTime>, name: &str, run: &mut dyn FnMut(&[f64])| {
        let mut next = windows.iter().cycle();
        group.bench_function(name, |b| b.iter(|| next.next().map(|y| run(black_box(y)))));
    };
    let noise = Noise::Relative(0.12);
    let methods: [(&str, Box<dyn Recover>); 2] = [
        ("linear", Box::new(Lmmse::new(Arc::clone(&prior), noise).expect("in range"))),
        ("non-negative", Box::new(NnLmmse::new(Arc::clone(&prior), noise).expect("in range"))),
    ];
    for (name, method) in &methods {
        each(&mut group, &format!("{name}, any operator"), &mut |y| {
            let problem = Problem::new(phi.view(), y);
            let _ = black_box(problem.and_then(|p| method.recover_into(&p, &mut work.0, &mut work.1)));
        });
    }
    let fixed = Fixed::new(phi.view(), Arc::clone(&prior), noise).expect("finite");
    let mut window = fixed.window();
    each(&mut group, "linear, fixed", &mut |y| {
        window.clear();
        window.extend(y);
        let _ = black_box(window.image());
    });
    each(&mut group, "linear, fixed, after the last sample", &mut |_| {
        let _ = black_box(window.image());
    });
    each(&mut group, "non-negative, fixed", &mut |y| {
        window.clear();
        window.extend(y);
        let _ = black_box(window.non_negative());
    });
    group.finish();
}

/// The network with the sizes of the trained one, its numbers drawn, beside the linear estimate: ±1 measurements of one
/// to three contacts with 5 % of noise. Every window has other rows than the one before.
fn unrolled(c: &mut Criterion) {
    let mut group = c.benchmark_group("unrolled");
    for (cols, m) in [(10, 7), (10, 20), (10, 50), (32, 100)] {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let images = Matrix::from(&DMatrix::from_columns(&(0..200).map(|k| touch(k, cols)).collect::<Vec<_>>()));
        let prior = Arc::new(ImagePrior::UNSEEN.learn(&images, cols).expect("images"));
        let windows: Vec<(Matrix, Vec<f64>)> = (0..16)
            .map(|k| {
                let phi = DMatrix::from_fn(m, cols * cols, |_, _| if rng.random() { 1.0 } else { -1.0 });
                let contacts = (0..1 + k % 3).map(|contact| touch(3 * k + contact, cols));
                let y = (&phi * contacts.sum::<DVector<f64>>()).map(|y| y * (1.0 + rng.random_range(-0.05..0.05)));
                (Matrix::from(&phi), y.as_slice().to_vec())
            })
            .collect();
        let methods: [(&str, Box<dyn Recover>); 2] = [
            ("network", Box::new(Unrolled::new(drawn_weights(&mut rng), [cols, cols]).expect("in range"))),
            ("linear", Box::new(Lmmse::new(prior, Noise::Relative(0.12)).expect("in range"))),
        ];
        let mut work = (Workspace::default(), Solution::default());
        for (name, method) in &methods {
            let mut next = windows.iter().cycle();
            group.bench_function(BenchmarkId::new(*name, format!("{cols} × {cols}, M = {m}")), |b| {
                b.iter(|| {
                    let Some((phi, y)) = next.next() else { return };
                    let problem = Problem::new(phi.view(), black_box(y));
                    let _ = black_box(problem.and_then(|p| method.recover_into(&p, &mut work.0, &mut work.1)));
                });
            });
        }
    }
    group.finish();
}

/// Four blocks of 24 channels and 13 values of memory, and four kinds of contacts. The numbers are as large as those of
/// layers at the start of a training, so that about half of what is cut off at zero remains.
fn drawn_weights(rng: &mut ChaCha8Rng) -> UnrolledWeights {
    let (channels, outputs, taxel, whole) = (24, 16, 25, 27);
    let mut draw = |inputs: usize, count: usize| -> Vec<f32> {
        (0..inputs * count).map(|_| rng.random_range(-1.0..1.0) / (inputs as f32).sqrt()).collect()
    };
    let block = |_| UnrolledBlock {
        taxel: draw(taxel, channels),
        whole: draw(whole, channels),
        bias: draw(1, channels),
        near: draw(9, channels),
        near_bias: draw(1, channels),
        output: draw(channels, outputs),
        output_bias: draw(1, outputs),
        noise: draw(whole + 1, 1),
    };
    let kinds =
        vec![[0.05, 0.05, 0.02, 0.88], [0.42, 0.09, 0.01, 0.48], [0.47, 0.19, 0.02, 0.32], [0.22, 0.45, 0.13, 0.2]];
    UnrolledWeights::new([1.2, 4.5], kinds, 0.012, (0..4).map(block).collect()).expect("sizes that fit")
}

/// A disc or a bar somewhere on the sheet.
fn touch(seed: u64, cols: usize) -> DVector<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let scale = cols as f64 / 10.0;
    let (r, c) = (scale * rng.random_range(2.0..7.0), scale * rng.random_range(2.0..7.0));
    let (size, turn) = (scale * rng.random_range(1.5..3.5), rng.random_range(0.0..3.1));
    let long = if rng.random() { 1.0 } else { 3.0 };
    DVector::from_fn(cols * cols, |k, _| {
        let (y, x) = ((k / cols) as f64 - r, (k % cols) as f64 - c);
        let (along, across) = (x * f64::cos(turn) + y * f64::sin(turn), y * f64::cos(turn) - x * f64::sin(turn));
        let inside = (along / size).powi(2) + (across / (size / long)).powi(2) <= 1.0;
        if inside { rng.random_range(0.6..1.4) } else { 0.0 }
    })
}

criterion_group!(benches, decode, classify, fixed, unrolled);
criterion_main!(benches);
