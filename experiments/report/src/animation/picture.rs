//! One picture: pressure, the samples of the current window, the image decoded from the wire, and the wire's trace.

use super::Animation;
use super::gif::{AHEAD, TRACE, WINDOW, step_of};
use super::timeline::Timeline;
use crate::figures::axis::Axis;
use crate::figures::canvas::{Anchor, Canvas, Point, TextStyle, text_width, wrap};
use crate::figures::colour::{FRAME, INK, MUTED, Rgb, heat};
use crate::figures::draw_heat;

/// Width of the picture, CSS pixels; the trace has two columns of pixels to each.
const WIDTH: f64 = 420.0;
const HEIGHT: f64 = 352.0;
const MARGIN: f64 = 14.0;
/// Side of the two images.
const TILE: f64 = 140.0;
const TILES_TOP: f64 = 74.0;
/// The samples of the window, between the images.
const BARS: (f64, f64) = (172.0, 76.0);
/// Upper left corner of the trace, and its size.
const TRACE_AT: Point = (46.0, 256.0);
const TRACE_SIZE: (f64, f64) = (360.0, 60.0);
/// Columns of pixels of the trace.
pub(super) const COLUMNS: usize = 720;
const COLUMN: f64 = TRACE_SIZE.0 / COLUMNS as f64;

const TITLE: TextStyle = TextStyle::new(15.0, INK).bold();
const HEADING: TextStyle = TextStyle::new(10.5, INK).bold();
const SMALL: TextStyle = TextStyle::new(10.0, MUTED);

impl Animation {
    /// Picture number `k`.
    pub(super) fn picture(&self, k: usize) -> Canvas {
        let time_s = self.timeline.instants_s[k];
        let mut canvas = Canvas::new(WIDTH, HEIGHT, &self.title);
        let fit = (WIDTH - 2.0 * MARGIN) / text_width(&self.title, TITLE.size, true);
        let title = TextStyle { size: TITLE.size * fit.min(1.0), ..TITLE };
        canvas.text((MARGIN, 20.0), &self.title, title);
        let line = TextStyle::new(12.0, MUTED);
        canvas.text((MARGIN, 42.0), &self.timeline.speed(), line);
        let clock = TextStyle::new(12.0, INK).anchored(Anchor::End);
        canvas.text((WIDTH - MARGIN, 42.0), &self.timeline.clock(time_s), clock);

        let right = WIDTH - MARGIN - TILE;
        let scale = |peak: f64| if peak > 0.0 { peak } else { 1.0 };
        let (pressure_pa, image) = (&self.pressures[k], &self.images[k].image);
        self.tile(&mut canvas, MARGIN, "pressure on the skin", pressure_pa, scale(self.peak_pa));
        scale_bar(&mut canvas, MARGIN, &pressure_label(self.peak_pa));
        match &self.peak_v {
            Ok(peak_v) => {
                self.tile(&mut canvas, right, "decoded from the wire", image, scale(*peak_v));
                scale_bar(&mut canvas, right, &format!("{peak_v:.1} V"));
            }
            Err(reason) => {
                canvas.text((right, TILES_TOP - 10.0), "not decoded", HEADING);
                canvas.frame((right, TILES_TOP), (TILE, TILE), FRAME, 1.0);
                let lines = wrap(reason, SMALL.size, false, TILE - 16.0);
                canvas.lines((right + 8.0, TILES_TOP + 20.0), &lines, SMALL);
            }
        }
        self.bars(&mut canvas, &self.output_v[self.images[k].window.clone()]);
        self.trace(&mut canvas, k);
        canvas
    }

    fn tile(&self, canvas: &mut Canvas, left: f64, heading: &str, values: &[f64], peak: f64) {
        canvas.text((left, TILES_TOP - 10.0), heading, HEADING);
        let shares: Vec<f64> = values.iter().map(|value| step_of(value / peak)).collect();
        draw_heat(canvas, &shares, self.shape, 1.0, None, (left, TILES_TOP), TILE);
    }

    /// The samples of the window as bars about zero.
    fn bars(&self, canvas: &mut Canvas, samples: &[f64]) {
        let (left, width) = BARS;
        let coloured = TextStyle { colour: WINDOW, ..HEADING };
        let heading = format!("{} samples", self.m);
        let at = (left + width / 2.0, TILES_TOP - 10.0);
        canvas.text(at, &heading, coloured.anchored(Anchor::Middle));
        let middle = TILES_TOP + TILE / 2.0;
        let half = TILE / 2.0 - 6.0;
        let pitch = width / samples.len().max(1) as f64;
        for (k, v) in samples.iter().enumerate().filter(|(_, v)| v.is_finite()) {
            let tall = (half * (v / self.largest_v).clamp(-1.0, 1.0) * 2.0).round() / 2.0;
            let x = half_pixel(left + (k as f64 + 0.15) * pitch);
            let wide = half_pixel(0.7 * pitch).max(0.5);
            canvas.rect((x, middle - tall.max(0.0)), (wide, tall.abs()), WINDOW, 1.0);
        }
        canvas.line(&[(left, middle), (left + width, middle)], MUTED, 1.0);
        for x in [left - 15.0, left + width + 5.0] {
            arrow(canvas, (x, middle));
        }
    }

