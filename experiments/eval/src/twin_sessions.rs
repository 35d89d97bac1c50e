//! Sessions of the twin, for scoring without recordings.

use rayon::prelude::*;
use spts::Session;
use spts::chain::{Acquisition, MAX_TOML_BYTES};
use spts::data::SessionSet;
use spts::record::{Twin, TwinError};
use spts::scene::{AssignError, Scene, Task};
use spts::session::Recorded;
use spts::simulate::{Request, SimulateError};
use spts_circuit::Mode;
use std::path::{Path, PathBuf};

/// Objects of the default set: those that the real skin was recorded with in both modes.
const OBJECTS: [&str; 5] = ["brain", "center", "eraser", "rec", "trig"];

/// Which sessions the twin simulates for `spts score --twin`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TwinSessions {
    /// Scenes as in `spts simulate`: `press/NAME`, or files that end in .toml. Empty for the default set.
    pub scenes: Vec<String>,
    /// Seed of all random numbers.
    pub seed: u64,
    /// Whether to simulate fewer presses.
    pub quick: bool,
}

/// Why the twin produced no sessions.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TwinSessionsError {
    /// A scene that is not valid.
    #[error("--twin {scene}: {source}")]
    Scene {
        /// The scene as requested.
        scene: String,
        /// Cause.
        source: Box<SimulateError>,
    },
    /// A drop, for which no images are scored.
    #[error("--twin {scene}: a drop has no hold to score; valid: scenes with [press]")]
    Drop {
        /// The scene as requested.
        scene: String,
    },
    /// The simulation failed.
    #[error("--twin {scene}: {source}")]
    Twin {
        /// The scene as requested.
        scene: String,
        /// Cause.
        source: Box<TwinError>,
    },
}

impl TwinSessions {
    /// Number of presses that are scanned (the last is the ground truth, the others are for training), and number of
    /// presses of the scene `name` that are scored (as in its file, if given there).
    #[must_use]
    pub fn presses(&self, name: &str) -> [usize; 2] {
        let [scanned, scored] = if self.quick { [4, 2] } else { [8, 6] };
        [scanned, own_presses(name).unwrap_or(scored)]
    }

    /// The scenes as they are asked for.
    fn names(&self) -> Vec<String> {
        if self.scenes.is_empty() {
            OBJECTS.map(|object| format!("press/{object}")).to_vec()
        } else {
            self.scenes.clone()
        }
    }

    /// Number of presses; [`TwinSessions::simulate`] reports after each.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.names().iter().flat_map(|name| self.presses(name)).sum()
    }

    /// Simulates and records all sessions. `done` is called after each press. Every press is simulated separately, so
    /// training data contain nothing that is scored. The result depends only on the scenes and the seed.
    ///
    /// # Errors
    /// [`TwinSessionsError`] for a scene that is not valid, or if the simulation fails.
    pub fn simulate(&self, done: &(dyn Fn() + Sync)) -> Result<SessionSet, TwinSessionsError> {
        let scenes = self.names().into_iter().map(|name| Ok((self.scene(&name)?, name)));
        let scenes = scenes.collect::<Result<Vec<(Scene, String)>, TwinSessionsError>>()?;
        let sessions = scenes.par_iter().enumerate().map(|(number, (scene, name))| {
            let session = self.session(scene, self.presses(name), number as u64, done);
            session.map_err(|source| TwinSessionsError::Twin {
                scene: name.clone(),
                source: Box::new(source),
            })
        });
        Ok(SessionSet {
            root: PathBuf::from("the twin"),
            sessions: sessions.collect::<Result<_, _>>()?,
            published: None,
            missing: Vec::new(),
        })
    }

    fn scene(&self, name: &str) -> Result<Scene, TwinSessionsError> {
        let failed = |source| TwinSessionsError::Scene {
            scene: name.to_owned(),
            source: Box::new(source),
        };
        let presses: usize = self.presses(name).iter().sum();
        let mut request = Request {
            scene: name.to_owned(),
            assignments: Vec::new(),
        };
        let drop = matches!(request.prepare().map_err(failed)?.scene.task(), Task::Drop(_));
        if drop {
            return Err(TwinSessionsError::Drop { scene: name.to_owned() });
        }
        for (key, value) in [("press.presses", presses as u64), ("seed", self.seed)] {
            let assignment = format!("{key}={value}").parse();
            request
                .assignments
                .push(assignment.map_err(|e: AssignError| failed(e.into()))?);
        }
        Ok(request.prepare().map_err(failed)?.scene)
    }

    fn session(
        &self,
        scene: &Scene,
        [scanned, scored]: [usize; 2],
        number: u64,
        done: &(dyn Fn() + Sync),
    ) -> Result<Session, TwinError> {
        let twin = Twin::new(scene)?;
        // sessions are numbered, so that every one has noise of its own
        let scan = Acquisition::presses(Mode::Raster, 2 * number);
        let raster = twin.recorded(&twin.presses(0..scanned, done)?, &scan)?;
        let sums = Acquisition {
            conditioning_presses: scanned,
            ..Acquisition::presses(Mode::Compressive, 2 * number + 1)
        };
        let compressive = twin.recorded(&twin.presses(scanned..scanned + scored, done)?, &sums)?;
        let raster = Recorded {
            conditioning: scanned - 1,
            ..raster
        };
        Ok(twin.session(Some(raster), Some(compressive)))
    }
}

/// Number of presses that a scene file says; `None` for a scene by name and for a file that does not say.
fn own_presses(name: &str) -> Option<usize> {
    let is_file = Path::new(name).extension().is_some_and(|e| e == "toml");
    // a file that cannot be read or is no scene is refused where it is prepared
    let text = is_file
        .then(|| spts_input::read_text(Path::new(name), MAX_TOML_BYTES).ok())
        .flatten()?;
    let table: toml::Table = toml::from_str(&text).ok()?;
    let presses = table.get("press")?.get("presses")?.as_integer()?;
    usize::try_from(presses).ok().filter(|presses| *presses > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_file_keeps_its_own_number_of_presses() {
        let dir = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = dir.path().join(name);
            std::fs::write(&path, text).unwrap();
            path.to_str().unwrap().to_owned()
        };
        let three = file("three.toml", "[press]\nobject = \"T\"\npresses = 3\n");
        let silent = file("silent.toml", "[press]\nobject = \"T\"\n");
        for (quick, name, presses) in [
            (false, three.as_str(), [8, 3]),
            (true, &three, [4, 3]),
            (false, &silent, [8, 6]),
            (true, "press/T", [4, 2]),
        ] {
            let twin = TwinSessions {
                scenes: vec![name.to_owned()],
                seed: 1,
                quick,
            };
            assert_eq!(twin.presses(name), presses, "{name}");
            assert_eq!(twin.steps(), presses.iter().sum::<usize>());
        }
    }
}
