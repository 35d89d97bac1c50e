//! Speed of the transducers, in steps of a whole skin.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use spts_models::{ConductanceMap, PressureMap, SkinLayout, Streams, TRANSDUCERS};
use std::hint::black_box;

/// Time between two frames, s.
const FRAME_S: f64 = 1e-3;
/// Frames after which a press repeats.
const FRAMES: u32 = 64;

/// A press that rises and falls on every fourth taxel.
fn press(skin: &SkinLayout) -> Vec<PressureMap> {
    let frame = |k: u32| {
        let peak_pa = 3e4 * (f64::from(k) / f64::from(FRAMES) * std::f64::consts::PI).sin();
        let values = (0..skin.taxels()).map(|t| if t % 4 == 0 { peak_pa } else { 0.0 });
        PressureMap::from_values(skin.rows(), skin.cols(), values.collect())
    };
    (0..FRAMES).map(frame).collect()
}

fn step(c: &mut Criterion) {
    for (name, build) in TRANSDUCERS {
        let mut group = c.benchmark_group(*name);
        for side in [10, 100] {
            let skin = SkinLayout::new(side, side, 15e-3, 10e-3).expect("the layout is valid");
            let mut transducer = build(Default::default(), &skin, Streams::new(1)).expect("the defaults are valid");
            let frames = press(&skin);
            let mut next = frames.iter().cycle();
            let mut out = ConductanceMap::zeros(side, side);
            group.throughput(Throughput::Elements(1));
            group.bench_function(BenchmarkId::new("step", skin.taxels()), |b| {
                b.iter(|| {
                    if let Some(frame) = next.next() {
                        transducer.step(black_box(frame), FRAME_S, &mut out);
                    }
                });
            });
        }
        group.finish();
    }
}

criterion_group!(benches, step);
criterion_main!(benches);
