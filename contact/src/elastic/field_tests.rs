//! The elastic contact fields: what they share with `winkler`, and where they must differ.

use super::{ElasticConfig, ElasticField, ElasticKernel, ElasticSolver, Influence};
use crate::columns::WinklerLayer;
use crate::foam::FoamLaw;
use crate::mesh::{TriMesh, cuboid, sphere};
use crate::objects::OBJECTS;
use crate::{ContactField as _, Patch, PosedMesh, TaxelBins, build_contact};
use approx::assert_relative_eq;
use spts_models::SkinLayout;

fn field(config: ElasticConfig, bonded: bool) -> ElasticField {
    ElasticField::new(config, bonded, &SkinLayout::default()).unwrap()
}

/// Block over [x0, x1] × [y0, y1] that stands on z = 0.
fn plate(x: [f64; 2], y: [f64; 2]) -> TriMesh {
    let middle = [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), 0.0];
    cuboid([x[1] - x[0], y[1] - y[0], 10e-3]).translated(middle)
}

/// Under the middle of a plate 15 thicknesses from its rim a layer carries what independent columns carry, densified,
/// damped and in series with the body: exp(−15) = 3e-7 of the rim's effect is left, and the iteration's 1e-6 × 10.
#[test]
fn middle_of_a_wide_plate_is_winkler() {
    let config = ElasticConfig { thickness_m: 2e-3, ..ElasticConfig::default() };
    let mesh = plate([-0.045, 0.045], [-0.045, 0.045]);
    for (depth_m, speed, body) in [(2e-4, 0.0, f64::INFINITY), (1.5e-3, 0.0, 2e7), (1e-3, -0.4, 5e7)] {
        let posed = PosedMesh {
            velocity_m_per_s: [0.0, 0.0, speed],
            stiffness_pa_per_m: body,
            ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -depth_m])
        };
        let mut layer = field(config, true);
        let middle = layer.respond(&posed).pressure_pa[30 * 60 + 30];
        let law = FoamLaw::new(config.stiffness_pa_per_m, config.max_strain * 2e-3, body);
        let expected = law.pressure_pa(depth_m - config.damping_s * speed);
        assert_relative_eq!(middle, expected, max_relative = 2e-5);
    }
}

/// A linear half-space answers in proportion: with damping as δ + τv, and at any depth.
#[test]
fn half_space_is_linear() {
    let mesh = plate([-0.03, 0.03], [-0.015, 0.015]);
    let mut half = field(ElasticConfig::default(), false);
    let mut force = |depth_m: f64, speed: f64| {
        let body = PosedMesh { velocity_m_per_s: [0.0, 0.0, speed], ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -depth_m]) };
        half.respond(&body).wrench.force_n[2]
    };
    let unit_n = force(1e-3, 0.0);
    assert!(unit_n > 1.0);
    assert_relative_eq!(force(2e-3, -1.0), 2.5 * unit_n, max_relative = 1e-5);
    assert_relative_eq!(force(1.0, 0.0), 1e3 * unit_n, max_relative = 1e-5);
    // lifted faster than it is deep: no tension
    assert!(force(1e-3, 3.0).abs() <= 0.0);
}

