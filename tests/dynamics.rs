//! Drops (and, below, presses) against conservation laws and closed forms, up to the largest step that a scene allows.

use crate::command::{files, spts, succeeds};
use spts_contact::Frame;
use spts_input::Refusal;
use spts_sim::World;
use spts_sim::mechanics::Mechanics;
use spts_sim::world::Bounce;
use std::path::Path;

mod presses;
mod rim;

const GRAVITY_M_PER_S2: f64 = 9.806_65;
/// Radius of the ball where a drop names none, m.
const BALL_RADIUS_M: f64 = 33.4e-3;

fn read(text: &str) -> Result<Mechanics, Refusal> {
    Mechanics::from_toml(text, Path::new(""))
}

/// A drop released at once.
#[derive(Debug, Clone, Copy)]
struct Drop {
    model: &'static str,
    cells_per_taxel: usize,
    /// Taxels along a side of the skin.
    taxels: usize,
    mass_kg: f64,
    height_m: f64,
    stiffness_pa_per_m: f64,
    damping_s: f64,
    /// Surface of the ball, Pa/m.
    ball_pa_per_m: f64,
    thickness_m: f64,
}

/// A rigid ball on the default foam.
const RIGID: Drop = Drop {
    model: "winkler",
    cells_per_taxel: 6,
    taxels: 10,
    mass_kg: 57.7e-3,
    height_m: 0.5,
    stiffness_pa_per_m: 1.5e7,
    damping_s: 0.5e-3,
    ball_pa_per_m: 1e12,
    thickness_m: 6e-3,
};

impl Drop {
    /// Long enough to land and leave again.
    fn text(&self, step: &str) -> String {
        let fall_s = (2.0 * self.height_m / GRAVITY_M_PER_S2).sqrt();
        format!(
            "timestep_s = {step}\n[skin]\nrows = {taxels}\ncols = {taxels}\n[contact]\nmodel = \"{}\"\ncells_per_taxel = {}\nstiffness_pa_per_m = {:e}\n\
             damping_s = {:e}\nthickness_m = {:e}\n[drop]\nmass_kg = {:e}\nheight_m = {:e}\nstiffness_pa_per_m = {:e}\nrelease_s = 0.0\n\
             release_spread_s = 0.0\nduration_s = {:e}",
            self.model,
            self.cells_per_taxel,
            self.stiffness_pa_per_m,
            self.damping_s,
            self.thickness_m,
            self.mass_kg,
            self.height_m,
            self.ball_pa_per_m,
            fall_s + 0.06,
            taxels = self.taxels,
        )
    }

    /// Largest step, s, or why there is none.
    fn limit_s(&self) -> Result<f64, Refusal> {
        Ok(read(&self.text("\"auto\""))?.step_limit_s())
    }

    fn run(&self, step_s: f64) -> (Vec<Bounce>, Vec<Frame>) {
        let scene = read(&self.text(&format!("{step_s:e}"))).unwrap();
        let mut world = World::new(&scene).unwrap();
        let frames: Result<_, _> = world.frames().collect();
        (world.bounces().to_vec(), frames.unwrap())
    }
}

