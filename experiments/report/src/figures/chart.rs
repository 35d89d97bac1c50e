//! Line charts: what is plotted, and the one way from rows of results to it.

use super::looks::{Stroke, Style, decoder_variant};
use spts_eval::unique;

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

impl Series {
    /// The curve `name` through `points`.
    pub fn new(name: impl Into<String>, style: Style, variant: u8, points: Vec<(f64, f64)>) -> Self {
        Self { name: name.into(), style, variant, points, spans: Vec::new(), scatter: Vec::new() }
    }

    /// The curve `name` of the decoder, locator or control `decoder`, in that one's own colour.
    pub(crate) fn of_decoder(name: impl Into<String>, decoder: &str, stroke: Stroke, points: Vec<(f64, f64)>) -> Self {
        Self::new(name, Style::Decoder, decoder_variant(decoder, stroke), points)
    }

    /// The same curve with a shade of its scatter.
    pub(crate) fn with_scatter(self, scatter: Vec<(f64, f64, f64)>) -> Self {
        Self { scatter, ..self }
    }

    /// The same curve with bands.
    pub(crate) fn with_spans(self, spans: Vec<(f64, f64, f64)>) -> Self {
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

impl Chart {
    /// The chart with points that the paper states: label, x and y of each.
    pub(crate) fn with_claims(self, claims: &[(&str, f64, f64)]) -> Self {
        let claim = |&(label, x, y): &(&str, f64, f64)| Claim { label: label.to_owned(), x: Some(x), y: Some(y) };
        Self { claims: claims.iter().map(claim).collect(), ..self }
    }

    /// The chart with ranges of x that the paper states: label and ends of each.
    pub(crate) fn with_ranges(self, ranges: &[(&str, f64, f64)]) -> Self {
        let range = |&(label, from, to): &(&str, f64, f64)| StatedRange { label: label.to_owned(), from, to };
        Self { ranges: ranges.iter().map(range).collect(), ..self }
    }
}

/// Rows as curves: what is on the axes, which curve a row belongs to, and which panel.
///
/// Curves and panels are in the order in which the rows first have them. A row without a value on one of the axes has
/// no point.
///
/// ```
/// use spts_report::figures::{Curve, Plot, Style, save_charts};
///
/// struct Score { skin: &'static str, m: usize, iou: Option<f64>, band: Option<(f64, f64)> }
/// let rows = [
///     Score { skin: "twin", m: 10, iou: Some(0.5), band: Some((0.4, 0.6)) },
///     Score { skin: "twin", m: 20, iou: Some(0.6), band: None },
///     Score { skin: "real skin", m: 10, iou: None, band: None },
/// ];
/// let chart = Plot::new(&rows)
///     .x("measurements M", |r| r.m as f64).log_x()
///     .y("IoU", |r| r.iou).within(0.0, 1.0)
///     .band(|r| r.band)
///     .by(|r| match r.skin {
///         "twin" => Curve::new(r.skin, Style::Twin, 0),
///         _ => Curve::new(r.skin, Style::Real, 0),
///     })
///     .chart("Images");
/// assert_eq!(chart.series.len(), 2);
/// assert_eq!(chart.series[0].points, [(10.0, 0.5), (20.0, 0.6)]);
/// # let dir = std::env::temp_dir().join(format!("spts-doc-plot-{}", std::process::id()));
/// save_charts(&[chart], &dir, "images")?; // images.svg and images.png
/// # std::fs::remove_dir_all(&dir)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Plot<'a, R> {
    rows: Vec<R>,
    x: Value<'a, R, f64>,
    y: Value<'a, R, f64>,
    band: Value<'a, R, (f64, f64)>,
    scatter: Value<'a, R, (f64, f64)>,
    curve: Box<dyn Fn(R) -> Curve + 'a>,
    /// Labels of the axes, logarithms and range.
    axes: Chart,
}

/// What is known of a row.
type Value<'a, R, V> = Box<dyn Fn(R) -> Option<V> + 'a>;

/// Name and look of a curve.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Whose numbers.
    pub style: Style,
    /// As in [`Series`].
    pub variant: u8,
}

impl Curve {
    /// The curve `name` of a style and variant.
    pub fn new(name: impl Into<String>, style: Style, variant: u8) -> Self {
        Self { name: name.into(), style, variant }
    }

