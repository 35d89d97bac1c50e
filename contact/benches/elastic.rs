//! Cost of elastic contact on one thread: raw solutions of the peers' problem (E = 150 kPa, ν = 0.2, 20 N, 45 mm;
//! Tamaas and aspher are raced on it by `scripts/oracles/speed.py`), and the fields on 60 × 60 cells under the T, cold
//! and warm.

use criterion::{Criterion, criterion_group, criterion_main};
use spts_contact::mesh::TriMesh;
use spts_contact::objects::by_name;
use spts_contact::{ContactField as _, ElasticConfig, ElasticField, ElasticKernel, ElasticSolver, PosedMesh};
use spts_models::SkinLayout;
use std::hint::black_box;

const LENGTH_M: f64 = 0.045;

fn heights(cells: u32, height: impl Fn(f64) -> f64) -> Vec<f64> {
    let at = |i: u32| (f64::from(i) + 0.5 - 0.5 * f64::from(cells)) * LENGTH_M / f64::from(cells);
    (0..cells * cells)
        .map(|i| height(at(i % cells).hypot(at(i / cells))))
        .collect()
}

fn raw(c: &mut Criterion) {
    let (modulus_pa, poisson) = (150e3, 0.2);
    let kernels = [
        ("half_space", ElasticKernel::HalfSpace { modulus_pa, poisson }),
        (
            "layer",
            ElasticKernel::Layer {
                modulus_pa,
                poisson,
                thickness_m: 6e-3,
            },
        ),
    ];
    let mut group = c.benchmark_group("press");
    for (name, kernel) in kernels {
        for cells in [64_u32, 128, 256] {
            let sphere = heights(cells, |r| r * r / (2.0 * 33.4e-3));
            let punch = heights(cells, |r| if r <= 0.01 { 0.0 } else { f64::INFINITY });
            let n = cells as usize;
            let mut solver = ElasticSolver::new(kernel, [n, n], LENGTH_M / f64::from(cells));
            for (shape, height_m) in [("sphere", &sphere), ("punch", &punch)] {
                group.bench_function(format!("{name}/{shape}/{cells}"), |b| {
                    b.iter(|| solver.press(black_box(height_m), 20.0, 5e-7));
                });
            }
        }
    }
    group.finish();
}

fn fields(c: &mut Criterion) {
    let mesh = by_name("T").map_or_else(TriMesh::default, |o| (o.build)());
    let mut group = c.benchmark_group("T");
    for (name, bonded) in [("layer", true), ("half_space", false)] {
        let Ok(mut field) = ElasticField::new(ElasticConfig::default(), bonded, &SkinLayout::default()) else {
            continue;
        };
        let away = PosedMesh::at_rest(&mesh, [0.0, 0.0, 1.0]);
        group.bench_function(format!("{name}/cold"), |b| {
            b.iter(|| {
                field.respond(&away);
                field
                    .respond(black_box(&PosedMesh::at_rest(&mesh, [0.003, -0.002, -1e-3])))
                    .wrench
            });
        });
        let mut depth_m = 1e-3;
        group.bench_function(format!("{name}/warm"), |b| {
            b.iter(|| {
                depth_m = if depth_m > 1.01e-3 { 1e-3 } else { depth_m + 1e-7 };
                field
                    .respond(black_box(&PosedMesh::at_rest(&mesh, [0.003, -0.002, -depth_m])))
                    .wrench
            });
        });
    }
    group.finish();
}

criterion_group!(benches, raw, fields);
criterion_main!(benches);
