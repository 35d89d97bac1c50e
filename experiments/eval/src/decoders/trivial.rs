//! Baselines that ignore the measurements.

use crate::algorithm::{Algorithm, Answer, Class, DecodeError, Trained};
use crate::training::{LearnError, TrainingData};
use crate::windows::Window;

/// One image for every window.
#[derive(Debug, Clone)]
struct Constant {
    image: Vec<f64>,
}

pub(super) fn empty(data: &TrainingData) -> Result<Box<dyn Trained>, LearnError> {
    let image = vec![0.0; data.images.nrows()];
    Ok(Box::new(Constant { image }))
}

/// Mean of the library, in which all objects have as many images.
pub(super) fn mean_image(data: &TrainingData) -> Result<Box<dyn Trained>, LearnError> {
    let images = data.library.images();
    let image = (0..images.nrows()).map(|r| images.row(r).iter().sum()).collect();
    Ok(Box::new(Constant { image }))
}

impl Trained for Constant {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(self.clone())
    }
}

impl Algorithm for Constant {
    fn decode(&mut self, _: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        answer.image.clone_from(&self.image);
        answer.class = Some(Class::Unknown);
        Ok(())
    }
}
