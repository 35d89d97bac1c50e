//! Recordings that are scored or learned from: of the real skin or of the twin.

use crate::real::{COLS, SHIFT_REACH, read, scorable};
use crate::score::{Protocol, Session};
use spts::data::{DataError, Published, load_twin, load_twin_bounces};
use spts_circuit::Recording;
use spts_recon::Matrix;
use spts_recon::dictionary::shifted;
use std::path::Path;

/// A directory of recordings.
#[derive(Debug, Clone)]
pub struct Source {
    /// Sessions in label order.
    pub sessions: Vec<Session>,
    /// Session of the bouncing ball.
    pub bounces: Option<Recording>,
    /// Dictionary and library published with them.
    pub published: Option<Published>,
    /// Whether the twin made them.
    pub simulated: bool,
    /// Columns of the sheet.
    pub cols: usize,
    /// Frames and presses of the compressive sessions that are scored.
    pub protocol: Protocol,
    /// Presses of the raster sessions that nothing is learned from.
    pub raster_protocol: Protocol,
}

impl Source {
    /// Reads `dir`: recordings in the published layout, or those of the twin that a report has saved.
    ///
    /// # Errors
    /// [`DataError`] when it holds neither, or a file in it cannot be used.
    pub fn open(dir: &Path) -> Result<Self, DataError> {
        match read(dir) {
            Ok(real) => Ok(Self {
                sessions: real.sessions,
                bounces: real.bounces,
                published: real.published,
                simulated: false,
                cols: COLS,
                protocol: Protocol::default(),
                raster_protocol: Protocol::default(),
            }),
            Err(nothing @ DataError::NothingFound { .. }) => match Self::twin(dir) {
                Err(DataError::NoTwin { .. }) => Err(nothing),
                twin => twin,
            },
            Err(error) => Err(error),
        }
    }

    /// The twin's compressive presses begin with the sheet worked in, so the first one counts already.
    fn twin(dir: &Path) -> Result<Self, DataError> {
        let sessions = load_twin(dir)?;
        let protocol = Protocol {
            first_press: 0,
            ..Protocol::default()
        };
        for session in &sessions {
            let recordings = [
                ("raster", Some(&session.raster)),
                ("compressive", session.compressive.as_ref()),
            ];
            for (name, recording) in recordings {
                if let Some(recording) = recording {
                    scorable(dir, &session.object, name, recording, &protocol)?;
                }
            }
        }
        let taxels = sessions.first().map_or(COLS * COLS, |s| s.raster.taxels());
        let odd = |s: &&Session| s.raster.taxels() != taxels || taxels.isqrt().pow(2) != taxels;
        if let Some(session) = sessions.iter().find(odd) {
            return Err(DataError::Unscorable {
                path: dir.to_owned(),
                session: format!("{} raster", session.object),
                field: "taxels",
                value: session.raster.taxels().to_string(),
                needed: format!("a square number, {taxels} as of the first object"),
            });
        }
        Ok(Self {
            sessions,
            bounces: load_twin_bounces(dir)?,
            published: None,
            simulated: true,
            cols: taxels.isqrt(),
            protocol,
            raster_protocol: Protocol::default(),
        })
    }

    /// The dictionary at all places: as published, or `dictionary` moved about.
    #[must_use]
    pub fn shifted(&self, dictionary: &Matrix) -> Matrix {
        let published = self.published.as_ref().and_then(|p| p.shifted.clone());
        published.unwrap_or_else(|| shifted(dictionary, self.cols, SHIFT_REACH))
    }
}
