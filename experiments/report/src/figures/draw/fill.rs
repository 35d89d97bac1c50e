//! Filled polygons and strokes on an RGB buffer, anti-aliased.

use super::canvas::Point;
use crate::figures::colour::Rgb;

/// Scan lines a pixel row. Along a scan line coverage is exact, so an upright edge is exact too.
const SCAN_LINES: usize = 5;

/// An RGB buffer, row-major.
pub(super) struct Pixels {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) rgb: Vec<u8>,
}

/// A pixel index of a coordinate, clamped to `0..=limit`.
#[expect(clippy::cast_possible_truncation, reason = "clamped to a buffer's size")]
pub(super) fn index(value: f64, limit: usize) -> usize {
    if value > 0.0 { (value as usize).min(limit) } else { 0 }
}

impl Pixels {
    /// A white buffer.
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self {
            width,
            height,
            rgb: vec![255; width * height * 3],
        }
    }

    /// Lays a colour over a pixel with a coverage between 0 and 1.
    fn blend(&mut self, x: usize, y: usize, fill: Rgb, share: f64) {
        let start = (y * self.width + x) * 3;
        if let Some([r, g, b]) = self.rgb.get_mut(start..start + 3) {
            let mixed = Rgb(*r, *g, *b).mix(fill, share.min(1.0));
            (*r, *g, *b) = (mixed.0, mixed.1, mixed.2);
        }
    }

    /// Paints the pixels `from..to` of a row.
    fn run(&mut self, y: usize, (from, to): (usize, usize), Rgb(r, g, b): Rgb) {
        let row = y * self.width;
        if let Some(pixels) = self.rgb.get_mut((row + from) * 3..(row + to) * 3) {
            pixels.as_chunks_mut::<3>().0.fill([r, g, b]);
        }
    }

    /// Fills a closed polygon, even-odd.
    pub(super) fn polygon(&mut self, points: &[Point], fill: Rgb, opacity: f64) {
        if points.iter().any(|(x, y)| !x.is_finite() || !y.is_finite()) {
            return;
        }
        let least = |of: fn(&Point) -> f64| points.iter().map(of).fold(f64::INFINITY, f64::min);
        let most = |of: fn(&Point) -> f64| points.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        let rows = index(least(|p| p.1), self.height)..index(most(|p| p.1) + 1.0, self.height);
        let left = index(least(|p| p.0), self.width);
        let right = index(most(|p| p.0).ceil(), self.width);
        // coverage of the pixels at the ends of spans, from `left` on; what lies between is counted as whole
        let mut cover = vec![0.0; right.saturating_sub(left)];
        let mut spans: Vec<Spans> = vec![Spans::default(); SCAN_LINES];
        for y in rows {
            for (scan, spans) in spans.iter_mut().enumerate() {
                spans.cross(points, y as f64 + (scan as f64 + 0.5) / SCAN_LINES as f64);
            }
            let whole = whole_run(&spans, (left, right)).filter(|_| opacity >= 1.0);
            let (mut first, mut last) = (right, left);
            for span in spans.iter().flat_map(|spans| spans.0.chunks_exact(2)) {
                let (from, to) = (index(span[0], self.width), index(span[1].ceil(), self.width));
                let (skip, go_on) = whole.unwrap_or((to, to));
                for x in (from..to.min(skip)).chain(go_on.max(from)..to) {
                    let inside = span[1].min(x as f64 + 1.0) - span[0].max(x as f64);
                    cover[x - left] += inside.max(0.0) / SCAN_LINES as f64;
                }
                (first, last) = (first.min(from), last.max(to));
            }
            let (skip, go_on) = whole.unwrap_or((last, last));
            for x in (first..last.min(skip)).chain(go_on.max(first)..last) {
                self.blend(x, y, fill, std::mem::take(&mut cover[x - left]) * opacity);
            }
            if let Some(run) = whole {
                self.run(y, run, fill);
            }
        }
    }

    /// Fills a disc.
    pub(super) fn disc(&mut self, (x, y): Point, radius: f64, fill: Rgb) {
        let corners = (0..32).map(|i| {
            let (sin, cos) = (f64::from(i) * std::f64::consts::TAU / 32.0).sin_cos();
            (x + radius * cos, y + radius * sin)
        });
        self.polygon(&corners.collect::<Vec<_>>(), fill, 1.0);
    }

    /// Strokes an open line with round joins, dashed or solid.
    pub(super) fn stroke(&mut self, points: &[Point], stroke: Rgb, width: f64, dash: Option<(f64, f64)>) {
        let pieces = match dash {
            Some((on, off)) if on > 0.0 && off > 0.0 => dashes(points, on, off),
            _ => vec![points.to_vec()],
        };
        for piece in &pieces {
            for edge in piece.windows(2) {
                let (dx, dy) = (edge[1].0 - edge[0].0, edge[1].1 - edge[0].1);
                let length = dx.hypot(dy);
                if length > 0.0 {
                    let (nx, ny) = (-dy / length * width / 2.0, dx / length * width / 2.0);
                    let [a, b] = [edge[0], edge[1]];
                    let quad = [
                        (a.0 + nx, a.1 + ny),
                        (b.0 + nx, b.1 + ny),
                        (b.0 - nx, b.1 - ny),
                        (a.0 - nx, a.1 - ny),
                    ];
                    self.polygon(&quad, stroke, 1.0);
                }
            }
            if width > 2.5 {
                let inner = piece.get(1..piece.len().saturating_sub(1)).unwrap_or_default();
                inner.iter().for_each(|&joint| self.disc(joint, width / 2.0, stroke));
            }
        }
    }
}