/// Checks of one drop with steps of `share` × the limit: its bounces and frames.
///
/// Energy: stepped with the velocity first, each step changes the energy by the work of the contact plus
/// m g dt (v′ − v)/2, since the weight's work is taken at the new velocity and its potential at the new height. Summed
/// over a contact, lost − work = −m g dt (out + in)/2, exactly; round-off of 1e4 steps of numbers near the energy
/// itself is 1e-12 of it, and times are differences of numbers 1e5 times larger: 1e-10 is allowed.
///
/// Restitution: inside a linear contact the step conserves v²/2 + ω²x²/2 − ω² dt x v/2, which differs from v²/2 at the
/// first and last instant, less than a step from the surface, by at most (ω dt)²/4 of it. So e² ≤ 1/(1 − (ω dt)²/4),
/// and the limit is ω dt = 1 at the stiffest point: an undamped explicit step may gain up to that. The weight's own
/// error adds as above. With damping there is no need of either: what a step gains must stay below what the foam takes.
///
/// Height: with the speed of a fall from `height_m` and up to a step's way more, e² of it and up to a step's way more
/// are reached again; with damping the release itself is not.
fn check(drop: &Drop, step_s: f64, share: f64) -> (Vec<Bounce>, Vec<Frame>) {
    let (bounces, frames) = drop.run(step_s);
    let gain = 1.0 / (1.0 - 0.25 * share * share);
    let mut highest_m = drop.height_m;
    for bounce in &bounces {
        let (v_in, v_out) = (bounce.speed_in_m_per_s, bounce.speed_out_m_per_s);
        let kinetic_j = 0.5 * drop.mass_kg * v_in * v_in;
        let told = format!("{drop:?} at {step_s:e} s: {bounce:?}");
        let drift_j = 0.5 * drop.mass_kg * GRAVITY_M_PER_S2 * step_s * (v_in + v_out);
        let scale_j = kinetic_j + drop.mass_kg * GRAVITY_M_PER_S2 * 0.2;
        assert!((bounce.lost_j - bounce.work_j + drift_j).abs() <= 1e-10 * scale_j, "{told}");
        assert!(bounce.peak_force_n > 0.0 && v_in > 0.0 && v_out > 0.0, "{told}");
        let allowed = if drop.damping_s > 0.0 { 1.0 } else { gain.sqrt() + drift_j / kinetic_j };
        assert!(bounce.restitution() <= allowed, "{told}");
        if drop.damping_s <= 0.0 {
            // each bounce may gain on the one before
            highest_m = allowed * allowed * (highest_m + v_in * step_s) + v_out * step_s;
        }
        // a drop that rests has no last bounce; one that leaves has lost, or gained no more than above
        assert!(bounce.lost_j >= -(gain - 1.0) * kinetic_j - drift_j, "{told}");
    }
    let told = format!("{drop:?} at {step_s:e} s");
    let touch = frames.iter().position(|frame| frame.wrench.force_n[2] > 0.0);
    let touch = touch.unwrap_or_else(|| panic!("{told} does not touch"));
    for (i, frame) in frames.iter().enumerate() {
        assert!(frame.pressure.values().iter().all(|p| p.is_finite() && *p >= 0.0));
        // nothing pushes it sideways
        let [x, y, z] = frame.pose.position_m;
        assert!(x.hypot(y) < 0.01 && z.is_finite(), "{told} drifts to {x} {y} {z}");
        let lowest_m = z - BALL_RADIUS_M;
        assert!(i < touch || lowest_m < highest_m, "{told} bounces to {lowest_m} m");
    }
    (bounces, frames)
}

/// Ball of 2 g to 50 kg, 1 cm to 5 m, 1e5 to 1e9 Pa/m, with and without damping, hard and soft, at the limit and at a
/// quarter of it. What the foam cannot carry is refused with what it can.
#[test]
fn energy_never_grows() {
    let mut carried = 0;
    for ball_pa_per_m in [2e7, 1e12] {
        for stiffness_pa_per_m in [1e5, 1.5e7, 1e9] {
            for mass_kg in [2e-3, 57.7e-3, 50.0] {
                for height_m in [0.01, 0.5, 5.0] {
                    for damping_s in [0.0, 0.5e-3] {
                        let drop = Drop { mass_kg, height_m, stiffness_pa_per_m, damping_s, ball_pa_per_m, ..RIGID };
                        match drop.limit_s() {
                            Ok(limit_s) => {
                                let (bounces, _) = check(&drop, limit_s, 1.0);
                                if height_m < 1.0 {
                                    check(&drop, 0.25 * limit_s, 0.25);
                                }
                                // 50 kg stay in the foam for longer than the 60 ms that are run
                                assert!(!bounces.is_empty() || mass_kg > 1.0, "{drop:?} does not bounce");
                                carried += 1;
                            }
                            // too much for the foam, or so stiff that no step resolves it
                            Err(told) => {
                                let told = told.to_string();
                                let most = ["absorbs at most", "would be flattened"];
                                let heavy = mass_kg > 1.0 && most.iter().any(|most| told.contains(most));
                                assert!(heavy || told.contains("no valid `timestep_s`"), "{drop:?}: {told}");
                            }
                        }
                    }
                }
            }
        }
    }
    // of 108; most of the others are 50 kg from 0.5 m and more, which the foam does not carry or which flatten the ball
    assert!(carried >= 86, "{carried}");
}

