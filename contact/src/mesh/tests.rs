//! The gate and the readers, fed with everything that can be wrong.

use super::tri_mesh::index;
use super::*;
use approx::assert_relative_eq;
use proptest::prelude::*;
use std::fmt::Write as _;

fn block() -> TriMesh {
    cuboid([0.02, 0.03, 0.04])
}

fn save(directory: &tempfile::TempDir, name: &str, content: &[u8]) -> std::path::PathBuf {
    let path = directory.path().join(name);
    std::fs::write(&path, content).unwrap();
    path
}

/// Checks that the refusal in `result` has every one of `parts`.
#[track_caller]
fn refuses<T: std::fmt::Debug>(result: Result<T, MeshError>, parts: &[&str]) {
    let said = result.unwrap_err().to_string();
    for part in parts {
        assert!(said.contains(part), "{said} lacks {part}");
    }
}

fn gate(mesh: &TriMesh) -> Result<(TriMesh, MeshReport), MeshError> {
    checked(mesh, 1.0, "x.obj")
}

#[test]
fn all_formats_come_back_alike() {
    let directory = tempfile::tempdir().unwrap();
    let tube = sphere(0.025, 20, 24);
    for (name, bytes) in [
        ("a.OBJ", tube.to_obj("a").into_bytes()),
        ("a.glb", tube.to_glb("a")),
        ("a.STL", binary(&tube)),
        ("text.Stl", text(&tube)),
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
    let missing = load(&directory.path().join("none.obj"), 1.0);
    refuses(missing, &["none.obj`: cannot be read"]);
    let step = load(&save(&directory, "a.step", b"x"), 1.0);
    refuses(step, &["extension `step` is not one of obj, glb, stl"]);
    refuses(load(&save(&directory, "plain", b"x"), 1.0), &["extension `` is not one of"]);
    let glb: &[u8] = b"glTF\x02\0\0\0\0\0\0\0";
    for (read, part) in [
        (read_obj(b"v 1 2\nf 1 1 1\n", 1.0, "a"), "malformed: line 1: coordinate z is missing"),
        (read_obj(b"v 1 2 3\nf 1 1 x/1\n", 1.0, "a"), "malformed: line 2: `x/1` is not a whole number"),
        (read_obj(&[0xff, 0xfe, 0], 1.0, "a"), "malformed"),
        (read_obj(b"", 1.0, "a"), "0 triangles of non-zero size"),
        (read_glb(b"glTF", 1.0, "a"), "malformed"),
        (read_glb(glb, 1.0, "a"), "malformed"),
    ] {
        refuses(read, &["mesh `a`: ", part]);
    }
}

#[test]
fn obj_dialects() {
    // quadrangles, texture and normal indices, negative indices, groups, materials, a stray line and a comment
    let text = "# cube\nmtllib none.mtl\no a\nv 0 0 0\nv .02 0 0\nv .02 .02 0\nv 0 .02 0\nv 0 0 .02\nv .02 0 .02\n\
                v .02 .02 .02\nv 0 .02 .02\nvn 0 0 1\nvt 0 0\ng one\nusemtl m\nf 1//1 4//1 3//1 2//1\nf 5/1 6/1 7/1 8/1\n\
                g two\nl 1 2\nf 1 2 6 5\nf 2 3 7 6\nf -6 -5 -1 -2\nf 4 1 5 8\n";
    let (mesh, report) = read_obj(text.as_bytes(), 1.0, "cube.obj").unwrap();
    assert_eq!((mesh.vertices.len(), mesh.triangles.len(), report.flipped), (8, 12, false));
    assert_relative_eq!(mesh.volume_m3(), 8e-6, max_relative = 1e-6);
}

#[test]
fn numbers_that_cannot_be() {
    let nan = read_obj(b"v 0 0 0\nv 0 nan 0\nv 0 0 1\nf 1 2 3\n", 1.0, "a.obj");
    refuses(nan, &["line 2: coordinate y = `nan` is not a finite number"]);
    let mut mesh = block();
    mesh.vertices[3][2] = f64::INFINITY;
    refuses(gate(&mesh), &["vertex 3, coordinate z = inf"]);
    assert!(read_glb(&mesh.to_glb("a"), 1.0, "a").is_err());
    let large = read_obj(b"v 0 0 0\nv 0 1e300 0\nv 0 0 1\nf 1 2 3\n", 1e300, "a.obj");
    refuses(large, &["vertex 1 has y = 1e300 = inf m after scale, outside"]);
    let mut mesh = block();
    mesh.triangles[2][1] = 8;
    refuses(gate(&mesh), &["mesh `x.obj`: triangle 2 uses vertex 8, outside [0, 8)"]);
    let glb = read_glb(&mesh.to_glb("a"), 1.0, "a");
    refuses(glb, &["triangle 2 uses vertex 8, outside [0, 8)"]);
    let obj = read_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 1.0, "a.obj");
    refuses(obj, &["line 4 uses vertex 4, outside [1, 3] or [-3, -1]"]);
    refuses(read_obj(b"v 0 0 0\nf 1 0 1\n", 1.0, "a.obj"), &["uses vertex 0"]);
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let why = format!("mesh `x.obj`: scale = {scale} is outside (0, ∞)");
        refuses(checked(&block(), scale, "x.obj"), &[&why]);
    }
}

#[test]
fn far_from_metres_suggests_the_scale() {
    let mut millimetres = block().scaled([1e3; 3]);
    refuses(gate(&millimetres), &["= 40 m", "millimetres, use scale = 0.001"]);
    assert!(checked(&millimetres, 1e-3, "a").is_ok());
    // a vertex that nothing uses does not count
    millimetres.vertices.push([1e9; 3]);
    assert!(checked(&millimetres, 1e-3, "a").is_ok());
    let small = checked(&block(), 1e-3, "a");
    assert!(matches!(small, Err(MeshError::FarFromMetres { .. })));
    // 0.04e-300 m: the size is what is wrong, though no two vertices are apart any more
    let words = ["e-302 m after scale = 1e-300 is", "if its unit is metres, use scale = 1"];
    refuses(checked(&block(), 1e-300, "a"), &words);
    let words = ["= 400000 m", "if its unit is micrometres, use scale = 1e-6"];
    refuses(gate(&block().scaled([1e7; 3])), &words);
    // no usual unit makes 4e10 units an object
    let words = ["vertex 0 has x = -1e10", "[-10000000, 10000000] m"];
    refuses(gate(&block().scaled([1e12; 3])), &words);
}

#[test]
fn meshes_without_an_inside() {
    let mut open = block();
    // half of the underside
    open.triangles.remove(0);
    refuses(gate(&open), &["3 of 18 edges lack a partner, one at ("]);
    let mut sheet = block();
    sheet.vertices.iter_mut().for_each(|v| v[2] = 0.0);
    // top and bottom coincide: either everything collapses or nothing is enclosed
    let said = gate(&sheet).unwrap_err().to_string();
    assert!(said.contains("encloses") || said.contains("0 triangles"), "{said}");
    let dust = TriMesh { vertices: vec![[0.0; 3]; 3], triangles: vec![[0, 1, 2]] };
    refuses(gate(&dust), &["0 triangles of non-zero size (1 degenerate ones dropped)"]);
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
    let (mesh, report) = pass(&soup);
    let counts = (mesh.vertices.len(), report.joined_vertices, report.dropped_triangles);
    assert_eq!(counts, (8, 28, 1));
}

