//! Speed of the readout and of the weights: measurements of 100 taxels a second, and weights a second.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use spts_circuit::{
    ConductanceSource, Constant, Interpolated, Jump, Mode, Profile, Readout, Seeding, WeightMode, Weights,
};
use spts_models::{ConductanceMap, SkinLayout, Streams};
use std::hint::black_box;

/// A hundred frames.
const MEASUREMENTS: usize = 10_000;
const TAXELS: usize = 100;

fn map(scale: f64) -> ConductanceMap {
    let values = (0_u32..100)
        .map(|k| if k % 4 == 0 { scale * f64::from(k) } else { 0.0 })
        .collect();
    ConductanceMap::from_values(10, 10, values)
}

/// One map a millisecond, as a simulated press has: about 64 measurements each.
fn press() -> Interpolated {
    let times_s = (0_u32..1000).map(|k| f64::from(k) * 1e-3).collect();
    let maps = (0_u32..1000).map(|k| map(1e-9 * f64::from(k))).collect();
    Interpolated::new(times_s, maps).expect("times increase")
}

fn acquire(c: &mut Criterion) {
    let mut group = c.benchmark_group("acquire");
    group.throughput(Throughput::Elements(MEASUREMENTS as u64));
    let mut run = |name: &str, mode: Mode, skin: &str, source: &mut dyn ConductanceSource| {
        let profile = Profile::named(name).expect("the profile is in the table");
        let mut readout =
            Readout::new(&profile, mode, &SkinLayout::default(), Streams::new(1), 0).expect("the profile is valid");
        group.bench_function(BenchmarkId::new(name, format!("{mode:?}/{skin}")), |b| {
            b.iter(|| readout.acquire(source, black_box(MEASUREMENTS)).expect("whole frames"));
        });
    };
    let mut held = Constant::new(map(1e-6)).expect("conductance within range");
    for name in ["ideal", "as_built", "as_published", "as_designed"] {
        for mode in [Mode::Compressive, Mode::Raster] {
            run(name, mode, "press", &mut press());
        }
    }
    run("ideal", Mode::Compressive, "constant", &mut held);
    group.finish();
}

fn weights(c: &mut Criterion) {
    let mut group = c.benchmark_group("weights");
    group.throughput(Throughput::Elements((MEASUREMENTS * TAXELS) as u64));
    let mut rows = vec![0.0; MEASUREMENTS * TAXELS];
    let mut bits = vec![0; MEASUREMENTS * TAXELS.div_ceil(64)];
    let mut sums = vec![0.0; MEASUREMENTS];
    let values = map(1e-6).values().to_vec();
    for mode in [WeightMode::Binary, WeightMode::Analog] {
        let weights = Weights::new(mode, Seeding::Address, 100);
        group.bench_function(BenchmarkId::new("sums", format!("{mode:?}")), |b| {
            b.iter(|| weights.weighted_sums(black_box(123_456_789), &values, &mut sums));
        });
        group.bench_function(BenchmarkId::new("fill_rows", format!("{mode:?}")), |b| {
            b.iter(|| weights.fill_rows(black_box(123_456_789), &mut rows));
        });
    }
    let weights = Weights::new(WeightMode::Binary, Seeding::Address, 100);
    group.bench_function("sign_bits", |b| {
        b.iter(|| weights.sign_bits(black_box(123_456_789), &mut bits));
    });
    group.finish();
}

fn jumps(c: &mut Criterion) {
    let mut group = c.benchmark_group("jump");
    for steps in [1_u64 << 8, 1 << 16, (1 << 32) - 1] {
        group.bench_function(BenchmarkId::from_parameter(steps), |b| {
            b.iter(|| Jump::new(black_box(steps)));
        });
    }
    group.finish();
}

criterion_group!(benches, acquire, weights, jumps);
criterion_main!(benches);
