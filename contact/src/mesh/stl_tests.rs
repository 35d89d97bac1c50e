//! STL files as they are met: text and binary, with every header, damaged.

use super::*;
use approx::assert_relative_eq;
use std::fmt::Write as _;

/// Text STL of `mesh`, as most programs write it.
pub(super) fn text(mesh: &TriMesh) -> Vec<u8> {
    let mut out = String::from("solid thing\n");
    for t in 0..mesh.triangles.len() {
        out.push_str("  facet normal 0 0 1\n    outer loop\n");
        for [x, y, z] in mesh.corners(t) {
            let _ = writeln!(out, "      vertex {x:e} {y:e} {z:e}");
        }
        out.push_str("    endloop\n  endfacet\n");
    }
    out.push_str("endsolid thing\n");
    out.into_bytes()
}

/// Binary STL of `mesh`, written by `stl_io`.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the file's precision")]
pub(super) fn binary(mesh: &TriMesh) -> Vec<u8> {
    let corner = |v: [f64; 3]| stl_io::Vertex::new(v.map(|x| x as f32));
    let triangles = (0..mesh.triangles.len()).map(|t| stl_io::Triangle {
        normal: stl_io::Normal::new([0.0; 3]),
        vertices: mesh.corners(t).map(corner),
    });
    let mut out = Vec::new();
    stl_io::write_stl(&mut out, triangles.collect::<Vec<_>>().iter()).unwrap();
    out
}

fn block() -> TriMesh {
    cuboid([0.02, 0.03, 0.04])
}

fn reason(bytes: &[u8]) -> String {
    read_stl(bytes, 1.0, "a.stl").unwrap_err().to_string()
}

#[track_caller]
fn is_the_block(bytes: &[u8]) {
    let (mesh, report) = read_stl(bytes, 1.0, "a.stl").unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len()), (8, 12));
    // f32 keeps 6e-8 of each side
    assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 2e-7);
    assert_eq!(report.notes(), Vec::<String>::new());
}

#[test]
fn text_and_binary_with_any_header() {
    is_the_block(&binary(&block()));
    let mut solid = binary(&block());
    for header in [&b"solid made by a CAD program"[..], b"SOLID", b"\xff\xfe latin"] {
        solid[..80].fill(b' ');
        solid[..header.len()].copy_from_slice(header);
        is_the_block(&solid);
    }
    let plain = String::from_utf8(text(&block())).unwrap();
    is_the_block(plain.as_bytes());
    is_the_block(plain.to_uppercase().as_bytes());
    is_the_block(plain.replace('\n', "\r\n").as_bytes());
    is_the_block(plain.replace("solid thing", "solid").as_bytes());
    is_the_block(plain.replace("normal 0 0 1", "normal nan nan nan").as_bytes());
    // two solids in one file
    let parts = plain.replacen("  facet", "endsolid thing\n\nsolid other\n  facet", 1);
    is_the_block(parts.as_bytes());
}

#[test]
fn damaged_files_say_what_is_wrong() {
    let binary = binary(&block());
    let cut = reason(&binary[..500]);
    assert!(cut.contains("12 triangles = 684 bytes, the file has 500"), "{cut}");
    let mut more = binary.clone();
    more[80] = 13;
    assert!(reason(&more).contains("13 triangles = 734 bytes, the file has 684"));
    let appended = [&binary[..], b"\r\n"].concat();
    assert!(reason(&appended).contains("684 bytes, the file has 686 (2 bytes too many"));
    assert!(reason(b"").contains("0 bytes"));
    assert!(reason(&[0; 84]).contains("0 triangles"));
    let mut solid = binary.clone();
    solid[..5].copy_from_slice(b"solid");
    assert!(reason(&solid[..683]).contains("684 bytes"));
    let mut nan = binary;
    nan[84 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    assert!(
        reason(&nan).contains("vertex 0, coordinate y = NaN"),
        "{}",
        reason(&nan)
    );

    let plain = String::from_utf8(text(&block())).unwrap();
    assert!(reason(&plain.as_bytes()[..plain.len() / 2]).contains("endsolid"));
    assert!(reason(plain.replacen("e-2", "e-2x", 1).as_bytes()).contains("malformed: triangle 0"));
    assert!(reason(plain.replacen("vertex -1e-2", "vertex -inf", 1).as_bytes()).contains("coordinate x = -inf"));
    assert!(reason(plain.replacen("    endloop\n", "", 1).as_bytes()).contains("triangle 0"));
    assert!(reason(b"solid empty\nendsolid empty\n").contains("0 triangles"));
}

#[test]
fn units_of_stl_files() {
    let micrometres = binary(&block().scaled([1e6; 3]));
    let said = reason(&micrometres);
    assert!(said.contains("micrometres, use scale = 1e-6"), "{said}");
    let (mesh, _) = read_stl(&micrometres, 1e-6, "a.stl").unwrap();
    assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 2e-7);
}
