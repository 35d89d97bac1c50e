//! Deciding by evidence, 17 classes and the unknown, and localising a blob: what is done before a sample arrives, and
//! after it.

use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_recon::classify::{EvidenceClassifier, Library, Posterior, TemplateModel};
use spts_recon::localise::{BlobConfig, Localiser};
use spts_recon::{AmplitudeRange, Matrix, SignTables};
use std::hint::black_box;

/// Rows and columns of the sheet.
const SIDE: usize = 10;

fn signs(rng: &mut ChaCha8Rng) -> Vec<f64> {
    (0..SIDE * SIDE)
        .map(|_| if rng.random::<bool>() { 1.0 } else { -1.0 })
        .collect()
}

fn classifier(rng: &mut ChaCha8Rng) -> EvidenceClassifier {
    let images = (0..SIDE * SIDE * 17)
        .map(|_| rng.random_range(0.0_f64..1.0).powi(4))
        .collect();
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
                Ok::<_, spts_recon::classify::EvidenceError>(classifier.decide(&preparation, &evidence, &mut posterior))
            });
        });
    }
    group.finish();
}

fn localise(c: &mut Criterion) {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let localiser = Localiser::new(&BlobConfig::new(SIDE, SIDE)).expect("valid parameters");
    let (mut evidence, mut projected) = (localiser.evidence(), Vec::new());
    let weights = signs(&mut rng);
    c.bench_function("blob/project a row", |b| {
        b.iter(|| localiser.project(black_box(&weights), &mut projected));
    });
    for _ in 0..10 {
        localiser
            .project(&signs(&mut rng), &mut projected)
            .expect("a row of the sheet");
        evidence
            .observe(&projected, rng.random_range(-1.0..1.0))
            .expect("a finite sample");
    }
    c.bench_function("blob/estimate", |b| b.iter(|| localiser.estimate(&mut evidence)));
}

criterion_group!(benches, evidence, localise);
criterion_main!(benches);
