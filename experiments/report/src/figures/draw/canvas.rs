//! The list of shapes.

use crate::figures::colour::Rgb;

/// A position in CSS pixels; y points down.
pub type Point = (f64, f64);

/// Which end of a text its position is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// Left end.
    Start,
    /// Middle.
    Middle,
    /// Right end.
    End,
}

/// How a text looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TextStyle {
    /// Size of an em in CSS pixels.
    pub size: f64,
    /// Bold face.
    pub bold: bool,
    /// Colour.
    pub colour: Rgb,
    /// Which end of the text its position is.
    pub anchor: Anchor,
    /// Turned a quarter to read upwards.
    pub upwards: bool,
}

impl TextStyle {
    /// Regular, level text that starts at its position.
    #[must_use]
    pub const fn new(size: f64, colour: Rgb) -> Self {
        Self {
            size,
            bold: false,
            colour,
            anchor: Anchor::Start,
            upwards: false,
        }
    }

    /// The same in bold.
    #[must_use]
    pub const fn bold(self) -> Self {
        Self { bold: true, ..self }
    }

    /// The same at another anchor.
    #[must_use]
    pub const fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The same reading upwards.
    #[must_use]
    pub const fn upwards(self) -> Self {
        Self { upwards: true, ..self }
    }
}

/// One shape.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A filled polygon, even-odd.
    Polygon {
        /// Corners.
        points: Vec<Point>,
        /// Fill.
        fill: Rgb,
        /// Opacity, 0 to 1.
        opacity: f64,
    },
    /// A filled disc.
    Disc {
        /// Centre.
        centre: Point,
        /// Radius.
        radius: f64,
        /// Fill.
        fill: Rgb,
    },
    /// A stroked open line with round joins.
    Line {
        /// Corners.
        points: Vec<Point>,
        /// Colour.
        stroke: Rgb,
        /// Width.
        width: f64,
        /// Lengths of dash and gap; `None` is solid.
        dash: Option<(f64, f64)>,
    },
    /// A picture stretched over a rectangle.
    Picture {
        /// Upper left corner.
        at: Point,
        /// Width and height of the rectangle.
        size: Point,
        /// Pixels in a row.
        width: usize,
        /// Pixels in a column.
        height: usize,
        /// Red, green, blue of every pixel, row-major.
        rgb: Vec<u8>,
    },
    /// A line of text. Texts are painted above all other shapes.
    Text {
        /// End named by the anchor, at the height of the middle of a capital.
        at: Point,
        /// Words.
        text: String,
        /// Look.
        style: TextStyle,
    },
}

/// A figure on white.
#[derive(Debug, Clone, PartialEq)]
pub struct Canvas {
    /// Width in CSS pixels.
    pub width: f64,
    /// Height in CSS pixels.
    pub height: f64,
    /// What the figure shows, for those who cannot see it.
    pub description: String,
    /// Shapes, in the order they are painted.
    pub items: Vec<Shape>,
}

impl Canvas {
    /// A blank figure.
    #[must_use]
    pub fn new(width: f64, height: f64, description: &str) -> Self {
        Self {
            width: width.ceil(),
            height: height.ceil(),
            description: description.to_owned(),
            items: Vec::new(),
        }
    }

    /// Adds a filled rectangle.
    pub fn rect(&mut self, (x, y): Point, (w, h): Point, fill: Rgb, opacity: f64) {
        self.items.push(Shape::Polygon {
            points: vec![(x, y), (x + w, y), (x + w, y + h), (x, y + h)],
            fill,
            opacity,
        });
    }

    /// Adds a solid line.
    pub fn line(&mut self, points: &[Point], stroke: Rgb, width: f64) {
        self.items.push(Shape::Line {
            points: points.to_vec(),
            stroke,
            width,
            dash: None,
        });
    }

    /// Adds the outline of a rectangle.
    pub fn frame(&mut self, (x, y): Point, (w, h): Point, stroke: Rgb, width: f64) {
        self.line(&[(x, y), (x + w, y), (x + w, y + h), (x, y + h), (x, y)], stroke, width);
    }

    /// Adds a line of text; an empty one adds nothing.
    pub fn text(&mut self, at: Point, text: &str, style: TextStyle) {
        if !text.trim().is_empty() {
            self.items.push(Shape::Text {
                at,
                text: text.to_owned(),
                style,
            });
        }
    }

    /// Adds lines of text, one below the other, the first at `at`.
    pub fn lines(&mut self, (x, y): Point, lines: &[String], style: TextStyle) {
        let mut middle = y;
        for line in lines {
            self.text((x, middle), line, style);
            middle += style.size * LINE_HEIGHT;
        }
    }
}

/// Distance between lines of text, in em.
pub const LINE_HEIGHT: f64 = 1.3;