    /// The trace, with what is past in colour and the current window marked.
    fn trace(&self, canvas: &mut Canvas, k: usize) {
        let window = &self.images[k].window;
        let ((left, top), (width, height)) = (TRACE_AT, TRACE_SIZE);
        let Timeline { from_s, to_s, .. } = self.timeline;
        let span_s = (to_s - from_s).max(f64::MIN_POSITIVE);
        let [low, high] = self.trace.range;
        let axis = Axis::new([low, high].into_iter(), false, None);
        let level = |v: f64| half_pixel(top + height * (1.0 - axis.place(v).unwrap_or(0.0).clamp(0.0, 1.0)));
        let at = |time_s: f64| left + width * ((time_s - from_s) / span_s).clamp(0.0, 1.0);

        let name = "voltage on the wire";
        canvas.text((MARGIN, top - 12.0), name, HEADING);
        let window_ms = 1e3 * self.m as f64 / self.rate_hz;
        let marked = format!("marked: the last {} samples, {window_ms:.2} ms", self.m);
        let style = SMALL.anchored(Anchor::End);
        let coloured = TextStyle { colour: WINDOW, ..style };
        canvas.text((left + width, top - 12.0), &marked, coloured);

        let now = at(self.timeline.instants_s[k]);
        // the window is wide enough to be seen
        let ends = [window.start, window.end].map(|sample| at(sample as f64 / self.rate_hz));
        let wide = half_pixel(ends[1] - ends[0]).max(1.5);
        let begin = half_pixel(ends[1] - wide).max(left);
        canvas.rect((begin, top), (wide, height), WINDOW, 0.4);
        for (column, range) in self.trace.columns.iter().enumerate() {
            let Some([low, high]) = range else { continue };
            let x = left + column as f64 * COLUMN;
            let (upper, lower) = (level(*high), level(*low));
            let colour = if x < now { TRACE } else { AHEAD };
            canvas.rect((x, upper), (COLUMN, (lower - upper).max(0.5)), colour, 1.0);
        }
        canvas.frame((left, top), (width, height), FRAME, 1.0);
        canvas.line(&[(now, top), (now, top + height)], WINDOW, 1.0);

        for (tick, label) in axis.ticks(4) {
            let Some(place) = axis.place(tick).filter(|place| (0.02..=0.98).contains(place)) else {
                continue;
            };
            let y = top + height * (1.0 - place);
            canvas.line(&[(left - 4.0, y), (left, y)], FRAME, 1.0);
            canvas.text((left - 7.0, y), &label, SMALL.anchored(Anchor::End));
        }
        let middle = SMALL.anchored(Anchor::Middle);
        canvas.text((MARGIN - 2.0, top + height / 2.0), "V", middle.upwards());
        let (zero_s, name) = self.timeline.zero();
        let ms = |time_s: f64| 1e3 * (time_s - zero_s);
        let times = Axis::new([].into_iter(), false, Some((ms(from_s), ms(to_s))));
        for (tick, label) in times.ticks(6) {
            let x = at(zero_s + 1e-3 * tick);
            canvas.line(&[(x, top + height), (x, top + height + 4.0)], FRAME, 1.0);
            canvas.text((x, top + height + 11.0), &label, middle);
        }
        canvas.text((left + width / 2.0, top + height + 26.0), name, middle);
    }
}

/// The heat map from 0 to `most`, below an image.
fn scale_bar(canvas: &mut Canvas, left: f64, most: &str) {
    const STEPS: u32 = 40;
    let (x, y, wide) = (left + 14.0, TILES_TOP + TILE + 7.0, 2.0);
    canvas.text((left + 2.0, y + 4.0), "0", SMALL);
    for step in 0..STEPS {
        let share = step_of(f64::from(step) / f64::from(STEPS - 1));
        canvas.rect((x + wide * f64::from(step), y), (wide, 8.0), heat(share), 1.0);
    }
    canvas.text((x + wide * f64::from(STEPS) + 5.0, y + 4.0), most, SMALL);
}

fn pressure_label(peak_pa: f64) -> String {
    match peak_pa {
        p if p >= 1e5 => format!("{:.0} kPa", 1e-3 * p),
        p if p >= 1e3 => format!("{:.1} kPa", 1e-3 * p),
        p => format!("{p:.0} Pa"),
    }
}

fn arrow(canvas: &mut Canvas, (x, y): Point) {
    const COLOUR: Rgb = MUTED;
    canvas.line(&[(x, y), (x + 9.0, y)], COLOUR, 1.5);
    canvas.line(&[(x + 5.0, y - 4.0), (x + 9.5, y), (x + 5.0, y + 4.0)], COLOUR, 1.5);
}

/// The nearest place that the painted picture shows sharply.
fn half_pixel(value: f64) -> f64 {
    (2.0 * value).round() / 2.0
}
