//! Looks: colour, stroke and marker of whose numbers a curve shows, and of decoders and locators, which look the same
//! in every figure, whatever else is in it. Stroke and marker are the second way, beside colour, to tell curves apart.

use super::canvas::{Canvas, Point};
use super::colour::{CLAIM, INK, Rgb, WHITE};
use spts_eval::decoders::DECODERS;

/// Whose numbers a series shows. Decides colour and stroke, the same in every figure.
///
/// Colours are from the palette of M. Okabe and K. Ito, *Color Universal Design* (2008), safe for the common kinds
/// of colour blindness; stroke and marker repeat the distinction for print in grey.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// The twin, compressive mode: solid blue.
    Twin,
    /// The recorded sensor, compressive mode: solid near-black, hollow markers.
    Real,
    /// The twin, raster control: solid vermilion.
    Raster,
    /// The recorded sensor, raster control: solid dark brown, hollow markers.
    RasterReal,
    /// A curve or number of the paper: dashed grey.
    Paper,
    /// A baseline: dotted green.
    Baseline,
    /// One of several alternatives, all of the twin: solid, six hues and markers, one a variant.
    Alternative,
    /// A decoder or locator, whose variant follows from its name alone: see [`decoder_variant`].
    Decoder,
}

impl Style {
    /// Variants that differ.
    pub(super) const fn variants(self) -> u8 {
        match self {
            Self::Alternative => 6,
            Self::Decoder => VARIANTS,
            _ => 4,
        }
    }
}

/// Hues of alternatives: six of the palette of Okabe and Ito, without its black and its yellow.
const ALTERNATIVES: [Rgb; 6] = [
    Rgb(0xd5, 0x5e, 0x00),
    Rgb(0x00, 0x72, 0xb2),
    Rgb(0x56, 0xb4, 0xe9),
    Rgb(0x00, 0x9e, 0x73),
    Rgb(0xe6, 0x9f, 0x00),
    Rgb(0xcc, 0x79, 0xa7),
];

/// Colour of a style; `variant` 0 is the style's own, 1 to 3 are shades of it, then they repeat.
pub(super) fn ink(style: Style, variant: u8) -> Rgb {
    let base = match style {
        Style::Twin => Rgb(0x00, 0x72, 0xb2),
        Style::Real => Rgb(0x1a, 0x1a, 0x1a),
        Style::Raster => Rgb(0xd5, 0x5e, 0x00),
        Style::RasterReal => Rgb(0x7a, 0x3e, 0x00),
        Style::Paper => CLAIM,
        Style::Baseline => Rgb(0x00, 0x9e, 0x73),
        Style::Decoder => return look(variant).0,
        Style::Alternative => return ALTERNATIVES[usize::from(variant % style.variants())],
    };
    match variant % 4 {
        0 => base,
        1 => base.mix(WHITE, 0.45),
        2 => base.mix(Rgb(0, 0, 0), 0.5).mix(WHITE, if style == Style::Real { 0.35 } else { 0.0 }),
        _ => base.mix(WHITE, 0.65),
    }
}

/// Colour, and form of the marker.
pub(super) type Look = (Rgb, u8);

/// Locators and controls by name; decoders have their look in [`DECODERS`].
const NAMED: &[(&str, Look)] = &[
    ("middle", (Rgb(0x8a, 0x8f, 0x98), 3)),
    ("raster", (Rgb(0x7a, 0x3e, 0x00), 4)),
    ("script_s5", (Rgb(0x56, 0xb4, 0xe9), 2)),
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
const LOOKS: u8 = (DECODERS.len() + NAMED.len() + OTHERS.len()) as u8;
/// Strokes that tell several curves of one decoder apart.
const STROKES: u8 = 4;
/// Variants of [`Style::Decoder`] that differ.
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

/// Variant of [`Style::Decoder`] for the decoder, locator or control called `name`.
pub fn decoder_variant(name: &str, stroke: Stroke) -> u8 {
    let own = DECODERS.iter().position(|spec| spec.name == name && spec.look.is_some());
    let named = || Some(DECODERS.len() + NAMED.iter().position(|(known, _)| *known == name)?);
    let place = own.or_else(named).unwrap_or_else(|| {
        // FNV-1a: the same program has the same look in every run
        let hash =
            name.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3));
        DECODERS.len() + NAMED.len() + usize::try_from(hash % OTHERS.len() as u64).unwrap_or(0)
    });
    u8::try_from(place).unwrap_or(0) * STROKES + stroke as u8
}

