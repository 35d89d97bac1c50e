//! Writers: OBJ text, GLB.

use super::tri_mesh::{TriMesh, index};
use std::fmt::Write as _;

/// Nearest f32, the precision of GLB: 4 nm on a 60 mm object.
#[expect(clippy::cast_possible_truncation, reason = "rounding to f32 is the file's precision")]
fn f32_of(v: [f64; 3]) -> [f32; 3] {
    v.map(|x| x as f32)
}

impl TriMesh {
    /// Wavefront OBJ text: positions in metres with 9 decimals (1 nm), triangles 1-based, `name` as the object's name.
    #[must_use]
    pub fn to_obj(&self, name: &str) -> String {
        let mut out = format!("# metres; contact face towards -z\no {name}\n");
        for v in &self.vertices {
            // + 0.0 turns a negative zero positive
            let [x, y, z] = v.map(|c| (c * 1e9).round() / 1e9 + 0.0);
            let _ = writeln!(out, "v {x:.9} {y:.9} {z:.9}");
        }
        for t in &self.triangles {
            let [a, b, c] = t.map(|i| u64::from(i) + 1);
            let _ = writeln!(out, "f {a} {b} {c}");
        }
        out
    }

    /// glTF 2.0 binary: one mesh in one node, positions (f32, m) and 32-bit indices.
    ///
    /// Source: Khronos, *glTF 2.0 Specification*, §4.4 (GLB layout), §3.6.2 (accessors).
    #[must_use]
    pub fn to_glb(&self, name: &str) -> Vec<u8> {
        let positions: Vec<[f32; 3]> = self.vertices.iter().map(|&v| f32_of(v)).collect();
        let (mut low, mut high) = ([0.0_f32; 3], [0.0_f32; 3]);
        if let Some(&first) = positions.first() {
            (low, high) = (first, first);
        }
        for p in &positions {
            for k in 0..3 {
                low[k] = low[k].min(p[k]);
                high[k] = high[k].max(p[k]);
            }
        }
        let mut bin: Vec<u8> = positions.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
        let position_bytes = bin.len();
        bin.extend(self.triangles.iter().flatten().flat_map(|i| i.to_le_bytes()));
        let index_bytes = bin.len() - position_bytes;
        let name: String = name
            .chars()
            .filter(|c| c.is_ascii_alphanumeric() || "-_. ".contains(*c))
            .collect();
        let mut json = format!(
            concat!(
                r#"{{"asset":{{"version":"2.0","generator":"spts-sim"}},"scene":0,"scenes":[{{"nodes":[0]}}],"#,
                r#""nodes":[{{"name":"{name}","mesh":0}}],"#,
                r#""meshes":[{{"name":"{name}","primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],"#,
                r#""accessors":[{{"bufferView":0,"componentType":5126,"count":{vertices},"type":"VEC3","min":{low:?},"max":{high:?}}},"#,
                r#"{{"bufferView":1,"componentType":5125,"count":{indices},"type":"SCALAR"}}],"#,
                r#""bufferViews":[{{"buffer":0,"byteLength":{position_bytes},"target":34962}},"#,
                r#"{{"buffer":0,"byteOffset":{position_bytes},"byteLength":{index_bytes},"target":34963}}],"#,
                r#""buffers":[{{"byteLength":{bytes}}}]}}"#
            ),
            name = name,
            vertices = positions.len(),
            indices = self.triangles.len() * 3,
            low = low,
            high = high,
            position_bytes = position_bytes,
            index_bytes = index_bytes,
            bytes = bin.len(),
        )
        .into_bytes();
        while json.len() % 4 != 0 {
            json.push(b' ');
        }
        let mut out = Vec::with_capacity(28 + json.len() + bin.len());
        out.extend(b"glTF");
        out.extend(2_u32.to_le_bytes());
        out.extend(index(28 + json.len() + bin.len()).to_le_bytes());
        for (kind, chunk) in [(b"JSON", &json), (b"BIN\0", &bin)] {
            out.extend(index(chunk.len()).to_le_bytes());
            out.extend(kind);
            out.extend(chunk);
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use crate::mesh::{TriMesh, cuboid};

    #[test]
    fn glb_is_read_by_the_gltf_crate() {
        let block = cuboid([0.02, 0.03, 0.04]);
        let (document, buffers, _) = gltf::import_slice(block.to_glb("block \"quoted\"")).unwrap();
        let primitive = document.meshes().next().unwrap().primitives().next().unwrap();
        let reader = primitive.reader(|b| Some(&buffers[b.index()]));
        assert_eq!(reader.read_positions().unwrap().count(), 8);
        assert_eq!(reader.read_indices().unwrap().into_u32().max(), Some(7));
        let high = primitive.bounding_box().max;
        assert!(
            (high[0] - 0.01).abs() < 1e-9 && (high[2] - 0.04).abs() < 1e-8,
            "{high:?}"
        );
    }

    #[test]
    fn obj_has_no_negative_zero() {
        let mesh = TriMesh {
            vertices: vec![[-1e-12, 0.0, 0.0]],
            triangles: vec![],
        };
        assert!(!mesh.to_obj("x").contains("-0.0"));
    }
}
