//! Every defect a user's mesh may have, on solids of known volume.

use super::tri_mesh::index;
use super::*;
use approx::assert_relative_eq;

/// 20 × 30 × 40 mm: 24e-6 m³.
fn block() -> TriMesh {
    cuboid([0.02, 0.03, 0.04])
}

/// 20 × 20 × 10 mm with faces in a grid of 1 mm: small defects are small against its extent.
fn tile() -> TriMesh {
    cuboid([0.02, 0.02, 0.01]).refined(1.5e-3, |_, _| true)
}

pub(super) fn pass(mesh: &TriMesh) -> (TriMesh, MeshReport) {
    let (mesh, report) = checked(mesh, 1.0, "a").unwrap();
    assert_eq!(mesh.open_edges(), 0);
    assert_relative_eq!(mesh.volume_m3(), report.volume_m3);
    (mesh, report)
}

fn refused(mesh: &TriMesh) -> MeshError {
    checked(mesh, 1.0, "x.obj").unwrap_err()
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
    let apart = block().merged(&block().translated([0.1, 0.0, 0.0]).flipped());
    let (mesh, report) = pass(&apart);
    assert!(report.flipped && report.turned_triangles == 0);
    assert_relative_eq!(mesh.volume_m3(), 48e-6, max_relative = 1e-12);
    // parts that overlap are a union: both stay outward
    let (mesh, report) = pass(&block().merged(&block().translated([0.013, 0.011, 0.007])));
    assert!(!report.flipped);
    assert_relative_eq!(mesh.volume_m3(), 48e-6, max_relative = 1e-12);
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
    let arch = extrude_recessed(
        &polygon::rectangle(0.04, 0.04),
        &polygon::rectangle(0.03, 0.03),
        0.03,
        0.025,
    );
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
fn boxes_that_touch_along_an_edge_pass() {
    let pair = block().merged(&block().flipped().translated([0.02, 0.03, 0.0]));
    let (mesh, report) = pass(&pair);
    assert!(report.flipped);
    assert_relative_eq!(mesh.volume_m3(), 48e-6, max_relative = 1e-12);
}

#[test]
fn small_holes_are_filled_flat() {
    let whole = cuboid([0.02, 0.02, 0.01]).refined(0.9e-3, |p, q| p[2].max(q[2]) <= 0.0);
    // one triangle of the underside, which is flat, so that volume and area come back
    let below = (0..whole.triangles.len())
        .find(|&t| centre(&whole, t)[2] <= 0.0)
        .unwrap();
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
    let MeshError::NotClosed { at, why, .. } = refused(&open_below) else {
        panic!("not refused for its hole")
    };
    assert!(at[2].abs() < 1e-12 && why.contains("downward"), "{at:?} {why}");
    let MeshError::NotClosed { at, .. } = refused(&without(&tile(), |c| c[0] >= 0.00999)) else {
        panic!("not refused for its hole")
    };
    assert!((at[0] - 0.01).abs() < 1e-9, "{at:?}");
    let mut k = 0;
    let fine = cuboid([0.02, 0.02, 0.01]).refined(8e-4, |_, _| true);
    let keep: Vec<bool> = (0..fine.triangles.len())
        .map(|_| {
            k += 1;
            k % 13 != 0
        })
        .collect();
    assert!(refused(&fine.only(&keep)).to_string().contains("2 % of the surface"));
    // places are in the unit of the file
    let millimetres = open_below.scaled([1e3; 3]);
    let text = checked(&millimetres, 1e-3, "x.obj").unwrap_err().to_string();
    assert!(text.contains("10.0000") && text.contains("x.obj"), "{text}");
}

/// Lower envelope of `mesh` above (x, y), m, by trying every triangle: the oracle for what a lid may not change.
pub(super) fn lowest_m(mesh: &TriMesh, x: f64, y: f64) -> f64 {
    let mut low = f64::INFINITY;
    for t in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(t);
        let turn =
            |p: [f64; 3], q: [f64; 3], r: [f64; 3]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
        let whole = turn(a, b, c);
        let [u, v, w] = [[b, c], [c, a], [a, b]].map(|[p, q]| turn(p, q, [x, y, 0.0]) / whole);
        if whole.abs() > 0.0 && u >= 0.0 && v >= 0.0 && w >= 0.0 {
            low = low.min(u * a[2] + v * b[2] + w * c[2]);
        }
    }
    low
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
            scan.vertices
                .extend([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)]);
            scan.triangles
                .extend([[base, base + 1, base + 2], [base, base + 2, base + 3]]);
        }
    }
    let (mesh, report) = pass(&scan);
    assert_eq!(report.lids, 1);
    for k in 0..400 {
        let [x, y] = [(k % 20, 0.0023), (k / 20, 0.0024)].map(|(i, step)| 7e-4 + f64::from(i) * step);
        let (before, after) = (lowest_m(&scan, x, y), lowest_m(&mesh, x, y));
        // the very same triangles decide, except in the notch, where there is nothing before and nothing after
        assert_eq!(before.to_bits(), after.to_bits(), "({x}, {y})");
    }
    // the same scan facing up says that its solid lies below it
    assert!(
        refused(&scan.flipped())
            .to_string()
            .contains("opens sideways or downward")
    );
}

/// A cone on its tip, 40 mm wide and 20 mm high, open above with a rim of `n` edges.
fn bowl(n: u32) -> TriMesh {
    let mut bowl = TriMesh {
        vertices: vec![[0.0; 3]],
        triangles: Vec::new(),
    };
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
    assert!(refused(&bowl(2001)).to_string().contains("more than 2000 edges"));
    // two rims, each short enough: 1700³ is 61 % of 2000³
    let mut two = bowl(1700);
    let base = index(two.vertices.len());
    let other = bowl(1700).translated([0.1, 0.0, 0.0]);
    two.vertices.extend(&other.vertices);
    two.triangles
        .extend(other.triangles.iter().map(|t| t.map(|i| i + base)));
    assert!(refused(&two).to_string().contains("more than 2000 edges"));
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
    walled
        .triangles
        .extend([[ends[0], ends[1], ends[2]], [ends[0], ends[2], ends[3]]]);
    let error = refused(&walled);
    assert!(
        matches!(
            error,
            MeshError::Branching { triangles: 3, .. } | MeshError::NotClosed { .. }
        ),
        "{error}"
    );
    // a Möbius band
    let mut band = TriMesh::default();
    let turns = 24_u32;
    for k in 0..turns {
        let angle = std::f64::consts::TAU * f64::from(k) / f64::from(turns);
        for side in [-0.005, 0.005] {
            let r = 0.02 + side * (0.5 * angle).cos();
            band.vertices
                .push([r * angle.cos(), r * angle.sin(), side * (0.5 * angle).sin()]);
        }
    }
    for k in 0..turns {
        let (p, q) = (2 * k, 2 * k + 1);
        let (r, s) = if k + 1 < turns { (p + 2, q + 2) } else { (1, 0) };
        band.triangles.extend([[p, r, q], [q, r, s]]);
    }
    assert!(matches!(refused(&band), MeshError::OneSided { .. }));
}

#[test]
fn a_mesh_far_from_its_origin_is_reported() {
    let (_, report) = pass(&block().translated([0.5, 0.0, 0.0]));
    assert!(report.is_off_centre());
    assert!(report.notes()[0].contains("(500.0, 0.0) mm"), "{:?}", report.notes());
}
