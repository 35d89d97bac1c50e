//! What every family of shapes must have, and what is refused.

use super::*;
use crate::mesh::checked;
use crate::mesh::polygon::circle;
use nalgebra::Vector3;

/// Every family over default and extreme ranges.
#[test]
fn every_family_keeps_its_promises() {
    let fixed =
        |size: f64, relief: f64, edge: f64| ShapeRanges { size_m: [size; 2], relief_m: [relief; 2], edge_m: [edge; 2] };
    let mut all = vec![(ShapeRanges::default(), 0..100)];
    for size in [5e-3, 50e-3, 0.3] {
        for relief in [0.0, 5e-3] {
            for edge in [0.0, 3e-3, 20e-3] {
                all.push((fixed(size, relief, edge), 1000..1006));
            }
        }
    }
    // a side of three pieces whose last one points at the upper corner
    all.push((fixed(20e-3, 5e-3, 0.0), 5023..5024));
    for family in SHAPE_FAMILIES {
        for (ranges, seeds) in &all {
            check_family(family, ranges, seeds.clone());
        }
    }
}

/// Without relief, all but the rounded edge lies on z = 0: the footprint less the perimeter times the radius, with a
/// tenth of that for the arcs around corners. Cuts of a union may leave necks that are narrower than two radii; they
/// are seldom 5 % of the footprint.
#[test]
fn undersides_are_flat_inside_their_edges() {
    let ranges = ShapeRanges { size_m: [80e-3; 2], relief_m: [0.0; 2], edge_m: [1.5e-3; 2] };
    for family in SHAPE_FAMILIES.iter().filter(|family| family.name != "dome") {
        for seed in 0..60 {
            let shape = family.build(&ranges, seed).unwrap();
            let (mut flat_m2, mut wall_m2) = (0.0, 0.0);
            for t in 0..shape.mesh.triangles.len() {
                let [a, b, c] = shape.mesh.corners(t);
                let (u, v) = ([0, 1, 2].map(|k| b[k] - a[k]), [0, 1, 2].map(|k| c[k] - a[k]));
                let up = 0.5 * (u[0] * v[1] - u[1] * v[0]);
                let aside = 0.5 * (u[1] * v[2] - u[2] * v[1]).hypot(u[2] * v[0] - u[0] * v[2]);
                if up < 0.0 && [a, b, c].iter().all(|p| p[2] < 1e-12) {
                    flat_m2 -= up;
                } else if up.abs() < 1e-9 * aside {
                    wall_m2 += aside;
                }
            }
            // walls are 10 mm high
            let necks_m2 = if family.name == "union" { 0.05 * shape.area_m2 } else { 0.0 };
            let least_m2 = shape.area_m2 - necks_m2 - 1.1 * shape.edge_m * wall_m2 / 10e-3;
            let name = family.name;
            assert!(flat_m2 >= least_m2, "{name} {seed}: {flat_m2:e} of {least_m2:e} m²");
        }
    }
}

/// Numbers of pieces and holes, and widths, of the families that are told apart by them.
#[test]
fn pads_are_many_and_rods_are_thin() {
    let of = |name: &str| {
        let ranges = ShapeRanges { size_m: [0.1; 2], ..ShapeRanges::default() };
        (0..400).map(|seed| build_shape(name, &ranges, seed).unwrap()).collect::<Vec<_>>()
    };
    let pads = of("pads");
    assert!(pads.iter().all(|shape| (4..=24).contains(&shape.parts) && shape.holes == 0));
    // four square ones in a row, 0.6 of their spacing wide, are two thirds of their box
    assert!(pads.iter().all(|shape| shape.area_m2 < 0.67 * shape.size_m[0] * shape.size_m[1]));
    assert!(pads.iter().any(|shape| shape.parts == 24) && pads.iter().any(|shape| shape.parts == 4));
    let rods = of("rods");
    assert!(rods.iter().all(|shape| (0.03..0.14).contains(&(shape.least_width_m / 0.1))));
    assert!(rods.iter().any(|shape| shape.holes == 16) && rods.iter().any(|shape| shape.parts == 5));
    // heel, ball and five toes; five fingertips and the palm
    for (name, most) in [("foot", 7), ("hand", 6)] {
        let shapes = of(name);
        assert!(shapes.iter().all(|shape| shape.parts <= most && shape.holes == 0), "{name}");
        for parts in [1, most] {
            assert!(shapes.iter().any(|shape| shape.parts == parts), "{name}: none of {parts} parts");
        }
    }
}

#[test]
fn what_is_asked_for_in_vain_is_told() {
    let error = build_shape("banana", &ShapeRanges::default(), 1).unwrap_err().to_string();
    assert!(error.starts_with("shape family \"banana\" is not one of \"plate\", \"perforated\""));
    for (toml, told) in [
        ("size_m = [1e-3, 0.1]", "`size_m[0]` = 0.001 is outside [5e-3, 0.3] m"),
        ("relief_m = [0.0, nan]", "`relief_m[1]` = NaN is outside [0, 5e-3] m"),
        ("edge_m = [2e-3, 1e-3]", "`edge_m[0]` = 0.002 is outside the range that ends at the second number"),
    ] {
        let ranges: ShapeRanges = toml::from_str(toml).unwrap();
        assert_eq!(build_shape("plate", &ranges, 1).unwrap_err().to_string(), told);
    }
    assert!(toml::from_str::<ShapeRanges>("height_m = [0.0, 1.0]").is_err());
}

