//! Scenes of objects pressed at their places in the published recordings.

use spts::scene::{PressConfig, SceneConfig};

/// `presses` presses of the object called `object` on the skin that follows from `seed`. Nothing is stepped (contact
/// field `footprint`), so that a press takes milliseconds.
pub(crate) fn footprint_scene(object: &str, presses: usize, seed: u64) -> SceneConfig {
    SceneConfig {
        seed,
        contact: [("model".to_owned(), "footprint".into())].into_iter().collect(),
        press: Some(PressConfig {
            object: Some(object.to_owned()),
            presses,
            ..PressConfig::default()
        }),
        ..SceneConfig::default()
    }
}
