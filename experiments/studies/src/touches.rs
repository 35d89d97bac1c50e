//! Touches on a skin, sent through its circuit: common parts of the studies of sensing matrices and of readouts.
//!
//! A `TouchScene` defines objects and skin, and its `draw` presses the objects. A `TouchWire` measures the touches
//! through a readout profile with any weights, and a `TouchScore` compares an image with the touch.

use spts_circuit::{ConductanceSource, Constant, Mode, Profile, Readout, RecordingInfo, Weights};
use spts_dataset::{Maker, Spec};
use spts_input::Refusal;
use spts_models::{ConductanceMap, SkinLayout, Streams};
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::statistics::{Band, Sample};
use std::sync::Arc;

/// What simulated touches are made with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TouchObjects {
    /// Procedural shapes of all families, a different one for every touch.
    Shapes,
    /// The seventeen objects of the published recordings, in turn.
    Objects,
}

/// Where an object lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    /// Anywhere on the sheet, in any rotation.
    Anywhere,
    /// So far from the middle of the sheet at most along both axes, m, in any rotation.
    Within(f64),
    /// At its published place and rotation, at the same distance in metres from the middle of any sheet. Only for
    /// [`TouchObjects::Objects`].
    Published,
}

/// Distance that the middle of an object keeps from the edge of the sheet, m, where the sheet is large enough.
const MARGIN_M: f64 = 0.03;
/// Objects lie within this share of the sheet's width and height at least, from the middle to both sides.
const LEAST_SHARE: f64 = 0.3;

/// Objects and skin of simulated touches: single objects at random places, rotations and forces (5 to 40 N), held
/// still. All touches are on one specimen of the skin.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TouchScene {
    /// Rows, columns, pitch and electrode.
    pub layout: SkinLayout,
    /// Kind of the objects.
    pub objects: TouchObjects,
    /// Families of procedural shapes; empty for all.
    pub families: &'static [&'static str],
    /// Smallest and largest extent of a procedural shape, m; `None` for the default 20 to 90 mm.
    pub size_m: Option<[f64; 2]>,
    /// Place, m from the middle, rotation, degrees, and force, N, of every touch; `None` for random ones.
    pub pose: Option<[f64; 4]>,
    /// Where objects without a `pose` lie.
    pub place: Place,
    /// Objects that are pressed at once.
    pub contacts: usize,
    /// Number of touches.
    pub touches: usize,
    /// Seed of all random numbers: touches, and the specimen of the skin.
    pub seed: u64,
    /// Specimen of the skin, if it is to differ from that of `seed`.
    pub specimen: Option<u64>,
}

/// One simulated touch: the conductances that it gives, and the touched taxels.
#[derive(Debug, Clone, PartialEq)]
pub struct Touch {
    /// Name of the object, or of the shape's family.
    pub name: Arc<str>,
    /// Conductance of every taxel, S; 0 for an untouched taxel.
    pub conductance_s: ConductanceMap,
    /// Taxels above 23 % of the largest conductance.
    pub support: Vec<bool>,
    /// Centre of mass of the support, (row, column), taxels; `None` for an empty support.
    pub centre_px: Option<[f64; 2]>,
}

impl Touch {
    /// The touch called `name` of a skin of this layout that conducts `conductance_s` above the idle skin.
    pub(crate) fn new(name: Arc<str>, conductance_s: ConductanceMap, layout: &SkinLayout) -> Self {
        let mut mask = Vec::new();
        support(conductance_s.values(), SUPPORT_THRESHOLD, &mut mask);
        let centre_px = centre_of_mass(conductance_s.values(), layout.cols(), SUPPORT_THRESHOLD);
        Self { name, conductance_s, support: mask, centre_px }
    }
}

impl TouchScene {
    /// A scene with `touches` touches of `objects` on a skin.
    pub(crate) fn new(layout: SkinLayout, objects: TouchObjects, touches: usize, seed: u64) -> Self {
        let (families, size_m, pose, specimen) = (&[][..], None, None, None);
        Self { layout, objects, families, size_m, pose, place: Place::Anywhere, contacts: 1, touches, seed, specimen }
    }

    /// Presses all touches. The result depends only on the scene.
    ///
    /// # Errors
    /// [`Refusal`] if the skin or a size is out of range, or a touch cannot be pressed.
    pub(crate) fn draw(&self) -> Result<Vec<Touch>, Refusal> {
        if self.touches == 0 {
            return Ok(Vec::new());
        }
        let spec = Spec::from_toml(&self.spec(), &toml::Table::new(), ".".as_ref())?;
        let mut maker = Maker::new(&spec);
        (0..self.touches as u64)
            .map(|index| {
                let row = maker.row(index)?;
                Ok(Touch::new(row.name(), row.conductance().clone(), &self.layout))
            })
            .collect()
    }

