//! Checks a specification before anything is built.

use super::config::{DropConfig, ObjectSource, PressConfig, RecordKind, SpecConfig};
use super::draw::Draw;
use super::error::SpecError;
use super::timing::{Timing, most_states};
use spts_circuit::FAULTS;
use spts_models::{SkinLayout, in_range, within};
use spts_sim::mechanics::{GRAVITY_M_PER_S2, PressConfig as ArmConfig};

/// Most values of a list column in one row, so that a row takes a few megabytes at most.
const MOST_VALUES: usize = 1 << 22;
/// Most values of a list column in all rows of a press, which are kept together: a few hundred megabytes.
const MOST_PRESS_VALUES: u64 = 1 << 24;

pub(super) fn check_name(name: &str) -> Result<(), SpecError> {
    let ok = |c: char| c.is_ascii_alphanumeric() || "-_".contains(c);
    if !name.is_empty() && name.len() <= 100 && name.chars().all(ok) {
        return Ok(());
    }
    Err(SpecError::Choice(format!(
        "`name` = \"{}\"; valid: 1 to 100 letters, digits, `-` and `_`",
        name.escape_debug()
    )))
}

pub(super) fn check_draws(c: &SpecConfig, skin: &SkinLayout, timing: &Timing, moving: bool) -> Result<(), SpecError> {
    let share = "[-1, 1]";
    c.pose.x_share.within("pose.x_share", -1.0, 1.0, share)?;
    c.pose.y_share.within("pose.y_share", -1.0, 1.0, share)?;
    c.pose.x_m.within("pose.x_m", -10.0, 10.0, "[-10, 10] m")?;
    c.pose.y_m.within("pose.y_m", -10.0, 10.0, "[-10, 10] m")?;
    c.pose
        .rotation_deg
        .within("pose.rotation_deg", -360.0, 360.0, "[-360, 360]")?;
    c.pose.tilt_x_deg.within("pose.tilt_x_deg", -60.0, 60.0, "[-60, 60]")?;
    c.pose.tilt_y_deg.within("pose.tilt_y_deg", -60.0, 60.0, "[-60, 60]")?;
    c.press
        .force_n
        .within("press.force_n", 0.01, 1000.0, "[0.01, 1000] N")?;
    c.press.hold_s.within("press.hold_s", 0.0, 3600.0, "[0, 3600] s")?;
    let k = c.press.tilt_stiffness_nm_per_rad;
    within("press.tilt_stiffness_nm_per_rad", k, 1.0, 1e9, "[1, 1e9] N m/rad")?;
    if let Some(stiffness) = &c.press.stiffness_pa_per_m {
        stiffness.within("press.stiffness_pa_per_m", 1e5, 1e12, "[1e5, 1e12] Pa/m")?;
    }
    c.object.count.within("object.count", 1.0, 3.0, "[1, 3]")?;
    c.skin
        .presses_before
        .within("skin.presses_before", 0.0, 1000.0, "[0, 1000]")?;
    if let Some(seed) = &c.skin.seed {
        seed.within("skin.seed", 0.0, 2.0_f64.powi(53), "[0, 2^53]")?;
    }
    let taxels = skin.taxels();
    c.faults
        .count
        .within("faults.count", 0.0, taxels as f64, "[0, taxels]")?;
    let split = &c.split;
    within("split.validation", split.validation, 0.0, 1.0, "[0, 1]")?;
    within("split.test", split.test, 0.0, 1.0, "[0, 1]")?;
    within(
        "split.validation + split.test",
        split.validation + split.test,
        0.0,
        1.0,
        "[0, 1]",
    )?;
    let m = c.record.measurements;
    in_range(
        "record.measurements",
        m as f64,
        (1..=1_000_000).contains(&m),
        "[1, 10^6]",
    )?;
    let values = if c.record.phi {
        m.saturating_mul(taxels)
    } else {
        m.max(taxels)
    };
    let field = if c.record.phi {
        "record.measurements × taxels"
    } else {
        "values of a row"
    };
    in_range(field, values as f64, values <= MOST_VALUES, "[1, 2^22]")?;
    let of_press = (most_states(timing, moving) * taxels as u64).max(timing.windows * m as u64);
    let field = "record.windows × taxels or measurements";
    in_range(field, of_press as f64, of_press <= MOST_PRESS_VALUES, "[1, 2^24]")?;
    check_ball(c)
}

