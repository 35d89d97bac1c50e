//! Everything a directory of recordings holds, ready to be scored.

use crate::data::{DataError, RecordingsDir};
use crate::score::{Arm, Learned, Protocol, Session};
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

/// Reads the directory `root`.
///
/// # Errors
/// [`DataError`] when a file that is there cannot be used, no object is there at all, or the published dictionary or
/// library is missing.
pub fn load(root: &Path) -> Result<Real, DataError> {
    let dir = RecordingsDir::open(root)?;
    let (mut sessions, mut missing) = (Vec::new(), Vec::new());
    for object in OBJECTS {
        let Some(raster) = dir.raster(object.name)? else {
            missing.push(format!("{}: raster session", object.name));
            continue;
        };
        let compressive = dir.compressive(object.name)?;
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
    let published = dir.published()?.ok_or_else(|| DataError::Io {
        path: root.join("dictionary.mat and SRC_lib.mat"),
        source: std::io::ErrorKind::NotFound.into(),
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

/// Columns of the published skin.
const COLS: usize = 10;
