//! What a spec is refused for before anything is built.

use super::config::SpecConfig;
use super::error::SpecError;
use spts_circuit::FAULTS;
use spts_models::{SkinLayout, in_range, within};

/// Most values of a list column in one row, so that a row takes a few megabytes at most.
const MOST_VALUES: usize = 1 << 22;

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

pub(super) fn check_draws(c: &SpecConfig, skin: &SkinLayout) -> Result<(), SpecError> {
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
