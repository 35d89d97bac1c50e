//! Rows hold what their columns say.

use super::{SMALL, spec};
use crate::make::Maker;
use crate::spec::{NAMED_SPECS, Spec};
use crate::{Dataset, Part, spread_rows};
use spts_circuit::Profile;
use std::collections::BTreeSet;

/// Rows in any order, from makers that have made other rows before, have the same bits.
#[test]
fn a_row_depends_on_its_number_alone() {
    let spec = spec(SMALL);
    let bits = |maker: &mut Maker<'_>, index: u64| -> Vec<u64> {
        let row = maker.row(index).unwrap();
        let values = [
            row.pressure().values(),
            row.conductance().values(),
            row.image(),
            row.volts(),
        ]
        .concat();
        values
            .into_iter()
            .chain([row.time_s(), row.first_row() as f64])
            .map(f64::to_bits)
            .collect()
    };
    let mut forward = Maker::new(&spec);
    let in_order: Vec<Vec<u64>> = (0..90).map(|k| bits(&mut forward, k)).collect();
    let mut backward = Maker::new(&spec);
    for k in (0..90).rev() {
        assert!(
            bits(&mut backward, k) == in_order[usize::try_from(k).unwrap()],
            "row {k}"
        );
    }
    for k in [0, 41, 89] {
        assert!(
            bits(&mut Maker::new(&spec), k) == in_order[usize::try_from(k).unwrap()],
            "row {k} alone"
        );
    }
}

/// Σ p·A is the sum of the forces, which no part beside the sheet can carry: the balance is exact to 1e-12 of the
/// force, and sums of a hundred taxels round to 1e-13.
#[test]
fn pressure_carries_the_force() {
    let spec = spec(SMALL);
    let mut maker = Maker::new(&spec);
    for index in 0..90 {
        let row = maker.row(index).unwrap();
        let forces: f64 = (0..row.objects()).map(|k| row.object(k).unwrap().touch.force_n).sum();
        let carried = row.pressure().sum() * spec.skin().cell_area_m2();
        assert!(
            (carried / forces - 1.0).abs() < 1e-11,
            "row {index}: {carried} N of {forces} N"
        );
    }
}

/// Without effects y is Φ x with x = Rf·Vd·G: closed form; sums of a hundred products round to 1e-13 of their size.
#[test]
fn samples_are_the_weighted_sums() {
    let spec =
        spec("rows = 30\nreadout = \"ideal\"\n[object]\nfrom = \"objects\"\n[record]\nwindows = 3\nmeasurements = 11");
    let volts_per_siemens = Profile::named("ideal").unwrap().volts_per_siemens();
    let mut maker = Maker::new(&spec);
    for index in 0..30 {
        let row = maker.row(index).unwrap();
        let phi = row.phi();
        assert!(
            phi.iter().all(|w| w.abs().to_bits() == 1.0_f64.to_bits()),
            "weights are ±1"
        );
        let x: Vec<f64> = row
            .conductance()
            .values()
            .iter()
            .map(|g| g * volts_per_siemens)
            .collect();
        let size: f64 = x.iter().sum();
        for (y, weights) in row.volts().iter().zip(phi.chunks_exact(100)) {
            let sum: f64 = weights.iter().zip(&x).map(|(w, x)| w * x).sum();
            assert!((y - sum).abs() < 1e-13 * size * 10.0, "row {index}: {y} and {sum}");
        }
        // windows follow each other without a gap
        let first = maker.row(index - index % 3).unwrap().first_row();
        assert_eq!(maker.row(index).unwrap().first_row(), first + 11 * (index % 3));
    }
}

/// Every spec that ships makes its first rows, within the sheet's means.
#[test]
fn specs_that_ship_make_rows() {
    for (name, _) in NAMED_SPECS {
        let spec = Spec::load(name, &toml::Table::new()).unwrap();
        let mut maker = Maker::new(&spec);
        let (mut refused, mut touched, rows) = (0, 0, if *name == "large-skin" { 20 } else { 300 });
        for index in 0..rows {
            let row = maker.row(index).unwrap_or_else(|e| panic!("{name}: {e}"));
            let taxels = spec.skin().taxels();
            let scanned = if spec.config().record.raster { taxels } else { 0 };
            assert_eq!((row.pressure().values().len(), row.image().len()), (taxels, scanned));
            assert!(row.volts().iter().all(|v| v.is_finite()), "{name} {index}");
            assert!(
                row.pressure().max() > 0.0 || row.time_s() < 0.01 || spec.is_moving(),
                "{name} {index}"
            );
            touched += u64::from(row.pressure().max() > 0.0);
            refused += row.object(0).unwrap().touch.refused;
        }
        assert!(3 * touched > rows, "{name}: {touched} of {rows} rows have a touch");
        assert!(refused < rows, "{name}: {refused} poses of {rows} rows were refused");
    }
}

