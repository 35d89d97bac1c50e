//! Axes: the range, the ticks and the place of a value; and the inner rectangle of a panel, with its two axes.

use super::canvas::Point;

/// Share of the range left free beyond the data.
const PADDING: f64 = 0.04;
/// Fewest ticks of a logarithmic axis. With fewer it takes finer parts of a decade, and at last the ticks of a linear
/// axis.
const LEAST_TICKS: usize = 3;
/// Parts of a decade at which a logarithmic axis has ticks, from coarse to fine.
const LEADS: [&[f64]; 3] = [&[1.0], &[1.0, 2.0, 5.0], &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0]];

/// A linear or logarithmic axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Lower end, in decades if `log`.
    low: f64,
    /// Upper end, in decades if `log`.
    high: f64,
    /// Logarithmic.
    log: bool,
}

impl Axis {
    /// An axis for `values`, or for `range` if one is given. Without values it runs from 0 to 1, or from 1 to 10.
    ///
    /// Values that are all of one sign and come near 0 bring 0 onto a linear axis, exactly at its end.
    pub fn new(values: impl Iterator<Item = f64>, log: bool, range: Option<(f64, f64)>) -> Self {
        let shown = |value: f64| value.is_finite() && (!log || value > 0.0);
        let place = |value: f64| if log { value.log10() } else { value };
        if let Some((low, high)) = range
            && shown(low)
            && shown(high)
            && low < high
        {
            return Self { low: place(low), high: place(high), log };
        }
        let (low, high) = values
            .filter(|&v| shown(v))
            .map(place)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
        if low > high {
            return Self { low: 0.0, high: 1.0, log };
        }
        // A single value, to rounding: 1e-9 is far above the rounding of a sum and below any tick.
        if high - low <= 1e-9 * low.abs().max(high.abs()) {
            let half = match low.abs() {
                _ if log => 0.5,
                size if size < f64::MIN_POSITIVE => 1.0,
                size => (0.1 * size).max(f64::MIN_POSITIVE.sqrt()),
            };
            return Self { low: low - half, high: high + half, log };
        }
        let free = PADDING * (high - low);
        let near = |end: f64, other: f64| !log && end.abs() <= 0.5 * other.abs();
        Self {
            low: if low >= 0.0 && near(low, high) { 0.0 } else { low - free },
            high: if high <= 0.0 && near(high, low) { 0.0 } else { high + free },
            log,
        }
    }

    /// Place of a value: 0 at the lower end, 1 at the upper. `None` if the axis cannot show it at any length.
    pub fn place(&self, value: f64) -> Option<f64> {
        let value = if self.log { value.log10() } else { value };
        value.is_finite().then(|| (value - self.low) / (self.high - self.low))
    }

    /// Ticks with their labels; about `count` on a linear axis.
    pub fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        if self.log {
            let ticks = self.log_ticks();
            if ticks.len() >= LEAST_TICKS {
                return ticks;
            }
            // Less than a decade between two ticks of the usual leads: ticks as on a linear axis.
            let linear = Self { low: 10_f64.powf(self.low), high: 10_f64.powf(self.high), log: false };
            let finer = linear.linear_ticks(count);
            if finer.len() > ticks.len() { finer } else { ticks }
        } else {
            self.linear_ticks(count)
        }
    }

    fn linear_ticks(&self, count: usize) -> Vec<(f64, String)> {
        let raw = (self.high - self.low) / count.max(1) as f64;
        let decade = 10_f64.powf(raw.log10().floor());
        let step = [1.0, 2.0, 2.5, 5.0].iter().map(|m| m * decade).find(|step| *step >= raw).unwrap_or(10.0 * decade);
        // Half a millionth of a step of slack keeps a tick at the very end.
        let first = (self.low / step - 5e-7).ceil();
        let decimals =
            (0..9).find(|&d| ((step * 10_f64.powi(d)) % 1.0).min(1.0 - (step * 10_f64.powi(d)) % 1.0) < 1e-6);
        (0..64)
            .map(|i| (first + f64::from(i)) * step)
            .take_while(|tick| *tick <= self.high + 5e-7 * step)
            .map(|tick| {
                let tick = if tick.abs() < 1e-9 * step { 0.0 } else { tick };
                (tick, plain(tick, decimals, self.low.abs().max(self.high.abs())))
            })
            .collect()
    }

    /// Ticks at the coarsest parts of a decade that give [`LEAST_TICKS`] of them.
    fn log_ticks(&self) -> Vec<(f64, String)> {
        let decades = self.high - self.low;
        let coarsest = match decades {
            d if d <= 0.7 => 2,
            d if d <= 2.6 => 1,
            _ => 0,
        };
        let mut tried = LEADS[coarsest..].iter().map(|leads| self.log_ticks_at(leads));
        tried.find(|ticks| ticks.len() >= LEAST_TICKS).unwrap_or_else(|| self.log_ticks_at(LEADS[coarsest]))
    }

    /// Ticks at `leads` times powers of ten.
    fn log_ticks_at(&self, leads: &[f64]) -> Vec<(f64, String)> {
        // At most nine decades are named.
        let stride = ((self.high - self.low) / 9.0).ceil().max(1.0);
        let mut ticks = Vec::new();
        let mut decade = (self.low / stride).floor() * stride;
        while decade <= self.high {
            for lead in leads {
                let exponent = decade + lead.log10();
                if exponent >= self.low - 1e-9 && exponent <= self.high + 1e-9 {
                    ticks.push((lead * 10_f64.powf(decade), log_label(*lead, decade)));
                }
            }
            decade += stride;
        }
        ticks
    }
}

