//! Speed of the operators that store no matrix. Criterion prints "elem/s": weights a second for ±1 weights, taxels a
//! second for shifted atoms; the dense product is the peer. `RAYON_NUM_THREADS=1` gives the speed of one core.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use spts_recon::Matrix;
use spts_recon::operator::{Atom, LinearOperator, ShiftedDictionary, SignGenerator, SignOperator};
use std::hint::black_box;

/// Both products of an operator.
fn products(c: &mut Criterion, name: &str, size: usize, elements: u64, a: &impl LinearOperator) {
    let (x, mut y) = (vec![0.5; a.ncols()], vec![0.0; a.nrows()]);
    let mut back = vec![0.0; a.ncols()];
    let mut group = c.benchmark_group(name);
    group.throughput(Throughput::Elements(elements)).sample_size(10);
    group.bench_function(BenchmarkId::new("apply", size), |b| {
        b.iter(|| a.apply(black_box(&x), &mut y))
    });
    group.bench_function(BenchmarkId::new("adjoint", size), |b| {
        b.iter(|| a.apply_adjoint(black_box(&y), &mut back));
    });
    group.finish();
}

fn operators(c: &mut Criterion) {
    let generator = SignGenerator::new(1_664_525, 1_013_904_223, 31).expect("bit 31 exists");
    for (n, m) in [(100_u32, 25), (10_000, 500), (230_400, 1_152)] {
        let seeds = (0..n).map(|k| k.wrapping_mul(0x85eb_ca6b)).collect();
        let signs = SignOperator::new(generator, seeds, 0, m);
        products(c, "signs", n as usize, u64::from(n) * m as u64, &signs);
    }
    let dense = Matrix::zeros(500, 10_000);
    products(c, "dense", 10_000, 5_000_000, &dense);
    let side = 480;
    let taxels = (side * side) as u64;
    let atoms = [1.0, 2.0, 4.0].map(Atom::cap);
    products(
        c,
        "shifted, 3 atoms",
        side,
        3 * taxels,
        &ShiftedDictionary::new(side, side, &atoms),
    );
}

criterion_group!(benches, operators);
criterion_main!(benches);
