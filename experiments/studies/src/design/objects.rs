//! The objects for which a skin is designed.

use crate::touches::{Place, Touch, TouchObjects, TouchScene};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts_dataset::{ObjectSource, PoseOrigin, Spec};
use spts_input::Refusal;
use spts_models::SkinLayout;
use spts_recon::classify::{EvidenceClassifier, Library, Posterior, TemplateModel};
use spts_recon::{AmplitudeRange, Matrix};
use std::path::Path;
use std::sync::Arc;

/// Largest extents of small and of large shapes, least and most, m.
const SIZES_M: [(&str, [f64; 2]); 2] = [("small", [0.02, 0.04]), ("large", [0.04, 0.09])];
/// Those of procedural shapes when a spec does not say.
const USUAL_SIZES_M: [f64; 2] = [0.02, 0.09];
/// Those of the seventeen objects, about.
const OBJECT_SIZES_M: [f64; 2] = [0.03, 0.1];

/// The objects for which a skin is designed: one or several at once, pressed with 5 to 40 N and held still.
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
    /// Number of them that are pressed at once; they do not overlap. 1 to 10.
    #[serde(default = "one")]
    pub contacts: usize,
}

/// Default of [`DesignObjects::contacts`].
fn one() -> usize {
    1
}

impl DesignObjects {
    /// `small` (shapes of 20 to 40 mm), `large` (40 to 90 mm), or the sections `[object]` and `[pose]` of a data set's
    /// specification, given by its name, its file, or the folder of a data set.
    ///
    /// From a specification, the source of the objects, the sizes of shapes and whether objects keep their published
    /// places are used. Its skin, forces, readout and numbers are not.
    ///
    /// # Errors
    /// [`Refusal`] for a specification that cannot be read, or has meshes or balls.
    pub fn named(name: &str) -> Result<Self, Refusal> {
        let shapes = |size_m| Self { name: name.to_owned(), seventeen: false, placed: false, size_m, contacts: 1 };
        if let Some((_, size_m)) = SIZES_M.iter().find(|(known, _)| *known == name) {
            return Ok(shapes(*size_m));
        }
        let refused = |reason: String| {
            Refusal::new(format!(
                "`objects` = {name:?}: {reason}; valid: small, large, the name of a data set's spec (presses-17, random-shapes, …), a spec file that ends in .toml, or the folder of a data set"
            ))
        };
        let path = Path::new(name);
        let file = if path.is_dir() { path.join("spec.toml").to_string_lossy().into_owned() } else { name.to_owned() };
        let spec = Spec::load(&file, &toml::Table::new()).map_err(|e| refused(e.to_string()))?;
        let (object, pose) = (&spec.config().object, &spec.config().pose);
        if spec.drops() {
            return Err(refused("a design is for presses".to_owned()));
        }
        let contacts = spec.most_objects();
        match object.from {
            ObjectSource::Shapes => Ok(Self { contacts, ..shapes(object.size_m.unwrap_or(USUAL_SIZES_M)) }),
            ObjectSource::Objects => Ok(Self {
                name: name.to_owned(),
                seventeen: true,
                placed: pose.about == PoseOrigin::Placement && pose.rotation_deg.is_fixed(),
                size_m: OBJECT_SIZES_M,
                contacts,
            }),
            _ => Err(refused("meshes and balls cannot be drawn for a design".to_owned())),
        }
    }

    /// So many of them at once; `None` leaves their number.
    #[must_use]
    pub fn at_once(self, contacts: Option<usize>) -> Self {
        Self { contacts: contacts.unwrap_or(self.contacts), ..self }
    }

    /// `touches` of them on a skin of their own.
    pub(super) fn scene(&self, layout: &SkinLayout, touches: usize, seed: u64) -> TouchScene {
        let objects = if self.seventeen { TouchObjects::Objects } else { TouchObjects::Shapes };
        TouchScene {
            size_m: (!self.seventeen).then_some(self.size_m),
            place: if self.placed { Place::Published } else { Place::Anywhere },
            contacts: self.contacts,
            ..TouchScene::new(*layout, objects, touches, seed)
        }
    }

