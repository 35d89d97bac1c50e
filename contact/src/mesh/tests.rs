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
        (read_obj(b"v 1 2\nf 1 1 1\n", 1.0, "a"), "malformed: vertex 0, coordinate z = `` is not a number"),
        (read_obj(b"v 1 2 3\nf 1 1 x/1\n", 1.0, "a"), "malformed: triangle 0: `x` is not a whole number"),
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
    refuses(nan, &["vertex 1, coordinate y = NaN"]);
    let mut mesh = block();
    mesh.vertices[3][2] = f64::INFINITY;
    refuses(gate(&mesh), &["vertex 3, coordinate z = inf"]);
    assert!(read_glb(&mesh.to_glb("a"), 1.0, "a").is_err());
    let mut mesh = block();
    mesh.triangles[2][1] = 8;
    refuses(gate(&mesh), &["mesh `x.obj`: triangle 2 uses vertex 8, outside [0, 8)"]);
    let glb = read_glb(&mesh.to_glb("a"), 1.0, "a");
    refuses(glb, &["triangle 2 uses vertex 8, outside [0, 8)"]);
    let obj = read_obj(b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", 1.0, "a.obj");
    refuses(obj, &["uses vertex 4, outside [1, 3]"]);
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
    let words = ["vertex 0 has x = -1e10", "[-1000000, 1000000] m"];
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
            prop_assert_eq!(mended.open_edges(), 0);
            prop_assert!(mended.volume_m3() > 0.0 && report.triangles == mended.triangles.len());
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
    let appended = [&binary[..], b"\r\n"].concat();
    says(&appended, "684 bytes, the file has 686 (2 bytes too many");
    says(b"", "0 bytes");
    says(&[0; 84], "0 triangles");
    let mut solid = binary.clone();
    solid[..5].copy_from_slice(b"solid");
    says(&solid[..683], "684 bytes");
    let mut nan = binary;
    nan[84 + 12 + 4..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    says(&nan, "vertex 0, coordinate y = NaN");

    let plain = String::from_utf8(text(&block())).unwrap();
    says(&plain.as_bytes()[..plain.len() / 2], "endsolid");
    let broken = |old: &str, new: &str| plain.replacen(old, new, 1).into_bytes();
    says(&broken("e-2", "e-2x"), "malformed: vertex 0, coordinate x = `-1e-2x` is not a number");
    says(&broken("vertex -1e-2", "vertex -inf"), "coordinate x = -inf");
    says(&broken("    endloop\n", ""), "triangle 0: `endloop` expected, found `endfacet`");
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
fn surfaces_without_outside_are_refused() {
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
    let said = gate(&walled).unwrap_err().to_string();
    let parts = ["3 triangles meet in an edge at", "not closed"];
    assert!(parts.iter().any(|part| said.contains(part)), "{said}");
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
