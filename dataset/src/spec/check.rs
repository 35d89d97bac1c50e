//! Checks a specification before anything is built; and when the windows of a press are recorded.

use super::config::{ObjectSource, PressConfig, RecordKind, SpecConfig};
use super::draw::{Draw, whole};
use spts::Refusal;
use spts_circuit::FAULTS;
use spts_models::{SkinLayout, in_range};
use spts_sim::mechanics::{GRAVITY_M_PER_S2, PressConfig as ArmConfig};

/// Most values of a list column in one row, so that a row takes a few megabytes at most.
const MOST_VALUES: usize = 1 << 22;
/// Most values of a list column in all rows of a press, which are kept together: a few hundred megabytes.
const MOST_PRESS_VALUES: u64 = 1 << 24;
/// Most windows of a press.
const MOST_WINDOWS: u64 = 10_000;
/// Default number of windows of a drop: with 1 ms between them they cover the contact of a tennis ball, 8 ms.
const DROP_WINDOWS: u64 = 16;
/// Default time between the windows, and from the first window to the touch, s: of a course, and of a drop.
const COURSE_S: [f64; 2] = [0.02, 0.1];
const DROP_S: [f64; 2] = [0.001, 0.004];
/// Time after the force is gone that the default number of windows of a course covers, s.
const AFTER_S: f64 = 0.1;
/// Longest press or drop that is followed in time, s: what a scene may last.
const LONGEST_S: f64 = 60.0;
/// Time between the frames of a press, and of a drop near the skin, s.
const FRAMES_S: [f64; 2] = [2e-3, 1e-4];
/// Most values of a press's frames: 1 GiB of each kind.
const MOST_FRAME_VALUES: f64 = (1_u64 << 27) as f64;
/// Time that a scene may take beside what is recorded, s: the approach of the arm, and what follows the last window.
const BESIDE_S: f64 = 0.5;

/// When the windows of a press are recorded.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    pub(crate) what: RecordKind,
    pub(crate) windows: u64,
    /// Time from window to window, s; `None` if they follow each other without a gap.
    pub(crate) interval_s: Option<f64>,
    /// Time from the first window to the touch, s; 0 for holds.
    pub(crate) before_s: f64,
    measurements: u64,
    /// Measurements a second, Hz; unknown until the readout is built.
    pub(crate) rate_hz: f64,
}

impl Timing {
    /// The timing of `config`, of which the rate is not known yet. Frames go on for `frames_s` after the touch, s.
    pub(super) fn of(config: &SpecConfig, frames_s: Option<f64>) -> Result<Self, Refusal> {
        let record = &config.record;
        let [interval_s, before_s] = match record.what {
            RecordKind::Hold => [None, None],
            RecordKind::Course => COURSE_S.map(Some),
            RecordKind::Drop => DROP_S.map(Some),
        };
        if record.what == RecordKind::Hold && record.before_s.is_some() {
            return Err(Refusal::new(
                "`record.before_s` is not for `record.what` = \"hold\", which begins in the hold",
            ));
        }
        let interval_s = record.interval_s.or(interval_s);
        if let Some(interval_s) = interval_s {
            let is_valid = interval_s > 0.0 && interval_s <= 10.0;
            in_range("record.interval_s", interval_s, is_valid, "(0, 10] s")?;
            if record.whole_rate {
                whole_rate(interval_s)?;
            }
        }
        let before_s = record.before_s.or(before_s).unwrap_or(0.0);
        let is_valid = (0.0..=10.0).contains(&before_s);
        in_range("record.before_s", before_s, is_valid, "[0, 10] s")?;
        let windows = record.windows.unwrap_or_else(|| default_windows(config, interval_s, before_s, frames_s));
        let is_valid = (1..=MOST_WINDOWS).contains(&windows);
        in_range("record.windows", windows as f64, is_valid, "[1, 10000]")?;
        Ok(Self {
            what: record.what,
            windows,
            interval_s,
            before_s,
            measurements: record.measurements as u64,
            rate_hz: f64::NAN,
        })
    }