/// Not coupled: the dynamics see `winkler` bit for bit, frames an elastic map of the same force with the edges that
/// columns lack.
#[test]
fn refined_for_frames_only() {
    let config = ElasticConfig { coupled: false, ..ElasticConfig::default() };
    let mesh = plate([-0.03, 0.03], [-0.015, 0.015]);
    let ball = sphere(33.4e-3, 24, 48);
    for bonded in [true, false] {
        let mut skin = field(config, bonded);
        let mut winkler = WinklerLayer::new(config.foam(), &SkinLayout::default()).unwrap();
        for (mesh, depth_m) in [(&mesh, 1e-3), (&mesh, 1.2e-3), (&ball, 3e-3), (&ball, 4e-3)] {
            let body = PosedMesh::at_rest(mesh, [0.003, -0.002, -depth_m]);
            let force_n = skin.respond(&body).wrench.force_n[2];
            assert_eq!(force_n.to_bits(), winkler.respond(&body).wrench.force_n[2].to_bits());
            let plain = winkler.respond(&body).pressure_pa.to_vec();
            let refined = skin.refine(&body, force_n).unwrap();
            let sum: f64 = refined.iter().sum::<f64>() * (0.015_f64 / 6.0).powi(2);
            assert_relative_eq!(sum, force_n, max_relative = 1e-12);
            let differ = refined.iter().zip(&plain).any(|(a, b)| (a - b).abs() > 0.05 * b.max(1e3));
            assert!(differ && refined.iter().all(|p| *p >= 0.0));
        }
        assert!(skin.refine(&PosedMesh::at_rest(&mesh, [0.0, 0.0, 1.0]), 0.0).unwrap().iter().all(|p| *p <= 0.0));
        assert!(skin.tolerance() <= 0.0);
    }
    assert!(field(ElasticConfig::default(), true).refine(&PosedMesh::at_rest(&mesh, [0.0; 3]), 1.0).is_none());
}

/// Along a press the answers from memory are those of a fresh field within the stated tolerance.
#[test]
fn tolerance_is_kept_along_a_press() {
    let ball = sphere(33.4e-3, 24, 48);
    let mesh = crate::objects::by_name("T").map(|o| (o.build)()).unwrap();
    for (mesh, bonded) in [(&ball, true), (&ball, false), (&mesh, true)] {
        let mut used = field(ElasticConfig::default(), bonded);
        for step in 1..=12 {
            let tilt = 1e-3 * f64::from(step);
            let body = PosedMesh {
                rotation: [[1.0, 0.0, tilt], [0.0, 1.0, 0.0], [-tilt, 0.0, 1.0]],
                ..PosedMesh::at_rest(mesh, [0.003, -0.002, -2.5e-4 * f64::from(step)])
            };
            let answer = used.respond(&body).pressure_pa.to_vec();
            let mut fresh = field(ElasticConfig::default(), bonded);
            let tolerance = fresh.tolerance();
            let expected = fresh.respond(&body).pressure_pa;
            let highest = expected.iter().copied().fold(0.0, f64::max);
            let worst = answer.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst <= tolerance * highest, "step {step}: {worst} of {highest}");
        }
    }
}

#[test]
fn refuses_what_it_cannot_do() {
    for (model, text, name) in [
        ("layer", "poisson = 0.5", "poisson"),
        ("layer", "poisson = nan", "poisson"),
        ("half_space", "tolerance = 0.0", "tolerance"),
        ("half_space", "densification = true", "densification"),
        ("layer", "thickness_m = -1.0", "thickness_m"),
    ] {
        let error = build_contact(model, toml::from_str(text).unwrap(), &SkinLayout::default());
        let said = error.err().unwrap().to_string();
        assert!(said.contains(&format!("`contact.{name}`")), "{said}");
    }
    let wide = SkinLayout::new(1000, 1000, 1e-3, 5e-4).unwrap();
    let error = ElasticField::new(ElasticConfig::default(), true, &wide).err().unwrap();
    assert!(error.to_string().contains("2^20"), "{error}");
}

