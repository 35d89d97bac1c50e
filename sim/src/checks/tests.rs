use super::engine::{COLUMN_MASS, Skin, tip};
use super::tips::Tips;
use super::*;
use approx::assert_relative_eq;
use spts_contact::mesh::{TriMesh, cuboid, extrude, polygon, sphere};
use spts_contact::{
    ContactField, ElasticConfig, ElasticField, PosedMesh, Response, TaxelBins, WinklerConfig, WinklerLayer, conformance,
};
use spts_models::{PressureMap, SkinLayout};

/// Stiffness of every skin here, Pa/m: the checks' default.
const K: f64 = 1.5e7;

fn relative_rms(a: &[f64], b: &[f64]) -> f64 {
    let apart: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    (apart / b.iter().map(|b| b * b).sum::<f64>()).sqrt()
}

/// `mesh`, standing on z = 0 in its own axes, tilted by `angle_rad` about x and with its origin `depth_m` below the
/// skin.
fn posed(mesh: &TriMesh, [x, y]: [f64; 2], depth_m: f64, angle_rad: f64) -> PosedMesh<'_> {
    let (s, c) = angle_rad.sin_cos();
    PosedMesh {
        rotation: [[1.0, 0.0, 0.0], [0.0, c, -s], [0.0, s, c]],
        ..PosedMesh::at_rest(mesh, [x, y, -depth_m])
    }
}

/// Linear springs: densification vanishes in a layer 10 m thick.
fn winkler(cells_per_taxel: usize, skin: &SkinLayout) -> WinklerLayer {
    let config = WinklerConfig {
        stiffness_pa_per_m: K,
        thickness_m: 10.0,
        cells_per_taxel,
        ..WinklerConfig::default()
    };
    WinklerLayer::new(config, skin).unwrap()
}

/// Mean pressure over each taxel of the whole skin, Pa.
fn cell_means(bins: &TaxelBins, fine_pa: &[f64]) -> PressureMap {
    let [means, _] = bins.means(fine_pa, None);
    means
}

/// 6 × 6 taxels of 15 mm: a block of finite elements that a test can afford.
fn small_skin() -> SkinLayout {
    SkinLayout::new(6, 6, 15e-3, 6e-3).unwrap()
}

fn assert_balanced(answer: &Response<'_>, cells_per_taxel: u32) {
    let cell_m = SkinLayout::default().pitch_m() / f64::from(cells_per_taxel);
    let sum_n = answer.pressure_pa.iter().sum::<f64>() * cell_m * cell_m;
    // the same numbers, added in another order
    assert_relative_eq!(answer.wrench.force_n[2], sum_n, max_relative = 1e-12);
    assert!(answer.pressure_pa.iter().all(|p| *p >= 0.0));
}

/// The bed's springs under MuJoCo's collisions against the exact lower envelope, on the same cells, at about 20 N.
///
/// Where they differ: a tip of radius r (with the shell, 0.06 of a cell, 0.45 mm) on a slope θ sinks r (1/cos θ − 1)
/// too deep, on the sphere at most r δ/R at its rim: 0.05 mm of 3.5 mm, weighed by the rim's small pressure below 1 %;
/// and a tip whose centre lies beside an edge by less than r is pressed too: no cell's centre is that near to an edge
/// here. The bound is 3 %. The ring is concave: its convex hull has 22 % more area.
#[test]
fn taxel_bed_is_a_winkler_layer() {
    let ball = sphere(0.0334, 96, 128);
    // covers the half x > 1 mm of the skin, and the edge leans by 1°
    let edge = cuboid([0.16, 0.16, 0.02]);
    let ring = extrude(&polygon::circle(0.030, 64), &[polygon::circle(0.014, 64)], 0.01);
    let cases = [
        ("sphere", posed(&ball, [0.003, -0.002], 3.5e-3, 0.0)),
        ("edge", posed(&edge, [0.081, 0.0], 2e-4, 0.0)),
        ("leaning edge", posed(&edge, [0.081, 0.0], -4e-4, 0.02)),
        ("ring", posed(&ring, [0.0005, 0.0], 6e-4, 0.005)),
    ];
    let mut bed = TaxelBed::new(TaxelBedConfig::default(), &SkinLayout::default()).unwrap();
    let (mut layer, bins) = (
        winkler(2, &SkinLayout::default()),
        TaxelBins::new(&SkinLayout::default(), 2),
    );
    for (name, body) in cases {
        let answer = bed.respond(&body);
        assert_balanced(&answer, 2);
        let expected = layer.respond(&body);
        let (force_n, expected_n) = (answer.wrench.force_n[2], expected.wrench.force_n[2]);
        assert!((10.0..40.0).contains(&expected_n), "{name}: {expected_n} N");
        let [taxels, expected_taxels] = [&answer, &expected].map(|r| cell_means(&bins, r.pressure_pa));
        let error = relative_rms(taxels.values(), expected_taxels.values());
        assert!(
            error <= 0.03,
            "{name}: relative RMS {error:.4}, {force_n} N for {expected_n} N"
        );
        for axis in 0..2 {
            // the lever of 3 % of the force at the contact's edge
            let slack_nm = 0.03 * expected_n * 0.075;
            let apart_nm = answer.wrench.torque_nm[axis] - expected.wrench.torque_nm[axis];
            assert!(apart_nm.abs() <= slack_nm, "{name}: torque off by {apart_nm} N m");
        }
    }
}

