//! Cost of one answer of each contact field: 60 × 60 cells, a sphere of 2208 triangles and a flat plate, pressed 3 mm and
//! 0.5 mm deep; and of whole presses against bare MuJoCo steps. `moving` turns a little at every call, `still` comes again with the same pose.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mujoco_rs::prelude::{MjData, MjModel};
use spts_models::SkinLayout;
use spts_sim::contact::{CONTACT_FIELDS, PosedMesh};
use spts_sim::mesh::{TriMesh, sphere};
use spts_sim::objects::by_name;
use spts_sim::scene::Scene;
use spts_sim::world::{World, mjcf};
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

/// The whole press of the T, world and all, and the bare MuJoCo steps of the same model holding the joint angles that the arm
/// had in that press. Throughput is in steps, of which a press has 3110.
fn press(c: &mut Criterion) {
    let Ok(scene) = Scene::press("T") else {
        return;
    };
    let steps = (scene.duration_s() / scene.timestep_s()).round();
    let mut poses = Vec::new();
    if let Ok(mut world) = World::new(&scene) {
        while matches!({ world.frames().next() }, Some(Ok(_))) {
            poses.push(world.positions());
        }
    }
    let mut group = c.benchmark_group("press");
    #[expect(clippy::cast_possible_truncation, reason = "a few thousand steps")]
    group.throughput(Throughput::Elements(steps as u64 + 1));
    group.sample_size(10);
    if let Ok(model) = MjModel::from_xml_string(&mjcf(&scene)) {
        let model = Box::new(model);
        group.bench_function("bare", |b| {
            let mut data = MjData::new(&*model);
            b.iter(|| {
                data.reset();
                data.qpos_mut().copy_from_slice(&poses[0]);
                for pose in &poses {
                    data.ctrl_mut().copy_from_slice(pose);
                    for _ in 0..4 {
                        data.step();
                    }
                }
            });
        });
    }
    group.bench_function("winkler", |b| {
        b.iter(|| World::new(&scene).map(|mut world| world.frames().count()));
    });
    let quick = Scene::from_toml("contact.model = \"footprint\"\n[press]\nobject = \"T\"", "".as_ref());
    if let Ok(scene) = quick {
        group.bench_function("footprint", |b| {
            b.iter(|| World::new(&scene).map(|mut world| world.frames().count()));
        });
    }
    group.finish();
}

criterion_group!(benches, respond, press);
criterion_main!(benches);
