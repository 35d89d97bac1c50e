//! Samples as codes of the converter.

use spts_circuit::Converter;

/// Code of a sample, a missing one as `missing`; `None` when it is not the volt of a code, bit for bit.
pub(super) fn code(volts: f64, converter: &Converter, missing: u32) -> Option<u32> {
    match volts.is_nan() {
        true => Some(missing),
        false => converter.code(volts),
    }
}

/// Mark of a missing sample: larger than every code, in the smallest unsigned type that holds both.
pub(super) fn missing_mark(converter: &Converter) -> u32 {
    if is_narrow(converter) {
        u32::from(u16::MAX)
    } else {
        u32::MAX
    }
}

/// Whether codes and the mark of a missing sample have 16 bits.
pub(super) fn is_narrow(converter: &Converter) -> bool {
    converter.max_code() < u32::from(u16::MAX)
}
