//! Presses and bounces against what was recorded on the real skin, and against conservation laws.

use super::*;
use approx::assert_relative_eq;
use mujoco_rs::prelude::{MjData, MjtObjBase};
use spts_contact::objects::OBJECTS;
use spts_contact::{ContactField, PosedMesh, Response};
use spts_models::SkinLayout;
use std::path::Path;

fn cell_area_m2() -> f64 {
    SkinLayout::default().cell_area_m2()
}

fn run(scene: &Mechanics, index: usize) -> Vec<Frame> {
    let mut world = World::repeat(scene, index).unwrap();
    world.frames().collect::<Result<_, _>>().unwrap()
}

/// All seventeen objects: balance of force in every frame, plateau, rise, overshoot, lift and fall as recorded. A press
/// without dynamics keeps the course that is asked for, exactly on the plateau.
#[test]
fn presses_follow_the_recorded_course() {
    for (i, object) in OBJECTS.iter().enumerate() {
        for model in ["winkler", "footprint"] {
            let text = format!("contact.model = \"{model}\"\n[press]\nobject = \"{}\"", object.name);
            let scene = Mechanics::from_toml(&text, Path::new("")).unwrap();
            let press = scene.config().press.as_ref().unwrap();
            let frames = run(&scene, i % 10);
            assert_eq!(frames.len(), 778, "{text}");
            let course = PressCourse::of(&frames, 20.0, press.plateau_s(), cell_area_m2()).unwrap();
            let told = format!("{text}: {course:?}");
            // sums of at most 3600 positive numbers in two orders
            assert!(course.imbalance < 1e-9, "{told}");
            if model == "footprint" {
                // the balance leaves 1e-12 of the force; ramps are within a frame of what they are made for
                assert!(course.plateau_error_n < 1e-9 && course.overshoot < 1e-9, "{told}");
                assert!((course.rise_s - press.rise_s).abs() < 4e-3, "{told}");
                assert!((course.fall_s - press.fall_s).abs() < 4e-3, "{told}");
                assert!((course.onset_s - press.onset_s).abs() <= press.onset_spread_s + 2e-3);
            }
            assert!(course.plateau_error_n < 0.1 && course.overshoot < 0.05, "{told}");
            assert!((0.2..=0.3).contains(&course.rise_s), "{told}");
            assert!((1.03..1.18).contains(&course.lift_s), "{told}");
            assert!((0.11..0.17).contains(&course.fall_s), "{told}");
            // idle before and after
            let mut idle = frames.iter().filter(|f| f.time_s < 0.2 || f.time_s > 1.5);
            assert!(idle.all(|f| f.pressure.max() <= 0.0));
            assert!(frames.iter().flat_map(|f| f.pressure.values()).all(|p| *p >= 0.0));
            let norm = |f: &Frame| f.pose.quaternion.iter().map(|q| q * q).sum::<f64>();
            assert!(frames.iter().all(|f| (norm(f) - 1.0).abs() < 1e-12));
        }
    }
}

/// The plateau is steady for other courses too: fast, slow, and both onset and lift far from their mean.
#[test]
fn plateau_is_steady_for_any_course() {
    for text in [
        "rise_s = 0.1\nlift_s = 0.74\nforce_n = 40.0",
        "rise_s = 0.6\nlift_s = 1.6\nduration_s = 2.2\nforce_n = 5.0",
        "onset_s = 0.5\nonset_spread_s = 0.25\nlift_s = 1.6\nlift_spread_s = 0.2\nduration_s = 2.2",
    ] {
        let text = format!("[press]\nobject = \"eraser\"\n{text}");
        let scene = Mechanics::from_toml(&text, Path::new("")).unwrap();
        let press = scene.config().press.as_ref().unwrap();
        for index in 0..4 {
            let frames = run(&scene, index);
            let course = PressCourse::of(&frames, press.force_n, press.plateau_s(), cell_area_m2()).unwrap();
            // half a percent, as 0.1 N of 20 N in the default course
            assert!(course.plateau_error_n < 5e-3 * press.force_n, "{text}: {course:?}");
        }
    }
}