    /// The same with the rate of the readout.
    pub(super) fn at_rate(self, rate_hz: f64) -> Result<Self, Refusal> {
        if let Some(interval_s) = self.interval_s {
            let shortest_s = self.measurements as f64 / rate_hz;
            // a rounding of the quotient must not cost the shortest one
            let is_valid = interval_s >= shortest_s * (1.0 - 1e-12);
            let range = "[record.measurements / sample rate, 10] s";
            in_range("record.interval_s", interval_s, is_valid, range)?;
        }
        Ok(Self { rate_hz, ..self })
    }

    /// Measurements from the beginning of window 0 to that of `window`.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "10,000 windows of 10 s at 1 GHz are 1e14"
    )]
    pub(crate) fn row_of(&self, window: u64) -> u64 {
        match self.interval_s {
            None => window * self.measurements,
            Some(interval_s) => (window as f64 * interval_s * self.rate_hz).round() as u64,
        }
    }

    /// Measurements from the beginning of window 0 to the end of the last one.
    pub(crate) fn span(&self) -> u64 {
        self.row_of(self.windows - 1) + self.measurements
    }

    /// The same, s.
    pub(crate) fn span_s(&self) -> f64 {
        self.span() as f64 / self.rate_hz
    }
}

/// Refuses an interval that does not make a whole number of windows a second, to 1e-6, as the export to LeRobot does.
fn whole_rate(interval_s: f64) -> Result<(), Refusal> {
    let rate = 1.0 / interval_s;
    let nearest = rate.round().max(1.0);
    if (rate - nearest).abs() <= 1e-6 {
        return Ok(());
    }
    Err(Refusal::new(format!(
        "`record.interval_s` = {interval_s} makes {rate} windows a second, and LeRobot's layout needs a whole number; \
         valid: 1/n s for whole n, such as {} for {nearest}; or set `record.whole_rate` = false, if the data set is \
         not for LeRobot",
        1.0 / nearest
    )))
}

fn default_windows(config: &SpecConfig, interval_s: Option<f64>, before_s: f64, frames_s: Option<f64>) -> u64 {
    match (config.record.what, interval_s) {
        (RecordKind::Course, Some(interval_s)) if frames_s.is_some() => {
            // a rounding of the quotient must not cost the last one
            whole(((before_s + frames_s.unwrap_or(0.0)) / interval_s + 1e-9).floor().max(1.0)) as u64
        }
        (RecordKind::Course, Some(interval_s)) => {
            let [_, hold_s] = config.press.hold_s.range();
            let [_, fall_s] = config.press.fall_s.range();
            let whole_s = before_s + hold_s + ArmConfig::ramp_s(fall_s) + AFTER_S;
            whole((whole_s / interval_s).ceil()) as u64
        }
        (RecordKind::Drop, _) => DROP_WINDOWS,
        _ => 1,
    }
}

pub(super) fn check_name(name: &str) -> Result<(), Refusal> {
    let ok = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    if !name.is_empty() && name.len() <= 100 && name.chars().all(ok) {
        return Ok(());
    }
    let name = name.escape_debug();
    let valid = "1 to 100 letters, digits, `-` and `_`";
    Err(Refusal::new(format!("`name` = \"{name}\"; valid: {valid}")))
}

/// Field, what is drawn for it, least and largest value, and these as text.
type Limits<'a> = (&'a str, &'a Draw, f64, f64, &'static str);

