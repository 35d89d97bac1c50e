//! Raster presses on many simulated skins for training, because the real skin is unknown before it is pressed.

use crate::labels::Labels;
use crate::protocol::PUBLISHED_HOLD_S;
use crate::session::ScoredSession;
use crate::skin_run::footprint_scene;
use rand::RngExt as _;
use rayon::prelude::*;
use spts::Session;
use spts::chain::{Acquisition, DEFAULT_READOUT};
use spts::record::Twin;
use spts::scene::{PressConfig, Scene};
use spts::session::{Event, Recorded};
use spts_circuit::{Block, Mode, Recording};
use spts_contact::objects::{OBJECTS, ObjectSpec};
use spts_input::Refusal;
use spts_models::{Mounting, SkinLayout, Streams, VelostatConfig, in_range};
use std::path::Path;

/// How simulated skins and presses vary.
///
/// ```
/// use spts_eval::training::Skins;
/// use spts_models::SkinLayout;
///
/// let median = Skins::median(SkinLayout::default());
/// assert_eq!((median.spread_log_sd, median.readout), (0.0, "ideal"));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Skins {
    /// Layout of every skin. The objects keep their distance in metres from its middle.
    pub layout: SkinLayout,
    /// Number of skins. Every object is pressed once on each; [1, 10000].
    pub skins: usize,
    /// Standard deviation, from taxel to taxel, of the natural logarithm of a taxel's gain that is the same in all
    /// sessions of a skin; [0, 2].
    pub spread_log_sd: f64,
    /// What the mounting of a skin changes anew for each session.
    pub mounting: Mounting,
    /// Standard deviation of an object's position along each axis, m; [0, 0.01].
    pub position_sd_m: f64,
    /// Standard deviation of an object's rotation about each axis, degrees; [0, 5].
    pub rotation_sd_deg: f64,
    /// Readout profile of the raster scans.
    pub readout: &'static str,
}

impl Default for Skins {
    /// 32 sheets as different as the transducer's defaults say, pressed with the arm's repeatability. A wider scatter
    /// of places, force or foam makes worse templates: the objects' places are calibrated.
    fn default() -> Self {
        let (sheet, press) = (VelostatConfig::default(), PressConfig::default());
        Self {
            layout: SkinLayout::default(),
            skins: 32,
            spread_log_sd: sheet.spread_log_sd,
            mounting: sheet.mounting(),
            position_sd_m: press.position_sd_m,
            rotation_sd_deg: press.rotation_sd_deg,
            readout: DEFAULT_READOUT,
        }
    }
}

impl Skins {
    /// Presses on the same number of median skins, which differ only by the arm's repeatability. They are scanned
    /// without readout faults, because y = Φx refers to the true images.
    pub fn median(layout: SkinLayout) -> Self {
        Self { layout, spread_log_sd: 0.0, mounting: Mounting::default(), readout: "ideal", ..Self::default() }
    }
}

impl Skins {
    /// Presses every object once on every skin. The sessions are in order of label; block k of each raster session is
    /// from skin k, and there are no compressive recordings. The result depends only on `seed`. `done` is called after
    /// every press.
    ///
    /// # Errors
    /// [`Refusal`] for a parameter outside its range, or if the simulation fails.
    pub fn press(&self, seed: u64, done: &(dyn Fn() + Sync)) -> Result<Vec<ScoredSession>, Refusal> {
        self.check()?;
        let labels = Labels::default();
        let sessions = OBJECTS.par_iter().map(|object| {
            let refused = |e: Refusal| e.at(object.name);
            let blocks = (0..self.skins).into_par_iter();
            let blocks = blocks.map(|skin| self.press_one(object, seed, skin, done));
            let blocks = blocks.collect::<Result<Vec<_>, Refusal>>();
            let raster = joined(blocks.map_err(refused)?).map_err(refused)?;
            let session = Session {
                hold_s: Some(PUBLISHED_HOLD_S),
                raster: Some(Recorded::new(raster)),
                ..Session::new(object.name, Event::Press)
            };
            Ok(ScoredSession::new(session, labels.number(object.name).unwrap_or_default()))
        });
        sessions.collect()
    }

    fn check(&self) -> Result<(), Refusal> {
        let few = (1..=10_000).contains(&self.skins);
        in_range("skins", self.skins as f64, few, "[1, 10000]").map(drop)
    }