/// The same at 10 µs, whatever the limit allows; and at the limit on the elastic fields, whose columns pull at each
/// other: the step and its limit know the force and its slope only. Undamped, the step may gain what [`check`] argues;
/// damped, nothing.
#[test]
fn energy_never_grows_with_short_steps_nor_on_elastic_fields() {
    let short = [(2e-3, 0.01, 1e5), (57.7e-3, 0.05, 1.5e7), (50.0, 0.05, 1e9), (2e-3, 0.01, 1e9), (1.0, 0.2, 1e7)];
    let on =
        |case: (f64, f64, f64), drop| Drop { mass_kg: case.0, height_m: case.1, stiffness_pa_per_m: case.2, ..drop };
    let mut cases: Vec<(Drop, Option<f64>)> = short.map(|case| (on(case, RIGID), Some(1e-5))).to_vec();
    for model in ["layer", "half_space"] {
        for case in [(57.7e-3, 0.5, 1.5e7), (2e-3, 0.01, 1e9), (1.0, 0.1, 1e8)] {
            for damping_s in [0.0, 0.5e-3] {
                let field = Drop { model, cells_per_taxel: 4, taxels: 4, damping_s, ..RIGID };
                cases.push((on(case, field), None));
            }
        }
    }
    for (drop, step_s) in cases {
        let limit_s = drop.limit_s().unwrap();
        let step_s = step_s.unwrap_or(limit_s);
        let (bounces, _) = check(&drop, step_s, step_s / limit_s);
        assert!(!bounces.is_empty(), "{drop:?} does not bounce");
    }
}

/// Strong damping at the limit: no step throws the ball back. It stays in the foam, which then carries its weight, or
/// leaves with less than e⁻² of its speed, which is what a critically damped spring leaves when its force ends (x = v t
/// e^(−ω t) has none at ω t = 2, where ẋ = −v e⁻²), and more damping leaves less.
#[test]
fn strong_damping_never_throws_back() {
    for (mass_kg, height_m, stiffness_pa_per_m, damping_s, leaves) in [
        (57.7e-3, 0.5, 1.5e7, 0.02, false),
        (57.7e-3, 5.0, 1.5e7, 5e-3, true),
        (2e-3, 0.5, 1e9, 2e-3, true),
        (50.0, 0.5, 1e9, 0.02, false),
        (57.7e-3, 0.01, 1e9, 0.02, false),
    ] {
        let drop = Drop { mass_kg, height_m, stiffness_pa_per_m, damping_s, ..RIGID };
        let limit_s = drop.limit_s().unwrap();
        let (bounces, frames) = check(&drop, limit_s, 1.0);
        assert_eq!(!bounces.is_empty(), leaves, "{drop:?}: {bounces:?}");
        for bounce in bounces {
            assert!(bounce.restitution() < (-2.0_f64).exp(), "{drop:?}: {bounce:?}");
        }
        if !leaves {
            // it creeps back from at most 6 mm with the damping time τ, three of which have passed: ẍ < e⁻³ 6 mm/τ² =
            // 0.08 g
            let weights = frames.last().unwrap().wrench.force_n[2] / (mass_kg * GRAVITY_M_PER_S2);
            assert!((0.9..1.1).contains(&weights), "{drop:?}: {weights} of its weight");
        }
    }
}

