//! Cost of whole presses against bare MuJoCo steps.

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use mujoco_rs::prelude::{MjData, MjModel};
use spts_sim::mechanics::Mechanics;
use spts_sim::world::{World, mjcf};

/// The whole press of the T, world and all, and the bare MuJoCo steps of the same model holding the joint angles that
/// the arm had in that press. Throughput is in steps, of which a press has 3110.
fn press(c: &mut Criterion) {
    let Ok(scene) = Mechanics::press("T") else {
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
    let quick = Mechanics::from_toml("contact.model = \"footprint\"\n[press]\nobject = \"T\"", "".as_ref());
    if let Ok(scene) = quick {
        group.bench_function("footprint", |b| {
            b.iter(|| World::new(&scene).map(|mut world| world.frames().count()));
        });
    }
    group.finish();
}

criterion_group!(benches, press);
criterion_main!(benches);
