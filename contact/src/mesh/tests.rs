//! The gate and the readers, fed with everything that can be wrong.

use super::tri_mesh::index;
use super::*;
use approx::assert_relative_eq;
use proptest::prelude::*;

fn block() -> TriMesh {
    cuboid([0.02, 0.03, 0.04])
}

fn save(directory: &tempfile::TempDir, name: &str, content: &[u8]) -> std::path::PathBuf {
    let path = directory.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

fn refused(mesh: &TriMesh, scale: f64) -> MeshError {
    checked(mesh, scale, "x.obj").unwrap_err()
}

#[test]
fn all_formats_come_back_alike() {
    let directory = tempfile::tempdir().unwrap();
    let tube = sphere(0.025, 20, 24);
    for (name, bytes) in [
        ("a.OBJ", tube.to_obj("a").into_bytes()),
        ("a.glb", tube.to_glb("a")),
        ("a.STL", stl_tests::binary(&tube)),
        ("text.Stl", stl_tests::text(&tube)),
    ] {
        let (read, report) = load(&save(&directory, name, &bytes), 1.0).unwrap();
        assert_eq!(read.triangles, tube.triangles, "{name}");
        assert!(!report.flipped && !report.heavy);
        for (a, b) in read.vertices.iter().zip(&tube.vertices) {
            for k in 0..3 {
                // half a unit in the last place of an f32 below 0.0625 m is 1.9e-9 m; OBJ's ninth decimal adds 5e-10 m
                assert!((a[k] - b[k]).abs() < 3e-9, "{name}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn files_that_are_not_meshes() {
    let directory = tempfile::tempdir().unwrap();
    let missing = load(&directory.path().join("none.obj"), 1.0).unwrap_err();
    assert!(
        matches!(&missing, MeshError::Unreadable { file, .. } if file.ends_with("none.obj")),
        "{missing}"
    );
    let step = load(&save(&directory, "a.step", b"x"), 1.0).unwrap_err();
    assert_eq!(
        step.to_string().matches("`step` is not one of obj, glb, stl").count(),
        1
    );
    assert!(matches!(
        load(&save(&directory, "plain", b"x"), 1.0),
        Err(MeshError::UnknownExtension { .. })
    ));
    assert!(matches!(
        read_obj(b"v 1 2\nf 1 1 1\n", 1.0, "a"),
        Err(MeshError::Malformed { .. })
    ));
    assert!(matches!(
        read_obj(&[0xff, 0xfe, 0], 1.0, "a"),
        Err(MeshError::Malformed { .. })
    ));
    assert!(matches!(read_obj(b"", 1.0, "a"), Err(MeshError::NoTriangles { .. })));
    assert!(matches!(read_glb(b"glTF", 1.0, "a"), Err(MeshError::Malformed { .. })));
    assert!(matches!(
        read_glb(b"glTF\x02\0\0\0\0\0\0\0", 1.0, "a"),
        Err(MeshError::Malformed { .. })
    ));
}

#[test]
fn obj_dialects() {
    // quadrangles, texture and normal indices, negative indices, groups, materials, a stray line and a comment
    let text = "# cube\nmtllib none.mtl\no a\nv 0 0 0\nv .02 0 0\nv .02 .02 0\nv 0 .02 0\nv 0 0 .02\nv .02 0 .02\n\
                v .02 .02 .02\nv 0 .02 .02\nvn 0 0 1\nvt 0 0\ng one\nusemtl m\nf 1//1 4//1 3//1 2//1\nf 5/1 6/1 7/1 8/1\n\
                g two\nl 1 2\nf 1 2 6 5\nf 2 3 7 6\nf -6 -5 -1 -2\nf 4 1 5 8\n";
    let (mesh, report) = read_obj(text.as_bytes(), 1.0, "cube.obj").unwrap();
    assert_eq!(
        (mesh.vertices.len(), mesh.triangles.len(), report.flipped),
        (8, 12, false)
    );
    assert_relative_eq!(mesh.volume_m3(), 8e-6, max_relative = 1e-6);
}

#[test]
fn coordinates_that_are_not_finite() {
    let error = read_obj(b"v 0 0 0\nv 0 nan 0\nv 0 0 1\nf 1 2 3\n", 1.0, "a.obj").unwrap_err();
    assert!(
        matches!(
            error,
            MeshError::NotFinite {
                vertex: 1,
                axis: 'y',
                ..
            }
        ),
        "{error}"
    );
    let mut mesh = block();
    mesh.vertices[3][2] = f64::INFINITY;
    assert!(refused(&mesh, 1.0).to_string().contains("vertex 3, coordinate z = inf"));
    assert!(matches!(
        read_glb(&mesh.to_glb("a"), 1.0, "a"),
        Err(MeshError::Malformed { .. } | MeshError::NotFinite { .. })
    ));
}

#[test]
fn indices_out_of_range() {
    let mut mesh = block();
    mesh.triangles[2][1] = 8;
    let expected = MeshError::IndexOutOfRange {
        file: "x.obj".into(),
        triangle: 2,
        index: 8,
        vertices: 8,
    };
    assert_eq!(refused(&mesh, 1.0), expected);
    assert!(matches!(
        read_glb(&mesh.to_glb("a"), 1.0, "a"),
        Err(MeshError::IndexOutOfRange { index: 8, .. })
    ));
    let error = read_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 1.0, "a.obj").unwrap_err();
    assert!(error.to_string().contains("uses vertex 4, outside [1, 3]"), "{error}");
    assert!(read_obj(b"v 0 0 0\nf 1 0 1\n", 1.0, "a.obj").is_err());
}

#[test]
fn far_from_metres_suggests_the_scale() {
    let mut millimetres = block().scaled([1e3; 3]);
    let error = refused(&millimetres, 1.0);
    assert!(error.to_string().contains("millimetres, use scale = 0.001"), "{error}");
    assert!(matches!(error, MeshError::FarFromMetres { extent_m, .. } if (extent_m - 40.0).abs() < 1e-9));
    assert!(checked(&millimetres, 1e-3, "a").is_ok());
    // a vertex that nothing uses does not count
    millimetres.vertices.push([1e9; 3]);
    assert!(checked(&millimetres, 1e-3, "a").is_ok());
    assert!(matches!(refused(&block(), 1e-3), MeshError::FarFromMetres { .. }));
    // 0.04e-300 m: the size is what is wrong, though no two vertices are apart any more
    let error = refused(&block(), 1e-300).to_string();
    assert!(error.contains("e-302 m after scale = 1e-300 is"), "{error}");
    assert!(error.ends_with("if its unit is metres, use scale = 1"), "{error}");
    let error = refused(&block().scaled([1e7; 3]), 1.0).to_string();
    assert!(
        error.contains("= 400000 m") && error.ends_with("if its unit is micrometres, use scale = 1e-6"),
        "{error}"
    );
    // no usual unit makes 4e10 units an object
    let error = refused(&block().scaled([1e12; 3]), 1.0).to_string();
    assert!(
        error.contains("vertex 0 has x = -1e10") && error.ends_with("[-1000000, 1000000] m"),
        "{error}"
    );
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(refused(&block(), scale), MeshError::Scale { .. }), "{scale}");
    }
}

#[test]
fn inside_out_is_turned_and_reported() {
    let (mesh, report) = checked(&block().flipped(), 1.0, "a").unwrap();
    assert!(report.flipped);
    assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 1e-12);
    assert_relative_eq!(report.volume_m3, 24e-6, max_relative = 1e-12);
}

#[test]
fn open_meshes_are_counted() {
    let mut mesh = block();
    // half of the underside
    mesh.triangles.remove(0);
    let error = refused(&mesh, 1.0);
    assert!(
        matches!(
            error,
            MeshError::NotClosed {
                open_edges: 3,
                edges: 18,
                ..
            }
        ),
        "{error}"
    );
    assert!(
        error.to_string().contains("3 of 18 edges lack a partner, one at ("),
        "{error}"
    );
}

#[test]
fn closed_without_inside() {
    let mut sheet = block();
    sheet.vertices.iter_mut().for_each(|v| v[2] = 0.0);
    // top and bottom coincide: either everything collapses or nothing is enclosed
    let error = refused(&sheet, 1.0);
    assert!(
        matches!(error, MeshError::NoVolume { .. } | MeshError::NoTriangles { .. }),
        "{error}"
    );
}

#[test]
fn soup_is_welded_and_collapsed_triangles_go() {
    let solid = block();
    let mut soup = TriMesh::default();
    for t in 0..solid.triangles.len() {
        let base = index(soup.vertices.len());
        soup.vertices.extend(solid.corners(t));
        soup.triangles.push([base, base + 1, base + 2]);
    }
    soup.triangles.push([0, 0, 1]);
    let (mesh, report) = checked(&soup, 1.0, "a").unwrap();
    assert_eq!(
        (mesh.vertices.len(), report.joined_vertices, report.dropped_triangles),
        (8, 28, 1)
    );
    let dust = TriMesh {
        vertices: vec![[0.0; 3]; 3],
        triangles: vec![[0, 1, 2]],
    };
    assert_eq!(
        refused(&dust, 1.0),
        MeshError::NoTriangles {
            file: "x.obj".into(),
            dropped: 1
        }
    );
}

#[test]
fn transforms_keep_the_solid() {
    let moved = block().translated([1.0, 2.0, 3.0]).rotated_x(1.1);
    assert_relative_eq!(moved.volume_m3(), 24e-6, max_relative = 1e-9);
    assert_relative_eq!(block().scaled([-1.0, 2.0, 1.0]).volume_m3(), 48e-6, max_relative = 1e-9);
    let pair = block().merged(&block().translated([0.1, 0.0, 0.0]));
    assert_relative_eq!(pair.volume_m3(), 48e-6, max_relative = 1e-9);
    assert_eq!((pair.open_edges(), pair.vertices.len()), (0, 16));
    assert_relative_eq!(
        block().translated([0.0, 0.0, -7.0]).grounded().bounds().unwrap().0[2],
        0.0
    );
}

/// A GLB whose one mesh hangs below two nodes: a child that is moved and mirrored, under a parent that scales.
#[test]
fn glb_node_transforms_are_applied() {
    let bytes = block().to_glb("a");
    let nodes = r#""nodes":[{"scale":[2,2,2],"children":[1]},{"mesh":0,"translation":[1,0,0],"scale":[-1,1,1]}]"#;
    let (mesh, report) = read_glb(
        &with_json(&bytes, r#""nodes":[{"name":"a","mesh":0}]"#, nodes),
        1.0,
        "a",
    )
    .unwrap();
    assert!(!report.flipped, "mirroring is undone by turning the triangles");
    assert_relative_eq!(mesh.volume_m3(), 8.0 * 24e-6, max_relative = 1e-6);
    assert_relative_eq!(mesh.bounds().unwrap().0[0], 2.0 - 0.02, max_relative = 1e-6);
    let cycle = r#""nodes":[{"mesh":0,"children":[0]}]"#;
    assert!(
        read_glb(
            &with_json(&bytes, r#""nodes":[{"name":"a","mesh":0}]"#, cycle),
            1.0,
            "a"
        )
        .is_err()
    );
}

#[test]
fn glb_accessors_outside_the_chunk() {
    let bytes = block().to_glb("a");
    for (old, new) in [
        (r#""count":8"#, r#""count":800"#),
        (r#""byteLength":96"#, r#""byteLength":99999"#),
        (r#""componentType":5126"#, r#""componentType":5123"#),
        (r#""componentType":5125"#, r#""componentType":5126"#),
        (r#""count":36"#, r#""count":35"#),
        (r#""attributes":{"POSITION":0}"#, r#""attributes":{}"#),
        (r#""indices":1"#, r#""indices":1,"mode":5"#),
        (r#""indices":1"#, r#""indices":9"#),
    ] {
        let broken = with_json(&bytes, old, new);
        assert!(read_glb(&broken, 1.0, "a").is_err(), "{new}");
    }
}

/// `glb` with `old` replaced by `new` in its JSON chunk, lengths mended.
fn with_json(glb: &[u8], old: &str, new: &str) -> Vec<u8> {
    let length = u32::from_le_bytes(glb[12..16].try_into().unwrap()) as usize;
    let text = String::from_utf8(glb[20..20 + length].to_vec()).unwrap();
    assert!(text.contains(old), "{text}");
    let mut json = text.trim_end().replace(old, new).into_bytes();
    json.resize(json.len().next_multiple_of(4), b' ');
    let mut out = glb[..8].to_vec();
    out.extend(index(20 + json.len() + glb.len() - 20 - length).to_le_bytes());
    out.extend(index(json.len()).to_le_bytes());
    out.extend(b"JSON");
    out.extend(json);
    out.extend(&glb[20 + length..]);
    out
}

proptest! {
    /// No bytes make a reader panic: damaged files of every kind, and noise.
    #[test]
    fn damaged_files_never_panic(at in 0_usize..2000, byte in any::<u8>(), cut in 0_usize..2000, noise in prop::collection::vec(any::<u8>(), 0..200)) {
        let mesh = sphere(0.02, 4, 5);
        for (bytes, read) in [
            (mesh.to_obj("a").into_bytes(), read_obj as fn(&[u8], f64, &str) -> _),
            (mesh.to_glb("a"), read_glb),
            (stl_tests::binary(&mesh), read_stl),
            (stl_tests::text(&mesh), read_stl),
        ] {
            let mut damaged = bytes;
            let at = at % damaged.len();
            damaged[at] = byte;
            let _: Result<(TriMesh, MeshReport), MeshError> = read(&damaged, 1.0, "a");
            damaged.truncate(cut);
            let _ = read(&damaged, 1.0, "a");
            let _ = read(&noise, 1.0, "a");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]
    /// No triangles make the gate panic, and what passes is closed and outward: random surfaces over few vertices, full
    /// of branches, duplicates, fins and holes.
    #[test]
    fn random_surfaces_never_panic(
        vertices in prop::collection::vec(prop::array::uniform3(-0.05_f64..0.05), 4..12),
        corners in prop::collection::vec(prop::array::uniform3(0_u32..12), 1..40),
        solid in any::<bool>(),
    ) {
        let n = index(vertices.len());
        let mut mesh = TriMesh { vertices, triangles: corners.into_iter().map(|t| t.map(|i| i % n)).collect() };
        if solid {
            mesh = mesh.merged(&block());
        }
        if let Ok((mended, report)) = checked(&mesh, 1.0, "a") {
            prop_assert_eq!(mended.open_edges(), 0);
            prop_assert!(mended.volume_m3() > 0.0 && report.triangles == mended.triangles.len());
        }
    }
}