#[test]
fn frames_come_at_their_interval_and_end() {
    let scene = Mechanics::press("X").unwrap();
    let mut world = World::new(&scene).unwrap();
    let frames: Vec<_> = world.frames().map(Result::unwrap).collect();
    for (i, frame) in (0_u32..).zip(&frames) {
        assert_relative_eq!(frame.time_s, f64::from(i) * 2e-3, epsilon = 1e-9);
    }
    assert_eq!(frames.len(), 778);
    assert!(world.frames().next().is_none());
}

/// 8.3 ± 0.5 ms of contact, restitution 0.65–0.78, and the energy lost is the work done on the foam. Gravity acts on
/// the updated velocity while potential energy uses the position: an error of g dt Δv / v² = 6e-4 of the kinetic
/// energy.
#[test]
fn ball_bounces_as_recorded() {
    let scene = Mechanics::bounce().unwrap();
    for drop in 0..3 {
        let mut world = World::repeat(&scene, drop).unwrap();
        let frames: Vec<_> = world.frames().collect::<Result<_, _>>().unwrap();
        let bounces = world.bounces();
        assert!(bounces.len() >= 2, "{bounces:?}");
        let first = bounces[0];
        assert!((7.8e-3..=8.8e-3).contains(&first.contact_s), "{first:?}");
        // v = √(2 g h), less what the last step before the touch is short of
        assert_relative_eq!(first.speed_in_m_per_s, 3.132, max_relative = 2e-3);
        for bounce in bounces {
            assert!((0.65..=0.80).contains(&bounce.restitution()), "{bounce:?}");
            let kinetic_j = 0.5 * 57.7e-3 * bounce.speed_in_m_per_s.powi(2);
            assert!((bounce.lost_j - bounce.work_j).abs() < 3e-3 * kinetic_j, "{bounce:?}");
        }
        assert!(first.restitution() <= 0.78);
        for pair in frames.windows(2) {
            let step_s = pair[1].time_s - pair[0].time_s;
            let touching = pair.iter().any(|f| f.wrench.force_n[2] > 0.0);
            assert!(step_s <= if touching { 2e-4 } else { 2e-3 } + 1e-9, "{step_s}");
        }
        for frame in &frames {
            assert!(frame.imbalance(cell_area_m2()) <= 1e-9);
            assert_eq!(frame.wrench.force_n[2] > 0.0, frame.pressure.max() > 0.0);
        }
    }
}

/// Restitution does not depend on the step: the damping is the foam's, not the integrator's.
#[test]
fn restitution_converges() {
    let at = |step_s: f64| {
        let text = format!(
            "timestep_s = {step_s:e}\nframe_interval_s = 2e-4\n[drop]\nduration_s = 0.6\nrelease_spread_s = 0.0"
        );
        let scene = Mechanics::from_toml(&text, Path::new("")).unwrap();
        let mut world = World::new(&scene).unwrap();
        assert!(world.frames().all(|f| f.is_ok()));
        world.bounces()[0].restitution()
    };
    let (coarse, fine) = (at(2e-4), at(2.5e-5));
    assert_relative_eq!(coarse, fine, epsilon = 0.01);
}

