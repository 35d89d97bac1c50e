//! Cost of one answer of each contact field: 60 × 60 cells, a sphere of 2208 triangles and a flat plate, pressed 3 mm
//! and 0.5 mm deep. `moving` turns a little at every call, `still` comes again with the same pose. `shape` is the cost
//! of one procedural shape of every family. `press` is a raw solution of the peers' problem on one thread (E = 150 kPa,
//! ν = 0.2, 20 N, 45 mm; Tamaas and aspher are raced on it by `scripts/oracles/speed.py`).

use criterion::{Criterion, criterion_group, criterion_main};
use spts_contact::mesh::{TriMesh, sphere};
use spts_contact::objects::by_name;
use spts_contact::shapes::{SHAPE_FAMILIES, ShapeRanges};
use spts_contact::{CONTACT_FIELDS, ElasticKernel, ElasticSolver, PosedMesh};
use spts_models::SkinLayout;
use std::hint::black_box;

fn respond(c: &mut Criterion) {
    let skin = SkinLayout::default();
    let plate = by_name("T").map_or_else(TriMesh::default, |o| (o.build)());
    let cases = [("sphere", sphere(33.4e-3, 24, 48), 3e-3), ("T", plate, 5e-4)];
    let mut group = c.benchmark_group("respond");
    for (name, build) in CONTACT_FIELDS {
        let Ok(mut field) = build(toml::Table::new(), &skin) else {
            continue;
        };
        for (mesh_name, mesh, depth_m) in &cases {
            let mut body = PosedMesh {
                velocity_m_per_s: [1e-4, 2e-4, -1e-3],
                angular_velocity_rad_per_s: [1e-3, 2e-3, -1e-3],
                ..PosedMesh::at_rest(mesh, [0.003, -0.002, -depth_m])
            };
            let label = |kind: &str| format!("{name}/{mesh_name}/{}/{kind}", mesh.triangles.len());
            group.bench_function(label("still"), |b| b.iter(|| field.respond(black_box(&body)).wrench));
            group.bench_function(label("moving"), |b| {
                b.iter(|| {
                    body.rotation[0][1] = if body.rotation[0][1] > 0.0 { 0.0 } else { 1e-9 };
                    field.respond(black_box(&body)).wrench
                });
            });
        }
    }
    group.finish();
}

fn shape(c: &mut Criterion) {
    let ranges = ShapeRanges::default();
    let mut group = c.benchmark_group("shape");
    for family in SHAPE_FAMILIES {
        // another shape at every call, as in a data set
        let mut seeds = (0..512).cycle();
        group.bench_function(family.name, |b| {
            b.iter(|| family.build(black_box(&ranges), seeds.next().unwrap_or(0)));
        });
    }
    group.finish();
}

const LENGTH_M: f64 = 0.045;

fn heights(cells: u32, height: impl Fn(f64) -> f64) -> Vec<f64> {
    let at = |i: u32| (f64::from(i) + 0.5 - 0.5 * f64::from(cells)) * LENGTH_M / f64::from(cells);
    (0..cells * cells).map(|i| height(at(i % cells).hypot(at(i / cells)))).collect()
}

fn elastic(c: &mut Criterion) {
    let (modulus_pa, poisson) = (150e3, 0.2);
    let layer = ElasticKernel::Layer { modulus_pa, poisson, thickness_m: 6e-3 };
    let kernels = [("half_space", ElasticKernel::HalfSpace { modulus_pa, poisson }), ("layer", layer)];
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

criterion_group!(benches, respond, shape, elastic);
criterion_main!(benches);