/// Checks that a ball falls where drops are recorded, and nowhere else.
fn check_ball(c: &SpecConfig) -> Result<(), SpecError> {
    let drops = c.record.what == RecordKind::Drop;
    if drops != (c.object.from == ObjectSource::Ball) {
        return Err(SpecError::Choice(
            "`record.what` = \"drop\" and `object.from` = \"ball\" go together".to_owned(),
        ));
    }
    if let Some(drop) = &c.drop {
        if !drops {
            return Err(SpecError::Choice(
                "`[drop]` is for `record.what` = \"drop\" only".to_owned(),
            ));
        }
        let DropConfig {
            height_m,
            mass_kg,
            radius_m,
            stiffness_pa_per_m,
        } = drop;
        height_m.within("drop.height_m", 1e-3, 5.0, "[0.001, 5] m")?;
        mass_kg.within("drop.mass_kg", 1e-3, 50.0, "[0.001, 50] kg")?;
        radius_m.within("drop.radius_m", 5e-3, 0.2, "[0.005, 0.2] m")?;
        stiffness_pa_per_m.within("drop.stiffness_pa_per_m", 1e5, 1e12, "[1e5, 1e12] Pa/m")?;
    }
    if !drops {
        return Ok(());
    }
    if c.press != PressConfig::default() {
        return Err(SpecError::Choice("`[press]` is not for drops; `[drop]` is".to_owned()));
    }
    for (field, draw) in [
        ("pose.rotation_deg", &c.pose.rotation_deg),
        ("pose.tilt_x_deg", &c.pose.tilt_x_deg),
        ("pose.tilt_y_deg", &c.pose.tilt_y_deg),
    ] {
        if *draw != Draw::Fixed(0.0) {
            return Err(SpecError::Choice(format!(
                "`{field}` is not for drops: a ball has no side"
            )));
        }
    }
    Ok(())
}

/// Checks what is followed in time: one object or ball, within the means of the simulated arm.
pub(super) fn check_moving(c: &SpecConfig) -> Result<(), SpecError> {
    let count = c.object.count.range();
    if count.iter().any(|count| super::whole(*count) != 1) {
        return Err(SpecError::Choice(format!(
            "`object.count` = {}; valid: 1 where a press is followed in time (a course, a drop, or a contact model other than \
             \"footprint\")",
            count[1]
        )));
    }
    if c.record.what == RecordKind::Drop {
        return Ok(());
    }
    let press = &c.press;
    press.force_n.within(
        "press.force_n",
        0.5,
        100.0,
        "[0.5, 100] N where a press is followed in time",
    )?;
    press.rise_s.within("press.rise_s", 0.1, 10.0, "[0.1, 10] s")?;
    press.fall_s.within("press.fall_s", 0.05, 10.0, "[0.05, 10] s")?;
    if c.record.what == RecordKind::Course {
        let ([hold_s, _], [_, rise_s]) = (press.hold_s.range(), press.rise_s.range());
        let shortest_s = ArmConfig::shortest_hold_s(rise_s);
        if hold_s <= shortest_s {
            return Err(SpecError::Choice(format!(
                "`press.hold_s` = {hold_s}; valid: above {shortest_s:.3} s with `press.rise_s` = {rise_s}, so that the \
                 force comes to rest before the lift"
            )));
        }
    }
    Ok(())
}

pub(super) fn check_faults(config: &SpecConfig) -> Result<(), SpecError> {
    for name in config.faults.names.iter().flatten() {
        if !FAULTS.iter().any(|(known, _)| known == name) {
            let known: Vec<&str> = FAULTS.iter().map(|(known, _)| *known).collect();
            return Err(SpecError::Choice(format!(
                "`faults.names` = \"{}\" is not a fault; known: {}",
                name.escape_debug(),
                known.join(", ")
            )));
        }
    }
    if config.faults.names.as_ref().is_some_and(Vec::is_empty) {
        return Err(SpecError::Choice(
            "`faults.names` = []: at least one name is needed".to_owned(),
        ));
    }
    Ok(())
}

/// Longest press or drop that is followed in time, s: what a scene may last.
const LONGEST_S: f64 = 60.0;
/// Time between the frames of a press, and of a drop near the skin, s.
const FRAMES_S: [f64; 2] = [2e-3, 1e-4];
/// Most values of a press's frames: 1 GiB of each kind.
const MOST_FRAME_VALUES: f64 = (1_u64 << 27) as f64;
/// Time that a scene may take beside what is recorded, s: the approach of the arm, and what follows the last window.
const BESIDE_S: f64 = 0.5;

/// Checks that what is followed in time is neither too long nor too large to be kept.
pub(super) fn check_frames(c: &SpecConfig, skin: &SkinLayout, timing: &Timing) -> Result<(), SpecError> {
    let [press_s, drop_s] = FRAMES_S;
    let ([_, hold_s], [_, fall_m]) = (
        c.press.hold_s.range(),
        c.drop.clone().unwrap_or_default().height_m.range(),
    );
    let (lasts_s, frames_s) = match timing.what {
        RecordKind::Hold => (hold_s + timing.span_s(), press_s),
        RecordKind::Course => (hold_s.max(timing.span_s()) + timing.before_s, press_s),
        RecordKind::Drop => ((2.0 * fall_m / GRAVITY_M_PER_S2).sqrt() + timing.span_s(), drop_s),
    };
    let field = "length of what is followed in time";
    in_range(field, lasts_s, lasts_s <= LONGEST_S - BESIDE_S, "[0, 59.5] s")?;
    let values = (lasts_s + BESIDE_S) / frames_s * skin.taxels() as f64;
    in_range(
        "frames × taxels",
        values.ceil(),
        values <= MOST_FRAME_VALUES,
        "[1, 2^27]",
    )?;
    Ok(())
}
