//! The elastic contact fields: what they share with `winkler`, and where they must differ.

use super::{ElasticConfig, ElasticField};
use crate::columns::{FoamLaw, WinklerLayer};
use crate::mesh::{TriMesh, sphere};
use crate::{ContactField as _, PosedMesh};
use approx::assert_relative_eq;
use spts_models::SkinLayout;

fn field(config: ElasticConfig, bonded: bool) -> ElasticField {
    ElasticField::new(config, bonded, &SkinLayout::default()).unwrap()
}

fn plate(x: [f64; 2], y: [f64; 2]) -> TriMesh {
    TriMesh {
        vertices: vec![
            [x[0], y[0], 0.0],
            [x[1], y[0], 0.0],
            [x[1], y[1], 0.0],
            [x[0], y[1], 0.0],
        ],
        triangles: vec![[0, 2, 1], [0, 3, 2]],
    }
}

/// Under the middle of a plate 15 thicknesses from its rim a layer carries what independent columns carry, densified,
/// damped and in series with the body: exp(−15) = 3e-7 of the rim's effect is left, and the iteration's 1e-6 × 10.
#[test]
fn middle_of_a_wide_plate_is_winkler() {
    let config = ElasticConfig {
        thickness_m: 2e-3,
        ..ElasticConfig::default()
    };
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
        let body = PosedMesh {
            velocity_m_per_s: [0.0, 0.0, speed],
            ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -depth_m])
        };
        half.respond(&body).wrench.force_n[2]
    };
    let unit_n = force(1e-3, 0.0);
    assert!(unit_n > 1.0);
    assert_relative_eq!(force(2e-3, -1.0), 2.5 * unit_n, max_relative = 1e-5);
    assert_relative_eq!(force(1.0, 0.0), 1e3 * unit_n, max_relative = 1e-5);
    // lifted faster than it is deep: no tension
    assert!(force(1e-3, 3.0).abs() <= 0.0);
}

/// The torque is the pressure's moment about the centre of mass, recomputed here from the map.
#[test]
fn torque_is_the_moment_of_pressure() {
    let mesh = plate([-0.02, 0.03], [-0.015, 0.01]);
    let (s, c) = 0.02_f64.sin_cos();
    let body = PosedMesh {
        rotation: [[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]],
        ..PosedMesh::at_rest(&mesh, [0.013, -0.007, -1.5e-3])
    };
    for bonded in [true, false] {
        let mut skin = field(ElasticConfig::default(), bonded);
        let response = skin.respond(&body);
        let cell_m = 0.015 / 6.0;
        let (mut force, mut torque) = (0.0, [0.0; 2]);
        for (i, p) in response.pressure_pa.iter().enumerate() {
            let at = |k: usize| (f64::from(u32::try_from(k).unwrap()) - 29.5) * cell_m;
            let (x, y, f) = (at(i % 60), -at(i / 60), p * cell_m * cell_m);
            force += f;
            torque[0] += (y + 0.007) * f;
            torque[1] -= (x - 0.013) * f;
        }
        assert_relative_eq!(response.wrench.force_n[2], force, max_relative = 1e-12);
        assert_relative_eq!(response.wrench.torque_nm[0], torque[0], max_relative = 1e-9);
        assert_relative_eq!(response.wrench.torque_nm[1], torque[1], max_relative = 1e-9);
        assert!(force > 1.0);
    }
}