/// A press that comes down slowly and goes up again: in every frame the taxels feel what they feel in it by itself,
/// within the 0.1 % of the middle of a ball (`forces::RATIO`), and four times as much for the rim of a contact that
/// grows cell by cell; its force is exact. A frame that moves, is moved aside or is of another surface stands for
/// itself: it differs by where the iteration starts alone.
#[test]
fn frames_between_two_forces() {
    let config = ElasticConfig { coupled: false, ..ElasticConfig::default() };
    let (ball, plate) = (sphere(33.4e-3, 24, 48), plate([-0.03, 0.03], [-0.015, 0.015]));
    let bins = TaxelBins::new(&SkinLayout::default(), config.cells_per_taxel);
    let mut layer = field(config, true);
    for mesh in [&ball, &plate] {
        for k in (8..60).chain((8..60).rev()) {
            let mut body = PosedMesh::at_rest(mesh, [0.003, -0.002, -5e-5 * f64::from(k)]);
            match k % 17 {
                5 => body.position_m[0] += 0.01,
                6 => body.stiffness_pa_per_m = 1e6,
                7 => body.velocity_m_per_s[2] = 1.0,
                _ => {}
            }
            let force_n = layer.respond(&PosedMesh { velocity_m_per_s: [0.0; 3], ..body }).wrench.force_n[2];
            let found = layer.refine(&body, force_n).unwrap().to_vec();
            let mut alone = field(config, true);
            let expected = alone.refine(&body, force_n).unwrap();
            let norm = |values: &mut dyn Iterator<Item = f64>| values.map(|v| v * v).sum::<f64>().sqrt();
            let [taxels, expected] = [&found, expected].map(|fine| bins.means(fine, None)[0].values().to_vec());
            let off = norm(&mut taxels.iter().zip(&expected).map(|(a, b)| a - b));
            let all = norm(&mut expected.iter().copied());
            let most = if (5..8).contains(&(k % 17)) { 1e-4 } else { 4e-3 };
            assert!(off < most * all, "{k}: {}", off / all);
            let sum: f64 = found.iter().sum::<f64>() * (0.015_f64 / 6.0).powi(2);
            assert_relative_eq!(sum, force_n, max_relative = 1e-12);
        }
    }
}

/// A body that grazes the skin, to the last bits of its height, has an answer: on the way down and from a deep pose.
#[test]
fn a_graze_has_an_answer() {
    let mut layer = field(ElasticConfig { cells_per_taxel: 3, ..ElasticConfig::default() }, true);
    for object in OBJECTS {
        let mesh = (object.build)();
        let body = PosedMesh { rotation: object.placement.matrix(), ..PosedMesh::at_rest(&mesh, [0.0; 3]) };
        let at = |z: f64| PosedMesh { position_m: [0.0, 0.0, z], ..body };
        let [low_m, _] = body.heights_m();
        let (mut apart, mut deep) = (-low_m, -low_m - 2e-3);
        for _ in 0..60 {
            let middle = 0.5 * (apart + deep);
            let force_n = layer.respond(&at(middle)).wrench.force_n[2];
            assert!(force_n >= 0.0, "{}: {force_n}", object.name);
            *if force_n > 0.0 { &mut deep } else { &mut apart } = middle;
        }
        assert!(layer.respond(&at(deep)).wrench.force_n[2] > 0.0, "{}", object.name);
    }
}

/// Nothing lies under the body: no depth gives the force, and the field says so until it has an answer again.
#[test]
fn a_frame_that_cannot_be_refined_says_why() {
    let config = ElasticConfig { coupled: false, ..ElasticConfig::default() };
    let mut layer = field(config, true);
    let mesh = sphere(20e-3, 24, 48);
    let body = PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3]);
    let beside = PosedMesh::at_rest(&mesh, [1.0, 0.0, -1e-3]);
    let force_n = layer.respond(&body).wrench.force_n[2];
    assert!(layer.refine(&beside, force_n).is_none());
    assert!(layer.failure().unwrap().contains("no depth found"));
    assert!(layer.refine(&body, force_n).is_some());
    assert_eq!(layer.failure(), None);
}

/// A falling ball is damped as soon as it touches a cell, so that the forces below the first cell's belong to no depth.
/// The search ends on either side of that jump, which is no failure; all larger forces are carried.
#[test]
fn a_jump_of_the_force_is_no_failure() {
    let config = ElasticConfig { coupled: false, ..ElasticConfig::default() };
    let mut layer = field(config, true);
    let mesh = sphere(20e-3, 24, 48);
    let body = PosedMesh { velocity_m_per_s: [0.0, 0.0, -1.0], ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3]) };
    let (mut jumps, mut carried) = (0, 0);
    for exponent in -10..=4 {
        if layer.refine(&body, 10_f64.powf(0.5 * f64::from(exponent))).is_some() {
            carried += 1;
        } else {
            jumps += 1;
        }
        assert_eq!(layer.failure(), None);
    }
    assert!(jumps > 0 && carried > 0, "{jumps} jumps, {carried} carried");
}