/// A tick of a linear axis; very large and very small axes are written with an exponent.
fn plain(tick: f64, decimals: Option<i32>, largest: f64) -> String {
    match decimals.and_then(|d| usize::try_from(d).ok()) {
        Some(decimals) if largest < 1e6 && decimals <= 5 => format!("{tick:.decimals$}").replace('-', "−"),
        _ if tick.abs() < f64::MIN_POSITIVE => "0".to_owned(),
        _ => {
            let exponent = tick.abs().log10().floor();
            let lead = format!("{:.2}", tick / 10_f64.powf(exponent));
            let lead = lead.trim_end_matches('0').trim_end_matches('.').replace('-', "−");
            format!("{lead}·10{}", superscript(exponent))
        }
    }
}

/// A tick of a logarithmic axis.
fn log_label(lead: f64, decade: f64) -> String {
    if (-3.0..5.0).contains(&decade) {
        return format!("{}", (lead * 10_f64.powf(decade + 6.0)).round() / 1e6);
    }
    let power = format!("10{}", superscript(decade));
    if lead > 1.0 { format!("{lead}·{power}") } else { power }
}

/// A whole number in raised digits.
fn superscript(exponent: f64) -> String {
    const DIGITS: [char; 10] = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    let raise = |c: char| c.to_digit(10).map_or('⁻', |digit| DIGITS[usize::try_from(digit).unwrap_or(0)]);
    format!("{exponent:.0}").chars().map(raise).collect()
}

/// The inner rectangle of a panel and its two axes.
pub(super) struct PanelFrame {
    pub(super) left: f64,
    pub(super) top: f64,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) x: Axis,
    pub(super) y: Axis,
}

impl PanelFrame {
    /// Where a point of the data stands, inside or outside the rectangle.
    pub(super) fn place(&self, (x, y): Point) -> Option<Point> {
        let (u, v) = (self.x.place(x)?, self.y.place(y)?);
        Some((self.left + u * self.width, self.top + (1.0 - v) * self.height))
    }

    /// Height of a value, if inside.
    pub(super) fn level(&self, y: f64) -> Option<f64> {
        let inside = self.y.place(y).filter(|v| (0.0..=1.0).contains(v));
        inside.map(|v| self.top + (1.0 - v) * self.height)
    }

    /// Horizontal place of a value, if inside.
    pub(super) fn column(&self, x: f64) -> Option<f64> {
        let inside = self.x.place(x).filter(|u| (0.0..=1.0).contains(u));
        inside.map(|u| self.left + u * self.width)
    }

    /// Whether a place is inside, the border included.
    pub(super) fn holds(&self, (x, y): Point) -> bool {
        // A tenth of a pixel of rounding.
        x >= self.left - 0.1
            && x <= self.left + self.width + 0.1
            && y >= self.top - 0.1
            && y <= self.top + self.height + 0.1
    }
}

#[cfg(test)]
mod tests {
    use super::Axis;

    #[test]
    fn ticks_are_readable() {
        let cases: [(f64, f64, bool, &[&str]); 6] = [
            (2.0, 100.0, true, &["2", "5", "10", "20", "50", "100"]),
            // it begins above a decade
            (1.6e-4, 0.07, true, &["2·10⁻⁴", "5·10⁻⁴", "0.001", "0.002", "0.005", "0.01", "0.02", "0.05"]),
            (1e-7, 1e-5, true, &["10⁻⁷", "2·10⁻⁷"]),
            (12.0, 98.0, false, &["0", "25", "50", "75", "100"]),
            (0.0, 4e7, false, &["0", "1·10⁷"]),
            (-0.3, 0.3, false, &["−0.2", "0.0", "0.2"]),
        ];
        for (low, high, log, expected) in cases {
            let ticks = Axis::new([low, high].into_iter(), log, None).ticks(5);
            let labels: Vec<&str> = ticks.iter().map(|(_, label)| label.as_str()).collect();
            assert_eq!(labels[..expected.len()], *expected);
        }
        // a short logarithmic axis has several ticks
        for (low, high) in [(11.0, 19.0), (55.0, 65.0), (0.012, 0.014), (2.1, 2.9)] {
            let ticks = Axis::new([low, high].into_iter(), true, None).ticks(5);
            assert!(ticks.len() >= 3, "{low} {high} {ticks:?}");
        }
    }

    #[test]
    fn degenerate_values_still_make_an_axis() {
        let cases: [&[f64]; 5] = [&[], &[f64::NAN], &[0.0], &[7.0, 7.0], &[-1e-300]];
        for values in cases {
            for log in [false, true] {
                let axis = Axis::new(values.iter().copied(), log, Some((3.0, 3.0)));
                let ticks = axis.ticks(5);
                assert!(!ticks.is_empty() && ticks.len() < 20, "{values:?} {log} {ticks:?}");
                let inside = |tick: f64| axis.place(tick).is_some_and(|p| (-0.01..=1.01).contains(&p));
                assert!(ticks.iter().all(|(tick, _)| inside(*tick)));
            }
        }
    }
}