fn within(limits: &[Limits<'_>]) -> Result<(), Refusal> {
    let mut limits = limits.iter();
    limits.try_for_each(|(field, draw, least, most, range)| draw.within(field, *least, *most, range))
}

pub(super) fn check_draws(c: &SpecConfig, skin: &SkinLayout, timing: &Timing, moving: bool) -> Result<(), Refusal> {
    let (pose, press, split, taxels) = (&c.pose, &c.press, &c.split, skin.taxels());
    let [tilt, validation, test, both] =
        [press.tilt_stiffness_nm_per_rad, split.validation, split.test, split.validation + split.test].map(Draw::Fixed);
    within(&[
        ("pose.x_share", &pose.x_share, -1.0, 1.0, "[-1, 1]"),
        ("pose.y_share", &pose.y_share, -1.0, 1.0, "[-1, 1]"),
        ("pose.x_m", &pose.x_m, -10.0, 10.0, "[-10, 10] m"),
        ("pose.y_m", &pose.y_m, -10.0, 10.0, "[-10, 10] m"),
        ("pose.rotation_deg", &pose.rotation_deg, -360.0, 360.0, "[-360, 360]"),
        ("pose.tilt_x_deg", &pose.tilt_x_deg, -60.0, 60.0, "[-60, 60]"),
        ("pose.tilt_y_deg", &pose.tilt_y_deg, -60.0, 60.0, "[-60, 60]"),
        ("press.force_n", &press.force_n, 0.01, 1000.0, "[0.01, 1000] N"),
        ("press.hold_s", &press.hold_s, 0.0, 3600.0, "[0, 3600] s"),
        ("press.tilt_stiffness_nm_per_rad", &tilt, 1.0, 1e9, "[1, 1e9] N m/rad"),
    ])?;
    if let Some(stiffness) = &press.stiffness_pa_per_m {
        stiffness.within("press.stiffness_pa_per_m", 1e5, 1e12, "[1e5, 1e12] Pa/m")?;
    }
    let before = &c.skin.presses_before;
    within(&[
        ("object.count", &c.object.count, 1.0, 10.0, "[1, 10]"),
        ("skin.presses_before", before, 0.0, 1000.0, "[0, 1000]"),
    ])?;
    if let Some(seed) = &c.skin.seed {
        seed.within("skin.seed", 0.0, 2.0_f64.powi(53), "[0, 2^53]")?;
    }
    within(&[
        ("faults.count", &c.faults.count, 0.0, taxels as f64, "[0, taxels]"),
        ("split.validation", &validation, 0.0, 1.0, "[0, 1]"),
        ("split.test", &test, 0.0, 1.0, "[0, 1]"),
        ("split.validation + split.test", &both, 0.0, 1.0, "[0, 1]"),
    ])?;
    let m = c.record.measurements;
    let is_valid = (1..=1_000_000).contains(&m);
    in_range("record.measurements", m as f64, is_valid, "[1, 10^6]")?;
    let (field, values) = if c.record.phi {
        ("record.measurements × taxels", m.saturating_mul(taxels))
    } else {
        ("values of a row", m.max(taxels))
    };
    in_range(field, values as f64, values <= MOST_VALUES, "[1, 2^22]")?;
    // truths and images that are kept: one for all windows of an object at rest that follow each other
    let at_rest = timing.interval_s.is_none() && !moving;
    let states = if at_rest { 1 } else { timing.windows };
    let of_press = (states * taxels as u64).max(timing.windows * m as u64);
    let field = "record.windows × taxels or measurements";
    in_range(field, of_press as f64, of_press <= MOST_PRESS_VALUES, "[1, 2^24]")?;
    check_ball(c)
}

/// Checks that a ball falls where drops are recorded, and nowhere else.
fn check_ball(c: &SpecConfig) -> Result<(), Refusal> {
    let drops = c.record.what == RecordKind::Drop;
    if drops != (c.object.from == ObjectSource::Ball) {
        let problem = "`record.what` = \"drop\" and `object.from` = \"ball\" go together";
        return Err(Refusal::new(problem));
    }
    if let Some(drop) = &c.drop {
        if !drops {
            return Err(Refusal::new("`[drop]` is for `record.what` = \"drop\" only"));
        }
        let stiffness = &drop.stiffness_pa_per_m;
        within(&[
            ("drop.height_m", &drop.height_m, 1e-3, 5.0, "[0.001, 5] m"),
            ("drop.mass_kg", &drop.mass_kg, 1e-3, 50.0, "[0.001, 50] kg"),
            ("drop.radius_m", &drop.radius_m, 5e-3, 0.2, "[0.005, 0.2] m"),
            ("drop.stiffness_pa_per_m", stiffness, 1e5, 1e12, "[1e5, 1e12] Pa/m"),
        ])?;
    }
    if !drops {
        return Ok(());
    }
    if c.press != PressConfig::default() {
        return Err(Refusal::new("`[press]` is not for drops; `[drop]` is"));
    }
    for (field, draw) in
        [("rotation_deg", &c.pose.rotation_deg), ("tilt_x_deg", &c.pose.tilt_x_deg), ("tilt_y_deg", &c.pose.tilt_y_deg)]
    {
        if *draw != Draw::Fixed(0.0) {
            let problem = format!("`pose.{field}` is not for drops: a ball has no side");
            return Err(Refusal::new(problem));
        }
    }
    Ok(())
}

/// Checks what is followed in time: one object or ball, within the means of the simulated arm.
pub(super) fn check_moving(c: &SpecConfig) -> Result<(), Refusal> {
    let count = c.object.count.range();
    if count.iter().any(|count| whole(*count) != 1) {
        return Err(Refusal::new(format!(
            "`object.count` = {}; valid: 1 where a press is followed in time (a course, a drop, or a contact model other than \
             \"footprint\")",
            count[1]
        )));
    }
    if c.record.what == RecordKind::Drop {
        return Ok(());
    }
    let (press, arm) = (&c.press, "[0.5, 100] N where a press is followed in time");
    within(&[
        ("press.force_n", &press.force_n, 0.5, 100.0, arm),
        ("press.rise_s", &press.rise_s, 0.1, 10.0, "[0.1, 10] s"),
        ("press.fall_s", &press.fall_s, 0.05, 10.0, "[0.05, 10] s"),
    ])?;
    if c.record.what == RecordKind::Course {
        let ([hold_s, _], [_, rise_s]) = (press.hold_s.range(), press.rise_s.range());
        let shortest_s = ArmConfig::shortest_hold_s(rise_s);
        if hold_s <= shortest_s {
            return Err(Refusal::new(format!(
                "`press.hold_s` = {hold_s}; valid: above {shortest_s:.3} s with `press.rise_s` = {rise_s}, so that the \
                 force comes to rest before the lift"
            )));
        }
    }
    Ok(())
}

pub(super) fn check_faults(config: &SpecConfig) -> Result<(), Refusal> {
    let names = config.faults.names.iter().flatten();
    for name in names {
        if !FAULTS.iter().any(|(known, _)| known == name) {
            let known: Vec<&str> = FAULTS.iter().map(|(known, _)| *known).collect();
            let (name, known) = (name.escape_debug(), known.join(", "));
            let problem = format!("`faults.names` = \"{name}\" is not a fault; known: {known}");
            return Err(Refusal::new(problem));
        }
    }
    if config.faults.names.as_ref().is_some_and(Vec::is_empty) {
        return Err(Refusal::new("`faults.names` = []: at least one name is needed"));
    }
    Ok(())
}

/// Checks that what is followed in time is neither too long nor too large to be kept.
pub(super) fn check_frames(c: &SpecConfig, skin: &SkinLayout, timing: &Timing) -> Result<(), Refusal> {
    let [press_s, drop_s] = FRAMES_S;
    let [_, hold_s] = c.press.hold_s.range();
    let [_, fall_m] = c.drop.clone().unwrap_or_default().height_m.range();
    let (lasts_s, frames_s) = match timing.what {
        RecordKind::Hold => (hold_s + timing.span_s(), press_s),
        RecordKind::Course => (hold_s.max(timing.span_s()) + timing.before_s, press_s),
        RecordKind::Drop => ((2.0 * fall_m / GRAVITY_M_PER_S2).sqrt() + timing.span_s(), drop_s),
    };
    let field = "length of what is followed in time";
    in_range(field, lasts_s, lasts_s <= LONGEST_S - BESIDE_S, "[0, 59.5] s")?;
    let values = (lasts_s + BESIDE_S) / frames_s * skin.taxels() as f64;
    let is_valid = values <= MOST_FRAME_VALUES;
    in_range("frames × taxels", values.ceil(), is_valid, "[1, 2^27]")?;
    Ok(())
}

/// Checks that the windows lie within frames whose hold lasts `hold_s` and which go on for `frames_s` after the touch.
pub(super) fn check_lasts(timing: &Timing, [hold_s, frames_s]: [f64; 2]) -> Result<(), Refusal> {
    let (span_s, most_s, of) = match timing.what {
        RecordKind::Hold => (timing.span_s(), hold_s, "the hold of the frames lasts"),
        _ => (timing.span_s() - timing.before_s, frames_s, "the frames go on after the touch for"),
    };
    if span_s <= most_s * (1.0 + 1e-9) {
        return Ok(());
    }
    let windows = timing.windows;
    Err(Refusal::new(format!("`record.windows` = {windows} take {span_s:.4} s, and {of} {most_s:.4} s")))
}
