//! Dense layers in single precision.

use super::weights::Layer;
use multiversion::multiversion;

/// Outputs that are summed in registers at a time.
const BLOCK: usize = 64;

/// Widths of tiles, widest first.
pub(super) const WIDTHS: [usize; 4] = [BLOCK, 16, 4, 1];

/// Adds Σᵢ uᵢ wᵢ over the `B` outputs of a tile (inputs × B), in the order of the inputs.
#[inline(always)]
fn block<const B: usize>(mut sums: [f32; B], tile: &[f32], inputs: &[(u32, f32)]) -> [f32; B] {
    let rows = tile.as_chunks::<B>().0;
    for &(i, value) in inputs {
        if let Some(row) = rows.get(i as usize) {
            for (sum, &w) in sums.iter_mut().zip(row) {
                *sum += value * w;
            }
        }
    }
    sums
}

#[inline(always)]
fn apply_of(weights: &[f32], inputs: &[(u32, f32)], out: &mut [f32]) {
    let count = weights.len() / out.len().max(1);
    let mut left = weights;
    let mut tile = |width: usize| {
        let (tile, rest) = left.split_at(count * width);
        left = rest;
        tile
    };
    let (wide, rest) = out.as_chunks_mut::<BLOCK>();
    for out in wide {
        *out = block(*out, tile(BLOCK), inputs);
    }
    let (sixteens, rest) = rest.as_chunks_mut::<16>();
    for out in sixteens {
        *out = block(*out, tile(16), inputs);
    }
    let (fours, rest) = rest.as_chunks_mut::<4>();
    for out in fours {
        *out = block(*out, tile(4), inputs);
    }
    for out in rest {
        [*out] = block([*out], tile(1), inputs);
    }
}

#[multiversion(targets("x86_64+avx512f", "x86_64+avx2", "aarch64+neon"))]
fn sums(weights: &[f32], inputs: &[(u32, f32)], out: &mut [f32]) {
    apply_of(weights, inputs, out);
}

/// `out` = W u + b for the inputs that are not zero, each with its number. The order of sums is that of the inputs: the
/// same bits whichever instruction set is chosen, because no product is fused with a sum.
pub(super) fn apply(layer: &Layer, inputs: &[(u32, f32)], out: &mut Vec<f32>) {
    out.clear();
    out.extend_from_slice(&layer.bias);
    sums(&layer.weights, inputs, out);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of outputs that fill blocks of every size, against sums as they are written. Integers have no rounding.
    #[test]
    fn layers_of_any_width_are_sums_of_products() {
        for outputs in [1_u16, 3, 5, 16, 67, 148] {
            let weights: Vec<f32> = (0..4 * outputs).map(|k| f32::from(k % 11) - 5.0).collect();
            let outputs = usize::from(outputs);
            let layer = Layer::new(weights.clone(), vec![1.0; outputs]);
            let mut out = vec![9.0; 2];
            apply(&layer, &[(0, 2.0), (3, -3.0)], &mut out);
            for (o, found) in out.iter().enumerate() {
                let expected = 1.0 + 2.0 * weights[o] - 3.0 * weights[3 * outputs + o];
                assert!((found - expected).abs() < 1e-6, "{outputs}: {o}");
            }
        }
    }
}