    /// The data set whose rows are the touches.
    fn spec(&self) -> String {
        let layout = &self.layout;
        let [width_m, height_m] = layout.extent_m();
        let share = |side_m: f64| match self.place {
            Place::Within(reach_m) => reach_m / side_m,
            Place::Anywhere | Place::Published => (0.5 - MARGIN_M / side_m).max(LEAST_SHARE),
        };
        let (x, y) = (share(width_m), share(height_m));
        let (from, about) = match self.objects {
            TouchObjects::Shapes => ("shapes", "middle"),
            TouchObjects::Objects => ("objects", if self.place == Place::Published { "placement" } else { "middle" }),
        };
        let mut size =
            self.size_m.map_or_else(String::new, |[least, most]| format!("size_m = [{least:e}, {most:e}]\n"));
        if !self.families.is_empty() {
            size.push_str(&format!("names = {:?}\n", self.families));
        }
        let pose = match self.pose {
            Some([x_m, y_m, rotation_deg, _]) => {
                format!("x_m = {x_m:e}\ny_m = {y_m:e}\nrotation_deg = {rotation_deg:e}\n")
            }
            None if self.place == Place::Published => String::new(),
            None => format!(
                "x_share = {{ uniform = [{:e}, {x:e}] }}\ny_share = {{ uniform = [{:e}, {y:e}] }}\n\
                 rotation_deg = {{ uniform = [-180.0, 180.0] }}\n",
                -x, -y
            ),
        };
        let force = match self.pose {
            Some([.., force_n]) => format!("{force_n:e}"),
            None => "{ log_uniform = [5.0, 40.0] }".to_owned(),
        };
        let contacts = self.contacts;
        let (touches, seed, specimen) = (self.touches, self.seed >> 1, self.specimen.unwrap_or(self.seed) % (1 << 53));
        format!(
            "rows = {touches}\nseed = {seed}\nreadout = \"ideal\"\n\
             [object]\nfrom = \"{from}\"\nrows_per_shape = 1\ncount = {contacts}\n{size}\
             [pose]\nabout = \"{about}\"\n{pose}\
             tilt_x_deg = {{ normal = [0.0, 0.3] }}\ntilt_y_deg = {{ normal = [0.0, 0.3] }}\n\
             [press]\nforce_n = {force}\nhold_s = {{ uniform = [0.3, 1.0] }}\n\
             [skin]\nrows = {}\ncols = {}\npitch_m = {:e}\nelectrode_m = {:e}\nrows_per_skin = {touches}\nseed = {specimen}\n\
             [record]\nmeasurements = 1\nraster = false\nlabels = []\n",
            layout.rows(),
            layout.cols(),
            layout.pitch_m(),
            layout.electrode_m(),
        )
    }
}

/// Measurements of the untouched skin, whose mean is taken off.
const IDLE_MEASUREMENTS: usize = 1000;
/// Block of the untouched skin; touches have numbers far below.
const IDLE_BLOCK: u64 = 1 << 40;

/// The wires of a skin: a readout with its device's parts, and the noise of one session.
pub(crate) struct TouchWire {
    readout: Readout,
    /// Output of every untouched wire, V.
    idle_v: Vec<f64>,
}

impl TouchWire {
    /// A readout with `profile` and `weights`, which replace those of the profile. `device` provides its random
    /// numbers.
    ///
    /// # Errors
    /// [`Refusal`] if the readout cannot be built.
    pub(crate) fn new(
        profile: &Profile,
        weights: &Weights,
        layout: &SkinLayout,
        device: Streams,
    ) -> Result<Self, Refusal> {
        let profile = profile.with_weights(weights)?;
        let mut readout = Readout::new(&profile, Mode::Compressive, layout, device, 0)?;
        let mut untouched = Constant::new(ConductanceMap::zeros(layout.rows(), layout.cols()))?;
        readout.seek_row(IDLE_BLOCK, 0);
        let wires = weights.wire_count();
        let idle = readout.measure(&mut untouched, IDLE_MEASUREMENTS * wires)?;
        let mean = |wire: usize| idle.iter().skip(wire).step_by(wires).sum::<f64>() / IDLE_MEASUREMENTS as f64;
        Ok(Self { readout, idle_v: (0..wires).map(mean).collect() })
    }

    /// A wire with the given readout. Nothing is subtracted from its samples.
    pub(crate) fn of(readout: Readout) -> Self {
        Self { readout, idle_v: vec![0.0] }
    }

    /// Output of every untouched wire, which [`TouchWire::measure`] subtracts, V.
    pub(crate) fn idle_v(&self) -> &[f64] {
        &self.idle_v
    }