    fn press_one(
        &self,
        object: &ObjectSpec,
        seed: u64,
        skin: usize,
        done: &(dyn Fn() + Sync),
    ) -> Result<Recording, Refusal> {
        let label = u64::from(object.label);
        // the skin follows from the scene's seed, and is the same for all objects
        let seed = Streams::new(seed).rng("learn/skin", skin as u64).random::<u64>() >> 1;
        // presses are numbered by the object, so that each has a scatter of its own
        let mut config = footprint_scene(object.name, OBJECTS.len() + 1, seed);
        if let Some(press) = &mut config.press {
            press.position_sd_m = self.position_sd_m;
            press.rotation_sd_deg = self.rotation_sd_deg;
        }
        config.skin = self.layout;
        for (name, log_sd) in [
            ("spread_log_sd", self.spread_log_sd),
            ("session_log_sd", self.mounting.log_sd),
            ("session_tilt_log_sd", self.mounting.tilt_log_sd),
        ] {
            config.transducer_parameters.insert(name.to_owned(), log_sd.into());
        }
        config.readout = Some(self.readout.to_owned());
        let scene = Scene::new(config, Path::new(""))?;
        let index = usize::from(object.label);
        let twin = Twin::new(&scene)?;
        let presses = twin.presses(index..index + 1, done)?;
        Ok(twin.recorded(&presses, &Acquisition::presses(Mode::Raster, label))?.recording)
    }
}

/// One session of the blocks of all `recordings`.
fn joined(recordings: Vec<Recording>) -> Result<Recording, Refusal> {
    let blocks: Vec<Block> = recordings.iter().flat_map(|r| r.blocks().iter().cloned()).collect();
    let Some(first) = recordings.first() else {
        return Err(Refusal::range("blocks", 0, "[1, ∞)"));
    };
    first.with_blocks(blocks)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::PLATEAU;
    use spts_recon::metrics::pearson;

    /// Gains of one skin are the same for every object, up to the spread of a session: the logarithm of the ratio of
    /// two skins' images is correlated between objects that touch the same taxels. With σ = 0.30 fixed and 0.10 a
    /// session, ρ = .9; the edges of a contact, which move, take some of it.
    #[test]
    fn a_skin_is_the_same_for_all_objects() {
        let skins = Skins {
            skins: 2,
            spread_log_sd: 0.30,
            mounting: Mounting { log_sd: 0.10, tilt_log_sd: 0.0 },
            position_sd_m: 0.0,
            rotation_sd_deg: 0.0,
            ..Skins::default()
        };
        let sessions = skins.press(3, &|| ()).unwrap();
        assert_eq!(sessions.len(), OBJECTS.len());
        let plateaus = |name: &str| {
            let session = sessions.iter().find(|s| s.object == name).unwrap();
            [0, 1].map(|press| {
                let mut image = vec![0.0; 100];
                for frame in PLATEAU {
                    let volts = session.raster.as_ref().unwrap().volts(press, frame);
                    image.iter_mut().zip(volts).for_each(|(sum, v)| *sum += v);
                }
                image
            })
        };
        let (rec, eraser) = (plateaus("rec"), plateaus("eraser"));
        let strong = |image: &[f64], k: usize| image[k] > 0.3 * image.iter().copied().fold(0.0, f64::max);
        let all = || rec.iter().chain(&eraser);
        let both: Vec<usize> = (0..100).filter(|&k| all().all(|image| strong(image, k))).collect();
        assert!(both.len() > 10, "{both:?}");
        let ratios = |[a, b]: &[Vec<f64>; 2]| both.iter().map(|&k| (a[k] / b[k]).ln()).collect::<Vec<f64>>();
        let r = pearson(&ratios(&rec), &ratios(&eraser)).unwrap();
        assert!(r > 0.7, "{r}");
    }

    #[test]
    fn what_is_out_of_range_is_refused() {
        let few = Skins { skins: 1, ..Skins::default() };
        let far = Skins { position_sd_m: -1.0, ..few };
        for (bad, field) in [(Skins { skins: 0, ..few }, "skins"), (far, "position_sd_m")] {
            let said = bad.press(1, &|| ()).unwrap_err().to_string();
            assert!(said.contains(field), "{said}");
        }
    }
}