/// A body as soft as the skin halves the stiffness.
#[test]
fn soft_body_is_in_series() {
    let block = cuboid([0.06, 0.06, 0.02]);
    let rigid = posed(&block, [0.0, 0.0], 1e-3, 0.0);
    let soft = PosedMesh {
        stiffness_pa_per_m: K,
        ..rigid
    };
    let mut bed = TaxelBed::new(TaxelBedConfig::default(), &SkinLayout::default()).unwrap();
    let [rigid_n, soft_n] = [rigid, soft].map(|body| bed.respond(&body).wrench.force_n[2]);
    // 8 × 8 whole cells under the block; the tips sink 4e-5 of their depth into it
    assert_relative_eq!(rigid_n, K * 0.0036 * 1e-3, max_relative = 1e-3);
    assert_relative_eq!(soft_n, 0.5 * rigid_n, max_relative = 1e-9);
}

/// Both checks are functions of the body alone, feel nothing that does not touch them, and never pull.
#[test]
fn checks_have_no_memory() {
    let block = cuboid([0.05, 0.05, 0.02]);
    let other = cuboid([0.03, 0.07, 0.02]);
    for (name, build) in CONTACT_CHECKS {
        let mut used = build(toml::Table::new(), &small_skin()).unwrap();
        for away in [[0.0, 0.0, 1e-6], [1.0, 0.0, -1e-3], [0.0, -0.4, -1e-3]] {
            let force_n = used.respond(&PosedMesh::at_rest(&block, away)).wrench.force_n;
            assert!(
                force_n.iter().all(|f| f.abs() <= 0.0),
                "{name}: {force_n:?} N at {away:?}"
            );
        }
        used.respond(&posed(&other, [0.01, 0.0], 3e-4, 0.01));
        let body = posed(&block, [0.0, 0.004], 2e-4, -0.005);
        let again = used.respond(&body).pressure_pa.to_vec();
        let mut fresh = build(used.parameters(), &small_skin()).unwrap();
        let cells = u32::try_from(fresh.cells_per_taxel()).unwrap();
        let answer = fresh.respond(&body);
        let bits = |p: &[f64]| p.iter().map(|p| p.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&again), bits(answer.pressure_pa), "{name}");
        assert!(answer.wrench.force_n[2] > 1.0 && answer.wrench.force_n.iter().all(|f| f.is_finite()));
        assert_balanced(&answer, cells);
    }
}

/// A column damped a thousand times too much is still on its way, at a thousandth of the depth in a unit of time, when
/// the skin is given up: no answer, and a reason.
#[test]
fn gives_no_answer_without_one() {
    let column = |x: f64| {
        format!(
            "<body pos=\"{x} 0 0\"><inertial pos=\"0 0 0\" mass=\"{COLUMN_MASS}\" diaginertia=\"1 1 1\"/>\
             <joint type=\"slide\" axis=\"0 0 1\" stiffness=\"1\" damping=\"1000\"/>{}</body>",
            tip()
        )
    };
    let skin = Skin {
        bodies: column(-0.5) + &column(0.5),
        coordinates: 2,
        cell_dofs: vec![0, 1],
        flat: vec![(0, 1.0), (1, 1.0)],
        ..Skin::default()
    };
    let mut tips = Tips::new(1, 2, 0.015, skin);
    let block = cuboid([0.01, 0.01, 0.01]);
    let body = posed(&block, [0.0075, 0.0], 1e-3, 0.0);
    let answer = tips.respond(&body, K);
    assert!(answer.wrench.force_n[2].is_nan() && answer.pressure_pa.iter().all(|p| p.abs() <= 0.0));
    let reason = tips.failure().unwrap();
    assert!(reason.starts_with("the skin moves by "), "{reason}");
    let lost = PosedMesh {
        velocity_m_per_s: [f64::NAN; 3],
        ..body
    };
    assert!(tips.respond(&lost, K).wrench.force_n[2].is_nan());
    assert!(tips.failure().unwrap().contains("not finite"));
    tips.respond(&posed(&block, [0.0, 0.0], -1e-3, 0.0), K);
    assert_eq!(tips.failure(), None);
}

