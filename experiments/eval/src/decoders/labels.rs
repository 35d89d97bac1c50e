//! What people read instead of a decoder's name: the label, in plain words, and a shorter one where space is short.

use super::find;
use crate::control::RASTER;

/// Label and short label of the control, which is scored beside the decoders of the table and is none of them.
const CONTROL: [&str; 2] = ["raster scan of M taxels", "raster"];

/// Label of the decoder or control `name`, in plain words, on pages and in their figures. An external program is
/// labelled by its name.
///
/// ```
/// use spts_eval::decoders::{label, short_label};
///
/// assert_eq!(label("amortised"), "trained network");
/// assert_eq!(short_label("amortised"), "amortised");
/// assert_eq!(label("my program"), "my program");
/// ```
#[must_use]
pub fn label(name: &str) -> &str {
    match find(name) {
        Some(spec) => spec.label,
        None if name == RASTER => CONTROL[0],
        None => name,
    }
}

/// Label of the decoder or control `name` where space is short: in printed tables, and in figures with many decoders.
/// An external program is labelled by its name.
#[must_use]
pub fn short_label(name: &str) -> &str {
    match find(name) {
        Some(spec) => spec.short,
        None if name == RASTER => CONTROL[1],
        None => name,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::decoders::DECODERS;

    /// Width of the column of decoders in the printed tables of the board.
    const WIDTH: usize = 22;

    /// No two decoders share a label or a short label, the control included, and short labels fit into their columns.
    #[test]
    fn every_decoder_has_labels_of_its_own() {
        let names: Vec<&str> = DECODERS.iter().map(|spec| spec.name).chain([RASTER]).collect();
        for (k, name) in names.iter().enumerate() {
            let (long, short) = (label(name), short_label(name));
            assert!(!long.trim().is_empty() && !short.trim().is_empty(), "{name}");
            assert!(
                short.chars().count() <= long.chars().count().min(WIDTH),
                "{name}: {short}"
            );
            for before in &names[..k] {
                assert_ne!(label(before), long, "{before} and {name}");
                assert_ne!(short_label(before), short, "{before} and {name}");
            }
        }
    }
}
