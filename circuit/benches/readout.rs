//! Speed of the readout: measurements of 100 taxels a second.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use spts_circuit::{ConductanceSource, Constant, Interpolated, Mode, Profile, Readout};
use spts_models::{ConductanceMap, SkinLayout, Streams};
use std::hint::black_box;

/// A hundred frames.
const MEASUREMENTS: usize = 10_000;

fn map(scale: f64) -> ConductanceMap {
    let values = (0_u32..100).map(|k| if k % 4 == 0 { scale * f64::from(k) } else { 0.0 }).collect();
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

criterion_group!(benches, acquire);
criterion_main!(benches);