    /// Taxels that those pressed at once may cover, with a margin for the edges: that many are solved for.
    pub(super) fn places(&self, layout: &SkinLayout) -> usize {
        let side = 1.1 * self.size_m[1] / layout.pitch_m() + 2.0;
        #[expect(clippy::cast_possible_truncation, reason = "float to integer casts saturate")]
        let most = (self.contacts as f64 * side * side).ceil() as usize;
        most.clamp(LEAST_PLACES, MOST_PLACES).min(layout.taxels())
    }
}

/// Fewest and most taxels that are solved for: fewer cost nothing worth saving, and time grows with their cube.
const LEAST_PLACES: usize = 100;
const MOST_PLACES: usize = 350;

/// Amplitudes that count as possible, V at the strongest taxel: all that the range of an amplifier holds.
const AMPLITUDES_V: [f64; 2] = [0.01, 20.0];
/// Prior probability of an object that is in no class; not used, because every touch is of one.
const UNKNOWN_PRIOR: f64 = 0.01;
/// Relative standard deviation of the gains of a specimen that was never seen.
const GAIN_SD: f64 = 0.3;
/// Eigenvectors of a class for such gains.
const RANK: usize = 20;

/// Gaussian classes of the objects at their places, learned from touches of other specimens.
pub(super) struct Classes {
    classifier: EvidenceClassifier,
    names: Vec<Arc<str>>,
}

impl Classes {
    /// Classes from mean images of `touches` on a skin of `cols` columns.
    pub(super) fn new(touches: &[&Touch], cols: usize) -> Result<Self, Refusal> {
        let mut names: Vec<Arc<str>> = touches.iter().map(|t| Arc::clone(&t.name)).collect();
        names.sort_unstable();
        names.dedup();
        let mean_of = |name: &Arc<str>| {
            let own: Vec<&&Touch> = touches.iter().filter(|t| t.name == *name).collect();
            let mut mean = vec![0.0; own[0].conductance_s.values().len()];
            for touch in &own {
                let values = touch.conductance_s.values();
                let largest = values.iter().fold(f64::MIN_POSITIVE, |most, v| most.max(*v));
                mean.iter_mut().zip(values).for_each(|(m, v)| *m += v / largest / own.len() as f64);
            }
            mean
        };
        let means: Vec<Vec<f64>> = names.iter().map(mean_of).collect();
        let taxels = means.first().map_or(0, Vec::len);
        let labels: Vec<usize> = (0..names.len()).collect();
        let templates = Library::new(&Matrix::from_column_slices(taxels, &means), &labels)?;
        let model = TemplateModel { gains: vec![GAIN_SD; taxels], rank: RANK, ..TemplateModel::new(cols) };
        let amplitude = AmplitudeRange::new(AMPLITUDES_V[0], AMPLITUDES_V[1])?;
        let classifier = EvidenceClassifier::new(&model.classes(&templates)?, amplitude, UNKNOWN_PRIOR)?;
        Ok(Self { classifier, names })
    }

    /// The sums of `rows` (one value a taxel, row after row) over everything that the classes hold.
    pub(super) fn rows(&self, rows: &[f64]) -> Vec<Vec<f64>> {
        let bank = self.classifier.bank();
        let project = |row: &[f64]| {
            let mut out = vec![0.0; bank.ncols()];
            bank.accumulate_row(row, &mut out);
            out
        };
        rows.par_chunks_exact(bank.nrows()).map(project).collect()
    }

    /// Whether the most probable class of the samples `volts` is the object called `name`.
    pub(super) fn is_right(&self, rows: &[Vec<f64>], volts: &[f64], name: &str) -> Result<bool, Refusal> {
        let mut preparation = self.classifier.preparation();
        let mut evidence = self.classifier.evidence();
        for (row, v) in rows.iter().zip(volts) {
            preparation.push(row)?;
            evidence.observe(&preparation, *v)?;
        }
        let decision = self.classifier.decide(&preparation, &evidence, &mut Posterior::default());
        Ok(decision.label.is_some_and(|label| &*self.names[label] == name))
    }
}

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
        for refused in ["drops", "nothing", "missing.toml"] {
            let error = DesignObjects::named(refused).unwrap_err().to_string();
            assert!(error.contains("`objects`") && error.contains("valid: small, large"), "{error}");
        }
    }
}
