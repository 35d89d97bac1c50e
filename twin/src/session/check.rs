//! Conditions that hold in every session that is written or read.

use super::{Recorded, Session};
use spts_circuit::Mode;
use spts_models::SkinLayout;

/// A field outside its range.
#[derive(Debug)]
pub(super) struct Invalid {
    pub(super) field: String,
    pub(super) value: String,
    pub(super) range: String,
}

/// What names of sessions are, as a user is told.
pub(crate) const NAMES: &str = "the names of files: not empty, `.` or `..`, without `/`, `\\` and control characters";

/// Whether `name` is the name of a file and nothing else, on any system.
pub(crate) fn is_plain(name: &str) -> bool {
    let foreign = |c: char| c == '/' || c == '\\' || c.is_control();
    !name.is_empty() && name != "." && name != ".." && !name.contains(foreign)
}

fn invalid<T>(field: String, value: String, range: String) -> Result<T, Invalid> {
    Err(Invalid { field, value, range })
}

/// The first thing that is wrong with `session`.
pub(super) fn check(session: &Session) -> Result<(), Invalid> {
    check_header(session)?;
    for (mode, recorded) in [
        (Mode::Raster, &session.raster),
        (Mode::Compressive, &session.compressive),
    ] {
        if let Some(recorded) = recorded {
            check_recorded(mode, recorded, recorded.recording.blocks().len())?;
        }
    }
    if let (Some(raster), Some(compressive)) = (session.raster(), session.compressive()) {
        let (found, needed) = (compressive.layout(), raster.layout());
        if found != needed {
            let range = format!("{{{}}}, the layout of `raster`", shown(needed));
            return invalid("compressive.info.layout".to_owned(), shown(found), range);
        }
    }
    Ok(())
}

/// The first thing that is wrong with what `session` says beside its recordings.
pub(super) fn check_header(session: &Session) -> Result<(), Invalid> {
    if !is_plain(&session.name) {
        return invalid("name".to_owned(), format!("{:?}", session.name), NAMES.to_owned());
    }
    if let Some([start_s, end_s]) = session.hold_s {
        let sound = start_s.is_finite() && end_s.is_finite() && 0.0 <= start_s && start_s < end_s;
        if !sound {
            let range = "0 ≤ start < end, both finite".to_owned();
            return invalid("hold_s".to_owned(), format!("[{start_s}, {end_s}]"), range);
        }
    }
    Ok(())
}

/// The first thing that is wrong with the recording in `mode`, which has `blocks` blocks in all.
pub(super) fn check_recorded(mode: Mode, recorded: &Recorded, blocks: usize) -> Result<(), Invalid> {
    let name = mode.name();
    let modes = match mode {
        Mode::Raster => "{\"raster\"}",
        Mode::Compressive => "{\"binary\", \"analog\"}",
    };
    let recording = &recorded.recording;
    if recording.mode() != mode {
        let found = format!("{:?}", recording.weights().mode()).to_lowercase();
        let field = format!("{name}.info.weights.mode");
        return invalid(field, format!("{found:?}"), modes.to_owned());
    }
    let (found, taxels) = (recording.measurements_per_frame(), recording.taxels());
    if mode == Mode::Raster && found != taxels {
        let field = format!("{name}.info.measurements_per_frame");
        return invalid(
            field,
            found.to_string(),
            format!("{{{taxels}}}, the taxels of the skin"),
        );
    }
    if recorded.conditioning > blocks {
        let field = format!("{name}.conditioning");
        let range = format!("[0, {blocks}], the blocks of the recording");
        return invalid(field, recorded.conditioning.to_string(), range);
    }
    Ok(())
}

fn shown(layout: &SkinLayout) -> String {
    format!(
        "{} × {} taxels, pitch {} m, electrode {} m",
        layout.rows(),
        layout.cols(),
        layout.pitch_m(),
        layout.electrode_m()
    )
}
