//! Classification of an image as one of the known objects.

use crate::touches::Touch;
use std::sync::Arc;

/// Shifts that are tried along either axis, taxels.
const REACH: isize = 1;

/// Images of known objects from other presses on the same skin. An image is classified by the most similar one.
#[derive(Debug, Clone)]
pub struct Templates {
    rows: usize,
    cols: usize,
    known: Vec<Known>,
}

/// One object.
#[derive(Debug, Clone)]
struct Known {
    name: Arc<str>,
    /// Indices and values of non-zero taxels, normalised to length 1.
    taxels: Vec<(usize, f64)>,
}

impl Templates {
    /// Templates from `touches` on a skin of `rows` × `cols`: the mean of all touches of an object, normalised to
    /// length 1.
    #[must_use]
    pub fn new(touches: &[Touch], rows: usize, cols: usize) -> Self {
        let mut sums: Vec<(Arc<str>, Vec<f64>)> = Vec::new();
        for touch in touches {
            let values = touch.conductance_s.values();
            let length = values.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            match sums.iter_mut().find(|(name, _)| *name == touch.name) {
                Some((_, sum)) => sum.iter_mut().zip(values).for_each(|(sum, v)| *sum += v / length),
                None => sums.push((touch.name.clone(), values.iter().map(|v| v / length).collect())),
            }
        }
        let known = sums.into_iter().map(|(name, sum)| {
            let length = sum.iter().map(|v| v * v).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
            let taxels = sum.iter().enumerate().filter(|(_, v)| **v > 0.0);
            Known {
                name,
                taxels: taxels.map(|(k, v)| (k, v / length)).collect(),
            }
        });
        Self {
            rows,
            cols,
            known: known.collect(),
        }
    }

    /// The object whose template, shifted by up to a taxel along each axis, correlates most with `image`. The length of
    /// `image` does not matter. `None` for an empty image.
    #[must_use]
    pub fn name(&self, image: &[f64]) -> Option<&str> {
        let shifts = (-REACH..=REACH).flat_map(|r| (-REACH..=REACH).map(move |c| (r, c)));
        let scores = self.known.iter().map(|known| {
            let score = |shift| self.correlation(known, image, shift);
            (shifts.clone().map(score).fold(0.0, f64::max), &*known.name)
        });
        let best = scores.reduce(|a, b| if b.0 > a.0 { b } else { a });
        best.filter(|(score, _)| *score > 0.0).map(|(_, name)| name)
    }

    /// Σ template·image with the template moved by `shift`; what leaves the skin counts nothing.
    fn correlation(&self, known: &Known, image: &[f64], (down, right): (isize, isize)) -> f64 {
        let moved = |k: usize, by: isize, most: usize| k.checked_add_signed(by).filter(|k| *k < most);
        let terms = known.taxels.iter().filter_map(|(k, v)| {
            let row = moved(k / self.cols, down, self.rows)?;
            let col = moved(k % self.cols, right, self.cols)?;
            Some(v * image[row * self.cols + col])
        });
        terms.sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::touches::{TouchObjects, TouchScene};
    use spts_models::SkinLayout;

    /// Other presses of the seventeen objects are named from their images as they are, also a taxel further.
    #[test]
    fn other_presses_are_named() {
        let scene = TouchScene {
            placed: true,
            specimen: Some(5),
            ..TouchScene::new(SkinLayout::default(), TouchObjects::Objects, 34, 1)
        };
        let templates = Templates::new(&scene.draw().unwrap(), 10, 10);
        let others = TouchScene {
            seed: 2,
            touches: 17,
            ..scene
        }
        .draw()
        .unwrap();
        let right = |shift: usize| {
            let named = others.iter().filter(|touch| {
                let mut image = touch.conductance_s.values().to_vec();
                image.rotate_right(shift);
                templates.name(&image) == Some(&*touch.name)
            });
            named.count()
        };
        assert!(right(0) >= 15 && right(1) >= 10, "{} and {} of 17", right(0), right(1));
        assert_eq!(templates.name(&[0.0; 100]), None);
    }
}
