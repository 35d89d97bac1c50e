//! Speed of the emulated array on the cells' own firmware: 100 cells, 1000 edges, each mode; and of one cell alone, in
//! instructions a second of one core.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use spts_firmware::{Array, CellMode, Clock, Image};
use std::hint::black_box;

const EDGES: usize = 1000;

fn clocked(c: &mut Criterion) {
    for (cells, name) in [(1, "cell"), (100, "array")] {
        let mut group = c.benchmark_group(name);
        group.sample_size(20);
        for mode in [CellMode::Raster, CellMode::Analog, CellMode::Binary] {
            let mut array = Array::new(cells, &Image::shipped()).expect("one bus holds the cells");
            array.start(mode).expect("every cell answers");
            let mut codes = vec![0; cells * EDGES];
            let mut run = |array: &Array| {
                let mut array = array.clone();
                array.clock(Clock::default(), &mut codes).expect("the clock is in range");
                array.instructions()
            };
            let instructions = run(&array) - array.instructions();
            group.throughput(Throughput::Elements(instructions));
            group.bench_function(format!("{mode:?}, {EDGES} edges"), |b| {
                b.iter(|| black_box(run(black_box(&array))));
            });
        }
        group.finish();
    }
}

/// What a session starts with: seeds for 100 cells.
fn seeds(c: &mut Criterion) {
    let array = Array::new(100, &Image::shipped()).expect("one bus holds the cells");
    c.bench_function("array/start", |b| {
        b.iter(|| {
            let mut array = array.clone();
            array.start(CellMode::Binary).expect("every cell answers");
            black_box(array)
        });
    });
}

criterion_group!(benches, clocked, seeds);
criterion_main!(benches);
