//! Everything a directory of recordings holds, ready to be scored.

use crate::score::{Arm, Learned, Protocol, Session, Truth};
use spts::data::{DataError, Published, RecordingsDir};
use spts_circuit::{Mode, Recording};
use spts_recon::dictionary::shifted;
use spts_sim::objects::OBJECTS;
use std::path::Path;

/// Reach of the shifted dictionary when none is published, taxels.
pub const SHIFT_REACH: usize = 2;

/// Recordings of a real skin.
#[derive(Debug, Clone)]
pub struct Real {
    /// Sessions of the objects that are there, in label order, with the published dictionary and library.
    pub arm: Arm,
    /// What was not found.
    pub missing: Vec<String>,
}

/// What a directory of recordings holds.
#[derive(Debug, Clone)]
pub struct Recorded {
    /// Sessions of the objects that are there, in label order.
    pub sessions: Vec<Session>,
    /// Session of the bouncing ball.
    pub bounces: Option<Recording>,
    /// Dictionary and library published with them.
    pub published: Option<Published>,
    /// What was not found.
    pub missing: Vec<String>,
}

/// Reads the sessions in the directory `root`, and dictionary and library if they are there.
///
/// # Errors
/// [`DataError`] when a file that is there cannot be used, or no object is there at all.
pub fn read(root: &Path) -> Result<Recorded, DataError> {
    let dir = RecordingsDir::open(root)?;
    let (mut sessions, mut missing) = (Vec::new(), Vec::new());
    for object in OBJECTS {
        let Some(raster) = dir.raster(object.name)? else {
            missing.push(format!("{}: raster session", object.name));
            continue;
        };
        let check = |session, recording| scorable(root, object.name, session, recording, &Protocol::default());
        check("raster", &raster)?;
        let compressive = dir.compressive(object.name)?;
        if let Some(recording) = &compressive {
            check("compressive", recording)?;
        }
        if compressive.is_none() {
            missing.push(format!("{}: compressive session", object.name));
        }
        sessions.push(Session {
            object: object.name.to_owned(),
            label: usize::from(object.label),
            raster,
            compressive,
        });
    }
    if sessions.is_empty() {
        return Err(DataError::NothingFound { path: root.to_owned() });
    }
    let bounces = dir.bounces()?;
    if bounces.is_none() {
        missing.push("bouncing ball: compressive session".to_owned());
    }
    Ok(Recorded {
        sessions,
        bounces,
        published: dir.published()?,
        missing,
    })
}

/// Reads the directory `root` with the published dictionary and library.
///
/// # Errors
/// As [`read`], and when the published dictionary or library is missing.
pub fn load(root: &Path) -> Result<Real, DataError> {
    let Recorded {
        sessions,
        bounces,
        published,
        mut missing,
    } = read(root)?;
    let published = published.ok_or_else(|| DataError::Missing {
        path: root.join("{dictionary,SRC_lib}.mat"),
        needed_by: "scoring with the published decoder (both files)".to_owned(),
    })?;
    let all_places = published.shifted.unwrap_or_else(|| {
        missing.push("permuted_dictionary.mat: shifted dictionary".to_owned());
        shifted(&published.dictionary, COLS, SHIFT_REACH)
    });
    Ok(Real {
        arm: Arm {
            sessions,
            bounces,
            learned: Learned::new(published.dictionary, all_places, published.library),
            cols: COLS,
            protocol: Protocol::default(),
            raster_protocol: Protocol::default(),
        },
        missing,
    })
}

/// Refuses a session that would score as nothing, or as perfect because nothing is in it.
pub(crate) fn scorable(
    root: &Path,
    object: &str,
    session: &str,
    recording: &Recording,
    protocol: &Protocol,
) -> Result<(), DataError> {
    let refuse = |field, value: String, needed: String| DataError::Unscorable {
        path: root.to_owned(),
        session: format!("{object} {session}"),
        field,
        value,
        needed,
    };
    let frames = protocol.first_frame + protocol.frames;
    if recording.frames() < frames {
        return Err(refuse(
            "frames",
            recording.frames().to_string(),
            format!("at least {frames}"),
        ));
    }
    let presses = recording.blocks().len();
    if presses <= protocol.first_press {
        return Err(refuse(
            "presses",
            presses.to_string(),
            format!("at least {}", protocol.first_press + 1),
        ));
    }
    let lost = protocol.presses_of(recording).find(|&press| {
        recording
            .volts(press, protocol.first_frame)
            .iter()
            .any(|v| !v.is_finite())
    });
    if let Some(press) = lost {
        let samples = format!("lost in frame {} of press {}", protocol.first_frame + 1, press + 1);
        return Err(refuse(
            "samples",
            samples,
            "finite samples in the scored frames".to_owned(),
        ));
    }
    if recording.mode() == Mode::Raster {
        let peak = Truth::new(recording, protocol)
            .image
            .iter()
            .copied()
            .fold(0.0, f64::max);
        if !(peak > 0.0 && peak.is_finite()) {
            return Err(refuse(
                "peak of the true image, V",
                peak.to_string(),
                "a contact above 0 V".to_owned(),
            ));
        }
    }
    Ok(())
}

/// Columns of the published skin.
pub const COLS: usize = 10;
