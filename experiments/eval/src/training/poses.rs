//! Simulated presses of the objects in approximately known poses.

use super::shapes::{ShapesError, scaled};
use rayon::prelude::*;
use spts_contact::objects::{OBJECTS, ObjectSpec};
use spts_dataset::{Maker, Spec};
use spts_models::{SkinLayout, Streams};
use spts_recon::Matrix;

/// How accurately the pose of an object is known: its place to half a taxel and its rotation to 15°, as read by eye;
/// its tilt is unknown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseKnowledge {
    /// Step to which a place is known along each axis, m.
    pub place_step_m: f64,
    /// Standard deviation of the place about the step, m.
    pub place_sd_m: f64,
    /// Step to which a rotation is known, degrees.
    pub rotation_step_deg: f64,
    /// Standard deviation of the rotation about the step, degrees.
    pub rotation_sd_deg: f64,
    /// Standard deviation of the tilt about each axis of the skin, degrees.
    pub tilt_sd_deg: f64,
}

impl Default for PoseKnowledge {
    fn default() -> Self {
        Self {
            place_step_m: 7.5e-3,
            place_sd_m: 4e-3,
            rotation_step_deg: 15.0,
            rotation_sd_deg: 5.0,
            tilt_sd_deg: 0.7,
        }
    }
}

/// Presses of each object.
const PRESSES: u64 = 600;
/// Pitch and middle of the sheet on which the objects' places are written down.
const PITCH_M: f64 = 0.015;
const MIDDLE: f64 = 4.5;

/// Simulated images of one object in many places, rotations and tilts, to learn from.
#[derive(Debug, Clone)]
pub struct PosedObject {
    /// Name.
    pub name: &'static str,
    /// Taxels × presses, with equal gains of all taxels; each image is scaled to a maximum of 1.
    pub images: Matrix,
}

impl PoseKnowledge {
    /// Images of all objects on a skin of this `layout`, at the same distances in metres from the middle. The result
    /// depends only on the layout and `seed`. `done` is called after every object.
    ///
    /// # Errors
    /// [`ShapesError`] if the objects cannot be pressed there.
    pub fn press(
        &self,
        layout: &SkinLayout,
        seed: u64,
        done: &(dyn Fn() + Sync),
    ) -> Result<Vec<PosedObject>, ShapesError> {
        let objects = OBJECTS.par_iter().map(|object| {
            let streams = Streams::new(seed).rng("poses", u64::from(object.label));
            let images = self.press_one(object, layout, streams)?;
            done();
            Ok(PosedObject {
                name: object.name,
                images,
            })
        });
        objects.collect()
    }

    fn press_one(
        &self,
        object: &ObjectSpec,
        layout: &SkinLayout,
        mut rng: impl rand::Rng,
    ) -> Result<Matrix, ShapesError> {
        let placement = &object.placement;
        let to = |step: f64, value: f64| (value / step).round() * step;
        let x_m = to(self.place_step_m, (placement.col - MIDDLE) * PITCH_M);
        let y_m = to(self.place_step_m, (MIDDLE - placement.row) * PITCH_M);
        let rotation_deg = to(self.rotation_step_deg, placement.rotation_rad.to_degrees());
        let text = format!(
            "rows = {PRESSES}\nseed = {}\nreadout = \"ideal\"\n\
             [object]\nfrom = \"objects\"\nnames = [\"{}\"]\n\
             [pose]\nx_m = {{ normal = [{x_m:e}, {:e}] }}\ny_m = {{ normal = [{y_m:e}, {:e}] }}\n\
             rotation_deg = {{ normal = [{rotation_deg:e}, {:e}] }}\n\
             tilt_x_deg = {{ normal = [0.0, {tilt:e}] }}\ntilt_y_deg = {{ normal = [0.0, {tilt:e}] }}\n\
             [skin]\nrows = {}\ncols = {}\npitch_m = {:e}\nelectrode_m = {:e}\n\
             [transducer]\nspread_log_sd = 0.0\nsession_log_sd = 0.0\n\
             [record]\nmeasurements = 1\nraster = false\nlabels = []\n",
            rng.next_u64() >> 2,
            object.name,
            self.place_sd_m,
            self.place_sd_m,
            self.rotation_sd_deg,
            layout.rows(),
            layout.cols(),
            layout.pitch_m(),
            layout.electrode_m(),
            tilt = self.tilt_sd_deg,
        );
        let spec = Spec::from_toml(&text, &toml::Table::new(), ".".as_ref())?;
        let mut maker = Maker::new(&spec);
        let images = (0..PRESSES)
            .map(|row| Ok(scaled(maker.row(row)?.conductance().values())))
            .collect::<Result<Vec<_>, ShapesError>>()?;
        let columns: Vec<&[f64]> = images.iter().map(Vec::as_slice).collect();
        Ok(Matrix::from_column_slices(layout.taxels(), &columns))
    }
}
