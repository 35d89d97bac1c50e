//! Presses whatever is pressed how hard, up to the largest step that a scene allows.

use super::read;
use spts_contact::Frame;
use spts_sim::World;
use spts_sim::world::PressCourse;

/// The arm holds 1 to 60 N within 0.1 N and overshoots by less than 5 %, whatever it presses.
#[test]
fn presses_settle_at_any_force() {
    for object in ["T", "brain", "tape", "eraser", "gel"] {
        for force_n in [1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0] {
            let scene = read(&format!("[press]\nobject = \"{object}\"\nforce_n = {force_n}")).unwrap();
            let frames: Vec<Frame> = World::new(&scene).unwrap().frames().map(Result::unwrap).collect();
            let plateau_s = scene.config().press.as_ref().unwrap().plateau_s();
            let course = PressCourse::of(&frames, force_n, plateau_s, scene.skin().cell_area_m2()).unwrap();
            let told = format!("{object} {force_n} N: {course:?}");
            assert!(course.plateau_error_n < 0.1 && course.overshoot < 0.05, "{told}");
            // sums of at most 3600 positive numbers in two orders
            assert!(course.imbalance < 1e-9, "{told}");
        }
    }
}

/// A hard plate and a tilted one, pressed with the largest step: as with a quarter of it. The force on a plateau is
/// held to 0.1 N, or to what a tilted plate that still turns on its mount leaves, with either step.
#[test]
fn presses_settle_at_the_limit() {
    for text in [
        "[contact]\nstiffness_pa_per_m = 1e9\n[press]\nobject = \"rec\"\nforce_n = 20.0",
        "[contact]\nstiffness_pa_per_m = 1e9\ndamping_s = 0.02\n[press]\nobject = \"rec\"\nforce_n = 20.0",
        "[press]\nobject = \"T\"\nforce_n = 60.0\ntilt_deg = [30.0, 0.0]",
        "[contact]\nstiffness_pa_per_m = 1e9\n[press]\nobject = \"rec\"\nforce_n = 60.0\ntilt_deg = [10.0, 5.0]",
    ] {
        let limit_s = read(&format!("timestep_s = \"auto\"\n{text}")).unwrap().step_limit_s();
        let course = |step_s: f64| {
            let scene = read(&format!("timestep_s = {step_s:e}\n{text}")).unwrap();
            let frames: Vec<Frame> = World::new(&scene).unwrap().frames().map(Result::unwrap).collect();
            let press = scene.config().press.as_ref().unwrap();
            let area_m2 = scene.skin().cell_area_m2();
            PressCourse::of(&frames, press.force_n, press.plateau_s(), area_m2).unwrap()
        };
        let (largest, fine) = (course(limit_s), course(0.25 * limit_s));
        let close = (largest.plateau_error_n - fine.plateau_error_n).abs() < 0.05;
        assert!(largest.plateau_error_n < 0.1 || close, "{text}: {largest:?}, {fine:?}");
        assert!(largest.overshoot < 0.05, "{text}: {largest:?}");
    }
}
