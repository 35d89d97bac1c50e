//! Reads OBJ files: their vertices and faces, in f64. Everything else in them is skipped.

use super::check::{MAX_EDGES, MeshError, cube, malformed, within_budget};
use super::files::{geometry_text, lines, point, start};
use super::polygon::{Point, cut};
use super::tri_mesh::{TriMesh, cross, dot, index, sub};

/// All triangles of the file, in its unit.
pub(super) fn obj_mesh(bytes: &[u8], file: &str) -> Result<TriMesh, MeshError> {
    let text = geometry_text(bytes, file)?;
    let mut mesh = TriMesh::default();
    let mut faces = Faces::default();
    let mut joined = String::new();
    let mut rest = lines(&text);
    while let Some((line, first)) = rest.next() {
        let mut words = data(first);
        if is_continued(first) {
            joined.clear();
            let mut part = first;
            while is_continued(part) {
                joined.push_str(part.trim_end().trim_end_matches('\\'));
                joined.push(' ');
                part = rest.next().map_or("", |(_, next)| next);
            }
            joined.push_str(part);
            words = data(&joined);
        }
        let mut words = words.split_whitespace();
        match words.next() {
            Some("v") => {
                within_budget(mesh.vertices.len() + 1, faces.triangles, file)?;
                mesh.vertices.push(point(words, line, file)?);
            }
            Some("f") => faces.push(words, line, mesh.vertices.len(), file)?,
            _ => {}
        }
    }
    faces.cut(&mut mesh, file)?;
    Ok(mesh)
}

/// A line without its comment.
fn data(line: &str) -> &str {
    line.split_once('#').map_or(line, |(data, _)| data)
}

/// Whether the next line goes on with this one: it ends with a backslash, and not in a comment or a name, where a
/// backslash may be part of a path or of a character of two bytes.
fn is_continued(line: &str) -> bool {
    let named = ["o", "mtllib", "usemtl"].contains(&line.split_whitespace().next().unwrap_or_default());
    let Some(before) = line.trim_end().strip_suffix('\\') else { return false };
    !named && !before.contains('#') && before.chars().next_back().is_none_or(|c| c.is_ascii())
}

/// The faces of a file, whose vertices may follow later.
#[derive(Default)]
struct Faces {
    /// Line, number of vertices before it, and end in `corners`, of each face.
    faces: Vec<(usize, usize, usize)>,
    /// As in the file: from 1 on, or backwards from −1.
    corners: Vec<i64>,
    /// How many the faces become.
    triangles: usize,
}

impl Faces {
    /// A face of corners such as `3/1/2`, of which only the vertex counts.
    fn push<'t>(
        &mut self,
        words: impl Iterator<Item = &'t str> + Clone,
        line: usize,
        seen: usize,
        file: &str,
    ) -> Result<(), MeshError> {
        self.triangles += words.clone().count().saturating_sub(2).max(1);
        within_budget(0, self.triangles, file)?;
        for word in words {
            let number = word.split('/').next().unwrap_or(word);
            self.corners.push(number.parse().map_err(|_| {
                let hint = if word.contains(',') { "; write spaces between corners, not commas" } else { "" };
                malformed(file, format_args!("line {line}: `{}` is not a whole number{hint}", start(word)))
            })?);
        }
        self.faces.push((line, seen, self.corners.len()));
        Ok(())
    }

    /// Cuts the faces into triangles, now that all vertices are known.
    fn cut(self, mesh: &mut TriMesh, file: &str) -> Result<(), MeshError> {
        let all = mesh.vertices.len();
        let (mut start, mut cubes) = (0, 0.0);
        for (line, seen, end) in self.faces {
            let mut corners = Vec::with_capacity(end - start);
            for &given in &self.corners[start..end] {
                corners.push(vertex(given, seen, all).ok_or_else(|| {
                    let backwards = if seen > 0 { format!(" or [-{seen}, -1]") } else { String::new() };
                    malformed(file, format_args!("line {line} uses vertex {given}, outside [1, {all}]{backwards}"))
                })?);
            }
            start = end;
            // the same corner twice in a row is one
            corners.dedup();
            while corners.len() > 1 && corners.first() == corners.last() {
                corners.pop();
            }
            match corners[..] {
                // counted and dropped with the others that have no area
                [] => {}
                [a] => mesh.triangles.push([a, a, a]),
                [a, b] => mesh.triangles.push([a, b, b]),
                [a, b, c] => mesh.triangles.push([a, b, c]),
                _ => {
                    let flat = flat(mesh, &corners);
                    let triangles = cut(&flat, |corners| {
                        cubes += cube(corners);
                        cubes <= cube(MAX_EDGES)
                    });
                    let triangles = triangles.map_err(|why| {
                        malformed(file, format_args!("line {line}: the face of {} corners {why}", corners.len()))
                    })?;
                    mesh.triangles.extend(triangles.into_iter().map(|t| t.map(|k| corners[k])));
                }
            }
        }
        Ok(())
    }
}

/// The vertex that is called `given` behind `seen` of `all` vertices. OBJ counts from 1, or backwards from −1 for the
/// last vertex so far.
fn vertex(given: i64, seen: usize, all: usize) -> Option<u32> {
    let from_0 = if given < 0 { i64::try_from(seen).ok()?.checked_add(given)? } else { given - 1 };
    usize::try_from(from_0).ok().filter(|vertex| *vertex < all).map(index)
}

/// The corners of a face in the plane that it lies in, counter-clockwise; of one that is bent, in the plane that has
/// most of its area (Newell's formula).
fn flat(mesh: &TriMesh, corners: &[u32]) -> Vec<Point> {
    let at = |k: usize| mesh.vertices[corners[k] as usize];
    let points: Vec<[f64; 3]> = (0..corners.len()).map(|k| sub(at(k), at(0))).collect();
    let parts = || points.windows(2).map(|pair| cross(pair[0], pair[1]));
    let sum = parts().fold([0.0; 3], |sum, n| [0, 1, 2].map(|k| sum[k] + n[k]));
    let largest = parts().fold([0.0; 3], |best, n| if dot(n, n) > dot(best, best) { n } else { best });
    // of an outline like an 8 the parts cancel, but it has a plane
    let normal = if dot(sum, sum) > 1e-18 * dot(largest, largest) { sum } else { largest };
    let unit = |v: [f64; 3]| {
        let length = dot(v, v).sqrt().max(f64::MIN_POSITIVE);
        v.map(|x| x / length)
    };
    let normal = unit(normal);
    // across the normal, from the axis that is farthest from it
    let mut axis = [0.0; 3];
    axis[(0..3).fold(0, |best, k| if normal[k].abs() < normal[best].abs() { k } else { best })] = 1.0;
    let u = unit(cross(axis, normal));
    let v = cross(normal, u);
    points.into_iter().map(|p| [dot(p, u), dot(p, v)]).collect()
}
