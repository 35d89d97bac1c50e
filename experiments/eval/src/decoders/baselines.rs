//! Baselines: images that ignore the measurements, and the mean image whose predicted measurements correlate best.

use crate::algorithm::{Algorithm, Answer, Class, DecodeError, Trained};
use crate::training::{Dictionary, TrainingData};
use crate::windows::Window;
use spts_input::Refusal;

/// One image for every window.
#[derive(Debug, Clone)]
struct Constant {
    image: Vec<f64>,
}

pub(super) fn empty(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    let image = vec![0.0; data.images.nrows()];
    Ok(Box::new(Constant { image }))
}

/// Mean of the library, in which all objects have as many images.
pub(super) fn mean_image(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    data.check_learned()?;
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

    fn takes_bits(&self) -> bool {
        true
    }
}

/// Takes the class c with the largest yᵀ Φ t_c / ‖Φ t_c‖, and its mean image t_c for the contact.
struct Correlate {
    templates: Dictionary,
    labels: Vec<usize>,
}

pub(super) fn correlate(data: &TrainingData) -> Result<Box<dyn Trained>, Refusal> {
    data.check_learned()?;
    Ok(Box::new(Correlate {
        templates: Dictionary::new(data.templates.images().clone()),
        labels: data.templates.labels().to_vec(),
    }))
}

impl Trained for Correlate {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(AtWork { correlate: self, seen: Vec::new(), sums: vec![[0.0; 2]; self.labels.len()] })
    }
}

struct AtWork<'a> {
    correlate: &'a Correlate,
    seen: Vec<f64>,
    /// yᵀ Φ t and ‖Φ t‖² of every template.
    sums: Vec<[f64; 2]>,
}

impl Algorithm for AtWork<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        let Correlate { templates, labels } = self.correlate;
        self.seen.resize(window.y.len() * labels.len(), 0.0);
        templates.project(window.phi, window.signs, &mut self.seen);
        self.sums.fill([0.0; 2]);
        for (row, y) in self.seen.chunks_exact(labels.len()).zip(window.y) {
            for ([yt, tt], t) in self.sums.iter_mut().zip(row) {
                *yt += y * t;
                *tt += t * t;
            }
        }
        let score = |k: usize| {
            let [yt, tt] = self.sums[k];
            if tt > 0.0 { yt / tt.sqrt() } else { f64::NEG_INFINITY }
        };
        let best = (1..labels.len()).fold(0, |best, k| if score(k) > score(best) { k } else { best });
        answer.image.resize(templates.atoms.nrows(), 0.0);
        templates.atoms.copy_column(best, &mut answer.image);
        answer.class = Some(Class::Known(labels[best]));
        Ok(())
    }
}
