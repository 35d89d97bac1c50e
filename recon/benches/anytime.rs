//! What a sample costs while measurements come in: class and probability, image and expected IoU. The peer of the image
//! is the estimate of the whole window so far, computed anew, as it would be without rank-one updates.

use criterion::{Criterion, criterion_group, criterion_main};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{AnytimeClassifier, EvidenceClassifier, Library, TemplateModel};
use spts_recon::metrics::SUPPORT_THRESHOLD;
use spts_recon::recover::{Gaussian, Lmmse, Motion, Noise, SequentialEstimate, SequentialGains, TrackedImage};
use spts_recon::{AmplitudeRange, Matrix, Problem, Recover as _, Solution, Workspace};
use std::hint::black_box;
use std::sync::Arc;

/// Rows and columns of the sheet.
const SIDE: usize = 10;
/// Taxels.
const N: usize = SIDE * SIDE;
/// Samples of a window.
const M: usize = 20;

/// Signs of a row's weights, two words, and the weights.
fn row(rng: &mut ChaCha8Rng) -> (Vec<u64>, Vec<f64>) {
    let signs: Vec<u64> = (0..N.div_ceil(64)).map(|_| rng.random()).collect();
    let weight = |k: usize| if signs[k / 64] >> (k % 64) & 1 == 1 { 1.0 } else { -1.0 };
    let weights = (0..N).map(weight).collect();
    (signs, weights)
}

fn classes(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let images = (0..N * 17).map(|_| rng.random_range(0.0_f64..1.0).powi(4)).collect();
    let images = Matrix::from_rows(N, 17, images).expect("the sizes fit");
    let library = Library::new(&images, &(0..17).collect::<Vec<_>>()).expect("a label an image");
    let components = TemplateModel::new(SIDE).classes(&library).expect("valid parameters");
    let amplitude = AmplitudeRange::new(0.2, 6.0).expect("a range");
    let classifier = EvidenceClassifier::new(&components, amplitude, 0.01).expect("valid components");
    let mut stream = AnytimeClassifier::new(classifier);
    let rows: Vec<(Vec<u64>, Vec<f64>)> = (0..M).map(|_| row(&mut rng)).collect();
    c.bench_function(
        "anytime/class, a window of 20 samples with a decision after each",
        |b| {
            b.iter(|| {
                stream.clear();
                rows.iter()
                    .zip(0_u32..)
                    .try_for_each(|((signs, _), k)| stream.push(black_box(signs), f64::from(k % 5) - 2.0).map(drop))
            });
        },
    );
}

fn images(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let rows: Vec<Vec<f64>> = (0..M).map(|_| row(&mut rng).1).collect();
    let y: Vec<f64> = (0..M).map(|_| rng.random_range(-3.0..3.0)).collect();
    let covariance = {
        let mut covariance = Matrix::zeros(N, N);
        for i in 0..N {
            for j in 0..N {
                let (down, across) = ((i / SIDE).abs_diff(j / SIDE), (i % SIDE).abs_diff(j % SIDE));
                let nugget = if i == j { 0.05 } else { 0.0 };
                covariance.row_mut(i)[j] = (-0.25 * (down * down + across * across) as f64).exp() + nugget;
            }
        }
        covariance
    };
    let prior = Arc::new(Gaussian::new(vec![0.0; N], covariance).expect("positive definite"));
    let noise = Noise::Relative(0.12);
    let mut gains = SequentialGains::new(Arc::clone(&prior), noise).expect("a prior without a mean");
    let mut estimate = SequentialEstimate::new(&gains);
    let mut group = c.benchmark_group("anytime/image");
    group.bench_function("a window of 20 rows and samples", |b| {
        b.iter(|| {
            gains.clear();
            estimate.clear();
            for (row, y) in rows.iter().zip(&y) {
                gains.push(black_box(row)).expect("finite");
                estimate.observe(&gains, *y).expect("finite");
            }
        });
    });
    group.bench_function("a window of 20 samples, rows prepared", |b| {
        b.iter(|| {
            estimate.clear();
            for y in black_box(&y) {
                estimate.observe(&gains, *y).expect("finite");
            }
        });
    });
    group.bench_function("expected IoU", |b| {
        b.iter(|| black_box(&estimate).expected_iou(&gains, SUPPORT_THRESHOLD));
    });
    let motion = Motion {
        memory: 1286.0,
        strength_memory: 96.0,
        noise: 0.12,
        idle_noise: 0.1,
    };
    let mut tracked = TrackedImage::new(Arc::clone(&prior), motion).expect("a prior without a mean");
    let window = Matrix::from_rows(M, N, rows.concat()).expect("the sizes fit");
    group.bench_function("a window of 20 rows and samples, followed in time", |b| {
        b.iter(|| tracked.observe(20.0, black_box(window.view()), &y).expect("finite"));
    });
    let lmmse = Lmmse::new(prior, noise).expect("in range");
    let (mut work, mut solution) = (Workspace::default(), Solution::default());
    let windows: Vec<Matrix> = (1..=M)
        .map(|m| Matrix::from_rows(m, N, rows[..m].concat()).expect("the sizes fit"))
        .collect();
    group.bench_function("peer: 20 estimates of the window so far", |b| {
        b.iter(|| {
            for (window, m) in windows.iter().zip(1..) {
                let problem = Problem::new(window.view(), black_box(&y[..m])).expect("the sizes fit");
                lmmse.recover_into(&problem, &mut work, &mut solution).expect("finite");
            }
        });
    });
    group.finish();
}

criterion_group!(benches, classes, images);
criterion_main!(benches);
