//! The legend, below the panels: it never covers data.

use super::chart::{Chart, Style};
use super::colour::{self, CLAIM, INK};
use super::draw::{Canvas, Point, Shape, TextStyle, text_width};
use super::marker;
use super::shade::RANGE_OPACITY;

/// Size of the words.
const SIZE: f64 = 13.0;
/// Height of a line.
const LINE: f64 = 22.0;
/// Width of the piece of curve before the words.
const SAMPLE: f64 = 34.0;
/// Space after an entry.
const GAP: f64 = 20.0;

/// What an entry shows.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum LegendKey {
    /// A curve.
    Curve(Style, u8),
    /// The star of a claim.
    Star,
    /// The line of a claim.
    Dashes,
    /// The shade of a range that the paper states.
    Shade,
    /// The ring of a published system.
    Ring,
}

/// Entries of a legend in lines.
pub(super) struct Legend {
    lines: Vec<Vec<(LegendKey, String, f64)>>,
    /// Height of all lines.
    pub(super) height: f64,
}

/// What a chart's legend names, each once.
pub(super) fn entries(chart: &Chart) -> Vec<(LegendKey, String)> {
    let mut out: Vec<(LegendKey, String)> = Vec::new();
    for series in &chart.series {
        let entry = (
            LegendKey::Curve(series.style, series.variant % series.style.variants()),
            series.name.clone(),
        );
        if !series.name.is_empty() && !out.contains(&entry) {
            out.push(entry);
        }
    }
    for claim in &chart.claims {
        let key = if claim.x.is_some() && claim.y.is_some() {
            LegendKey::Star
        } else {
            LegendKey::Dashes
        };
        let entry = (key, "stated in the paper".to_owned());
        if (claim.x.is_some() || claim.y.is_some()) && !out.contains(&entry) {
            out.push(entry);
        }
    }
    if !chart.ranges.is_empty() {
        out.push((LegendKey::Shade, "range in the paper".to_owned()));
    }
    if !chart.published.is_empty() {
        out.push((LegendKey::Ring, "published, as stated".to_owned()));
    }
    out
}

impl Legend {
    /// Breaks the entries of a chart into lines no wider than `width`.
    pub(super) fn new(chart: &Chart, width: f64) -> Self {
        let mut lines: Vec<Vec<_>> = Vec::new();
        let mut used = f64::INFINITY;
        for (key, name) in entries(chart) {
            let wide = SAMPLE + 8.0 + text_width(&name, SIZE, false);
            if used + wide > width {
                lines.push(Vec::new());
                used = 0.0;
            }
            used += wide + GAP;
            if let Some(line) = lines.last_mut() {
                line.push((key, name, wide));
            }
        }
        let height = if lines.is_empty() {
            0.0
        } else {
            LINE * lines.len() as f64 + 6.0
        };
        Self { lines, height }
    }

    /// Draws the lines, centred in `width`.
    pub(super) fn draw(&self, canvas: &mut Canvas, (left, top): Point, width: f64) {
        for (index, line) in self.lines.iter().enumerate() {
            let total = line.iter().map(|(_, _, wide)| wide + GAP).sum::<f64>() - GAP;
            let y = top + LINE * (index as f64 + 0.5);
            let mut x = left + ((width - total) / 2.0).max(0.0);
            for (key, name, wide) in line {
                let (points, middle) = (vec![(x, y), (x + SAMPLE, y)], (x + SAMPLE / 2.0, y));
                match key {
                    LegendKey::Curve(style, variant) => {
                        let (stroke, dash) = (colour::style(*style, *variant), marker::dash(*style, *variant));
                        canvas.items.push(Shape::Line {
                            points,
                            stroke,
                            width: 2.2,
                            dash,
                        });
                        marker::draw(canvas, middle, *style, *variant);
                    }
                    LegendKey::Shade => canvas.rect((x, y - 7.0), (SAMPLE, 14.0), CLAIM, RANGE_OPACITY),
                    LegendKey::Star => marker::star(canvas, middle),
                    LegendKey::Ring => marker::ring(canvas, middle),
                    LegendKey::Dashes => {
                        canvas.items.push(Shape::Line {
                            points,
                            stroke: CLAIM,
                            width: 1.6,
                            dash: marker::dash(Style::Paper, 0),
                        });
                    }
                }
                canvas.text((x + SAMPLE + 8.0, y), name, TextStyle::new(SIZE, INK));
                x += wide + GAP;
            }
        }
    }
}
