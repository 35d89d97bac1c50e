//! `spts simulate --list`: what can be simulated.

use serde::Serialize;
use spts_contact::objects::pressable;
use std::fmt::Write as _;

/// Everything that `SCENE` may be.
#[derive(Debug, Serialize)]
pub(super) struct SceneList {
    scenes: &'static [NamedScene],
    objects: Vec<NamedObject>,
}

#[derive(Debug, Serialize)]
struct NamedScene {
    /// As it stands on the command line.
    scene: &'static str,
    about: &'static str,
}

#[derive(Debug, Serialize)]
struct NamedObject {
    name: &'static str,
    /// Number of its class; 0 for what has none.
    label: u8,
    about: &'static str,
}

const SCENES: &[NamedScene] = &[
    NamedScene {
        scene: "press/NAME",
        about: "A robot arm presses the object NAME, one of those below, on the skin",
    },
    NamedScene {
        scene: "press --mesh FILE",
        about: "The arm presses a mesh of your own: .obj, .glb or .stl",
    },
    NamedScene {
        scene: "bounce",
        about: "A tennis ball falls on the skin and bounces",
    },
    NamedScene {
        scene: "arm",
        about: "A finger touches a skin that is wrapped round a robot's arm",
    },
    NamedScene {
        scene: "FILE.toml",
        about: "A scene file. Every run writes one, scene.toml, to start from",
    },
];

impl SceneList {
    pub(super) fn new() -> Self {
        let objects = pressable().map(|object| NamedObject {
            name: object.name,
            label: object.label,
            about: object.description,
        });
        Self {
            scenes: SCENES,
            objects: objects.collect(),
        }
    }

    /// The list, a line each.
    pub(super) fn text(&self) -> String {
        let mut text = "Scenes:\n".to_owned();
        for NamedScene { scene, about } in self.scenes {
            let _ = writeln!(text, "  {scene:<18} {about}");
        }
        text += "\nObjects for press/NAME:\n";
        for NamedObject { name, about, .. } in &self.objects {
            let _ = writeln!(text, "  {name:<18} {about}");
        }
        text + "\nTry: spts simulate press/T"
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use spts::simulate::{NAMED_SCENES, Request};

    /// Every scene that ships is listed, and what is listed can be simulated.
    #[test]
    fn the_list_is_complete() {
        let list = SceneList::new();
        for (name, _) in NAMED_SCENES {
            assert!(list.scenes.iter().any(|scene| scene.scene == *name), "{name}");
        }
        let plain = list.scenes.iter().map(|scene| scene.scene.to_owned());
        let plain = plain.filter(|scene| !scene.contains(|c: char| c.is_uppercase()));
        let objects = list.objects.iter().map(|object| format!("press/{}", object.name));
        for scene in plain.chain(objects) {
            let request = Request {
                scene,
                ..Request::default()
            };
            request.prepare().unwrap();
        }
    }
}
