//! Presses without dynamics: the course they follow, and how far they are from the stepped ones.

use super::*;
use approx::assert_relative_eq;
use spts_contact::Frame;
use spts_contact::mesh::cuboid;
use spts_contact::objects::OBJECTS;
use std::path::Path;

fn scene(model: &str, object: &str) -> Mechanics {
    let text = format!("[contact]\nmodel = \"{model}\"\n[press]\nobject = \"{object}\"");
    Mechanics::from_toml(&text, Path::new("")).unwrap()
}

fn run(scene: &Mechanics, index: usize) -> Vec<Frame> {
    World::repeat(scene, index)
        .unwrap()
        .frames()
        .map(Result::unwrap)
        .collect()
}

/// All seventeen objects keep the course that the stepped presses were asked for, exactly on the plateau.
#[test]
fn presses_follow_the_course() {
    for (i, object) in OBJECTS.iter().enumerate() {
        let scene = scene("footprint", object.name);
        let press = scene.config().press.as_ref().unwrap();
        let frames = run(&scene, i % 10);
        assert_eq!(frames.len(), 778, "{}", object.name);
        let area_m2 = scene.skin().cell_area_m2();
        let course = PressCourse::of(&frames, press.force_n, press.plateau_s(), area_m2).unwrap();
        // the balance leaves 1e-12 of the force; sums in another order
        assert!(course.plateau_error_n < 1e-9, "{}: {course:?}", object.name);
        assert!(
            course.imbalance < 1e-9 && course.overshoot < 1e-9,
            "{}: {course:?}",
            object.name
        );
        // within a frame of what the ramps are made for
        assert!(
            (course.rise_s - press.rise_s).abs() < 4e-3,
            "{}: {course:?}",
            object.name
        );
        assert!(
            (course.fall_s - press.fall_s).abs() < 4e-3,
            "{}: {course:?}",
            object.name
        );
        assert!((course.onset_s - press.onset_s).abs() <= press.onset_spread_s + 2e-3);
        assert!(
            frames
                .iter()
                .filter(|f| f.time_s < 0.2 || f.time_s > 1.5)
                .all(|f| f.pressure.max() <= 0.0)
        );
        for frame in &frames {
            let q: f64 = frame.pose.quaternion.iter().map(|q| q * q).sum();
            assert_relative_eq!(q, 1.0, max_relative = 1e-12);
        }
    }
}

/// The same index is the same press: on the plateau the object stands where the stepped arm puts it (within a tenth of
/// how far it gives way sideways), and the taxels feel nearly the same. The rest is friction, and outlines that cross
/// the centres of cells: one of some hundred cells in contact, or 0.5 %.
#[test]
fn plateau_is_that_of_the_stepped_press() {
    for name in ["T", "tape", "tennis"] {
        let plateau = |model: &str| {
            let frames = run(&scene(model, name), 3);
            frames.into_iter().find(|f| f.time_s > 0.85).unwrap()
        };
        let (fast, slow) = (plateau("footprint"), plateau("winkler"));
        for i in 0..2 {
            let apart_m = (fast.pose.position_m[i] - slow.pose.position_m[i]).abs();
            assert!(apart_m < 2e-5, "{name}: {apart_m:e} m");
        }
        let pairs = fast.pressure.values().iter().zip(slow.pressure.values());
        let off: f64 = pairs.map(|(a, b)| (a - b).powi(2)).sum();
        let all: f64 = slow.pressure.values().iter().map(|b| b * b).sum();
        let rms = (off / all).sqrt();
        assert!(rms < 5e-3, "{name}: {rms}");
    }
}

#[test]
fn same_bits_in_any_order_and_repeats_differ() {
    let scene = scene("footprint", "smallT");
    let (b, a) = (run(&scene, 1), run(&scene, 0));
    assert_eq!(run(&scene, 0), a);
    assert_eq!(run(&scene, 1), b);
    assert_ne!(a, b);
}

/// A field that needs a force cannot stop a ball, and says so.
#[test]
fn drop_is_refused() {
    let error = Mechanics::from_toml("[contact]\nmodel = \"footprint\"\n[drop]", Path::new(""));
    let error = error.unwrap_err().to_string();
    assert_eq!(
        error,
        "`contact.model` = \"footprint\" needs a force and cannot stop a ball: use [press] instead of [drop], or another model"
    );
}

/// The joint angles asked for bring the object to where the frame says it is.
#[test]
fn joints_reach_the_pose() {
    let scene = scene("footprint", "X");
    let mut world = World::new(&scene).unwrap();
    assert_eq!(world.positions().len(), 6);
    for time_s in [0.1, 0.5, 0.85, 1.3] {
        let frame = world.frames().map(Result::unwrap).find(|f| f.time_s >= time_s).unwrap();
        let joints: [f64; 6] = world.positions().try_into().unwrap();
        let tool_m = model::tool_length_m(scene.mesh());
        let tip = ur5::flange(&joints) * nalgebra::Point3::new(0.0, 0.0, tool_m);
        for i in 0..3 {
            assert!(
                (tip[i] - frame.pose.position_m[i]).abs() < 1e-9,
                "{tip} {:?}",
                frame.pose
            );
        }
    }
}

/// A whole press of a plate whose origin is 0.1 m above its face: 0.5 N on the plateau and 5 mN at the touch, on a
/// stiff skin.
#[test]
fn press_of_a_body_with_a_far_origin() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = cuboid([0.085, 0.07, 0.01]).translated([0.0, 0.0, -0.1]);
    let mut text = String::new();
    for [x, y, z] in &mesh.vertices {
        text += &format!("v {x} {y} {z}\n");
    }
    for t in &mesh.triangles {
        text += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
    }
    std::fs::write(folder.path().join("plate.obj"), text).unwrap();
    for k in ["1.5e7", "1e9"] {
        let scene = format!(
            "[contact]\nmodel = \"footprint\"\nstiffness_pa_per_m = {k}\n[press]\nmesh = \"plate.obj\"\nforce_n = 0.5"
        );
        let scene = Mechanics::from_toml(&scene, folder.path()).unwrap();
        let lowest_m = scene.mesh().vertices.iter().map(|v| v[2]).fold(f64::INFINITY, f64::min);
        assert!((lowest_m + 0.1).abs() < 1e-6, "{lowest_m}");
        let frames: Vec<_> = World::new(&scene).unwrap().frames().map(Result::unwrap).collect();
        let most_n = frames.iter().map(|f| f.wrench.force_n[2]).fold(0.0, f64::max);
        assert_relative_eq!(most_n, 0.5, max_relative = 2e-12);
    }
}
