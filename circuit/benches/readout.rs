//! Speed of the readout and of the weights, in measurements of 100 taxels.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use spts_circuit::{Interpolated, Mode, Profile, Readout, Seeding, WeightMode, Weights};
use spts_models::{ConductanceMap, Streams};
use std::hint::black_box;

/// Ten frames.
const MEASUREMENTS: usize = 1000;

fn press() -> Interpolated {
    let map = |scale: f64| {
        let values = (0_u32..100)
            .map(|k| if k % 4 == 0 { scale * f64::from(k) } else { 0.0 })
            .collect();
        ConductanceMap::from_values(10, 10, values)
    };
    let times_s = (0_u32..1000).map(|k| f64::from(k) * 1e-3);
    let maps = (0_u32..1000).map(|k| map(1e-9 * f64::from(k))).collect();
    Interpolated::new(times_s.collect(), maps).expect("times increase")
}

fn acquire(c: &mut Criterion) {
    let mut group = c.benchmark_group("acquire");
    group.throughput(Throughput::Elements(MEASUREMENTS as u64));
    for name in ["ideal", "as_built", "as_published"] {
        for mode in [Mode::Compressive, Mode::Raster] {
            let profile = Profile::named(name).expect("the profile is in the table");
            let mut readout = Readout::new(&profile, mode, 100, Streams::new(1)).expect("the profile is valid");
            let mut press = press();
            group.bench_function(BenchmarkId::new(name, format!("{mode:?}")), |b| {
                b.iter(|| {
                    readout
                        .acquire(&mut press, black_box(MEASUREMENTS))
                        .expect("whole frames")
                });
            });
        }
    }
    group.finish();
}

fn rows(c: &mut Criterion) {
    let mut group = c.benchmark_group("fill_rows");
    group.throughput(Throughput::Elements(MEASUREMENTS as u64));
    let mut out = vec![0.0; MEASUREMENTS * 100];
    for mode in [WeightMode::Binary, WeightMode::Analog] {
        let weights = Weights::new(mode, Seeding::Address, 100);
        group.bench_function(format!("{mode:?}"), |b| {
            b.iter(|| weights.fill_rows(black_box(123_456_789), &mut out))
        });
    }
    group.finish();
}

criterion_group!(benches, acquire, rows);
criterion_main!(benches);