// Elastic fields on skins and under bodies at their extremes.

fn skin(rows: usize, cols: usize, pitch_m: f64) -> SkinLayout {
    SkinLayout::new(rows, cols, pitch_m, 0.5 * pitch_m).unwrap()
}

/// One cell a taxel.
fn coarse(thickness_m: f64, poisson: f64) -> ElasticConfig {
    ElasticConfig { cells_per_taxel: 1, thickness_m, poisson, ..ElasticConfig::default() }
}

/// The tightest tolerance is reached, at once and from memory, by a ball and by a flat shape's sharp edges, on 60 × 60
/// cells.
#[test]
fn tightest_tolerance() {
    let layout = SkinLayout::default();
    let (ball, plate) = (sphere(33.4e-3, 24, 48), cuboid([0.06, 0.03, 0.01]));
    for (bonded, poisson) in [(true, 0.2), (true, 0.49), (false, 0.2)] {
        let config = ElasticConfig { tolerance: 1e-12, poisson, ..ElasticConfig::default() };
        let mut field = ElasticField::new(config, bonded, &layout).unwrap();
        for mesh in [&ball, &plate] {
            for depth_m in [1e-3, 1.1e-3, 2e-3] {
                let body = PosedMesh::at_rest(mesh, [3e-3, -2e-3, -depth_m]);
                assert!(field.respond(&body).wrench.force_n[2] > 0.0);
            }
        }
    }
}

/// A wide plate over cells of 1000 thicknesses: each carries K δ (densification off), which is what wide cells are
/// independent columns for (the iteration's 1e-10 × 10); and at 20 thicknesses the sum of all coefficients still is
/// 1/K, the uniform layer's compliance (exp(−0.7 · 25) = 3e-8 is cut off).
#[test]
fn cells_wider_than_the_layer_are_columns() {
    let layout = skin(4, 6, 0.1);
    let config = ElasticConfig { densification: Some(false), tolerance: 1e-10, ..coarse(1e-4, 0.45) };
    let mut field = ElasticField::new(config, true, &layout).unwrap();
    let plate = cuboid([2.0, 2.0, 0.02]);
    let response = field.respond(&PosedMesh::at_rest(&plate, [0.0, 0.0, -1e-5]));
    let expected_pa = config.stiffness_pa_per_m * 1e-5;
    for p in response.pressure_pa {
        assert!((p - expected_pa).abs() <= 1e-9 * expected_pa, "{p} {expected_pa}");
    }
    for cell_m in [3e-3, 20e-3, 49e-3, 51e-3] {
        let kernel = ElasticKernel::Layer { modulus_pa: 1.0, poisson: 0.3, thickness_m: 1e-3 };
        let influence = Influence::new(&kernel, [12, 12], cell_m);
        let sides = |k: usize| if k == 0 { 1.0 } else { 2.0 };
        let sum: f64 = (0..144).map(|k| sides(k / 12) * sides(k % 12) * influence.at(k / 12, k % 12)).sum();
        let stiffness = super::confined_stiffness_pa_per_m(1.0, 0.3, 1e-3);
        assert!((sum * stiffness - 1.0).abs() < 1e-6, "{cell_m}: {}", sum * stiffness);
    }
}