/// Where a scan line is inside a polygon: from the first crossing to the second, from the third to the fourth, and so
/// on.
#[derive(Clone, Default)]
struct Spans(Vec<f64>);

impl Spans {
    /// Those at the height `level`.
    fn cross(&mut self, points: &[Point], level: f64) {
        self.0.clear();
        self.0.extend((0..points.len()).filter_map(|i| {
            let (a, b) = (points[i], points[(i + 1) % points.len()]);
            ((a.1 <= level) != (b.1 <= level)).then(|| a.0 + (level - a.1) / (b.1 - a.1) * (b.0 - a.0))
        }));
        self.0.sort_by(f64::total_cmp);
    }
}

/// The pixels `from..to` within `left..right` that all scan lines of a row cover wholly, where each has one span.
fn whole_run(scans: &[Spans], (left, right): (usize, usize)) -> Option<(usize, usize)> {
    let (mut from, mut to) = (left, right);
    for Spans(crossings) in scans {
        let [begin, end] = crossings[..] else { return None };
        from = from.max(index(begin.ceil(), right));
        to = to.min(index(end, right));
    }
    (from < to).then_some((from, to))
}

/// Cuts a line into dashes of length `on`, `off` apart.
fn dashes(points: &[Point], on: f64, off: f64) -> Vec<Vec<Point>> {
    let mut out = Vec::new();
    let mut piece = points.first().map_or(Vec::new(), |&p| vec![p]);
    let (mut drawing, mut left) = (true, on);
    for edge in points.windows(2) {
        let length = (edge[1].0 - edge[0].0).hypot(edge[1].1 - edge[0].1);
        let mut done = 0.0;
        while length - done > left {
            done += left;
            let share = done / length;
            let cut = (
                edge[0].0 + share * (edge[1].0 - edge[0].0),
                edge[0].1 + share * (edge[1].1 - edge[0].1),
            );
            if drawing {
                piece.push(cut);
                out.push(std::mem::take(&mut piece));
            } else {
                piece = vec![cut];
            }
            drawing = !drawing;
            left = if drawing { on } else { off };
        }
        left -= length - done;
        if drawing {
            piece.push(edge[1]);
        }
    }
    if piece.len() > 1 {
        out.push(piece);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::{Pixels, dashes};
    use crate::figures::colour::Rgb;

    /// Coverage of a rectangle with corners between pixels: area inside each pixel. Rows are sampled by five scan
    /// lines, and 0.6 and 0.4 of a row hold three and two of them; half a grey level of rounding remains.
    #[test]
    fn coverage_is_area() {
        let mut pixels = Pixels::new(3, 3);
        pixels.polygon(&[(0.5, 0.4), (2.25, 0.4), (2.25, 2.4), (0.5, 2.4)], Rgb(0, 0, 0), 1.0);
        let expected = [0.5 * 0.6, 0.6, 0.25 * 0.6, 0.5, 1.0, 0.25, 0.5 * 0.4, 0.4, 0.25 * 0.4];
        for (pixel, area) in pixels.rgb.chunks_exact(3).zip(expected) {
            assert!(
                (f64::from(pixel[0]) - 255.0 * (1.0 - area)).abs() <= 0.5 + 1e-9,
                "{pixel:?} {area}"
            );
        }
    }

    /// Runs of wholly covered pixels are painted at once where the fill is opaque. One part in 10^12 less opaque, every
    /// pixel is blended, which is less than a grey level away: the pixels are the same.
    #[test]
    fn runs_are_what_blending_gives() {
        let mut state = 1_u32;
        let mut random = |limit: f64| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24) * limit
        };
        let (mut runs, mut blended) = (Pixels::new(40, 30), Pixels::new(40, 30));
        for k in 0..400_u32 {
            // corners may lie outside; every other polygon is upright
            let mut point = || (random(50.0) - 5.0, random(40.0) - 5.0);
            let (a, b) = (point(), point());
            let points = if k % 2 == 0 {
                vec![a, (b.0, a.1), b, (a.0, b.1)]
            } else {
                vec![a, b, point(), point(), point()]
            };
            let fill = Rgb(u8::try_from(k % 256).unwrap(), 255 - u8::try_from(k % 200).unwrap(), 77);
            runs.polygon(&points, fill, 1.0);
            blended.polygon(&points, fill, 1.0 - 1e-12);
            assert!(runs.rgb == blended.rgb, "polygon {k}: {points:?}");
        }
    }

    #[test]
    fn dashes_run_round_corners() {
        let pieces = dashes(&[(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)], 4.0, 1.0);
        assert_eq!(
            pieces,
            [vec![(0.0, 0.0), (3.0, 0.0), (3.0, 1.0)], vec![(3.0, 2.0), (3.0, 4.0)]]
        );
    }
}
