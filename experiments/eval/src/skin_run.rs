//! Sessions of simulated skins: objects are pressed, scanned and summed.

use rayon::prelude::*;
use spts::Session;
use spts::chain::{Acquisition, MAX_TOML_BYTES};
use spts::data::SessionSet;
use spts::record::{PressFrames, Twin};
use spts::scene::{PressConfig, Scene, SceneConfig, Task};
use spts::session::Recorded;
use spts::simulate::Request;
use spts_circuit::{Interpolated, Mode};
use spts_input::Refusal;
use std::path::{Path, PathBuf};

/// The presses of one scene, on the skin that follows from its seed: the first are scanned, those after them summed.
/// Every press is simulated by itself, so that nothing of a scan is in what is scored.
#[derive(Debug, Clone, Copy)]
pub struct SkinRun<'a> {
    /// The scene, with a section `press`.
    pub scene: &'a Scene,
    /// Number among the runs on this skin: each has noise of its own.
    pub number: u64,
    /// Number of presses that are scanned.
    pub scanned: usize,
    /// Number of presses after them that are summed; 0 for no compressive recording.
    pub summed: usize,
    /// Presses that the sheet has had when the compressive recording begins: it changes with its first presses.
    pub conditioning: usize,
}

/// What a [`SkinRun`] gave.
#[derive(Debug, Clone)]
pub struct SkinRunPresses {
    /// Both recordings.
    pub session: Session,
    /// The presses, scanned ones first.
    pub presses: Vec<PressFrames>,
    /// Conductances over the time of the presses that are summed.
    pub courses: Vec<Interpolated>,
}

impl SkinRun<'_> {
    /// Simulates and records. `done` is called after each press.
    ///
    /// # Errors
    /// [`Refusal`] if the mechanics or the readout fail.
    pub fn record(&self, done: &(dyn Fn() + Sync)) -> Result<SkinRunPresses, Refusal> {
        let twin = Twin::new(self.scene)?;
        let (mut presses, mut courses) = (twin.presses(0..self.scanned, done)?, Vec::new());
        let scan = Acquisition::presses(Mode::Raster, 2 * self.number);
        let raster = Recorded {
            conditioning: self.conditioning.min(self.scanned.saturating_sub(1)),
            ..twin.recorded(&presses, &scan)?
        };
        let sums = Acquisition {
            conditioning_presses: self.conditioning,
            ..Acquisition::presses(Mode::Compressive, 2 * self.number + 1)
        };
        let compressive = if self.summed > 0 {
            let later = twin.presses(self.scanned..self.scanned + self.summed, done)?;
            let mut conductance = twin.conductance(&later, &sums)?;
            let compressive = twin.read_out(&later, &mut conductance, &sums)?;
            courses.extend(conductance);
            presses.extend(later);
            Some(compressive)
        } else {
            None
        };
        Ok(SkinRunPresses { session: twin.session(Some(raster), compressive), presses, courses })
    }
}

/// The sessions of a simulated skin as a set.
pub fn twin_set(sessions: Vec<Session>) -> SessionSet {
    SessionSet { root: PathBuf::from("the twin"), sessions, published: None, missing: Vec::new(), note: None }
}

/// `presses` presses of the object called `object`, at its place in the published recordings, on the skin that follows
/// from `seed`. Nothing is stepped (contact field `footprint`), so that a press takes milliseconds: its plateau is at
/// rest in any case.
pub fn footprint_scene(object: &str, presses: usize, seed: u64) -> SceneConfig {
    SceneConfig {
        seed,
        contact: [("model".to_owned(), "footprint".into())].into_iter().collect(),
        press: Some(PressConfig { object: Some(object.to_owned()), presses, ..PressConfig::default() }),
        ..SceneConfig::default()
    }
}

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

impl TwinSessions {
    /// Number of presses that are scanned (the last is the ground truth, the others are for training), and number of
    /// presses of the scene `name` that are scored (as in its file, if given there).
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
    pub fn steps(&self) -> usize {
        self.names().iter().flat_map(|name| self.presses(name)).sum()
    }

    /// Simulates and records all sessions. `done` is called after each press. The result depends only on the scenes and
    /// the seed.
    ///
    /// # Errors
    /// [`Refusal`] for a scene that is not valid, or if the simulation fails.
    pub fn simulate(&self, done: &(dyn Fn() + Sync)) -> Result<SessionSet, Refusal> {
        let scenes = self.names().into_iter().map(|name| Ok((self.scene(&name)?, name)));
        let scenes = scenes.collect::<Result<Vec<(Scene, String)>, Refusal>>()?;
        let sessions = scenes.par_iter().enumerate().map(|(number, (scene, name))| {
            let [scanned, summed] = self.presses(name);
            let run = SkinRun { scene, number: number as u64, scanned, summed, conditioning: scanned };
            let SkinRunPresses { mut session, courses, .. } = run.record(done).map_err(|e| refused(name, e))?;
            let facts = session.compressive.iter_mut().flat_map(|compressive| &mut compressive.presses);
            for (facts, course) in facts.zip(courses) {
                facts.course = Some(course);
            }
            Ok(session)
        });
        Ok(twin_set(sessions.collect::<Result<_, Refusal>>()?))
    }

    fn scene(&self, name: &str) -> Result<Scene, Refusal> {
        let presses: usize = self.presses(name).iter().sum();
        let mut request = Request { scene: name.to_owned(), assignments: Vec::new() };
        let drop = matches!(request.prepare().map_err(|e| refused(name, e))?.scene.task(), Task::Drop(_));
        if drop {
            let message = "a drop has no hold to score; valid: scenes with [press]";
            return Err(Refusal::new(message).at(format_args!("--twin {name}")));
        }
        for (key, value) in [("press.presses", presses as u64), ("seed", self.seed)] {
            let assignment = format!("{key}={value}").parse();
            request.assignments.push(assignment.map_err(|e| refused(name, e))?);
        }
        Ok(request.prepare().map_err(|e| refused(name, e))?.scene)
    }
}

/// Why the scene `name` gives no session.
fn refused(name: &str, error: Refusal) -> Refusal {
    error.at(format_args!("--twin {name}"))
}

/// Number of presses that a scene file says; `None` for a scene by name and for a file that does not say.
fn own_presses(name: &str) -> Option<usize> {
    let is_file = Path::new(name).extension().is_some_and(|e| e == "toml");
    // a file that cannot be read or is no scene is refused where it is prepared
    let text = is_file.then(|| spts_input::read_text(Path::new(name), MAX_TOML_BYTES).ok()).flatten()?;
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
            let twin = TwinSessions { scenes: vec![name.to_owned()], seed: 1, quick };
            assert_eq!(twin.presses(name), presses, "{name}");
            assert_eq!(twin.steps(), presses.iter().sum::<usize>());
        }
    }
}