/// The limit of the step is safe, and within a factor of three of what is not: a drop on undamped foam, for which the
/// exact limit of a linear spring is twice ours, keeps its energy at 1.5 times the limit and is thrown back at three
/// times.
#[test]
fn limit_of_the_step_is_safe_and_not_needlessly_small() {
    for (stiffness, mass_kg, height_m, thickness_m) in [(1e9, 2e-3, 0.5, 6e-3), (1e9, 57.7e-3, 5.0, 10.0)] {
        let text = format!(
            "[contact]\nstiffness_pa_per_m = {stiffness:e}\ndamping_s = 0.0\nthickness_m = {thickness_m:e}\n[drop]\n\
             mass_kg = {mass_kg:e}\nheight_m = {height_m}\nstiffness_pa_per_m = 1e12\nrelease_s = 0.0\n\
             release_spread_s = 0.0\nduration_s = 1.1"
        );
        let read = |step: &str| Mechanics::from_toml(&format!("timestep_s = {step}\n{text}"), Path::new(""));
        assert!(read("1.0").is_err());
        let base = read("\"auto\"").unwrap();
        let limit_s = base.step_limit_s();
        let restitution = |share: f64| {
            let mut world = World::new(&base.clone().with_step(share * limit_s)).unwrap();
            assert!(world.frames().all(|f| f.is_ok()));
            world.bounces()[0].restitution()
        };
        // 1/√(1 − (ω dt)²/4) at ω dt = 1.5, were the spring linear, is 1.5; a sphere's grows from nothing
        assert!(restitution(1.0) < 1.02 && restitution(1.5) < 1.5, "{text}");
        assert!(restitution(3.0) > 1.5, "{text}");
    }
}

#[test]
fn same_bits_in_any_thread_and_order() {
    let mut scenes = vec![Mechanics::bounce().unwrap()];
    scenes.push(Mechanics::from_toml("seed = 5\n[press]\nobject = \"smallT\"", Path::new("")).unwrap());
    for scene in &scenes {
        let here = [run(scene, 0), run(scene, 1)];
        let there = std::thread::scope(|threads| {
            let handles = [1, 0].map(|index| threads.spawn(move || run(scene, index)));
            handles.map(|handle| handle.join().unwrap())
        });
        assert_eq!(here[0], there[1]);
        assert_eq!(here[1], there[0]);
        assert_ne!(here[0], here[1], "repeats should differ by their jitter");
    }
    let other = Mechanics::from_toml("seed = 6\n[press]\nobject = \"smallT\"", Path::new("")).unwrap();
    assert_ne!(run(&scenes[1], 0), run(&other, 0));
}

/// MuJoCo's kinematics of the model equal the Denavit–Hartenberg product; the object hangs where it should.
#[test]
fn model_kinematics_equal_dh() {
    let scene = Mechanics::press("T").unwrap();
    let model = model::compile(&scene, None).unwrap();
    let id = model.name_to_id(MjtObjBase::mjOBJ_BODY, "flange").unwrap();
    let mut data = MjData::new(Box::new(model));
    for k in 0..50_u32 {
        let joints: [f64; 6] =
            std::array::from_fn(|i| (f64::from(k) * 0.37 + f64::from(u32::try_from(i).unwrap())).sin() * 3.0);
        data.qpos_mut().copy_from_slice(&joints);
        data.forward();
        let expected = arm::flange(&joints);
        let position = nalgebra::Vector3::from(data.xpos()[id]);
        assert!((position - expected.translation.vector).norm() < 1e-12);
        let matrix = nalgebra::Matrix3::from_row_slice(&data.xmat()[id]);
        assert!((matrix - expected.rotation.to_rotation_matrix().matrix()).abs().max() < 1e-12);
    }
}

#[test]
fn bad_worlds() {
    let scene = Mechanics::press("T").unwrap();
    let error = World::repeat(&scene, 10).unwrap_err().to_string();
    assert_eq!(error, "press 10 is outside [0, 10)");
    let far = "[skin]\nrows = 400\ncols = 400\n[contact]\ncells_per_taxel = 1\n[press]\nobject = \"rec\"\nrow = 0.0\ncol = 390.0";
    let far = Mechanics::from_toml(far, Path::new("")).unwrap();
    assert!(World::new(&far).unwrap_err().to_string().contains("the arm cannot reach"));
}

