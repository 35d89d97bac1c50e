use super::*;
use crate::mesh::{SOFT_MAX_TRIANGLES, checked, load};
use approx::assert_abs_diff_eq;
use std::path::PathBuf;

fn assets() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("assets")
}

#[test]
fn table_is_in_label_order() {
    let names: Vec<&str> = OBJECTS.iter().map(|o| o.name).collect();
    assert_eq!(
        names.join(" "),
        "brain center circle comb corner eraser fish gel line perfume rec smallT T tape tennis trig X"
    );
    for (i, o) in (1..).zip(OBJECTS) {
        assert_eq!(o.label, i);
        assert_eq!(by_name(o.name).map(|p| p.label), Some(i));
    }
    assert!(by_name("banana").is_none());
}

/// Closed, outward, light, standing on z = 0, and unchanged by the gate for foreign meshes.
#[test]
fn every_object_is_a_solid() {
    for o in OBJECTS {
        let mesh = (o.build)();
        let (repaired, report) = checked(&mesh, 1.0, o.name).unwrap();
        assert_eq!((report.joined_vertices, report.dropped_triangles, report.flipped), (0, 0, false), "{}", o.name);
        assert_eq!(repaired.triangles.len(), mesh.triangles.len(), "{}", o.name);
        assert!(report.triangles <= SOFT_MAX_TRIANGLES, "{}: {} triangles", o.name, report.triangles);
        let (low, high) = mesh.bounds().unwrap();
        assert_abs_diff_eq!(low[2], 0.0, epsilon = 1e-9);
        assert!(low[0] < 0.0 && high[0] > 0.0 && low[1] < 0.0 && high[1] > 0.0, "{}: origin outside", o.name);
        assert!(report.extent_m.iter().all(|&e| (3e-3..=0.16).contains(&e)), "{}: {:?}", o.name, report.extent_m);
    }
}

/// The committed files are what `cargo run -p spts-contact --example generate_objects` makes. Coordinates may differ by
/// the rounding to f32 of a 0.1 m coordinate (7e-9 m) and of OBJ's ninth decimal (5e-10 m).
#[test]
fn committed_files_are_current() {
    const ROUNDING_M: f64 = 1e-8;
    for o in OBJECTS {
        let built = (o.build)();
        for extension in ["obj", "glb"] {
            let (read, _) = load(&assets().join(format!("{}.{extension}", o.name)), 1.0).unwrap();
            assert_eq!(read.triangles.len(), built.triangles.len(), "{}.{extension}", o.name);
            for t in 0..read.triangles.len() {
                for (a, b) in read.corners(t).into_iter().zip(built.corners(t)) {
                    for k in 0..3 {
                        assert_abs_diff_eq!(a[k], b[k], epsilon = ROUNDING_M);
                    }
                }
            }
        }
    }
    assert_eq!(std::fs::read_to_string(assets().join("placements.csv")).unwrap(), placements_csv());
}

/// Holes and hollows are real: straight up from the skin, where do these points meet the solid?
#[test]
fn holes_and_hollows_are_real() {
    let above = |name: &str, x: f64, y: f64| (by_name(name).unwrap().build)().underside_m([x, y]);
    assert_eq!(above("tape", 0.0, 0.0), None);
    assert!(above("perfume", 1e-4, 2e-4).unwrap() >= 3e-3);
    assert_eq!(above("center", -2.5e-3, 4e-3), None);
    assert_eq!(above("T", -20e-3, -20e-3), None);
    // between the first two teeth of the comb, and on the second
    assert_eq!(above("comb", -26.7e-3, -6e-3), None);
    assert!(above("comb", -24.2e-3, -6e-3).is_some());
}

/// The matrix is a rotation, and tilts act in skin axes after the rotation.
#[test]
fn placement_matrix() {
    let p = Placement { row: 0.0, col: 0.0, rotation_rad: 0.7, tilt_x_rad: 0.02, tilt_y_rad: -0.03 };
    let m = p.matrix();
    for i in 0..3 {
        for j in 0..3 {
            let product: f64 = (0..3).map(|k| m[i][k] * m[j][k]).sum();
            assert_abs_diff_eq!(product, if i == j { 1.0 } else { 0.0 }, epsilon = 1e-15);
        }
    }
    // height of body point (x, y): tilt_x · y' − tilt_y · x' to first order, in skin axes
    let body = [0.03, -0.02];
    let [x, y, z] = [0, 1, 2].map(|r| m[r][0] * body[0] + m[r][1] * body[1]);
    assert_abs_diff_eq!(z, 0.02 * y + 0.03 * x, epsilon = 0.05 * 0.03_f64.powi(2));
}
