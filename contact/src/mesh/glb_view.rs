//! Bounds-checked access to the numbers of a GLB file.

use super::error::MeshError;
use gltf::accessor::{DataType, Dimensions};

/// Start, stride and count of an accessor's elements of `size` bytes inside `blob`, or why it does not fit.
fn elements<'b>(
    accessor: &gltf::Accessor<'_>,
    blob: &'b [u8],
    size: usize,
    file: &str,
) -> Result<impl Iterator<Item = &'b [u8]> + use<'b>, MeshError> {
    let outside = || MeshError::Malformed {
        file: file.to_owned(),
        reason: format!(
            "accessor {} ({} elements of {size} bytes) reaches outside the {} bytes of the BIN chunk",
            accessor.index(),
            accessor.count(),
            blob.len()
        ),
    };
    let unsupported = |feature: &str| MeshError::Unsupported {
        file: file.to_owned(),
        feature: feature.to_owned(),
    };
    if accessor.sparse().is_some() {
        return Err(unsupported("a sparse accessor"));
    }
    let view = accessor
        .view()
        .ok_or_else(|| unsupported("an accessor without buffer view"))?;
    if !matches!(view.buffer().source(), gltf::buffer::Source::Bin) {
        return Err(unsupported("a buffer outside the file"));
    }
    let stride = view.stride().unwrap_or(size);
    let count = accessor.count();
    let view_end = view.offset().checked_add(view.length()).ok_or_else(outside)?;
    let data = blob.get(view.offset()..view_end).ok_or_else(outside)?;
    let data = data.get(accessor.offset()..).ok_or_else(outside)?;
    let end = count
        .saturating_sub(1)
        .checked_mul(stride)
        .and_then(|last| last.checked_add(size))
        .ok_or_else(outside)?;
    if stride < size || (count > 0 && end > data.len()) {
        return Err(outside());
    }
    Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
}

/// Vertex positions: three f32 each.
pub(super) fn positions(accessor: &gltf::Accessor<'_>, blob: &[u8], file: &str) -> Result<Vec<[f32; 3]>, MeshError> {
    if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
        return Err(wrong_type(accessor, "three f32", file));
    }
    let number = |b: &[u8]| f32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    Ok(elements(accessor, blob, 12, file)?
        .map(|b| [number(&b[..4]), number(&b[4..8]), number(&b[8..])])
        .collect())
}

/// Corner indices: unsigned 8, 16 or 32 bits.
pub(super) fn indices(accessor: &gltf::Accessor<'_>, blob: &[u8], file: &str) -> Result<Vec<u32>, MeshError> {
    let size = match (accessor.data_type(), accessor.dimensions()) {
        (DataType::U8, Dimensions::Scalar) => 1,
        (DataType::U16, Dimensions::Scalar) => 2,
        (DataType::U32, Dimensions::Scalar) => 4,
        _ => return Err(wrong_type(accessor, "one u8, u16 or u32", file)),
    };
    let number = |b: &[u8]| b.iter().rev().fold(0_u32, |n, &byte| n << 8 | u32::from(byte));
    Ok(elements(accessor, blob, size, file)?.map(number).collect())
}

fn wrong_type(accessor: &gltf::Accessor<'_>, expected: &str, file: &str) -> MeshError {
    MeshError::Malformed {
        file: file.to_owned(),
        reason: format!(
            "accessor {} holds {:?} {:?}, {expected} expected",
            accessor.index(),
            accessor.dimensions(),
            accessor.data_type()
        ),
    }
}
