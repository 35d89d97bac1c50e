//! A body on foam that is compressed already.

use super::foam::FoamLaw;
use super::{Footprint, WinklerConfig, WinklerLayer};
use crate::body::PosedMesh;
use crate::field::ContactField;
use crate::mesh::cuboid;
use crate::quasi_static::{Holder, Load};
use approx::assert_relative_eq;
use spts_models::SkinLayout;

const FLAT_M: f64 = 40e-3;

fn strains(of: impl Fn(usize) -> f64) -> Vec<f64> {
    (0..100).map(of).collect()
}

/// The law of the foam under a rigid body.
fn law(c: &WinklerConfig) -> FoamLaw {
    FoamLaw::new(c.stiffness_pa_per_m, c.max_strain * c.thickness_m, f64::INFINITY)
}

/// The rest pressure is the foam's law at the strain, K h ε / (1 − ε/ε_max) as long as the solid in series gives way by
/// little: its share is p/(50 K) of ε h, 2.4 % at ε = 0.1 and less below.
#[test]
fn rest_pressure_is_the_foams_law_at_the_strain() {
    let config = WinklerConfig::default();
    let mut layer = WinklerLayer::new(config, &SkinLayout::default()).unwrap();
    let strain = strains(|k| 1e-3 * k as f64);
    let rest_pa = layer.preload(&strain).unwrap();
    for (strain, rest_pa) in strain.iter().zip(&rest_pa) {
        assert_relative_eq!(*rest_pa, law(&config).pressure_pa(strain * config.thickness_m));
        let modulus_pa = config.stiffness_pa_per_m * config.thickness_m;
        let closed_pa = modulus_pa * strain / (1.0 - strain / config.max_strain);
        assert_relative_eq!(*rest_pa, closed_pa, max_relative = 0.025);
    }
}

/// A rigid flat body that sinks in by d adds f(ε h + d) − f(ε h) on every cell: more than on fresh foam, since the law
/// stiffens. To the rounding of a difference of two numbers ten times as large.
#[test]
fn a_body_adds_what_the_stiffened_foam_gives() {
    let config = WinklerConfig::default();
    let mesh = cuboid([FLAT_M, FLAT_M, 5e-3]);
    let low_m = mesh.bounds().unwrap().0[2];
    let depth_m = 0.8e-3;
    let body = PosedMesh::at_rest(&mesh, [0.0, 0.0, -low_m - depth_m]);
    let force_n = |strain: f64| {
        let mut layer = WinklerLayer::new(config, &SkinLayout::default()).unwrap();
        layer.preload(&strains(|_| strain)).unwrap();
        layer.respond(&body).wrench.force_n[2]
    };
    let fresh_n = WinklerLayer::new(config, &SkinLayout::default())
        .unwrap()
        .respond(&body)
        .wrench
        .force_n[2];
    let area_m2 = fresh_n / law(&config).pressure_pa(depth_m);
    for strain in [0.02, 0.08, 0.3] {
        let start_m = strain * config.thickness_m;
        let added_pa = law(&config).pressure_pa(start_m + depth_m) - law(&config).pressure_pa(start_m);
        assert_relative_eq!(force_n(strain), added_pa * area_m2, max_relative = 1e-11);
        assert!(force_n(strain) > fresh_n);
    }
}

/// A soft surface in series gives way to what is added alone: δ = d_foam + (p − p₀)/K_b.
#[test]
fn a_soft_body_gives_way_to_what_is_added() {
    let config = WinklerConfig::default();
    let mesh = cuboid([FLAT_M, FLAT_M, 5e-3]);
    let low_m = mesh.bounds().unwrap().0[2];
    let (strain, depth_m, body_pa_per_m) = (0.1, 1e-3, 2e7);
    let mut layer = WinklerLayer::new(config, &SkinLayout::default()).unwrap();
    let rest_pa = layer.preload(&strains(|_| strain)).unwrap()[0];
    let body = PosedMesh {
        stiffness_pa_per_m: body_pa_per_m,
        ..PosedMesh::at_rest(&mesh, [0.0, 0.0, -low_m - depth_m])
    };
    let answer = layer.respond(&body);
    let added_pa = answer.pressure_pa.iter().copied().fold(0.0, f64::max);
    let foam_m = depth_m - added_pa / body_pa_per_m;
    let expected_pa = law(&config).pressure_pa(strain * config.thickness_m + foam_m);
    assert_relative_eq!(rest_pa + added_pa, expected_pa, max_relative = 1e-11);
}

/// A preload of nothing changes no bit, of either field.
#[test]
fn no_preload_is_the_flat_skin() {
    let mesh = cuboid([FLAT_M, 25e-3, 5e-3]);
    let low_m = mesh.bounds().unwrap().0[2];
    let body = PosedMesh::at_rest(&mesh, [3e-3, -2e-3, -low_m - 1e-3]);
    let load = Load {
        force_n: 9.0,
        axis_m: [3e-3, -2e-3],
        holder: Holder::Rigid,
        from: None,
    };
    let skin = SkinLayout::default();
    let answers = |preloaded: bool| {
        let mut layer = WinklerLayer::new(WinklerConfig::default(), &skin).unwrap();
        let mut footprint = Footprint::new(WinklerConfig::default(), &skin).unwrap();
        if preloaded {
            for field in [&mut layer as &mut dyn ContactField, &mut footprint] {
                assert_eq!(field.preload(&[0.0; 100]), Some(vec![0.0; 100]));
            }
        }
        let stepped = layer.respond(&body).pressure_pa.to_vec();
        let balanced = footprint.quasi_static().unwrap().carry(&body, &load).unwrap();
        (stepped, balanced.response.pressure_pa.to_vec())
    };
    assert_eq!(answers(true), answers(false));
}

/// A balanced body on uneven preload carries its force by what it adds.
#[test]
fn a_balance_on_uneven_preload_carries_the_force() {
    let skin = SkinLayout::default();
    let mesh = cuboid([FLAT_M, FLAT_M, 5e-3]);
    let mut field = Footprint::new(WinklerConfig::default(), &skin).unwrap();
    field
        .preload(&strains(|k| if k % 3 == 0 { 0.08 } else { 0.0 }))
        .unwrap();
    let load = Load {
        force_n: 12.0,
        axis_m: [0.0, 0.0],
        holder: Holder::Rigid,
        from: None,
    };
    let body = PosedMesh::at_rest(&mesh, [0.0; 3]);
    let cell_m = skin.pitch_m() / field.cells_per_taxel() as f64;
    let balance = field.quasi_static().unwrap().carry(&body, &load).unwrap();
    let force_n = balance.response.pressure_pa.iter().sum::<f64>() * cell_m * cell_m;
    // the balance ends at 1e-12 of the force, and a sum of some thousand cells rounds by less
    assert_relative_eq!(force_n, load.force_n, max_relative = 1e-11);
}