/// Look of a variant.
pub(super) fn look(variant: u8) -> Look {
    let place = usize::from(variant % VARIANTS / STROKES);
    let after = place.saturating_sub(DECODERS.len());
    let own = DECODERS.get(place).and_then(|spec| spec.look);
    let own = own.map(|(colour, marker)| {
        let [_, r, g, b] = colour.to_be_bytes();
        (Rgb(r, g, b), marker)
    });
    let named = || NAMED.get(after).map(|(_, look)| *look);
    own.or_else(named).unwrap_or_else(|| OTHERS[after.saturating_sub(NAMED.len()) % OTHERS.len()])
}

/// Stroke of a variant.
pub(super) fn stroke(variant: u8) -> Stroke {
    Stroke::of(usize::from(variant % STROKES))
}

/// Half the width of a marker.
const RADIUS: f64 = 4.2;

/// Dash and gap of a style's stroke; `None` is solid.
pub(super) fn dash(style: Style, variant: u8) -> Option<(f64, f64)> {
    match style {
        Style::Decoder => stroke(variant).dash(),
        Style::Paper => Some((7.0, 4.0)),
        Style::Baseline => Some((2.2, 3.2)),
        _ => None,
    }
}

/// Draws a marker: the style chooses filled or hollow and, with the variant, the form.
pub(super) fn draw_marker(canvas: &mut Canvas, place: Point, style: Style, variant: u8) {
    let fill = ink(style, variant);
    let first = match style {
        Style::Twin | Style::Real | Style::Alternative | Style::Decoder => 0,
        Style::Raster | Style::RasterReal => 1,
        Style::Baseline => 2,
        Style::Paper => 3,
    };
    let form = match style {
        Style::Decoder => look(variant).1,
        Style::Alternative => [1, 0, 5, 3, 2, 4][usize::from(variant % style.variants())],
        _ => (first + variant % 4) % 4,
    };
    // A white rim separates markers that overlap.
    shape(canvas, place, form, RADIUS + 1.0, WHITE);
    shape(canvas, place, form, RADIUS, fill);
    let hollow = match style {
        Style::Real | Style::RasterReal => true,
        Style::Decoder => stroke(variant).hollow(),
        _ => false,
    };
    if hollow {
        shape(canvas, place, form, RADIUS - 1.8, WHITE);
    }
}

/// A disc, square, triangle, diamond, triangle on its tip or pentagon of about the same weight.
fn shape(canvas: &mut Canvas, (x, y): Point, form: u8, radius: f64, fill: Rgb) {
    let corners: &[Point] = match form {
        0 => {
            return canvas.disc((x, y), radius, fill);
        }
        1 => &[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)],
        2 => &[(0.0, -1.2), (1.15, 0.85), (-1.15, 0.85)],
        4 => &[(0.0, 1.2), (1.15, -0.85), (-1.15, -0.85)],
        5 => &[(0.0, -1.1), (1.05, -0.34), (0.65, 0.89), (-0.65, 0.89), (-1.05, -0.34)],
        _ => &[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)],
    };
    let points = corners.iter().map(|(u, v)| (x + u * radius, y + v * radius));
    canvas.polygon(&points.collect::<Vec<_>>(), fill, 1.0);
}

/// Draws the ring of what others have published.
pub(super) fn ring(canvas: &mut Canvas, centre: Point) {
    for (radius, fill) in [(RADIUS + 2.0, WHITE), (RADIUS + 1.0, INK), (RADIUS - 0.8, WHITE)] {
        canvas.disc(centre, radius, fill);
    }
}

/// Draws the star of a claim.
pub(super) fn star(canvas: &mut Canvas, (x, y): Point) {
    for (size, fill) in [(10.5, WHITE), (8.5, CLAIM)] {
        let points = (0..10).map(|i| {
            let radius = if i % 2 == 0 { size } else { size * 0.45 };
            let (sin, cos) = (f64::from(i) * std::f64::consts::PI / 5.0).sin_cos();
            (x + radius * sin, y - radius * cos)
        });
        canvas.polygon(&points.collect::<Vec<_>>(), fill, 1.0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks in the table of decoders are used, and no two are equal.
    #[test]
    fn every_decoder_has_a_look_of_its_own() {
        for (k, spec) in DECODERS.iter().enumerate() {
            let own = look(decoder_variant(spec.name, Stroke::Solid));
            if let Some((colour, marker)) = spec.look {
                let [_, r, g, b] = colour.to_be_bytes();
                assert_eq!(own, (Rgb(r, g, b), marker), "{}", spec.name);
            }
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