/// 500 × 500 taxels of 0.1 m over 0.1 mm are built and answer; a finer grid than an elastic field can have is refused
/// by name.
#[test]
fn large_skins() {
    let layout = skin(500, 500, 0.1);
    let mut field = ElasticField::new(coarse(1e-4, 0.2), true, &layout).unwrap();
    let ball = sphere(0.3, 8, 12);
    let pressure_pa = field.respond(&PosedMesh::at_rest(&ball, [0.0, 0.0, -0.1])).pressure_pa;
    let loaded = pressure_pa.iter().filter(|p| **p > 0.0).count();
    assert!((1..100).contains(&loaded));
    for bonded in [true, false] {
        let config = ElasticConfig { cells_per_taxel: 3, ..coarse(1e-4, 0.2) };
        let error = ElasticField::new(config, bonded, &layout).err().unwrap().to_string();
        for part in ["rows × cols × contact.cells_per_taxel²", "2250000", "2^20"] {
            assert!(error.contains(part), "{error}");
        }
    }
}

/// What has no answer says so: NaN for the wrench, no pressure; and the next body is answered as by a fresh field.
#[test]
fn no_answer_is_nan() {
    let layout = SkinLayout::default();
    let ball = sphere(33.4e-3, 12, 16);
    let good = PosedMesh::at_rest(&ball, [0.0, 0.0, -2e-3]);
    let bad = PosedMesh { velocity_m_per_s: [0.0, 0.0, f64::NAN], ..good };
    let config = ElasticConfig { cells_per_taxel: 2, densification: Some(false), ..ElasticConfig::default() };
    let mut skin = ElasticField::new(config, true, &layout).unwrap();
    let expected_n = skin.respond(&good).wrench.force_n[2];
    assert!(expected_n > 0.0);
    assert!(skin.respond(&bad).pressure_pa.iter().all(|p| p.abs() <= 0.0));
    assert!(skin.carry(&bad, 1.0).is_none());
    let again_n = skin.respond(&good).wrench.force_n[2];
    assert_eq!(again_n.to_bits(), expected_n.to_bits());
    // no iteration reaches an error below 0
    let hopeless = ElasticConfig { tolerance: -1.0, ..config };
    let mut skin = ElasticField::unchecked(hopeless, true, &layout).unwrap();
    assert!(skin.respond(&good).wrench.force_n[2].is_nan());
    assert!(skin.carry(&good, 1.0).is_none());
    // a body beside the skin never carries anything
    let mut skin = ElasticField::new(config, true, &layout).unwrap();
    let beside = PosedMesh::at_rest(&ball, [1.0, 0.0, 0.0]);
    assert!(skin.carry(&beside, 1.0).is_none());
    assert!(skin.carry(&good, 1.0).is_some());
}

/// Input that carries nothing: zeros that have not converged, and no panic.
#[test]
fn nothing_to_press() {
    let kernel = ElasticKernel::HalfSpace { modulus_pa: 1e5, poisson: 0.2 };
    let mut solver = ElasticSolver::new(kernel, [3, 4], 1e-3);
    let patch = |rows, cols| Patch { rows: [0, rows], cols: [0, cols] };
    for height_m in [f64::INFINITY, f64::NAN] {
        let outcome = solver.press(&[height_m; 12], 1.0, 1e-6);
        assert!(!outcome.converged && solver.pressure_pa() == [0.0; 12]);
    }
    for force_n in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let outcome = solver.press(&[0.0; 12], force_n, 1e-6);
        assert!(!outcome.converged && solver.pressure_pa() == [0.0; 12]);
    }
    assert!(!solver.sink(patch(0, 0), &[], 1e-6).converged);
    assert!(!solver.sink(patch(4, 4), &[1e-3; 16], 1e-6).converged);
    assert_eq!(solver.pressure_pa(), [0.0; 16]);
    let free = solver.sink(patch(2, 2), &[f64::NEG_INFINITY; 4], 1e-6);
    assert!(free.converged && solver.pressure_pa() == [0.0; 4]);
    assert!(solver.sink(patch(3, 4), &[1e-3; 12], 1e-6).converged);
    let mut none = ElasticSolver::new(kernel, [0, 0], 1e-3);
    assert!(!none.press(&[], 1.0, 1e-6).converged);
}