/// A family that draws a crossed outline, or a dome with a hole, is refused and does not panic.
#[test]
fn a_family_without_solids_is_refused() {
    let crossed: fn(&mut Dice) -> Plan = |_| Plan::simple(vec![[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]], 1.0);
    let pierced: fn(&mut Dice) -> Plan = |_| {
        let (outline, hole) = (circle(1.0, 20), circle(0.3, 12));
        let dome = Some(Dome { cap_rad: 1.0, rise: 0.2, flat: 0.0 });
        Plan { dome, ..Plan::apart(vec![outline], vec![hole], 0.5) }
    };
    let broken: fn(&mut Dice) -> Plan = |_| Plan::simple(vec![[0.0, 0.0], [f64::NAN, 2.0], [2.0, 0.0]], 1.0);
    for plan in [crossed, pierced, broken, |_| Plan::default()] {
        let family = ShapeFamily { name: "odd", description: "", plan };
        let error = family.build(&ShapeRanges::default(), 3).unwrap_err().to_string();
        assert_eq!(error, "shape family \"odd\" has no closed solid for seed 3 in 16 tries");
    }
}

/// Largest number of triangles in a shape.
const MAX_TRIANGLES: usize = 6000;
/// Largest relative error of the drawn size and of the volume's lower bound: rounding of sums over a few hundred
/// points.
const ROUNDING: f64 = 1e-9;
/// Least height of a triangle over its longest side as a share of the shape's size: far above rounding, far below what
/// a field can see.
const LEAST_TRIANGLE: f64 = 1e-7;

/// A shape is a closed solid on z = 0 that needs no repair, has the drawn size, relief and edge, and consists of few,
/// well-formed triangles. The same seed gives the same shape, and another seed another shape.
fn check_family(family: &ShapeFamily, ranges: &ShapeRanges, seeds: std::ops::Range<u64>) {
    let mut last: Option<Shape> = None;
    for seed in seeds {
        let what = format!("{}, seed {seed}, {ranges:?}", family.name);
        let [shape, again] = [(); 2].map(|()| family.build(ranges, seed).expect(&what));
        assert!(shape == again, "{what}: two shapes of one seed");
        assert!(last.is_none_or(|last| last.mesh != shape.mesh), "{what}: the shape of the seed before");
        check_shape(&shape, ranges, &what);
        last = Some(shape);
    }
}

fn check_shape(shape: &Shape, ranges: &ShapeRanges, what: &str) {
    let mesh = &shape.mesh;
    let count = mesh.triangles.len();
    assert!(count <= MAX_TRIANGLES, "{what}: {count} triangles");
    let (clean, report) = checked(mesh, 1.0, what).expect("a solid");
    assert_eq!((mesh.open_edges(), clean.triangles.len()), (0, count), "{what}: {report:?}");
    let mended =
        report.joined_vertices + report.dropped_triangles + report.duplicate_triangles + report.turned_triangles;
    let closed = report.filled_holes + report.lids;
    assert!(mended + closed == 0 && !report.flipped, "{what}: {report:?}");
    let (low, high) = mesh.bounds().expect("a solid has vertices");
    assert!(low[2].abs() <= 0.0, "{what}: stands on z = {}", low[2]);
    let extent = [high[0] - low[0], high[1] - low[1]];
    let size_m = extent[0].max(extent[1]);
    let [least, most] = ranges.size_m;
    assert!(size_m >= least * (1.0 - ROUNDING) && size_m <= most * (1.0 + ROUNDING), "{what}: {size_m} m");
    for (found, said) in extent.iter().zip(shape.size_m) {
        assert!((found - said).abs() <= ROUNDING * size_m, "{what}: {found} m, {said} m said");
    }
    let relief_m = shape.relief_m;
    assert!(relief_m <= ranges.relief_m[1] && (relief_m > 0.0 || ranges.relief_m[0] < 1e-6), "{what}: {relief_m} m");
    assert!(shape.edge_m <= ranges.edge_m[1], "{what}: edge {} m", shape.edge_m);
    // the flat top is 10 mm above the highest point of the underside
    let volume_m3 = mesh.volume_m3();
    assert!(volume_m3 >= shape.area_m2 * 10e-3 * (1.0 - ROUNDING), "{what}: {volume_m3} m³");
    let box_m2 = extent[0] * extent[1];
    assert!(shape.area_m2 > 0.0 && shape.area_m2 <= box_m2 * (1.0 + ROUNDING), "{what}: {} m²", shape.area_m2);
    for t in 0..count {
        let [a, b, c] = mesh.corners(t).map(Vector3::from);
        let longest_m = (b - a).norm().max((c - a).norm()).max((c - b).norm());
        let height_m = (b - a).cross(&(c - a)).norm() / longest_m;
        assert!(height_m > LEAST_TRIANGLE * size_m, "{what}: triangle {t} is {height_m} m high");
    }
}