#[test]
fn transforms_keep_the_solid() {
    let moved = block().translated([1.0, 2.0, 3.0]).rotated_x(1.1);
    assert_relative_eq!(moved.volume_m3(), 24e-6, max_relative = 1e-9);
    assert_relative_eq!(block().scaled([-1.0, 2.0, 1.0]).volume_m3(), 48e-6, max_relative = 1e-9);
    let pair = block().merged(&block().translated([0.1, 0.0, 0.0]));
    assert_relative_eq!(pair.volume_m3(), 48e-6, max_relative = 1e-9);
    assert_eq!((pair.open_edges(), pair.vertices.len()), (0, 16));
    assert_relative_eq!(block().translated([0.0, 0.0, -7.0]).grounded().bounds().unwrap().0[2], 0.0);
}

/// A GLB whose one mesh hangs below two nodes: a child that is moved and mirrored, under a parent that scales.
#[test]
fn glb_node_transforms_are_applied() {
    let read = |nodes: &str| {
        let bytes = with_json(&block().to_glb("a"), r#""nodes":[{"name":"a","mesh":0}]"#, nodes);
        read_glb(&bytes, 1.0, "a")
    };
    let nodes = r#""nodes":[{"scale":[2,2,2],"children":[1]},{"mesh":0,"translation":[1,0,0],"scale":[-1,1,1]}]"#;
    let (mesh, report) = read(nodes).unwrap();
    assert!(!report.flipped, "mirroring is undone by turning the triangles");
    assert_relative_eq!(mesh.volume_m3(), 8.0 * 24e-6, max_relative = 1e-6);
    assert_relative_eq!(mesh.bounds().unwrap().0[0], 2.0 - 0.02, max_relative = 1e-6);
    refuses(read(r#""nodes":[{"mesh":0,"children":[0]}]"#), &["the node tree is cyclic"]);
    refuses(read(r#""nodes":[{"mesh":3}]"#), &["mesh 3 is outside [0, 1)"]);
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
        (r#""indices":1"#, r#""indices":1,"mode":9"#),
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
            (mesh.to_obj("a").into_bytes(), read_obj::<f64> as fn(&[u8], f64, &str) -> _),
            (mesh.to_glb("a"), read_glb::<f64>),
            (binary(&mesh), read_stl::<f64>),
            (text(&mesh), read_stl::<f64>),
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
            prop_assert_eq!(mended.open_edges() == 0, report.open_edges == 0);
            prop_assert!(report.open_edges > 0 || mended.volume_m3() > 0.0 && report.triangles == mended.triangles.len());
        }
    }
}

// STL files as they are met: text and binary, with every header, damaged.

/// Text STL of `mesh`, as most programs write it.
fn text(mesh: &TriMesh) -> Vec<u8> {
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

/// Binary STL of `mesh`: an empty header, and of each triangle a normal, three corners and a word that mean nothing.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the file's precision")]
fn binary(mesh: &TriMesh) -> Vec<u8> {
    let mut out = vec![0; 80];
    out.extend(index(mesh.triangles.len()).to_le_bytes());
    for t in 0..mesh.triangles.len() {
        let corners = mesh.corners(t);
        out.extend([0; 12]);
        out.extend(corners.as_flattened().iter().flat_map(|x| (*x as f32).to_le_bytes()));
        out.extend([0; 2]);
    }
    out
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
    let says = |bytes: &[u8], part: &str| refuses(read_stl(bytes, 1.0, "a.stl"), &[part]);
    let binary = binary(&block());
    says(&binary[..500], "12 triangles = 684 bytes, the file has 500");
    let mut more = binary.clone();
    more[80] = 13;
    says(&more, "13 triangles = 734 bytes, the file has 684");
    says(&[&binary[..], &[7; 49], &[8; 51]].concat(), "684 bytes, the file has 784 (100 bytes too many");
    says(b"", "0 bytes");
    says(&[0; 84], "0 triangles");
    let mut solid = binary.clone();
    solid[..5].copy_from_slice(b"solid");
    says(&solid[..683], "684 bytes");
    let mut nan = binary;
    nan[84 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    says(&nan, "vertex 0, coordinate y = NaN");

    let plain = String::from_utf8(text(&block())).unwrap();
    says(&plain.as_bytes()[..plain.len() / 2], "truncated?");
    let broken = |old: &str, new: &str| plain.replacen(old, new, 1).into_bytes();
    says(&broken("e-2", "e-2x"), "malformed: line 4: coordinate x = `-1e-2x` is not a number");
    says(&broken("vertex -1e-2", "vertex -inf"), "line 4: coordinate x = `-inf` is not a finite number");
    says(&broken("    endloop\n", ""), "line 7: `endloop` expected, found `endfacet`");
    says(b"solid empty\nendsolid empty\n", "0 triangles");
    // the unit of a file is never guessed
    let micrometres = self::binary(&block().scaled([1e6; 3]));
    says(&micrometres, "micrometres, use scale = 1e-6");
    assert!(read_stl(&micrometres, 1e-6, "a.stl").is_ok());
}

// Every defect a user's mesh may have, on solids of known volume.

/// 20 × 20 × 10 mm with faces in a grid of 1 mm: small defects are small against its extent.
fn tile() -> TriMesh {
    cuboid([0.02, 0.02, 0.01]).refined(1.5e-3, |_, _| true)
}

/// What the gate makes of a mesh that it lets pass.
#[track_caller]
fn pass(mesh: &TriMesh) -> (TriMesh, MeshReport) {
    let (mesh, report) = gate(mesh).unwrap();
    assert_eq!(mesh.open_edges(), 0);
    assert_relative_eq!(mesh.volume_m3(), report.volume_m3);
    (mesh, report)
}

/// Middle of triangle `t`.
fn centre(mesh: &TriMesh, t: usize) -> [f64; 3] {
    let [a, b, c] = mesh.corners(t);
    [0, 1, 2].map(|k| (a[k] + b[k] + c[k]) / 3.0)
}

/// Without the triangles whose middle `gone` accepts.
fn without(mesh: &TriMesh, gone: impl Fn([f64; 3]) -> bool) -> TriMesh {
    let keep: Vec<bool> = (0..mesh.triangles.len()).map(|t| !gone(centre(mesh, t))).collect();
    mesh.only(&keep)
}

#[test]
fn a_sound_mesh_passes_untouched() {
    let (mesh, report) = pass(&block());
    assert_eq!(mesh, block());
    assert_eq!(report.notes(), Vec::<String>::new());
    assert_eq!((report.vertices, report.triangles), (8, 12));
}

#[test]
fn triangles_turned_against_their_neighbours() {
    let mut mesh = tile();
    for t in (0..mesh.triangles.len()).step_by(7) {
        mesh.triangles[t].swap(0, 1);
    }
    let (mended, report) = pass(&mesh);
    assert_eq!(report.turned_triangles, mesh.triangles.len().div_ceil(7));
    assert!(!report.flipped);
    assert_relative_eq!(mended.volume_m3(), 4e-6, max_relative = 1e-12);
}

#[test]
fn parts_are_turned_one_by_one() {
    let (mesh, report) = pass(&block().flipped());
    assert!(report.flipped);
    assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 1e-12);
    let apart = block().merged(&block().translated([0.1, 0.0, 0.0]).flipped());
    let along_an_edge = block().merged(&block().flipped().translated([0.02, 0.03, 0.0]));
    // parts that overlap are a union: both stay outward
    let overlapping = block().merged(&block().translated([0.013, 0.011, 0.007]));
    for (pair, flipped) in [(apart, true), (along_an_edge, true), (overlapping, false)] {
        let (mesh, report) = pass(&pair);
        assert_eq!((report.flipped, report.turned_triangles), (flipped, 0));
        assert_relative_eq!(mesh.volume_m3(), 48e-6, max_relative = 1e-12);
    }
}

#[test]
fn a_cavity_is_not_inside_out() {
    let cavity = cuboid([0.01, 0.01, 0.01]).translated([0.0, 0.0, 0.01]).flipped();
    let hollow = block().merged(&cavity);
    let (mesh, report) = pass(&hollow);
    assert!(!report.flipped);
    for t in 0..hollow.triangles.len() {
        let [before, after] = [&hollow, &mesh].map(|m| m.area_vector_m2(t).map(f64::to_bits));
        assert_eq!(before, after);
    }
    // the whole inside out: both are turned
    let (mesh, report) = pass(&hollow.clone().flipped());
    assert!(report.flipped);
    assert_relative_eq!(mesh.volume_m3(), 23e-6, max_relative = 1e-12);
    // inside the box around a bent part, but not inside the part: no cavity
    let arch = extrude_recessed(&polygon::rectangle(0.04, 0.04), &polygon::rectangle(0.03, 0.03), 0.03, 0.025);
    let below = cuboid([0.01, 0.01, 0.01]).flipped();
    let (mesh, report) = pass(&arch.clone().merged(&below));
    assert!(report.flipped);
    assert_relative_eq!(mesh.volume_m3(), arch.volume_m3() + 1e-6, max_relative = 1e-12);
}

#[test]
fn duplicate_triangles_are_dropped() {
    let mut mesh = block();
    let [a, b, c] = mesh.triangles[3];
    mesh.triangles.push([b, c, a]);
    // the same corners the other way: still one triangle of the surface
    let [a, b, c] = mesh.triangles[5];
    mesh.triangles.push([b, a, c]);
    let (mended, report) = pass(&mesh);
    assert_eq!((report.duplicate_triangles, mended), (2, block()));
    // everything twice, the copies turned over
    let (mended, report) = pass(&block().merged(&block().flipped()));
    assert_eq!((report.duplicate_triangles, report.joined_vertices), (12, 8));
    assert_relative_eq!(mended.volume_m3(), 24e-6, max_relative = 1e-12);
}

#[test]
fn sheets_that_enclose_nothing_go() {
    // a fin of two sides on an edge of the block
    let mut mesh = block();
    let tip = index(mesh.vertices.len());
    mesh.vertices.push([0.0, 0.0, 0.06]);
    let [a, b, _] = mesh.triangles[4];
    mesh.triangles.extend([[a, b, tip], [b, a, tip]]);
    let (mended, report) = pass(&mesh);
    assert_eq!((report.duplicate_triangles, mended.triangles.len()), (2, 12));
    // two boxes with a face in common: the wall between them goes, one box of twice the volume stays
    let mirrored = block().scaled([-1.0, 1.0, 1.0]).translated([0.02, 0.0, 0.0]);
    let (mended, report) = pass(&block().merged(&mirrored));
    assert_eq!((report.joined_vertices, report.duplicate_triangles), (4, 4));
    assert_relative_eq!(mended.volume_m3(), 48e-6, max_relative = 1e-12);
    // cut along different diagonals it stays, and does no harm
    let (mended, report) = pass(&block().merged(&block().translated([0.02, 0.0, 0.0])));
    assert_eq!((report.joined_vertices, report.duplicate_triangles), (4, 0));
    assert_relative_eq!(mended.volume_m3(), 48e-6, max_relative = 1e-12);
}

#[test]
fn small_holes_are_filled_flat() {
    let whole = cuboid([0.02, 0.02, 0.01]).refined(0.9e-3, |p, q| p[2].max(q[2]) <= 0.0);
    // one triangle of the underside, which is flat, so that volume and area come back
    let below = (0..whole.triangles.len()).find(|&t| centre(&whole, t)[2] <= 0.0).unwrap();
    let mut keep = vec![true; whole.triangles.len()];
    keep[below] = false;
    let (mended, report) = pass(&whole.only(&keep));
    assert_eq!((report.filled_holes, report.lids), (1, 0));
    assert_relative_eq!(mended.volume_m3(), 4e-6, max_relative = 1e-12);
    assert_relative_eq!(mended.area_m2(), whole.area_m2(), max_relative = 1e-12);
    // a finer tile, from which a patch of several triangles is missing
    let fine = cuboid([0.02, 0.02, 0.01]).refined(3e-4, |p, q| p[2].max(q[2]) <= 0.0);
    let holed = without(&fine, |c| c[2] <= 0.0 && c[0].hypot(c[1] - 0.002) < 3e-4);
    assert!(holed.triangles.len() + 3 < fine.triangles.len() && holed.open_edges() > 3);
    let (mended, report) = pass(&holed);
    assert_eq!(report.filled_holes, 1);
    assert_relative_eq!(mended.volume_m3(), 4e-6, max_relative = 1e-12);
}

#[test]
fn holes_that_may_touch_are_refused_with_their_place() {
    // the underside and a wall are missing; and a sieve of small holes
    let open_below = without(&tile(), |c| c[2] <= 0.0);
    refuses(gate(&open_below), &[", 0.0000) of the file: ", "downward"]);
    let open_beside = without(&tile(), |c| c[0] >= 0.00999);
    refuses(gate(&open_beside), &["one at (0.0100, "]);
    let fine = cuboid([0.02, 0.02, 0.01]).refined(8e-4, |_, _| true);
    let keep: Vec<bool> = (1..=fine.triangles.len()).map(|k| k % 13 != 0).collect();
    refuses(gate(&fine.only(&keep)), &["2 % of the surface"]);
    // places are in the unit of the file
    let millimetres = open_below.scaled([1e3; 3]);
    refuses(checked(&millimetres, 1e-3, "x.obj"), &["10.0000", "x.obj"]);
}

#[test]
fn an_open_top_gets_a_lid_above_everything() {
    let bucket = without(&tile(), |c| c[2] >= 0.00999);
    let (mesh, report) = pass(&bucket);
    assert_eq!((report.lids, report.filled_holes), (1, 0));
    // the lid stands a quarter of the extent, 5 mm, above the top
    assert_relative_eq!(mesh.volume_m3(), 4e-6 + 2e-6, max_relative = 1e-12);
    // a scan of a bumpy underside that is no solid at all, facing down, with a notch in its outline
    let n = 24_u32;
    let at = |i: u32, j: u32| {
        let (x, y) = (f64::from(i) * 2e-3, f64::from(j) * 2e-3);
        [x, y, 1e-3 * (300.0 * x).sin() * (200.0 * y).cos()]
    };
    let mut scan = TriMesh::default();
    for i in 0..n {
        for j in 0..n {
            if i > 16 && j > 5 && j < 9 {
                continue;
            }
            let base = index(scan.vertices.len());
            scan.vertices.extend([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            scan.triangles.extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        }
    }
    let (mesh, report) = pass(&scan);
    assert_eq!(report.lids, 1);
    for k in 0..400 {
        let [x, y] = [(k % 20, 0.0023), (k / 20, 0.0024)].map(|(i, step)| 7e-4 + f64::from(i) * step);
        let [before, after] = [&scan, &mesh].map(|mesh| mesh.underside_m([x, y]).map(f64::to_bits));
        // the very same triangles decide, except in the notch, where there is nothing before and nothing after
        assert_eq!(before, after, "({x}, {y})");
    }
    // the same scan facing up says that its solid lies below it
    refuses(gate(&scan.flipped()), &["opens sideways or downward"]);
}

/// A cone on its tip, 40 mm wide and 20 mm high, open above with a rim of `n` edges.
fn bowl(n: u32) -> TriMesh {
    let mut bowl = TriMesh { vertices: vec![[0.0; 3]], triangles: Vec::new() };
    for k in 0..n {
        let (y, x) = (std::f64::consts::TAU * f64::from(k) / f64::from(n)).sin_cos();
        bowl.vertices.push([0.02 * x, 0.02 * y, 0.02]);
        bowl.triangles.push([0, 1 + (k + 1) % n, 1 + k]);
    }
    bowl
}

#[test]
fn rims_that_would_take_long_are_refused() {
    assert_eq!(pass(&bowl(2000)).1.lids, 1);
    refuses(gate(&bowl(2001)), &["more than 2000 edges"]);
    // two rims, each short enough: 1700³ is 61 % of 2000³
    let two = bowl(1700).merged(&bowl(1700).translated([0.1, 0.0, 0.0]));
    refuses(gate(&two), &["more than 2000 edges"]);
}

#[test]
fn vertices_on_a_neighbours_edge() {
    // the edge between two triangles of a face split for one of them only
    let mut mesh = block();
    let [a, b, c] = mesh.triangles[0];
    let middle = mesh.middle_m([a, b]);
    let m = index(mesh.vertices.len());
    mesh.vertices.push(middle);
    mesh.triangles[0] = [a, m, c];
    mesh.triangles.push([m, b, c]);
    assert_eq!(mesh.open_edges(), 3);
    let (mended, report) = pass(&mesh);
    assert_eq!(report.filled_holes, 1);
    assert_relative_eq!(mended.volume_m3(), 24e-6, max_relative = 1e-12);
    assert_relative_eq!(mended.area_m2(), block().area_m2(), max_relative = 1e-12);
}

#[test]
fn surfaces_without_outside() {
    // a wall inside a box: three sheets meet along its border
    let mut walled = block();
    let corner = |p: [f64; 3]| {
        let near = |v: &[f64; 3]| (0..3).all(|k| (v[k] - p[k]).abs() < 1e-9);
        index(walled.vertices.iter().position(near).unwrap())
    };
    let ends = [
        corner([-0.01, -0.015, 0.0]),
        corner([0.01, 0.015, 0.0]),
        corner([0.01, 0.015, 0.04]),
        corner([-0.01, -0.015, 0.04]),
    ];
    walled.triangles.extend([[ends[0], ends[1], ends[2]], [ends[0], ends[2], ends[3]]]);
    // nothing of it shows from below: the underside is that of the box
    let (mesh, report) = gate(&walled).unwrap();
    assert_eq!((report.open_edges > 0, report.open_below_m, mesh.triangles.len()), (true, None, 14));
    assert!(report.notes()[0].contains("none of its holes is seen from below"), "{:?}", report.notes());
    // a Möbius band
    let mut band = TriMesh::default();
    let turns = 24_u32;
    for k in 0..turns {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(turns);
        for side in [-0.005, 0.005] {
            let r = 0.02 + side * (0.5 * angle).cos();
            band.vertices.push([r * angle.cos(), r * angle.sin(), side * (0.5 * angle).sin()]);
        }
    }
    for k in 0..turns {
        let (p, q) = (2 * k, 2 * k + 1);
        let (r, s) = if k + 1 < turns { (p + 2, q + 2) } else { (1, 0) };
        band.triangles.extend([[p, r, q], [q, r, s]]);
    }
    refuses(gate(&band), &["the surface has one side only"]);
}

#[test]
fn a_mesh_far_from_its_origin_is_reported() {
    let (_, report) = pass(&block().translated([0.5, 0.0, 0.0]));
    assert!(report.is_off_centre());
    assert!(report.notes()[0].contains("(500.0, 0.0) mm"), "{:?}", report.notes());
}

// Decimation against closed forms and against the original.

/// Deepest point below a sphere of `radius_m` of the triangles inscribed in it: the centre of the smallest circle
/// around a triangle, which is its circumcentre or, if it is obtuse, the middle of its longest side.
fn deepest_m(mesh: &TriMesh, radius_m: f64) -> f64 {
    let depth = |t: usize| {
        let [a, b, c] = mesh.corners(t);
        let square = |p: [f64; 3], q: [f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>();
        let mut sides = [square(a, b), square(b, c), square(c, a)];
        sides.sort_by(f64::total_cmp);
        let [s, m, l] = sides;
        let n = mesh.area_vector_m2(t);
        let double = n.iter().map(|x| x * x).sum::<f64>();
        let circle = if l >= s + m { 0.25 * l } else { s * m * l / (4.0 * double) };
        radius_m - (radius_m * radius_m - circle).sqrt()
    };
    (0..mesh.triangles.len()).map(depth).fold(0.0, f64::max)
}

/// New vertices are old ones and lie on the sphere, so that the depth of the new facets is known in closed form.
#[test]
fn a_fine_sphere_is_decimated_within_its_bound() {
    let radius_m = 0.03;
    let ball = sphere(radius_m, 160, 320);
    assert!(ball.triangles.len() > 100_000);
    let (mesh, report) = pass(&ball);
    assert_eq!(report.decimated_from, Some(ball.triangles.len()));
    assert_eq!((mesh.triangles.len() <= SOFT_MAX_TRIANGLES, report.heavy), (true, false));
    let said_m = report.decimation_error_m.unwrap();
    assert!(said_m > 0.0 && said_m <= MAX_DECIMATION_ERROR_M, "{said_m}");
    // the original lies below the sphere itself, by at most its own deepest facet; and the deepest point is missed by
    // at most half the original's spacing s, over which a depth changes by s²/8R
    let spacing_m = std::f64::consts::TAU * radius_m / 320.0;
    let slack_m = deepest_m(&ball, radius_m) + spacing_m * spacing_m / (8.0 * radius_m);
    let depth_m = deepest_m(&mesh, radius_m);
    assert!((said_m - depth_m).abs() <= slack_m, "{said_m} {depth_m} {slack_m}");
    // the volume lost is at most the area times the error
    assert!(mesh.volume_m3() > ball.volume_m3() - ball.area_m2() * said_m);
    let again = pass(&ball).0;
    assert!(again == mesh, "not deterministic");
}

/// A rough surface cannot be brought down to the target within the bound: it keeps more triangles rather than its
/// error.
#[test]
fn what_cannot_be_decimated_within_the_bound_stays_heavy() {
    let mut rough = sphere(0.03, 60, 120);
    for (k, v) in rough.vertices.iter_mut().enumerate() {
        let factor = if k % 2 == 0 { 1.02 } else { 0.98 };
        *v = [v[0] * factor, v[1] * factor, 0.03 + (v[2] - 0.03) * factor];
    }
    let (mesh, report) = pass(&rough);
    assert!(report.heavy && mesh.triangles.len() > SOFT_MAX_TRIANGLES);
    assert!(report.decimation_error_m.unwrap_or(0.0) <= MAX_DECIMATION_ERROR_M);
    assert!(report.notes().iter().any(|n| n.contains("slow contact")));
}

/// The slivers around the poles, 7 µm wide, mislead the estimate of the error.
#[test]
fn a_ball_of_slivers_is_decimated_from_stl_too() {
    let ball = sphere(0.05, 300, 501);
    let (mesh, report) = read_stl(&binary(&ball), 1.0, "ball.stl").unwrap();
    assert_eq!(report.decimated_from, Some(299_598));
    assert!(report.decimation_error_m.unwrap() <= MAX_DECIMATION_ERROR_M && mesh.triangles.len() < 60_000);
    assert!((mesh.volume_m3() / 5.236e-4 - 1.0).abs() < 0.01, "{}", mesh.volume_m3());
}

/// A million triangles, bumpy so that the decimation has something to keep, as a file has them. Oracle: the underside
/// of the original, found by trying every triangle.
#[test]
fn a_million_triangles_from_a_file() {
    let ball = sphere(0.03, 500, 1000).mapped(|v| {
        let bump = 1.0 + 0.01 * (200.0 * v[0]).sin() * (200.0 * v[1]).cos();
        [v[0] * bump, v[1] * bump, v[2]]
    });
    let (mesh, report) = read_stl(&binary(&ball), 1.0, "ball.stl").unwrap();
    assert_eq!(report.decimated_from, Some(ball.triangles.len()));
    assert_eq!(mesh.open_edges(), 0);
    // smooth on the scale of a millimetre: a few thousand facets follow it to 0.1 mm
    assert!(mesh.triangles.len() < 2 * SOFT_MAX_TRIANGLES, "{}", mesh.triangles.len());
    let error_m = report.decimation_error_m.unwrap();
    assert!(error_m <= MAX_DECIMATION_ERROR_M, "{error_m}");
    // up to 10 mm from the lowest point the surface rises by at most tan(asin(1/3)) + 0.06 = 0.41, so that a distance e
    // between the surfaces is at most 1.1 e upright; the rest is for where the error was not sampled
    for [x, y] in [[0.0, 0.0], [0.004, 0.001], [-0.003, 0.005], [0.006, -0.007], [-0.0091, -0.002]] {
        let [before, after] = [&ball, &mesh].map(|mesh| mesh.underside_m([x, y]).unwrap());
        assert!((before - after).abs() <= 1.2 * error_m, "({x}, {y}): {before} {after}");
    }
}

// OBJ as people write it: one table for what is read, one for what is refused.

/// A box of 40 × 60 × 20 mm by quadrangles; `#` goes behind every datum, a face goes on in the next line.
const BOX: &str = "v 0 0 0\nv 0.04 0 0\nv 0.04 0.06 0\nv 0 0.06 0\nv 0 0 0.02\nv 0.04 0 0.02\nv 0.04 0.06 0.02\n\
                   v 0 0.06 0.02\nf 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";

#[test]
fn obj_is_read_whatever_its_line_ends_and_names() {
    let named = |name: &[u8]| [b"# ", name, b"\no ", name, b"\nmtllib ", name, b"\n", BOX.as_bytes()].concat();
    let with = |old: &str, new: &str| BOX.replace(old, new).into_bytes();
    for (what, text) in [
        ("plain", BOX.as_bytes().to_vec()),
        ("comments", with("\n", " # 7 8 9\n")),
        ("comments at once", with("\n", "#7\n")),
        ("CR LF", with("\n", "\r\n")),
        ("CR", with("\n", "\r")),
        ("no last line end", BOX.trim_end().as_bytes().to_vec()),
        ("continued", with("f 1 4 3 2", "f 1 4 \\\n3 2")),
        (
            "continued, CR LF",
            with("\n", "\r\n").iter().flat_map(|&b| if b == b' ' { b" \\\r\n ".to_vec() } else { vec![b] }).collect(),
        ),
        ("continued twice", with("f 1 4 3 2", "f \\\n1 4 \\  \n3 2 # end")),
        ("comment with a backslash", with("f 1 4 3 2", "# c:\\\nf 1 4 3 2")),
        ("path with a backslash", with("f 1 4 3 2", "mtllib c:\\\nf 1 4 3 2")),
        ("Latin-1", named(b"W\xfcrfel")),
        // the second byte of the last character is a backslash
        ("GBK", named(b"\xc4\xa3\xd0\xcd \xb2\x5c")),
        ("more numbers and slashes", with("f 1 4 3 2", "vt 0 0\nf 1// 4/1 3/1/1 2//1")),
        ("colours and weights", with("v 0 0 0\n", "v 0 0 0 255 255 255\n").to_vec()),
        ("faces before their vertices", {
            let (vertices, faces) = BOX.split_once('f').unwrap();
            format!("f{faces}{vertices}").into_bytes()
        }),
        ("corners repeated and in a row", with("f 1 4 3 2", "f 1 1 4 3 3 2 1")),
        ("a face of two corners, a line, a point", with("f 1 4 3 2", "f 1 4 3 2\nf 1 2\nl 1 2\np 1")),
    ] {
        let (mesh, _) = read_obj(&text, 1.0, "a.obj").unwrap_or_else(|error| panic!("{what}: {error}"));
        assert_relative_eq!(mesh.volume_m3(), 4.8e-5, max_relative = 1e-12);
        assert_eq!(mesh.vertices.len(), 8, "{what}");
    }
}

#[test]
fn obj_faults_have_their_line_and_what_to_do() {
    let wide = |little: bool, mark: &str| -> Vec<u8> {
        let units = mark.encode_utf16().chain(BOX.encode_utf16());
        units.flat_map(|u| if little { u.to_le_bytes() } else { u.to_be_bytes() }).collect()
    };
    for (text, words) in [
        (BOX.replace("0.06", "0,06"), ["line 3", "`0,06`", "decimal points, not commas"]),
        (BOX.replace("0.02", "2e-2m"), ["line 5", "`2e-2m`", "not a number"]),
        (BOX.replace("v 0 0 0\n", "v 0 0\n"), ["line 1", "coordinate z", "missing"]),
        (BOX.replace("f 2 3 7 6", "f 2 3 7 9"), ["line 12", "vertex 9", "[1, 8] or [-8, -1]"]),
        (BOX.replace("f 2 3 7 6", "f 2 3 7 0"), ["line 12", "vertex 0", "[1, 8]"]),
        (BOX.replace("f 2 3 7 6", "f 2 3 7 -9"), ["line 12", "vertex -9", "[-8, -1]"]),
        (BOX.replace("f 2 3 7 6", "f 2 3 7.5 6"), ["line 12", "`7.5`", "whole number"]),
        (BOX.replace("f 2 3 7 6", "f 2,3,7,6"), ["line 12", "`2,3,7,6`", "spaces between corners"]),
        // the two sides of an 8
        (BOX.replace("f 1 4 3 2", "f 1 3 4 2"), ["line 9", "4 corners", "crosses itself"]),
    ] {
        refuses(read_obj(text.as_bytes(), 1.0, "a.obj"), &words);
    }
    for (little, mark) in [(true, "\u{feff}"), (false, "\u{feff}"), (true, ""), (false, "")] {
        refuses(read_obj(&wide(little, mark), 1.0, "a.obj"), &["UTF-16"]);
        let stl = String::from_utf8(text(&block())).unwrap();
        let units = mark.encode_utf16().chain(stl.encode_utf16());
        let stl: Vec<u8> = units.flat_map(|u| if little { u.to_le_bytes() } else { u.to_be_bytes() }).collect();
        refuses(read_stl(&stl, 1.0, "a.stl"), &["UTF-16"]);
    }
    let comma = String::from_utf8(text(&block())).unwrap().replace("-1e-2", "-0,01");
    refuses(read_stl(comma.as_bytes(), 1.0, "a.stl"), &["line 4", "`-0,01`", "decimal points, not commas"]);
}

/// Prism over `outline` in the plane that `turn` makes of z = 0, with its caps as one face each.
fn prism(outline: &[[f64; 2]], height: f64, place: impl Fn([f64; 3]) -> [f64; 3]) -> String {
    let n = outline.len();
    let mut out = String::new();
    for z in [0.0, height] {
        for [x, y] in outline {
            let [x, y, z] = place([*x, *y, z]);
            let _ = writeln!(out, "v {x:?} {y:?} {z:?}");
        }
    }
    let list = |corners: Vec<usize>| corners.iter().map(ToString::to_string).collect::<Vec<_>>().join(" ");
    let _ = writeln!(out, "f {}\nf {}", list((1..=n).rev().collect()), list((n + 1..=2 * n).collect()));
    for k in 0..n {
        let j = (k + 1) % n;
        let _ = writeln!(out, "f {} {} {} {}", k + 1, j + 1, n + j + 1, n + k + 1);
    }
    out
}

/// Faces of every outline cover its area, in any plane and from any first corner: volume = area × height.
#[test]
fn concave_faces_cover_their_area() {
    let u = vec![[0.0, 0.0], [9.0, 0.0], [9.0, 9.0], [7.0, 9.0], [7.0, 2.0], [2.0, 2.0], [2.0, 9.0], [0.0, 9.0]];
    let arrow = vec![[0.0, 0.0], [4.0, 2.0], [0.0, 4.0], [1.0, 2.0]];
    let star: Vec<[f64; 2]> = (0..24)
        .map(|k| {
            let (y, x) = (std::f64::consts::TAU * f64::from(k) / 24.0).sin_cos();
            let r = if k % 2 == 0 { 5.0 } else { 1.5 };
            [r * x, r * y]
        })
        .collect();
    // corners on a straight line, in the notch too
    let dotted = vec![
        [0.0, 0.0],
        [3.0, 0.0],
        [6.0, 0.0],
        [6.0, 6.0],
        [4.0, 6.0],
        [4.0, 4.0],
        [4.0, 2.0],
        [2.0, 2.0],
        [2.0, 6.0],
        [0.0, 6.0],
        [0.0, 3.0],
    ];
    for (outline, area) in
        [(u, 46.0), (arrow, 6.0), (star, 12.0 * 5.0 * 1.5 * (std::f64::consts::PI / 12.0).sin()), (dotted, 28.0)]
    {
        for first in 0..outline.len() {
            for (turn, far) in [(0.0, 0.0), (0.7, 0.0), (1.9, 5e5)] {
                let mut outline = outline.clone();
                outline.rotate_left(first);
                let (s, c) = f64::sin_cos(turn);
                let text = prism(&outline, 2.0, |[x, y, z]| {
                    [c * x - s * z + far, c * y - s * (s * x + c * z), s * y + c * (s * x + c * z)]
                });
                let (mesh, report) = read_obj(text.as_bytes(), 0.01, "a.obj").unwrap();
                // 5e3 m of f64 have steps of 1e-12 m, of 0.04 m 2e-11
                assert_relative_eq!(mesh.volume_m3(), 2.0 * area * 1e-6, max_relative = 1e-8);
                assert_eq!((report.filled_holes, report.open_edges), (0, 0), "{first} {turn}");
            }
        }
    }
    // a square with a square hole, joined by a cut that the outline goes both ways
    let ring = [
        [0.0, 0.0],
        [6.0, 0.0],
        [6.0, 6.0],
        [0.0, 6.0],
        [0.0, 0.0],
        [2.0, 2.0],
        [2.0, 4.0],
        [4.0, 4.0],
        [4.0, 2.0],
        [2.0, 2.0],
    ];
    let triangles = polygon::cut(&ring, |_| true).unwrap();
    let area: f64 = triangles.iter().map(|&[a, b, c]| 0.5 * polygon::turn(ring[a], ring[b], ring[c])).sum();
    assert_relative_eq!(area, 32.0, max_relative = 1e-12);
    // two squares that touch in a corner
    let touching = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [1.0, 1.0], [0.0, 1.0]];
    let triangles = polygon::cut(&touching, |_| true).unwrap();
    let area: f64 = triangles.iter().map(|&[a, b, c]| 0.5 * polygon::turn(touching[a], touching[b], touching[c])).sum();
    assert_relative_eq!(area, 2.0, max_relative = 1e-12);
    // a star drawn in one stroke goes twice around its middle
    let pentagram: Vec<[f64; 2]> =
        (0..5).map(|k| f64::from(2 * k) * std::f64::consts::TAU / 5.0).map(|a| [a.cos(), a.sin()]).collect();
    assert!(polygon::cut(&pentagram, |_| true).is_err());
    // a comb of more teeth than can be cut
    let comb: Vec<[f64; 2]> =
        (0..2100).map(|k| [f64::from(k), f64::from(k % 2)]).chain([[2099.0, -1.0], [0.0, -1.0]]).collect();
    let text = prism(&comb.iter().rev().copied().collect::<Vec<_>>(), 2.0, |p| p);
    refuses(read_obj(text.as_bytes(), 1e-4, "a.obj"), &["line 4205", "more corners than can be cut"]);
}

#[test]
fn far_from_the_origin() {
    let far = [500_000.0, 400_000.0, 12.0];
    let text: String = BOX.lines().fold(String::new(), |mut out, line| {
        let numbers: Vec<f64> = line.split(' ').skip(1).map(|word| word.parse().unwrap()).collect();
        let _ = match line.starts_with('v') {
            true => writeln!(out, "v {:.3} {:.3} {:.3}", numbers[0] + far[0], numbers[1] + far[1], numbers[2] + far[2]),
            false => writeln!(out, "{line}"),
        };
        out
    });
    // half a step of f64 there is 3e-11 m, of 20 mm 1.5e-9
    let (mesh, report) = read_obj(text.as_bytes(), 1.0, "a.obj").unwrap();
    assert_relative_eq!(mesh.volume_m3(), 4.8e-5, max_relative = 1e-8);
    assert!(mesh.is_solid() && report.is_off_centre());
    let options = MeshOptions { centre: true, ..MeshOptions::from(1.0) };
    let (mesh, report) = read_obj(text.as_bytes(), options, "a.obj").unwrap();
    let (low, high) = mesh.bounds().unwrap();
    for (found, expected) in low.iter().chain(&high).zip([-0.02, -0.03, 0.0, 0.02, 0.03, 0.02]) {
        assert!((found - expected).abs() < 1e-9, "{low:?} {high:?}");
    }
    assert!(report.notes()[0].contains("moved by (-500000020.0, -400000030.0, -12000.0) mm"), "{:?}", report.notes());
    // formats of f32 have steps of 31 mm there
    let moved = block().translated(far);
    refuses(read_stl(&binary(&moved), 1.0, "a.stl"), &["up to 500000", "steps of 6", "move it to the origin"]);
    refuses(read_glb(&moved.to_glb("a"), 1.0, "a.glb"), &["up to 500000"]);
    assert!(read_stl(&binary(&block().translated([1.0, 1.0, 1.0])), 1.0, "a.stl").is_ok());
}

#[test]
fn stl_with_a_tail_or_a_wrong_count() {
    let binary = binary(&block());
    for tail in [&[13, 10][..], b"thirteen byte", &[0; 428], &[26; 3]] {
        let (mesh, report) = read_stl(&[&binary, tail].concat(), 1.0, "a.stl").unwrap();
        assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 2e-7);
        assert_eq!(report.appended_bytes, tail.len());
        assert!(report.notes()[0].contains("after the last triangle"), "{:?}", report.notes());
    }
    let mut none = binary.clone();
    none[80] = 0;
    refuses(read_stl(&none, 1.0, "a.stl"), &["declares 0 triangles", "684 bytes", "12 triangles"]);
    // one triangle fewer than there are
    none[80] = 11;
    refuses(read_stl(&none, 1.0, "a.stl"), &["11 triangles = 634 bytes", "684"]);
    let latin = [b"solid K\xf6rper\n", &text(&block())[b"solid thing\n".len()..]].concat();
    is_the_block(&latin);
}

#[test]
fn sheets_are_told_as_such() {
    let sheet = |z: fn(f64) -> f64| {
        let mut sheet = TriMesh::default();
        for [x, y] in [[0.0, 0.0], [0.06, 0.0], [0.06, 0.04], [0.0, 0.04]] {
            sheet.vertices.push([x, y, z(x + y)]);
        }
        sheet.triangles.extend([[0, 1, 2], [0, 2, 3]]);
        sheet
    };
    let flat = sheet(|_| 0.0);
    let upright = flat.clone().mapped(|[x, y, _]| [x, 0.01, y]);
    let two_sided = |mesh: &TriMesh| mesh.clone().merged(&mesh.clone().flipped());
    let bent = sheet(|d| d * d);
    for mesh in
        [flat.clone(), two_sided(&flat), sheet(|d| 4e-3 * d), upright, two_sided(&bent), flat.clone().scaled([10.0; 3])]
    {
        let said = refused_words(&mesh);
        assert!(said.contains("encloses no volume") && said.contains("--as-is") && !said.contains("scale"), "{said}");
    }
    // the same, pressed as it is
    let options = MeshOptions { repair: Repair::NearSide, ..MeshOptions::from(1.0) };
    for mesh in [flat.clone(), two_sided(&flat), bent.clone(), two_sided(&bent)] {
        let (read, report) = checked(&mesh, options, "a.stl").unwrap();
        assert_eq!((read.triangles.len(), report.open_below_m.is_some()), (2, true));
    }
}

fn refused_words(mesh: &TriMesh) -> String {
    gate(mesh).unwrap_err().to_string()
}

/// Open below, it is refused with the way on; as it is, its underside is that of the shell.
#[test]
fn what_is_open_below_is_pressed_as_it_is_only_if_asked() {
    let open = without(&tile(), |c| c[2] <= 0.0);
    refuses(gate(&open), &["not closed", "`--as-is`", "repair = \"near_side\""]);
    let options = MeshOptions { repair: Repair::NearSide, ..MeshOptions::from(1.0) };
    let (mesh, report) = checked(&open, options, "a.stl").unwrap();
    assert_eq!((report.open_edges, report.lids, mesh.triangles.len()), (open.open_edges(), 0, open.triangles.len()));
    assert!(report.notes()[0].contains("is open towards the skin, as at ("), "{:?}", report.notes());
    // inside the rim, the skin meets the top from within
    assert_relative_eq!(mesh.underside_m([0.001, 0.002]).unwrap(), 0.01, max_relative = 1e-12);
    // a mesh that is closed is the same either way
    assert_eq!(checked(&tile(), options, "a.stl").unwrap().0, checked(&tile(), 1.0, "a.stl").unwrap().0);
    // a box without a wall inside a larger one: open, and nothing of that shows
    let inner = without(&tile(), |c| c[0] >= 0.00999).scaled([0.5; 3]).translated([0.0, 0.0, 2e-3]);
    let nested = tile().merged(&inner);
    let (mesh, report) = gate(&nested).unwrap();
    assert!(report.open_edges > 0 && report.open_below_m.is_none());
    assert_relative_eq!(mesh.underside_m([0.001, 0.002]).unwrap(), 0.0);
}

#[test]
fn sizes_are_told_in_plausible_units() {
    for (size, scale, words) in [
        (60.0, 1.0, ["millimetres, use scale = 0.001 (`--scale 0.001`)", "60 mm wide"]),
        (2.4, 1.0, ["inches, use scale = 0.0254", "60.96 mm wide"]),
        (0.06, 1e-3, ["metres, use scale = 1", "60 mm wide"]),
        (6e4, 1.0, ["micrometres, use scale = 1e-6", "60 mm wide"]),
        (2.4, 1e-4, ["inches, use scale = 0.0254", "millimetres, 0.001: 2.4 mm"]),
    ] {
        refuses(checked(&cuboid([size; 3]), scale, "a.stl"), &words);
    }
}

// GLB as exporters write it.

/// The JSON of a box of 24 cm³ by its writer, with `old` replaced by `new`.
fn glb(old: &str, new: &str) -> Result<(TriMesh, MeshReport), MeshError> {
    read_glb(&with_json(&block().to_glb("a"), old, new), 1.0, "a.glb")
}

#[test]
fn glb_extensions() {
    let requires = |name: &str| glb(r#"{"asset""#, &format!(r#"{{"extensionsRequired":["{name}"],"asset""#));
    for paint in [
        "KHR_materials_variants",
        "KHR_texture_transform",
        "KHR_texture_basisu",
        "EXT_texture_webp",
        "KHR_lights_punctual",
        "KHR_xmp_json_ld",
        "KHR_materials_unlit",
        "KHR_mesh_quantization",
    ] {
        let (mesh, _) = requires(paint).unwrap_or_else(|error| panic!("{paint}: {error}"));
        assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 1e-6);
    }
    for (name, words) in [
        ("KHR_draco_mesh_compression", "without Draco compression"),
        ("EXT_meshopt_compression", "without meshopt compression"),
        ("EXT_mesh_gpu_instancing", "may move triangles"),
    ] {
        refuses(requires(name), &[name, words]);
    }
    // packed triangles behind an extension that is only said to be used
    let used =
        with_json(&block().to_glb("a"), r#"{"asset""#, r#"{"extensionsUsed":["KHR_draco_mesh_compression"],"asset""#);
    let used = with_json(&used, r#"{"bufferView":0,"componentType":5126"#, r#"{"componentType":5126"#);
    refuses(read_glb(&used, 1.0, "a"), &["KHR_draco_mesh_compression"]);
}

#[test]
fn glb_skins_ignore_the_node_and_follow_the_bones() {
    let nodes = r#""nodes":[{"name":"a","mesh":0}]"#;
    // without weights nothing moves: neither the node nor its parent counts
    let skin = r#""skins":[{"joints":[1]}],"nodes":[{"mesh":0,"skin":0,"scale":[0.5,0.5,0.5],"translation":[0.3,0,0]},{"scale":[2,2,2]}]"#;
    let (mesh, report) = glb(nodes, skin).unwrap();
    assert!(report.posed && report.notes()[0].contains("pose of the file"), "{:?}", report.notes());
    assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 1e-6);
    assert_relative_eq!(mesh.bounds().unwrap().1[0], 0.01, max_relative = 1e-6);
    // every vertex follows the one joint, which doubles: 32 bytes of joints and 32 of weights more
    let bytes = block().to_glb("a");
    let mut more = with_json(&bytes, nodes, skin);
    more =
        with_json(&more, r#""attributes":{"POSITION":0}"#, r#""attributes":{"POSITION":0,"JOINTS_0":2,"WEIGHTS_0":3}"#);
    let base = 96 + 144;
    let accessors = format!(
        r#"{{"bufferView":2,"componentType":5121,"count":8,"type":"VEC4"}},{{"bufferView":3,"componentType":5121,"normalized":true,"count":8,"type":"VEC4"}}],"bufferViews":[{{"buffer":0,"byteLength":96}},{{"buffer":0,"byteOffset":96,"byteLength":144}},{{"buffer":0,"byteOffset":{base},"byteLength":32}},{{"buffer":0,"byteOffset":{},"byteLength":32}}"#,
        base + 32
    );
    let json = String::from_utf8_lossy(&more).into_owned();
    let from = json.find(r#"],"bufferViews":["#).unwrap();
    let to = json[from + 17..].find(']').unwrap() + from + 17;
    more = with_json(&more, &json[from..to], &format!(",{accessors}"));
    more = with_json(&more, r#""buffers":[{"byteLength":240}"#, r#""buffers":[{"byteLength":304}"#);
    // joints 0, and weights of 1 in the first place
    let mut tail = vec![0_u8; 32];
    tail.extend([255, 0, 0, 0].repeat(8));
    let length = index(more.len() + 64);
    more[8..12].copy_from_slice(&length.to_le_bytes());
    let json_length = u32::from_le_bytes(more[12..16].try_into().unwrap()) as usize;
    more[20 + json_length..][..4].copy_from_slice(&304_u32.to_le_bytes());
    more.extend(tail);
    let (mesh, _) = read_glb(&more, 1.0, "a").unwrap();
    assert_relative_eq!(mesh.volume_m3(), 8.0 * 24e-6, max_relative = 1e-6);
    refuses(read_glb(&with_json(&more, r#""joints":[1]"#, r#""joints":[]"#), 1.0, "a"), &["joint 0, outside [0, 0)"]);
}

#[test]
fn glb_modes_and_accessors() {
    let primitives = r#"{"attributes":{"POSITION":0},"indices":1}]"#;
    for mode in 0..4 {
        let beside = format!(
            r#"{{"attributes":{{"POSITION":0}},"indices":1}},{{"attributes":{{"POSITION":0}},"mode":{mode}}}]"#
        );
        let (mesh, report) = glb(primitives, &beside).unwrap();
        assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 1e-6);
        assert_eq!(report.skipped_primitives, 1);
    }
    refuses(glb(r#""indices":1"#, r#""indices":1,"mode":1"#), &["0 triangles"]);
    refuses(glb(r#""mesh":0}"#, r#""mesh":0,"weights":[0.5]}"#), &["morphed"]);
    // a tetrahedron as a strip, and its cap as a fan, of positions in whole numbers with a scale
    let corners: [[i16; 3]; 4] = [[0, 0, 0], [32767, 0, 0], [0, 32767, 0], [0, 0, 32767]];
    let bin: Vec<u8> = corners.iter().flat_map(|p| [p[0], p[1], p[2], 0]).flat_map(i16::to_le_bytes).collect();
    let whole = |mode: u32, order: &[u8], normalized: bool, scale: f64| {
        let bin = [&bin[..], order, &[0; 4][..(4 - order.len() % 4) % 4]].concat();
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"nodes":[{{"mesh":0,"scale":[{scale},{scale},{scale}]}}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1,"mode":{mode}}}]}}],"accessors":[{{"bufferView":0,"componentType":5122,"normalized":{normalized},"count":4,"type":"VEC3"}},{{"bufferView":1,"componentType":5121,"count":{n},"type":"SCALAR"}}],"bufferViews":[{{"buffer":0,"byteLength":32,"byteStride":8}},{{"buffer":0,"byteOffset":32,"byteLength":{n}}}],"buffers":[{{"byteLength":{all}}}]}}"#,
            n = order.len(),
            all = bin.len()
        );
        let json = format!("{json:<width$}", width = json.len().next_multiple_of(4));
        let mut out = b"glTF\x02\0\0\0".to_vec();
        out.extend(index(28 + json.len() + bin.len()).to_le_bytes());
        out.extend([&index(json.len()).to_le_bytes()[..], b"JSON", json.as_bytes()].concat());
        out.extend([&index(bin.len()).to_le_bytes()[..], b"BIN\0", &bin].concat());
        read_glb(&out, 1.0, "a")
    };
    // a sixth of the cube of 30 mm
    let strip = [0, 2, 1, 3, 0, 2];
    for (normalized, scale) in [(true, 0.03), (false, 0.03 / 32767.0)] {
        let (mesh, _) = whole(5, &strip, normalized, scale).unwrap();
        // the scale of a node is f32
        assert_relative_eq!(mesh.volume_m3(), 2.7e-5 / 6.0, max_relative = 2e-7);
    }
    // three sides around the tip, open above: the fourth is the lid's
    let (mesh, report) = whole(6, &[0, 2, 1, 3, 2], true, 0.03).unwrap();
    assert!(mesh.triangles.len() >= 4 && report.lids + report.filled_holes <= 1);
    // sparse: a vertex that is moved, and an accessor of zeros that all of its vertices change
    let sparse = |indices: usize| {
        format!(
            r#""count":8,"sparse":{{"count":{indices},"indices":{{"bufferView":1,"componentType":5125}},"values":{{"bufferView":0}}}},"#
        )
    };
    let (mesh, _) = glb(r#""count":8,"#, &sparse(0)).unwrap();
    assert_relative_eq!(mesh.volume_m3(), 24e-6, max_relative = 1e-6);
    refuses(glb(r#""count":8,"#, &sparse(9)), &["changes 9 of 8"]);
    // a vertex outside the span that the accessor declares
    let declared = format!(r#"{}"type":"VEC3","min":[1,"#, sparse(0));
    refuses(glb(r#""count":8,"type":"VEC3","min":["#, &declared), &["the sparse accessor 0 declares [1, "]);
    refuses(glb(r#""bufferView":0,"componentType":5126"#, r#""componentType":5126"#), &["0 triangles"]);
}
