use super::*;

/// Every family over default and extreme ranges.
#[test]
fn every_family_keeps_its_promises() {
    let fixed = |size: f64, relief: f64, edge: f64| ShapeRanges {
        size_m: [size; 2],
        relief_m: [relief; 2],
        edge_m: [edge; 2],
    };
    let mut all = vec![(ShapeRanges::default(), 0..100)];
    for size in [5e-3, 50e-3, 0.3] {
        for relief in [0.0, 5e-3] {
            for edge in [0.0, 3e-3, 20e-3] {
                all.push((fixed(size, relief, edge), 1000..1012));
            }
        }
    }
    for family in SHAPE_FAMILIES {
        for (ranges, seeds) in &all {
            if let Err(fault) = check_shape_family(family, ranges, seeds.clone()) {
                panic!("{fault} ({ranges:?})");
            }
        }
    }
}

#[test]
fn an_unknown_family_is_told_the_known_ones() {
    let error = build_shape("banana", &ShapeRanges::default(), 1)
        .unwrap_err()
        .to_string();
    assert!(error.starts_with("shape family \"banana\" is not one of \"plate\", \"perforated\""));
    let ranges = ShapeRanges {
        size_m: [1.0, 2.0],
        ..ShapeRanges::default()
    };
    let error = build_shape("plate", &ranges, 1).unwrap_err().to_string();
    assert_eq!(error, "`size_m[0]` = 1 is outside [5e-3, 0.3] m");
}

#[test]
fn names_are_distinct() {
    for (i, family) in SHAPE_FAMILIES.iter().enumerate() {
        assert!(SHAPE_FAMILIES[..i].iter().all(|other| other.name != family.name));
    }
}