/// A rigid sphere on linear springs, F = π K R δ²: from ½ m v² = π K R δ_m³/3 the deepest point is δ_m = (3 m v²/(2 π K
/// R))^⅓ and the contact lasts T = 2 ∫ dδ/(v √(1 − (δ/δ_m)³)) = ⅔ B(⅓, ½) δ_m/v.
///
/// B(⅓, ½) = Γ(⅓) Γ(½)/Γ(5/6) = 2.678939 · 1.772454/1.128787 = 4.206546.
///
/// T and the peak force go with (K R)^∓⅓, so that a relative error of the force, of one sign and nowhere above ε, moves
/// them by at most ε/3. ε: the sphere against its parabola, δ_m/3R, and the weight against the peak force. Besides: two
/// instants known to a step, and facets up to 1e-3 R inside the sphere, of δ_m.
#[test]
fn contact_time_of_a_sphere() {
    const BETA: f64 = 4.206_546;
    for (mass_kg, height_m, stiffness_pa_per_m) in
        [(57.7e-3, 0.5, 1.5e7), (57.7e-3, 2.0, 1e8), (57.7e-3, 0.5, 1e8), (1.0, 0.5, 1e8), (5e-3, 0.5, 3e6)]
    {
        let drop = Drop { mass_kg, height_m, stiffness_pa_per_m, damping_s: 0.0, thickness_m: 10.0, ..RIGID };
        let step_s = 2e-5;
        let (bounces, _) = drop.run(step_s);
        let bounce = bounces[0];
        let v = bounce.speed_in_m_per_s;
        let spring = std::f64::consts::PI * stiffness_pa_per_m * BALL_RADIUS_M;
        let deepest_m = (1.5 * mass_kg * v * v / spring).cbrt();
        let expected_s = 2.0 / 3.0 * BETA * deepest_m / v;
        let tolerance = 2.0 * step_s / expected_s
            + 1e-3 * BALL_RADIUS_M / deepest_m
            + deepest_m / (9.0 * BALL_RADIUS_M)
            + mass_kg * GRAVITY_M_PER_S2 / (3.0 * spring * deepest_m * deepest_m);
        let error = bounce.contact_s / expected_s - 1.0;
        assert!(error.abs() < tolerance && tolerance < 0.05, "{drop:?}: {error:.4}, {tolerance:.4}");
        // and the peak force, π K R δ_m² = 3 m v²/(2 δ_m)
        let peak_error = bounce.peak_force_n / (spring * deepest_m * deepest_m) - 1.0;
        assert!(peak_error.abs() < tolerance, "{drop:?}: {peak_error:.4}, {tolerance:.4}");
    }
}

/// More damping, less rebound.
#[test]
fn restitution_falls_with_damping() {
    let mut last = f64::INFINITY;
    for damping_s in [0.0, 1e-4, 2.5e-4, 5e-4, 1e-3, 2e-3] {
        let drop = Drop { damping_s, ..RIGID };
        let (bounces, _) = drop.run(drop.limit_s().unwrap().min(2e-5));
        let restitution = bounces[0].restitution();
        assert!(restitution < last, "{damping_s}: {restitution} after {last}");
        last = restitution;
    }
    assert!(last < 0.3, "{last}");
}

/// On the command line: what `auto` came to is written down and gives the same bytes again; other words are refused.
#[test]
fn timestep_option() {
    let dir = tempfile::tempdir().unwrap();
    let base = ["simulate", "bounce", "--height", "0.05", "--no-record"];
    let run = |more: &[&str]| succeeds(dir.path(), &[&base[..], more].concat());
    run(&["--timestep", "auto", "--out", "auto"]);
    let scene = std::fs::read_to_string(dir.path().join("auto/scene.toml")).unwrap();
    assert!(scene.contains("timestep_s = 0.0001\n"), "{scene}");
    run(&["--timestep", "5e-5", "--out", "half"]);
    succeeds(dir.path(), &["simulate", "auto/scene.toml", "--no-record", "--out", "again"]);
    let [auto, again, half] = ["auto", "again", "half"].map(|name| files(&dir.path().join(name)));
    for name in ["scene.toml", "frames.csv", "pressure_pa_000.npy", "summary.json"] {
        assert!(auto[name] == again[name], "{name} differs");
    }
    assert!(auto["frames.csv"] != half["frames.csv"]);
    for (word, facts) in [
        ("fast", &["--timestep", "fast", "\"auto\""][..]),
        ("nan", &["timestep_s", "NaN", "[1e-6"]),
        ("-1", &["timestep_s", "-1", "[1e-6"]),
        ("0.5", &["timestep_s", "0.5", "outside [1e-6, "]),
    ] {
        let output = spts(dir.path(), &[&base[..], &["--timestep", word]].concat());
        let said = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(facts.iter().all(|fact| said.contains(fact)), "{said}");
    }
}
