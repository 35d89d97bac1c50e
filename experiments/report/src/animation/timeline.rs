//! Which part of a press or drop is shown, and how slowly; and the trace of the wire in that time, as columns of
//! pixels.

use spts_contact::Frame;
use std::ops::Range;

/// Time between two pictures, hundredths of a second: the unit of a GIF.
pub(super) const DELAY_CS: u16 = 7;
/// Least length of the animation, s. Speeds are round, so that it is up to two and a half times as long.
const SHOWN_S: f64 = 3.0;
/// Loaded is what has more than this share of the largest force.
const LOADED: f64 = 0.005;
/// Time before and after the contact, as shares of its duration.
const MARGINS: [f64; 2] = [0.15, 0.25];

/// The instants of the pictures.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Timeline {
    /// Where the animation begins, s since the start of the block.
    pub(super) from_s: f64,
    /// Where it ends.
    pub(super) to_s: f64,
    /// First instant under load; `None` where nothing touches the skin.
    pub(super) touch_s: Option<f64>,
    /// Every picture's instant.
    pub(super) instants_s: Vec<f64>,
    /// Time on the screen over time on the skin.
    pub(super) slower: f64,
}

impl Timeline {
    /// The contact with the largest force among `frames`, of a block that lasts `block_s`; all of the block where there
    /// is no contact.
    pub(super) fn of(frames: &[Frame], block_s: f64) -> Self {
        let contact = contact_s(frames);
        let (from_s, to_s) = match contact {
            Some([start, end]) => {
                let [before, after] = MARGINS.map(|share| share * (end - start));
                ((start - before).max(0.0), (end + after).min(block_s))
            }
            None => (0.0, block_s),
        };
        let to_s = to_s.max(from_s);
        let slower = slow_motion(to_s - from_s);
        let step_s = f64::from(DELAY_CS) / 100.0 / slower;
        // a picture shows what is known at its instant, so the first one is a step after the beginning
        let instants = (1_u32..).map(|k| from_s + f64::from(k) * step_s);
        // the rounding of a sum is far less than a thousandth of a step
        let instants_s: Vec<f64> = instants.take_while(|t| *t <= to_s + 1e-3 * step_s).collect();
        Self {
            instants_s: instants_s.into_iter().map(|t| t.min(to_s)).collect(),
            touch_s: contact.map(|[start, _]| start),
            from_s,
            to_s,
            slower,
        }
    }

    /// What the picture says about its speed.
    pub(super) fn speed(&self) -> String {
        if self.slower > 1.0 {
            format!("{} × slower than real", self.slower)
        } else if self.slower < 1.0 {
            format!("{} × faster than real", (1.0 / self.slower).round())
        } else {
            "in real time".to_owned()
        }
    }

    /// What the picture says about the instant `time_s`.
    pub(super) fn clock(&self, time_s: f64) -> String {
        let span_ms = 1e3 * (self.to_s - self.from_s);
        let decimals = if span_ms < 100.0 { 1 } else { 0 };
        let Some(touch_s) = self.touch_s else {
            return format!("{:.decimals$} ms", 1e3 * time_s);
        };
        let since_ms = 1e3 * (time_s - touch_s);
        if since_ms < 0.0 {
            format!("{:.decimals$} ms before the touch", -since_ms)
        } else {
            format!("{since_ms:.decimals$} ms after the touch")
        }
    }

    /// The zero of the time axis, s since the start of the block, and its name.
    pub(super) fn zero(&self) -> (f64, &'static str) {
        self.touch_s.map_or((0.0, "time, ms"), |touch| (touch, "time after the touch, ms"))
    }
}

/// First and last instant under load of the contact with the largest force, to a frame.
fn contact_s(frames: &[Frame]) -> Option<[f64; 2]> {
    let force = |frame: &Frame| frame.wrench.force_n[2];
    let strongest = (0..frames.len()).max_by(|a, b| force(&frames[*a]).total_cmp(&force(&frames[*b])))?;
    let peak = force(&frames[strongest]);
    let idle = |frame: &Frame| force(frame) <= LOADED * peak;
    if peak <= 0.0 || !peak.is_finite() {
        return None;
    }
    let start = frames[..strongest].iter().rposition(idle).unwrap_or(0);
    let end = frames[strongest..].iter().position(idle);
    let end = end.map_or(frames.len() - 1, |after| strongest + after);
    Some([frames[start].time_s, frames[end].time_s])
}

/// The least of 1, 2, 3, 5, 10, 20 … and of one half, one fifth, one tenth … with which `span_s` fills the animation.
fn slow_motion(span_s: f64) -> f64 {
    if span_s.is_nan() || span_s <= 0.0 {
        return 1.0;
    }
    let decades = || (0..9).map(|decade| 10_f64.powi(decade));
    let faster = decades().flat_map(|d| [1.0, 2.0, 5.0].map(|step| 1.0 / (step * d)));
    let mut speeds: Vec<f64> = faster.collect();
    speeds.reverse();
    speeds.extend(decades().flat_map(|d| [1.0, 2.0, 3.0, 5.0].map(|step| step * d)));
    let enough = |speed: &&f64| *speed * span_s >= SHOWN_S;
    speeds.iter().find(enough).copied().unwrap_or(1e9)
}

/// Pressure of every taxel at `time_s`, Pa: on straight lines between frames.
pub(super) fn pressure_pa(frames: &[Frame], time_s: f64) -> Vec<f64> {
    let after = frames.partition_point(|frame| frame.time_s <= time_s);
    let Some(before) = frames.get(after.saturating_sub(1)) else {
        return Vec::new();
    };
    let mut values = before.pressure.values().to_vec();
    if let Some(next) = frames.get(after).filter(|_| after > 0) {
        let share = (time_s - before.time_s) / (next.time_s - before.time_s);
        for (value, next) in values.iter_mut().zip(next.pressure.values()) {
            *value += share * (next - *value);
        }
    }
    values
}

/// Least and largest voltage under each column of pixels.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Trace {
    /// Least and largest voltage of a column, V; `None` where all its samples were lost.
    pub(super) columns: Vec<Option<[f64; 2]>>,
    /// Least and largest voltage of all, V.
    pub(super) range: [f64; 2],
}

impl Trace {
    /// The samples `shown` of `volts` in `columns` columns. A column reaches to the last sample of the one before, so
    /// that the trace is a line.
    pub(super) fn new(volts: &[f64], shown: Range<usize>, columns: usize) -> Self {
        let volts = &volts[shown.start.min(volts.len())..shown.end.min(volts.len())];
        let (mut before, mut all) = (None, None);
        let place = |column: usize| column * volts.len() / columns.max(1);
        let columns = (0..columns).map(|column| {
            let samples = place(column)..place(column + 1).max(place(column) + 1).min(volts.len());
            let own = volts[samples].iter().copied().filter(|v| v.is_finite());
            let mut range: Option<[f64; 2]> = None;
            let mut last = before;
            for v in before.into_iter().chain(own) {
                range = Some(with(range, v));
                all = Some(with(all, v));
                last = Some(v);
            }
            before = last;
            range
        });
        let columns = columns.collect();
        Self { columns, range: all.unwrap_or([0.0, 1.0]) }
    }
}

fn with(range: Option<[f64; 2]>, v: f64) -> [f64; 2] {
    range.map_or([v, v], |[low, high]| [low.min(v), high.max(v)])
}