/// Shares of the splits within five standard errors, and no shape in two of them.
#[test]
fn splits_divide_neither_shapes_nor_presses() {
    let text = "rows = 4000\n[object]\nrows_per_shape = 4\n[pose]\nrotation_deg = 10\n[split]\nvalidation = 0.2\ntest = 0.3\n[record]\nwindows = 2\nraster = false\nmeasurements = 1";
    let spec = spec(text);
    let mut maker = Maker::new(&spec);
    let splits: Vec<&str> = (0..4000).map(|k| maker.row(k).unwrap().split()).collect();
    assert!(
        splits
            .chunks(4)
            .all(|shape| shape.iter().all(|split| *split == shape[0]))
    );
    for (split, share) in [("train", 0.5_f64), ("validation", 0.2), ("test", 0.3)] {
        let found = splits.iter().step_by(4).filter(|s| **s == split).count() as f64 / 1000.0;
        assert!(
            (found - share).abs() < 5.0 * (share * (1.0 - share) / 1000.0).sqrt(),
            "{split}: {found}"
        );
    }
}

/// Rows that are made and rows that are read are the same JSON, whichever rows and columns are asked for.
#[test]
fn chosen_rows_are_the_rows_of_files() {
    let spec = spec(SMALL);
    let dir = tempfile::tempdir().unwrap();
    let dataset = Dataset::begin(dir.path(), spec.clone()).unwrap();
    dataset.make(Part::parse("0/2").unwrap(), &()).unwrap();
    assert_eq!(dataset.made_rows(), [0..20, 40..60, 80..90]);
    let wanted: BTreeSet<u64> = [0, 1, 19, 41, 42, 59, 80, 89].into();
    for columns in [&[][..], &["index", "support", "object_2", "y_v", "phi"]] {
        let (mut read, mut made) = (Vec::new(), Vec::new());
        dataset
            .rows(&wanted, columns, |row| {
                read.push(row);
                Ok(())
            })
            .unwrap();
        spec.rows(&wanted, columns, |row| {
            made.push(row);
            Ok(())
        })
        .unwrap();
        assert_eq!(read, made);
        let numbers: Vec<u64> = read.iter().map(|row| row["index"].as_u64().unwrap()).collect();
        assert!(numbers.iter().eq(&wanted), "{numbers:?}");
        // `phi` is not recorded
        let kept = if columns.is_empty() {
            crate::columns(&spec).len()
        } else {
            4
        };
        assert!(read.iter().all(|row| row.as_object().unwrap().len() == kept));
    }
    let head = dataset.head(20).unwrap();
    assert_eq!((head.len(), &head[19]["index"]), (20, &19.into()));
    let missing = dataset.rows(&[20].into(), &[], |_| Ok(())).unwrap_err().to_string();
    assert!(missing.contains("part-00001.parquet"), "{missing}");
    let beyond = dataset.rows(&[90].into(), &[], |_| Ok(())).unwrap_err().to_string();
    assert!(beyond.ends_with("has no row 90; valid: [0, 89]"), "{beyond}");
}

/// What is drawn at random lies in the rows that are there, is a function of label and seed, and is all of them when
/// there are no more.
#[test]
fn drawn_rows_are_rows_that_are_there() {
    let spec = spec(SMALL);
    let held = [0..20, 40..60, 80..90];
    let drawn = spec.drawn_rows("preview", &held, 12, 4);
    assert_eq!(drawn.len(), 12);
    assert!(drawn.iter().all(|row| held.iter().any(|range| range.contains(row))));
    assert_eq!(drawn, spec.drawn_rows("preview", &held, 12, 4));
    assert_ne!(drawn, spec.drawn_rows("preview", &held, 12, 5));
    assert_ne!(drawn, spec.drawn_rows("verify", &held, 12, 4));
    let all: BTreeSet<u64> = held.iter().cloned().flatten().collect();
    assert_eq!(spec.drawn_rows("preview", &held, 50, 4), all);
    assert_eq!(spread_rows(&held, 1000), all);
    assert!(spread_rows(&[], 5).is_empty());
}

/// `record.labels` leaves columns out and changes none of the others.
#[test]
fn labels_are_columns_that_can_be_left_out() {
    let maps = ["pressure_pa", "conductance_s", "support"];
    let all = spec(SMALL);
    let one = spec(&format!("{SMALL}\nlabels = [\"support\"]"));
    let rows = |spec: &Spec| {
        let mut rows = Vec::new();
        let each = |row| {
            rows.push(row);
            Ok(())
        };
        spec.rows(&(0..3).collect(), &[], each).unwrap();
        rows
    };
    for (mut full, short) in rows(&all).into_iter().zip(rows(&one)) {
        let full = full.as_object_mut().unwrap();
        assert!(maps.iter().all(|name| full[*name].is_array()));
        full.remove("pressure_pa");
        full.remove("conductance_s");
        assert_eq!(&*full, short.as_object().unwrap());
    }
}
