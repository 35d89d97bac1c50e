//! Checks that every reference in a GLB file that the mesh reader follows is valid.
//!
//! The validation of the `gltf` crate (version 1.4.1) indexes before it checks, so a damaged file could end the
//! process. This check runs in its place.

use gltf::json::validation::Checked;
use gltf::json::{Index, Root};

/// First reference or enumeration of `root` that is wrong, in words.
pub(super) fn broken_reference(root: &Root) -> Option<String> {
    let within = |what: &str, i: usize, n: usize| (i >= n).then(|| format!("{what} {i} is outside [0, {n})"));
    if let Some(scene) = root.scene
        && let Some(wrong) = within("scene", scene.value(), root.scenes.len())
    {
        return Some(wrong);
    }
    let nodes = root.scenes.iter().flat_map(|s| &s.nodes);
    let children = root.nodes.iter().filter_map(|n| n.children.as_ref()).flatten();
    let meshes = root.nodes.iter().filter_map(|n| n.mesh).map(|m| m.value());
    let views = root.accessors.iter().filter_map(|a| a.buffer_view).map(|v| v.value());
    nodes
        .chain(children)
        .find_map(|node| within("node", node.value(), root.nodes.len()))
        .or_else(|| meshes.into_iter().find_map(|i| within("mesh", i, root.meshes.len())))
        .or_else(|| {
            root.meshes
                .iter()
                .flat_map(|m| &m.primitives)
                .find_map(|p| broken_primitive(root, p))
        })
        .or_else(|| {
            views
                .into_iter()
                .find_map(|i| within("buffer view", i, root.buffer_views.len()))
        })
        .or_else(|| {
            root.buffer_views
                .iter()
                .find_map(|v| within("buffer", v.buffer.value(), root.buffers.len()))
        })
        .or_else(|| {
            root.accessors
                .iter()
                .position(|a| !is_readable(a))
                .map(|i| format!("accessor {i} has an unknown type"))
        })
}

fn broken_primitive(root: &Root, primitive: &gltf::json::mesh::Primitive) -> Option<String> {
    let n = root.accessors.len();
    let outside = |i: &Index<gltf::json::Accessor>| {
        (i.value() >= n).then(|| format!("accessor {} is outside [0, {n})", i.value()))
    };
    if matches!(primitive.mode, Checked::Invalid) {
        return Some("a primitive has an unknown mode".to_owned());
    }
    primitive
        .attributes
        .get(&Checked::Valid(gltf::Semantic::Positions))
        .and_then(outside)
        .or_else(|| primitive.indices.as_ref().and_then(outside))
}

fn is_readable(accessor: &gltf::json::Accessor) -> bool {
    matches!(accessor.component_type, Checked::Valid(_)) && matches!(accessor.type_, Checked::Valid(_))
}