    /// What is known of its samples.
    pub(crate) fn info(&self) -> &RecordingInfo {
        self.readout.info()
    }

    /// Unmodified samples of a skin with this conductance at the first rows, V. `number` determines the noise.
    ///
    /// # Errors
    /// [`Refusal`] if the skin has another size.
    pub(crate) fn volts(
        &mut self,
        conductance_s: ConductanceMap,
        number: u64,
        measurements: usize,
    ) -> Result<Vec<f64>, Refusal> {
        self.volts_of(&mut Constant::new(conductance_s)?, [number, 0], measurements)
    }

    /// The same of a skin whose conductance changes, from the row `at[1]` of the block `at[0]` on.
    ///
    /// # Errors
    /// As [`TouchWire::volts`].
    pub(crate) fn volts_of(
        &mut self,
        source: &mut dyn ConductanceSource,
        at: [u64; 2],
        measurements: usize,
    ) -> Result<Vec<f64>, Refusal> {
        self.readout.seek_row(at[0], at[1]);
        self.readout.measure(source, measurements)
    }

    /// The same samples, minus the mean of the untouched skin, V.
    ///
    /// # Errors
    /// As [`TouchWire::volts`].
    pub(crate) fn measure(
        &mut self,
        conductance_s: ConductanceMap,
        number: u64,
        measurements: usize,
    ) -> Result<Vec<f64>, Refusal> {
        let mut volts = self.volts(conductance_s, number, measurements)?;
        volts.iter_mut().zip(self.idle_v.iter().cycle()).for_each(|(v, idle_v)| *v -= idle_v);
        Ok(volts)
    }
}

/// How well a decoded image shows a simulated touch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TouchScore {
    /// Intersection over union of the supports.
    pub iou: f64,
    /// Distance of the centres, taxels; `None` if the image or the touch is empty.
    pub place_px: Option<f64>,
}

impl TouchScore {
    /// The scores of `image`, one value a taxel, in any unit.
    ///
    /// # Panics
    /// If image and touch have different numbers of taxels.
    pub(crate) fn of(image: &[f64], touch: &Touch, layout: &SkinLayout) -> Self {
        assert_eq!(image.len(), touch.support.len(), "taxels");
        let mut found = Vec::new();
        support(image, SUPPORT_THRESHOLD, &mut found);
        let centre = centre_of_mass(image, layout.cols(), SUPPORT_THRESHOLD);
        Self {
            iou: SupportScore::new(&found, &touch.support).iou,
            place_px: centre.zip(touch.centre_px).map(|(a, b)| distance(a, b)),
        }
    }
}

/// Probability outside of a [`band`].
const OUTSIDE: f64 = 0.1;

/// Mean of independent repetitions, each with its own skin, noise and touches, and its 90 % confidence interval. The
/// band of a single one has no width. `None` without repetitions.
///
/// ```
/// use spts_studies::touches::band;
///
/// let found = band(&[0.7, 0.8, 0.9]).expect("three repetitions");
/// assert!((found.mean - 0.8).abs() < 1e-12 && found.low < 0.7 && found.high > 0.9);
/// assert!(band(&[]).is_none());
/// ```
pub fn band(repetitions: &[f64]) -> Option<Band> {
    Sample::of(repetitions).map(|sample| sample.band(OUTSIDE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn touches_are_on_the_skin_and_follow_from_the_seed() {
        for (rows, cols, pitch_m) in [(10, 10, 0.015), (24, 16, 0.005)] {
            let layout = SkinLayout::new(rows, cols, pitch_m, SkinLayout::usual_electrode_m(pitch_m)).unwrap();
            for objects in [TouchObjects::Shapes, TouchObjects::Objects] {
                let scene = TouchScene::new(layout, objects, 12, 7);
                let touches = scene.draw().unwrap();
                assert!(touches.iter().all(|t| t.centre_px.is_some() && t.support.iter().any(|on| *on)));
                assert_eq!(touches, scene.draw().unwrap());
                // more touches begin with the same ones
                let more = TouchScene { touches: 15, ..scene };
                assert_eq!(touches[..], more.draw().unwrap()[..12]);
            }
        }
    }

    #[test]
    fn another_specimen_has_other_gains_under_the_same_touches() {
        let scene = TouchScene::new(SkinLayout::default(), TouchObjects::Shapes, 2, 3);
        let other = TouchScene { specimen: Some(4), ..scene.clone() };
        let (a, b) = (scene.draw().unwrap(), other.draw().unwrap());
        assert_ne!(a[0].conductance_s, b[0].conductance_s);
        let pressed = |t: &Touch| t.conductance_s.values().iter().map(|g| *g > 0.0).collect::<Vec<_>>();
        assert_eq!(pressed(&a[0]), pressed(&b[0]));
    }
}
