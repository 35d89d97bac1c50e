//! Samples as the codes that left the converter.

use spts_circuit::{Block, Converter};

/// Codes of the samples of all `blocks`, a missing one as `missing`; `None` when a sample is not the volt of a code,
/// bit for bit.
pub(super) fn encoded(blocks: &[Block], converter: &Converter, missing: u32) -> Option<Vec<u32>> {
    let samples = blocks.iter().flat_map(|block| &block.volts);
    samples
        .map(|volts| match volts.is_nan() {
            true => Some(missing),
            false => converter.code(*volts),
        })
        .collect()
}

/// Mark of a missing sample: larger than every code, in the smallest unsigned type that holds both.
pub(super) fn missing_mark(converter: &Converter) -> u32 {
    if converter.max_code() < u32::from(u16::MAX) {
        u32::from(u16::MAX)
    } else {
        u32::MAX
    }
}
