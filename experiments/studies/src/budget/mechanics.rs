//! The presses: simulated once for each object and contact model, whatever the readout.

use super::size::BudgetSize;
use rayon::prelude::*;
use spts::progress::Progress;
use spts::record::{TwinError, press_frames};
use spts::scene::{MechanicsError, SceneError};
use spts::scene::{PressConfig, Scene, SceneConfig};
use spts_contact::Frame;
use spts_contact::objects::ObjectSpec;
use spts_models::SkinLayout;
use spts_sim::fidelity::change_model;
use std::path::Path;

/// What is pressed, on which skin.
#[derive(Debug, Clone, Copy)]
pub(super) struct PressSetup<'a> {
    pub(super) objects: &'a [&'static ObjectSpec],
    pub(super) readout: &'a str,
    /// Taxels along one side of the skin.
    pub(super) side: usize,
    pub(super) seed: u64,
}

/// An object and the frames of all its presses.
#[derive(Debug, Clone)]
pub(super) struct Pressed {
    pub(super) object: &'static ObjectSpec,
    pub(super) scene: Scene,
    pub(super) presses: Vec<Vec<Frame>>,
}

impl PressSetup<'_> {
    /// Scene of an object: on the published skin at its own place, on a larger one as far from the middle. `layer` puts
    /// the elastic layer, solved at the frames, in place of the columns.
    pub(super) fn scene(&self, object: &ObjectSpec, size: &BudgetSize, layer: bool) -> Result<Scene, TwinError> {
        let published = SkinLayout::default();
        let skin = SkinLayout::new(self.side, self.side, published.pitch_m(), published.electrode_m())
            .map_err(|e| SceneError::from(MechanicsError::from(e)))?;
        let shift = 0.5 * (self.side as f64 - published.rows() as f64);
        let press = PressConfig {
            object: Some(object.name.to_owned()),
            row: Some(object.placement.row + shift),
            col: Some(object.placement.col + shift),
            presses: size.presses(),
            ..PressConfig::default()
        };
        let mut config = SceneConfig {
            seed: self.seed,
            readout: Some(self.readout.to_owned()),
            skin,
            press: Some(press),
            ..SceneConfig::default()
        };
        if layer {
            change_model(&mut config.contact, "layer");
            config.contact.insert("coupled".to_owned(), false.into());
        }
        Ok(Scene::new(config, Path::new(""))?)
    }

    /// Runs every press of every object and reports each to `progress`.
    pub(super) fn press(
        &self,
        size: &BudgetSize,
        layer: bool,
        progress: &dyn Progress,
    ) -> Result<Vec<Pressed>, TwinError> {
        let of_object = |&object: &&'static ObjectSpec| {
            let scene = self.scene(object, size, layer)?;
            let presses = (0..size.presses()).into_par_iter().map(|index| {
                let frames = press_frames(&scene, index)?.frames;
                progress.step();
                Ok(frames)
            });
            Ok(Pressed {
                object,
                presses: presses.collect::<Result<_, TwinError>>()?,
                scene,
            })
        };
        self.objects.par_iter().map(of_object).collect()
    }
}