/// The rotors at the tool weigh at least what the time step's limit counts on, wherever the skin is pressed.
#[test]
fn arm_is_heavier_than_assumed() {
    let tool = nalgebra::Isometry3::from_parts(
        nalgebra::Translation3::new(0.0, 0.0, 0.05),
        nalgebra::UnitQuaternion::from_axis_angle(&nalgebra::Vector3::x_axis(), std::f64::consts::PI),
    );
    for (x, y) in [(0.0, 0.0), (0.07, 0.07), (-0.07, 0.07), (0.07, -0.07), (-0.07, -0.07)] {
        let goal = nalgebra::Isometry3::translation(x, y, 0.0) * tool.inverse();
        let joints = arm::solve(&goal, &arm::HOME_RAD).unwrap();
        let jacobian = arm::jacobian(&joints, &tool.translation.vector);
        let row = jacobian.row(2);
        let mobility: f64 = row.iter().zip(&arm::LINKS).map(|(j, link)| j * j / link.rotor_kg_m2).sum();
        assert!(1.0 / mobility > crate::mechanics::ARM_MASS_KG, "{}", 1.0 / mobility);
    }
}

/// Whether this machine has what draws without a graphics card: the EGL dispatcher and Mesa behind it.
fn mesa_is_installed() -> bool {
    let folders = ["/usr/lib", "/usr/lib64", "/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu"];
    let has = |file: &str| folders.iter().any(|folder| Path::new(folder).join(file).exists());
    has("libEGL.so.1") && has("libEGL_mesa.so.0")
}

/// A picture has the size asked for and is not of one colour, and the pads show the pressure. Only a machine without
/// EGL may answer with an error, which tells the renderer's own reason.
#[test]
fn picture_or_clear_error() {
    use crate::render::{Camera, Renderer};
    let scene = Mechanics::press("X").unwrap();
    let mut world = World::new(&scene).unwrap();
    let frame = world.frames().find(|f| f.as_ref().unwrap().time_s > 0.8).unwrap().unwrap();
    let too_small = Renderer::new(&world, 0, 10).unwrap_err().to_string();
    assert_eq!(too_small, "picture of 0 × 10 is outside [1, 8192] pixels a side");
    let full_pa = frame.pressure.max();
    let mut renderer = Renderer::new(&world, 160, 120).unwrap();
    match renderer.draw(&world, Camera::Close, Some((&frame, full_pa))) {
        Ok(picture) => {
            assert_eq!(picture.rgb.len(), 160 * 120 * 3);
            assert!(picture.rgb.iter().any(|v| *v != picture.rgb[0]));
            let idle = renderer.draw(&world, Camera::Close, None).unwrap();
            assert_ne!(picture.rgb, idle.rgb);
        }
        Err(error) => {
            assert!(error.to_string().starts_with("off-screen rendering failed: "), "{error}");
            assert!(!mesa_is_installed(), "EGL is there, and yet: {error}");
        }
    }
}

/// A field that answers the dynamics but no frame.
struct Unrefined(Box<dyn ContactField>);

impl ContactField for Unrefined {
    fn respond(&mut self, body: &PosedMesh<'_>) -> Response<'_> {
        self.0.respond(body)
    }

    fn failure(&self) -> Option<String> {
        Some("no depth found".to_owned())
    }

    fn cells_per_taxel(&self) -> usize {
        self.0.cells_per_taxel()
    }

    fn parameters(&self) -> toml::Table {
        self.0.parameters()
    }

    fn damping_s(&self) -> f64 {
        self.0.damping_s()
    }

    fn thickness_m(&self) -> f64 {
        self.0.thickness_m()
    }
}

/// A frame never shows another map than the scene asks for.
#[test]
fn a_frame_without_its_pressure_stops_the_world() {
    let scene = Mechanics::press("T").unwrap();
    let field = Box::new(Unrefined(scene.build_contact().unwrap()));
    let error = Dynamics::new(&scene, 0, field).unwrap().advance().unwrap_err();
    assert!(error.to_string().ends_with(": no depth found"), "{error}");
}
