//! Good scenes survive a round trip, bad ones end in an error that says what is wrong.

use super::{Scene, SceneError};
use std::path::Path;

fn read(text: &str) -> Result<Scene, SceneError> {
    Scene::from_toml(text, Path::new("."))
}