/// The bed keeps every promise of a contact field, at a metre's depth too.
#[test]
fn taxel_bed_conforms() {
    let (_, build) = CONTACT_CHECKS.iter().find(|(name, _)| *name == "taxel_bed").unwrap();
    conformance(*build).unwrap();
}

/// A plate over the whole skin compresses the foam uniformly: St. Venant–Kirchhoff's p = K δ (1 − ε)(1 − ε/2), for
/// every ν. The free ring outside disturbs the rim; in the middle, 30 mm or ten thicknesses further in, nothing is
/// left.
#[test]
fn flex_under_a_uniform_load() {
    let plate = cuboid([0.09, 0.09, 0.02]);
    for (poisson, strain) in [(0.0, 0.02), (0.2, 0.02), (0.2, 0.1), (0.4, 0.02)] {
        let config = FlexConfig {
            thickness_m: 3e-3,
            poisson,
            elements: 1,
            ..FlexConfig::default()
        };
        let mut layer = FlexLayer::new(config, &small_skin()).unwrap();
        let depth_m = strain * config.thickness_m;
        let answer = layer.respond(&posed(&plate, [0.0, 0.0], depth_m, 0.0));
        assert_balanced(&answer, 1);
        let expected_pa = K * depth_m * (1.0 - strain) * (1.0 - 0.5 * strain);
        // what has not settled (1e-5), the tips' sinking (1e-4) and what is left of the rim
        assert_relative_eq!(answer.pressure_pa[14], expected_pa, max_relative = 1e-3);
    }
}

/// Relative RMS over taxels between a flex with `cells` nodes a taxel side, or springs without it, and the elastic
/// layer of 6 × 6 cells a taxel, under a block of 4 × 4 whole taxels: both of K, h = 6 mm, ν = 0.2.
fn apart_from_layer(cells: Option<usize>, strain: f64) -> f64 {
    let (skin, thickness_m) = (small_skin(), 6e-3);
    let block = cuboid([0.06, 0.06, 0.02]);
    let body = posed(&block, [0.0, 0.0], strain * thickness_m, 0.0);
    let elastic = ElasticConfig {
        stiffness_pa_per_m: K,
        thickness_m,
        poisson: 0.2,
        densification: Some(false),
        ..ElasticConfig::default()
    };
    let mut layer = ElasticField::new(elastic, true, &skin).unwrap();
    let fine = layer.respond(&body).pressure_pa.to_vec();
    let expected = cell_means(&TaxelBins::new(&skin, layer.cells_per_taxel()), &fine);
    let taxels = if let Some(cells_per_taxel) = cells {
        let config = FlexConfig {
            thickness_m,
            cells_per_taxel,
            ..FlexConfig::default()
        };
        let mut flex = FlexLayer::new(config, &skin).unwrap();
        cell_means(&TaxelBins::new(&skin, cells_per_taxel), flex.respond(&body).pressure_pa)
    } else {
        cell_means(&TaxelBins::new(&skin, 1), winkler(1, &skin).respond(&body).pressure_pa)
    };
    relative_rms(taxels.values(), expected.values())
}

/// At 1 % strain the flex misses 1.5 % by its material (1.5 ε) and, with one node a taxel, a part of what the layer's
/// rim carries above the middle. Springs know nothing of the rim: with its material's error and all, the flex has to be
/// nearer.
#[test]
fn flex_is_near_the_layer() {
    let strain = 0.01;
    let (springs, flex) = (apart_from_layer(None, strain), apart_from_layer(Some(1), strain));
    assert!(flex < springs, "flex {flex:.4}, springs {springs:.4}");
}

/// Half the cell: the rim's part of the error, about 3.6 of 5.1 %, falls by half in first order, the material's 1.5 %
/// stays: a third less in all, of which a fifth is asked for.
#[test]
#[ignore = "864 degrees of freedom: half a minute"]
fn flex_comes_nearer_with_more_nodes() {
    let [coarse, fine] = [1, 2].map(|cells| apart_from_layer(Some(cells), 0.01));
    assert!(fine <= 0.8 * coarse, "{coarse:.4} → {fine:.4}");
}
