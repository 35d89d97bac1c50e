//! Line charts: what is plotted.

use super::looks::{self, Stroke};

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
    /// A decoder or locator, whose variant follows from its name alone: see [`super::decoder_variant`].
    Decoder,
}

/// One curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend.
    pub name: String,
    /// Whose numbers.
    pub style: Style,
    /// Shade and marker, to tell several series of one style apart. Four differ, of alternatives six; then they repeat.
    pub variant: u8,
    /// Points in the order they are joined. One with a non-finite coordinate, or one that a logarithmic axis cannot
    /// show, is skipped.
    pub points: Vec<(f64, f64)>,
    /// Bands at some of the points: horizontal coordinate, lower and upper end. Drawn as thin bars.
    pub spans: Vec<(f64, f64, f64)>,
    /// Scatter about the curve: horizontal coordinate, lower and upper end. Drawn as a shade.
    pub scatter: Vec<(f64, f64, f64)>,
}

impl Style {
    /// Variants that differ.
    pub(super) const fn variants(self) -> u8 {
        match self {
            Self::Alternative => 6,
            Self::Decoder => looks::VARIANTS,
            _ => 4,
        }
    }
}

impl Series {
    /// The curve `name` through `points`.
    pub fn new(name: impl Into<String>, style: Style, variant: u8, points: Vec<(f64, f64)>) -> Self {
        Self {
            name: name.into(),
            style,
            variant,
            points,
            spans: Vec::new(),
            scatter: Vec::new(),
        }
    }

    /// The curve `name` of the decoder, locator or control `decoder`, in that one's own colour.
    pub fn of_decoder(name: impl Into<String>, decoder: &str, stroke: Stroke, points: Vec<(f64, f64)>) -> Self {
        Self::new(name, Style::Decoder, looks::decoder_variant(decoder, stroke), points)
    }

    /// The same curve with a shade of its scatter.
    #[must_use]
    pub fn with_scatter(self, scatter: Vec<(f64, f64, f64)>) -> Self {
        Self { scatter, ..self }
    }

    /// The same curve with bands.
    #[must_use]
    pub fn with_spans(self, spans: Vec<(f64, f64, f64)>) -> Self {
        Self { spans, ..self }
    }
}

/// What the paper claims: a point (`x` and `y`), a horizontal line (`y` alone) or a vertical line (`x` alone).
#[derive(Debug, Clone, PartialEq)]
pub struct Claim {
    /// Words beside the mark.
    pub label: String,
    /// Horizontal coordinate.
    pub x: Option<f64>,
    /// Vertical coordinate.
    pub y: Option<f64>,
}

/// A range on the horizontal axis that the paper states.
#[derive(Debug, Clone, PartialEq)]
pub struct StatedRange {
    /// Words beside the range.
    pub label: String,
    /// Lower end.
    pub from: f64,
    /// Upper end.
    pub to: f64,
}

/// One panel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Chart {
    /// Heading of the panel.
    pub title: String,
    /// Quantity and unit on the horizontal axis.
    pub x_label: String,
    /// Quantity and unit on the vertical axis.
    pub y_label: String,
    /// Logarithmic horizontal axis.
    pub x_log: bool,
    /// Logarithmic vertical axis.
    pub y_log: bool,
    /// Ends of the vertical axis; `None` chooses them to hold every point. Curves are cut at the ends.
    pub y_range: Option<(f64, f64)>,
    /// Curves.
    pub series: Vec<Series>,
    /// Claims of the paper.
    pub claims: Vec<Claim>,
    /// Ranges that the paper states, shaded.
    pub ranges: Vec<StatedRange>,
    /// What others have published: points that are drawn hollow.
    pub published: Vec<Claim>,
}
