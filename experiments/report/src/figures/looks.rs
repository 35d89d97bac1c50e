//! Looks of decoders and locators: each has one colour and one marker in every figure, whatever else is in it.

use super::colour::Rgb;

/// Colour, and form of the marker.
pub(super) type Look = (Rgb, u8);

/// Decoders, locators and controls by name.
const NAMED: &[(&str, Look)] = &[
    // baselines: greys and sands
    ("empty", (Rgb(0x8a, 0x8f, 0x98), 3)),
    ("middle", (Rgb(0x8a, 0x8f, 0x98), 3)),
    ("mean_image", (Rgb(0x5f, 0x66, 0x70), 1)),
    ("correlate", (Rgb(0x9c, 0x86, 0x5a), 2)),
    ("raster", (Rgb(0x7a, 0x3e, 0x00), 4)),
    // the published decoders: blues
    ("matched", (Rgb(0x00, 0x72, 0xb2), 0)),
    ("script_s20", (Rgb(0x56, 0xb4, 0xe9), 2)),
    ("script_s5", (Rgb(0x56, 0xb4, 0xe9), 2)),
    ("script_m4", (Rgb(0x2c, 0x3f, 0x8f), 5)),
    // pursuits: violets
    ("omp", (Rgb(0x6a, 0x3d, 0x9a), 0)),
    ("nn_omp", (Rgb(0xcc, 0x79, 0xa7), 1)),
    ("nn_lasso", (Rgb(0xe6, 0x9f, 0x00), 2)),
    ("tv", (Rgb(0x4a, 0x4a, 0x4a), 4)),
    // those that learn from images: greens, and red for the best
    ("nn_lmmse", (Rgb(0x00, 0x9e, 0x73), 3)),
    ("lmmse", (Rgb(0x66, 0xa6, 0x1e), 0)),
    ("nn_lmmse_seen", (Rgb(0x00, 0x5f, 0x45), 1)),
    ("mixture", (Rgb(0x1b, 0x9a, 0xaa), 5)),
    ("amortised", (Rgb(0x1a, 0x1a, 0x1a), 2)),
    ("evidence", (Rgb(0xd5, 0x5e, 0x00), 1)),
    ("blob", (Rgb(0xd5, 0x5e, 0x00), 1)),
    ("taxel", (Rgb(0x66, 0xa6, 0x1e), 0)),
];

/// Programs from outside: one of these by name.
const OTHERS: [Look; 6] = [
    (Rgb(0xb2, 0x18, 0x2b), 5),
    (Rgb(0x21, 0x66, 0xac), 1),
    (Rgb(0x4d, 0x92, 0x21), 4),
    (Rgb(0xc5, 0x1b, 0x7d), 3),
    (Rgb(0xbf, 0x81, 0x2d), 5),
    (Rgb(0x54, 0x27, 0x88), 4),
];

/// Looks there are.
#[expect(clippy::cast_possible_truncation, reason = "some thirty looks")]
const LOOKS: u8 = (NAMED.len() + OTHERS.len()) as u8;
/// Strokes that tell several curves of one decoder apart.
const STROKES: u8 = 4;
/// Variants of [`super::Style::Decoder`] that differ.
pub(super) const VARIANTS: u8 = LOOKS * STROKES;

/// How a curve of a decoder is drawn, to tell its curves in one figure apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Stroke {
    /// Solid, filled markers: the twin, or the only curve.
    Solid,
    /// Dashed, hollow markers: the real skin, or a second curve.
    Dashed,
    /// Dotted.
    Dotted,
    /// Dash and dot, hollow markers.
    DashDot,
}

impl Stroke {
    /// The stroke of the curve `index` of a decoder; after four they repeat.
    #[must_use]
    pub fn of(index: usize) -> Self {
        [Self::Solid, Self::Dashed, Self::Dotted, Self::DashDot][index % usize::from(STROKES)]
    }

    /// Dash and gap; `None` is solid.
    pub(super) const fn dash(self) -> Option<(f64, f64)> {
        match self {
            Self::Solid => None,
            Self::Dashed => Some((6.0, 4.0)),
            Self::Dotted => Some((1.6, 3.4)),
            Self::DashDot => Some((10.0, 3.0)),
        }
    }

    /// Whether markers are hollow.
    pub(super) const fn hollow(self) -> bool {
        matches!(self, Self::Dashed | Self::DashDot)
    }
}

/// Variant of [`super::Style::Decoder`] for the decoder, locator or control called `name`.
#[must_use]
pub fn decoder_variant(name: &str, stroke: Stroke) -> u8 {
    let place = NAMED.iter().position(|(known, _)| *known == name).unwrap_or_else(|| {
        // FNV-1a: the same program has the same look in every run
        let hash = name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| {
            (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3)
        });
        NAMED.len() + usize::try_from(hash % OTHERS.len() as u64).unwrap_or(0)
    });
    u8::try_from(place).unwrap_or(0) * STROKES + stroke as u8
}

/// Look of a variant.
pub(super) fn look(variant: u8) -> Look {
    let place = usize::from(variant % VARIANTS / STROKES);
    let named = NAMED.get(place).map(|(_, look)| *look);
    named.unwrap_or_else(|| OTHERS[(place - NAMED.len()) % OTHERS.len()])
}

/// Stroke of a variant.
pub(super) fn stroke(variant: u8) -> Stroke {
    Stroke::of(usize::from(variant % STROKES))
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts_eval::decoders::DECODERS;

    /// Every decoder of the table has a look of its own, so that adding or leaving out one changes no other.
    #[test]
    fn every_decoder_has_a_look_of_its_own() {
        for (k, spec) in DECODERS.iter().enumerate() {
            assert!(NAMED.iter().any(|(name, _)| *name == spec.name), "{}", spec.name);
            let own = look(decoder_variant(spec.name, Stroke::Solid));
            for other in &DECODERS[..k] {
                assert_ne!(own, look(decoder_variant(other.name, Stroke::Solid)), "{}", spec.name);
            }
        }
    }

    #[test]
    fn strokes_change_neither_colour_nor_marker() {
        for name in ["evidence", "my own program"] {
            let solid = decoder_variant(name, Stroke::Solid);
            let dashed = decoder_variant(name, Stroke::Dashed);
            assert_eq!(look(solid), look(dashed));
            assert_eq!((stroke(solid), stroke(dashed)), (Stroke::Solid, Stroke::Dashed));
        }
    }
}
