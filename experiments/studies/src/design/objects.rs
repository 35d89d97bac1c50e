//! The objects for which a skin is designed.

use crate::touches::{TouchObjects, TouchScene};
use serde::{Deserialize, Serialize};
use spts_dataset::{ObjectSource, PoseOrigin, Spec};
use spts_input::Refusal;
use spts_models::SkinLayout;
use std::path::Path;

/// Largest extents of small and of large shapes, least and most, m.
const SIZES_M: [(&str, [f64; 2]); 2] = [("small", [0.02, 0.04]), ("large", [0.04, 0.09])];
/// Those of procedural shapes when a spec does not say.
const USUAL_SIZES_M: [f64; 2] = [0.02, 0.09];
/// Those of the seventeen objects, about.
const OBJECT_SIZES_M: [f64; 2] = [0.03, 0.1];

/// The objects for which a skin is designed: single objects, pressed with 5 to 40 N and held still.
///
/// ```
/// use spts_studies::design::DesignObjects;
///
/// assert_eq!(DesignObjects::named("small")?.size_m, [20e-3, 40e-3]);
/// let error = DesignObjects::named("huge").unwrap_err();
/// assert!(error.to_string().starts_with("`objects` = \"huge\""));
/// # Ok::<(), spts_input::Refusal>(())
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DesignObjects {
    /// Requested name.
    pub name: String,
    /// Whether they are the seventeen objects of the published recordings. If not, they are procedural shapes.
    pub seventeen: bool,
    /// Whether they keep their published places and rotations.
    pub placed: bool,
    /// Smallest and largest extent over the skin, m.
    pub size_m: [f64; 2],
}

impl DesignObjects {
    /// `small` (shapes of 20 to 40 mm), `large` (40 to 90 mm), or the sections `[object]` and `[pose]` of a data set's
    /// specification, given by its name, its file, or the folder of a data set.
    ///
    /// From a specification, the source of the objects, the sizes of shapes and whether objects keep their published
    /// places are used. Its skin, forces, readout and numbers are not.
    ///
    /// # Errors
    /// [`Refusal`] for a specification that cannot be read, or has meshes, balls or several simultaneous
    /// objects.
    pub fn named(name: &str) -> Result<Self, Refusal> {
        let shapes = |size_m| Self {
            name: name.to_owned(),
            seventeen: false,
            placed: false,
            size_m,
        };
        if let Some((_, size_m)) = SIZES_M.iter().find(|(known, _)| *known == name) {
            return Ok(shapes(*size_m));
        }
        let refused = |reason: String| {
            Refusal::new(format!(
                "`objects` = {name:?}: {reason}; valid: small, large, the name of a data set's spec (presses-17, random-shapes, …), a spec file that ends in .toml, or the folder of a data set"
            ))
        };
        let path = Path::new(name);
        let file = if path.is_dir() {
            path.join("spec.toml").to_string_lossy().into_owned()
        } else {
            name.to_owned()
        };
        let spec = Spec::load(&file, &toml::Table::new()).map_err(|e| refused(e.to_string()))?;
        let (object, pose) = (&spec.config().object, &spec.config().pose);
        if spec.drops() || spec.most_objects() > 1 {
            return Err(refused("a design is for presses of one object at a time".to_owned()));
        }
        match object.from {
            ObjectSource::Shapes => Ok(shapes(object.size_m.unwrap_or(USUAL_SIZES_M))),
            ObjectSource::Objects => Ok(Self {
                name: name.to_owned(),
                seventeen: true,
                placed: pose.about == PoseOrigin::Placement && pose.rotation_deg.is_fixed(),
                size_m: OBJECT_SIZES_M,
            }),
            _ => Err(refused("meshes and balls cannot be drawn for a design".to_owned())),
        }
    }

    /// `touches` of them on a skin of their own.
    pub(super) fn scene(&self, layout: &SkinLayout, touches: usize, seed: u64) -> TouchScene {
        let objects = if self.seventeen {
            TouchObjects::Objects
        } else {
            TouchObjects::Shapes
        };
        TouchScene {
            size_m: (!self.seventeen).then_some(self.size_m),
            placed: self.placed,
            ..TouchScene::new(*layout, objects, touches, seed)
        }
    }

    /// Taxels that one of them may cover, with a margin for the edges: that many are solved for.
    pub(super) fn places(&self, layout: &SkinLayout) -> usize {
        let side = 1.1 * self.size_m[1] / layout.pitch_m() + 2.0;
        #[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
        let most = (side * side).ceil() as usize;
        most.clamp(LEAST_PLACES, MOST_PLACES).min(layout.taxels())
    }
}

/// Fewest and most taxels that are solved for: fewer cost nothing worth saving, and time grows with their cube.
const LEAST_PLACES: usize = 100;
const MOST_PLACES: usize = 350;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_specs_are_understood() {
        let named = |name: &str| DesignObjects::named(name).unwrap();
        assert_eq!(named("small").size_m.map(f64::to_bits), [0.02, 0.04].map(f64::to_bits));
        assert!(named("presses-17").seventeen && !named("presses-17").placed);
        assert!(!named("random-shapes").seventeen);
        let dir = tempfile::tempdir().unwrap();
        let write = |text: &str| {
            std::fs::write(dir.path().join("spec.toml"), text).unwrap();
            DesignObjects::named(dir.path().to_str().unwrap())
        };
        let placed = write("rows = 10\n[object]\nfrom = \"objects\"\n[pose]\nabout = \"placement\"").unwrap();
        assert!(placed.seventeen && placed.placed);
        let sized = write("rows = 10\n[object]\nfrom = \"shapes\"\nsize_m = [0.01, 0.03]").unwrap();
        assert_eq!(sized.size_m.map(f64::to_bits), [0.01, 0.03].map(f64::to_bits));
        for refused in ["large-skin", "drops", "nothing", "missing.toml"] {
            let error = DesignObjects::named(refused).unwrap_err().to_string();
            assert!(
                error.contains("`objects`") && error.contains("valid: small, large"),
                "{error}"
            );
        }
    }
}