/// Not coupled: the dynamics see `winkler` bit for bit, frames an elastic map of the same force with the edges that
/// columns lack.
#[test]
fn refined_for_frames_only() {
    let config = ElasticConfig {
        coupled: false,
        ..ElasticConfig::default()
    };
    let mesh = plate([-0.03, 0.03], [-0.015, 0.015]);
    let ball = sphere(33.4e-3, 24, 48);
    for bonded in [true, false] {
        let mut skin = field(config, bonded);
        let mut winkler = WinklerLayer::new(config.winkler(), &SkinLayout::default()).unwrap();
        for (mesh, depth_m) in [(&mesh, 1e-3), (&mesh, 1.2e-3), (&ball, 3e-3), (&ball, 4e-3)] {
            let body = PosedMesh::at_rest(mesh, [0.003, -0.002, -depth_m]);
            let force_n = skin.respond(&body).wrench.force_n[2];
            assert_eq!(force_n.to_bits(), winkler.respond(&body).wrench.force_n[2].to_bits());
            let plain = winkler.respond(&body).pressure_pa.to_vec();
            let refined = skin.refine(&body, force_n).unwrap();
            let sum: f64 = refined.iter().sum::<f64>() * (0.015_f64 / 6.0).powi(2);
            assert_relative_eq!(sum, force_n, max_relative = 1e-12);
            let differ = refined
                .iter()
                .zip(&plain)
                .any(|(a, b)| (a - b).abs() > 0.05 * b.max(1e3));
            assert!(differ && refined.iter().all(|p| *p >= 0.0));
        }
        assert!(
            skin.refine(&PosedMesh::at_rest(&mesh, [0.0, 0.0, 1.0]), 0.0)
                .unwrap()
                .iter()
                .all(|p| *p <= 0.0)
        );
        assert!(skin.tolerance() <= 0.0);
    }
    assert!(
        field(ElasticConfig::default(), true)
            .refine(&PosedMesh::at_rest(&mesh, [0.0; 3]), 1.0)
            .is_none()
    );
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
            let worst = answer
                .iter()
                .zip(expected)
                .map(|(a, b)| (a - b).abs())
                .fold(0.0, f64::max);
            assert!(worst <= tolerance * highest, "step {step}: {worst} of {highest}");
        }
    }
}

/// Skins of one taxel and of one cell, wholly flooded, deep beyond the foam and fast: finite.
#[test]
fn smallest_and_flooded_skins() {
    let mesh = plate([-1.0, 1.0], [-1.0, 1.0]);
    let skin = SkinLayout::new(1, 1, 15e-3, 6e-3).unwrap();
    for cells_per_taxel in [1, 5] {
        for bonded in [true, false] {
            let config = ElasticConfig {
                cells_per_taxel,
                poisson: 0.45,
                ..ElasticConfig::default()
            };
            let mut small = ElasticField::new(config, bonded, &skin).unwrap();
            for depth_m in [1e-9, 1e-3, 1.0] {
                let body = PosedMesh {
                    velocity_m_per_s: [1.0, 0.0, -50.0],
                    ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -depth_m])
                };
                let response = small.respond(&body);
                assert!(response.pressure_pa.iter().all(|p| p.is_finite() && *p > 0.0));
                assert!(response.wrench.force_n[2].is_finite());
            }
        }
    }
}

#[test]
fn refuses_what_it_cannot_do() {
    let base = ElasticConfig::default();
    let cases = [
        (ElasticConfig { poisson: 0.5, ..base }, true, "poisson"),
        (
            ElasticConfig {
                poisson: f64::NAN,
                ..base
            },
            true,
            "poisson",
        ),
        (ElasticConfig { tolerance: 0.0, ..base }, false, "tolerance"),
        (
            ElasticConfig {
                densification: Some(true),
                ..base
            },
            false,
            "densification",
        ),
        (
            ElasticConfig {
                thickness_m: -1.0,
                ..base
            },
            true,
            "thickness_m",
        ),
    ];
    for (config, bonded, name) in cases {
        let error = ElasticField::new(config, bonded, &SkinLayout::default()).err().unwrap();
        assert!(error.to_string().contains(name), "{error}");
    }
    let wide = SkinLayout::new(1000, 1000, 1e-3, 5e-4).unwrap();
    let error = ElasticField::new(ElasticConfig::default(), true, &wide).err().unwrap();
    assert!(error.to_string().contains("2^20"), "{error}");
}

/// Nothing lies under the body: no depth gives the force, and the field says so until it has an answer again.
#[test]
fn a_frame_that_cannot_be_refined_says_why() {
    let config = ElasticConfig {
        coupled: false,
        ..ElasticConfig::default()
    };
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
    let config = ElasticConfig {
        coupled: false,
        ..ElasticConfig::default()
    };
    let mut layer = field(config, true);
    let mesh = sphere(20e-3, 24, 48);
    let body = PosedMesh {
        velocity_m_per_s: [0.0, 0.0, -1.0],
        ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -1e-3])
    };
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
