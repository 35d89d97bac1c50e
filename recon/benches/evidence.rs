//! Deciding by evidence, 17 classes and the unknown, a mixture of shapes, and localising a blob: what is done before a
//! sample arrives, and after it.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{
    ClusterModel, Clusters, EvidenceClassifier, ImageEstimator, Library, Posterior, TemplateModel,
};
use spts_recon::localise::Localiser;
use spts_recon::{AmplitudeRange, Matrix, SignTables, Workspace};
use std::hint::black_box;

/// Rows and columns of the sheet.
const SIDE: usize = 10;

fn signs(rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..SIDE * SIDE).map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 }).collect()
}

fn classifier(rng: &mut ChaCha8Rng) -> EvidenceClassifier {
    let images = (0..SIDE * SIDE * 17).map(|_| rng.random_range(0.0_f64..1.0).powi(4)).collect();
    let images = Matrix::from_rows(SIDE * SIDE, 17, images).expect("the sizes fit");
    let library = Library::new(&images, &(0..17).collect::<Vec<_>>()).expect("a label an image");
    let model = TemplateModel::open(SIDE);
    let mut components = model.classes(&library).expect("valid parameters");
    components.push(model.unknown(&library).expect("valid parameters"));
    let amplitude = AmplitudeRange::new(0.2, 6.0).expect("a range");
    EvidenceClassifier::new(&components, amplitude, 0.01).expect("valid components")
}

fn evidence(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let classifier = classifier(&mut rng);
    let mut group = c.benchmark_group("evidence");
    for m in [7, 20] {
        let tables = SignTables::<f32>::new(classifier.bank().view());
        let signs: Vec<u64> = (0..m * tables.words()).map(|_| rng.random()).collect();
        let mut formed = vec![0.0; m * classifier.bank().ncols()];
        group.bench_function(BenchmarkId::new("form rows", m), |b| {
            b.iter(|| tables.fill_rows(black_box(&signs), &mut formed));
        });
        let rows = Matrix::from_rows(m, classifier.bank().ncols(), formed).expect("the sizes fit");
        let y: Vec<f64> = (0..m).map(|_| rng.random_range(-3.0..3.0)).collect();
        let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
        let mut posterior = Posterior::default();
        group.bench_function(BenchmarkId::new("prepare", m), |b| {
            b.iter(|| {
                preparation.clear();
                (0..m).try_for_each(|r| preparation.push(rows.row(r)))
            });
        });
        group.bench_function(BenchmarkId::new("samples to decision", m), |b| {
            b.iter(|| {
                evidence.clear();
                for y in black_box(&y) {
                    evidence.observe(&preparation, *y)?;
                }
                Ok::<_, spts_input::Refusal>(classifier.decide(&preparation, &evidence, &mut posterior))
            });
        });
    }
    group.finish();
}

fn localise(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let localiser = Localiser::new([SIDE, SIDE]).expect("valid parameters");
    let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
    let weights = signs(&mut rng);
    c.bench_function("blob/project a row", |b| {
        b.iter(|| localiser.project(black_box(&weights), &mut projected));
    });
    for _ in 0..10 {
        localiser.project(&signs(&mut rng), &mut projected).expect("a row of the sheet");
        evidence.observe(&projected, rng.random_range(-1.0..1.0)).expect("a finite sample");
    }
    c.bench_function("blob/estimate", |b| b.iter(|| localiser.estimate(&mut evidence)));
}

/// Images of rectangles anywhere on the sheet, taxels × images.
fn rectangles(rng: &mut ChaCha8Rng, count: usize) -> Matrix {
    let mut values = vec![0.0; SIDE * SIDE * count];
    for k in 0..count {
        let [top, left] = [(); 2].map(|()| rng.random_range(0..SIDE - 3));
        let [high, wide] = [(); 2].map(|()| rng.random_range(1..=3));
        for taxel in (top..top + high).flat_map(|row| (left..left + wide).map(move |col| row * SIDE + col)) {
            values[taxel * count + k] = 1.0;
        }
    }
    Matrix::from_rows(SIDE * SIDE, count, values).expect("the sizes fit")
}

/// Thirty clusters of shapes and a wide component, two of them solved with non-negative taxels: as the decoder
/// `mixture` of the board.
fn mixture(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let model = ClusterModel { clusters: 30, gain: 0.3, floor: 0.01, noise: 0.12, rank: 20 };
    let shapes = rectangles(&mut rng, 3000);
    let clusters = Clusters::with_wide(&model, &shapes, 0.99, &mut rng).expect("valid parameters");
    let amplitude = AmplitudeRange::new(0.05, 50.0).expect("a range");
    let classifier = EvidenceClassifier::new(&clusters.components, amplitude, 0.5).expect("valid components");
    let images = ImageEstimator::non_negative(clusters.priors, model.noise, 2).expect("valid priors");
    let mut group = c.benchmark_group("mixture");
    let m = 20;
    let phi: Vec<f64> = (0..m).flat_map(|_| signs(&mut rng)).collect();
    let phi = Matrix::from_rows(m, SIDE * SIDE, phi).expect("the sizes fit");
    let mut y: Vec<f64> = (0..m).map(|r| dot(phi.row(r), &shapes.column(7))).collect();
    y.iter_mut().for_each(|y| *y += rng.random_range(-0.3..0.3));
    let bank = classifier.bank();
    let rows: Vec<Vec<f64>> =
        (0..m).map(|r| (0..bank.ncols()).map(|k| dot(phi.row(r), &bank.column(k))).collect()).collect();
    let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
    group.bench_function("prepare/20", |b| {
        b.iter(|| {
            preparation.clear();
            rows.iter().try_for_each(|row| preparation.push(row))
        });
    });
    let (mut posterior, mut workspace) = (Posterior::default(), Workspace::default());
    let mut image = vec![0.0; SIDE * SIDE];
    group.bench_function("samples to image/20", |b| {
        b.iter(|| {
            evidence.clear();
            for y in black_box(&y) {
                evidence.observe(&preparation, *y).expect("a finite sample");
            }
            classifier.decide(&preparation, &evidence, &mut posterior);
            images.estimate(&posterior, phi.view(), &y, &mut workspace, &mut image)
        });
    });
    group.finish();
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

criterion_group!(benches, evidence, mixture, localise);
criterion_main!(benches);