    /// The curve `name` of the decoder, locator or control `decoder`, in that one's own colour.
    pub(crate) fn of_decoder(name: impl Into<String>, decoder: &str, stroke: Stroke) -> Self {
        Self::new(name, Style::Decoder, decoder_variant(decoder, stroke))
    }
}

impl<'a, R: Copy> Plot<'a, R> {
    /// One nameless curve of `rows`, which are references or small values; there is nothing on the axes yet.
    pub fn new(rows: impl IntoIterator<Item = R>) -> Self {
        Self {
            rows: rows.into_iter().collect(),
            x: Box::new(|_| None),
            y: Box::new(|_| None),
            band: Box::new(|_| None),
            scatter: Box::new(|_| None),
            curve: Box::new(|_| Curve::new("", Style::Twin, 0)),
            axes: Chart::default(),
        }
    }

    /// The horizontal axis: quantity with unit, and its value.
    pub fn x<V: Into<Option<f64>>>(mut self, label: &str, value: impl Fn(R) -> V + 'a) -> Self {
        label.clone_into(&mut self.axes.x_label);
        self.x = Box::new(move |row| value(row).into());
        self
    }

    /// The vertical axis: quantity with unit, and its value.
    pub fn y<V: Into<Option<f64>>>(mut self, label: &str, value: impl Fn(R) -> V + 'a) -> Self {
        label.clone_into(&mut self.axes.y_label);
        self.y = Box::new(move |row| value(row).into());
        self
    }

    /// Lower and upper end of an interval about the value, drawn as a thin bar.
    pub fn band(mut self, ends: impl Fn(R) -> Option<(f64, f64)> + 'a) -> Self {
        self.band = Box::new(ends);
        self
    }

    /// Lower and upper end of the scatter about the curve, drawn as a shade.
    pub fn scatter(mut self, ends: impl Fn(R) -> Option<(f64, f64)> + 'a) -> Self {
        self.scatter = Box::new(ends);
        self
    }

    /// Which curve a row belongs to.
    pub fn by(mut self, curve: impl Fn(R) -> Curve + 'a) -> Self {
        self.curve = Box::new(curve);
        self
    }

    /// A logarithmic horizontal axis.
    pub fn log_x(mut self) -> Self {
        self.axes.x_log = true;
        self
    }

    /// A logarithmic vertical axis.
    pub(crate) fn log_y(mut self) -> Self {
        self.axes.y_log = true;
        self
    }

    /// Ends of the vertical axis; without, it holds every point.
    pub fn within(mut self, low: f64, high: f64) -> Self {
        self.axes.y_range = Some((low, high));
        self
    }

    /// All rows in one panel.
    pub fn chart(&self, title: impl Into<String>) -> Chart {
        self.panel(title.into(), &self.rows)
    }

    /// The rows divided into panels by what `facet` says, which is also the panel's title.
    pub fn facets(&self, facet: impl Fn(R) -> String) -> Vec<Chart> {
        let titles = unique(self.rows.iter().map(|row| facet(*row)));
        let panel = |title: String| {
            let own = self.rows.iter().copied().filter(|row| facet(*row) == title);
            let own: Vec<R> = own.collect();
            self.panel(title, &own)
        };
        titles.into_iter().map(panel).collect()
    }

    fn panel(&self, title: String, rows: &[R]) -> Chart {
        let ends = |of: &Value<'a, R, (f64, f64)>, own: &[R]| -> Vec<(f64, f64, f64)> {
            let bars = own.iter().filter_map(|&row| {
                let (low, high) = of(row)?;
                Some(((self.x)(row)?, low, high))
            });
            bars.collect()
        };
        let series = |curve: Curve| {
            let own: Vec<R> = rows.iter().copied().filter(|&row| (self.curve)(row) == curve).collect();
            let points = own.iter().filter_map(|&row| Some(((self.x)(row)?, (self.y)(row)?)));
            Series::new(curve.name, curve.style, curve.variant, points.collect())
                .with_spans(ends(&self.band, &own))
                .with_scatter(ends(&self.scatter, &own))
        };
        let curves = unique(rows.iter().map(|&row| (self.curve)(row)));
        Chart { title, series: curves.into_iter().map(series).collect(), ..self.axes.clone() }
    }
}
