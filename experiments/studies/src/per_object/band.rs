//! Bands over simulated skins, and the distance of the real skin from them.

use super::images::ReadoutImages;
use crate::calibrate::predicted;
use serde::Serialize;
use spts_eval::Scores;

/// Name of a score and its value; `None` for a decoder without it.
pub type ScoreOf = (&'static str, fn(&Scores) -> Option<f64>);

/// The scores that are compared: intersection over union of the supports, and the share of single windows classified.
pub const SCORES: [ScoreOf; 2] = [("iou", |s| s.iou), ("class_single", |s| s.class_single)];

/// One score of one object, such as its IoU, on one real or simulated skin.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectScore {
    /// Decoder.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// One of [`SCORES`].
    pub score: &'static str,
    /// Object.
    pub object: String,
    /// Value, in [0, 1].
    pub value: f64,
}

impl ObjectScore {
    /// Whether `other` is the same score of the same object.
    fn is_of(&self, other: &Self) -> bool {
        self.key() == other.key() && self.object == other.object
    }

    fn key(&self) -> (&str, usize, &str) {
        (&self.decoder, self.m, self.score)
    }
}

/// One score of one object: simulated skins and real skin.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectBand {
    /// The images of the twin's recordings.
    pub images: ReadoutImages,
    /// Decoder.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// One of [`SCORES`].
    pub score: &'static str,
    /// Object.
    pub object: String,
    /// Score of the real skin.
    pub real: f64,
    /// Mean over the simulated skins.
    pub twin: f64,
    /// Lower end of the band, in which a further simulated skin scores with a probability of 90 %.
    pub low: f64,
    /// Upper end of the band.
    pub high: f64,
    /// twin − real.
    pub difference: f64,
    /// Whether the real skin lies in the band.
    pub inside: bool,
    /// Score of every simulated skin.
    #[serde(skip)]
    pub skins: Vec<f64>,
}

/// How far the twin is from the real skin in one score, over all objects.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ScoreDistance {
    /// The images of the twin's recordings.
    pub images: ReadoutImages,
    /// Decoder.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// One of [`SCORES`].
    pub score: &'static str,
    /// Mean over the objects of |twin − real|, where "twin" is the mean over the simulated skins. Errors of opposite
    /// sign do not cancel.
    pub mean_abs_difference: f64,
    /// The same distance for a simulated skin in place of the real one, from the mean of the others: the expected
    /// distance if the real skin were one of the twin's.
    pub between_skins: f64,
    /// Mean over the objects of twin − real, in which errors cancel.
    pub difference_of_means: f64,
    /// Number of objects.
    pub objects: usize,
    /// Objects whose real score lies outside the band, separated by spaces.
    pub outside: String,
}

/// The band of every score of the real skin that all `skins` also have, in the order of `real`.
///
/// ```
/// use spts_studies::per_object::{ReadoutImages, ObjectScore, bands};
///
/// let (decoder, object) = ("matched".to_owned(), "T".to_owned());
/// let one = ObjectScore { decoder, m: 20, score: "iou", object, value: 0.0 };
/// let score = |value| ObjectScore { value, ..one.clone() };
/// let skins: Vec<_> = [0.70, 0.74, 0.78].map(|value| vec![score(value)]).to_vec();
/// let band = &bands(ReadoutImages::Twin, &[score(0.76)], &skins)[0];
/// assert!(band.inside && (band.twin - 0.74).abs() < 1e-12);
/// ```
#[must_use]
pub fn bands(images: ReadoutImages, real: &[ObjectScore], skins: &[Vec<ObjectScore>]) -> Vec<ObjectBand> {
    let band = |real: &ObjectScore| {
        let same = |skin: &Vec<ObjectScore>| skin.iter().find(|s| s.is_of(real)).map(|s| s.value);
        let skins: Vec<f64> = skins.iter().map(same).collect::<Option<_>>()?;
        let (low, high) = predicted(&skins)?;
        let twin = skins.iter().sum::<f64>() / skins.len() as f64;
        let (low, high) = (low.max(0.0), high.min(1.0));
        Some(ObjectBand {
            images,
            decoder: real.decoder.clone(),
            m: real.m,
            score: real.score,
            object: real.object.clone(),
            real: real.value,
            twin,
            low,
            high,
            difference: twin - real.value,
            inside: low <= real.value && real.value <= high,
            skins,
        })
    };
    real.iter().filter_map(band).collect()
}

/// The distance in every score of `bands`, in order.
#[must_use]
pub fn distances(bands: &[ObjectBand]) -> Vec<ScoreDistance> {
    let mut out: Vec<ScoreDistance> = Vec::new();
    let key = |b: &ObjectBand| (b.images, b.decoder.clone(), b.m, b.score);
    for first in bands {
        if out
            .iter()
            .any(|d| (d.images, d.decoder.clone(), d.m, d.score) == key(first))
        {
            continue;
        }
        let of: Vec<&ObjectBand> = bands.iter().filter(|b| key(b) == key(first)).collect();
        let mean = |get: &dyn Fn(&ObjectBand) -> f64| of.iter().map(|b| get(b)).sum::<f64>() / of.len() as f64;
        let outside: Vec<&str> = of.iter().filter(|b| !b.inside).map(|b| b.object.as_str()).collect();
        out.push(ScoreDistance {
            images: first.images,
            decoder: first.decoder.clone(),
            m: first.m,
            score: first.score,
            mean_abs_difference: mean(&|b| b.difference.abs()),
            between_skins: mean(&|b| one_to_others(&b.skins)),
            difference_of_means: mean(&|b| b.difference),
            objects: of.len(),
            outside: outside.join(" "),
        });
    }
    out
}

/// Mean distance of a value to the mean of the others; 0 of one value.
fn one_to_others(values: &[f64]) -> f64 {
    let n = values.len() as f64;
    let sum: f64 = values.iter().sum();
    if values.len() < 2 {
        return 0.0;
    }
    let off = |v: &f64| (v - (sum - v) / (n - 1.0)).abs();
    values.iter().map(off).sum::<f64>() / n
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;

    fn score(object: &str, value: f64) -> ObjectScore {
        ObjectScore {
            decoder: "matched".to_owned(),
            m: 20,
            score: "iou",
            object: object.to_owned(),
            value,
        }
    }

    /// The twin is .4 low on one object and .4 high on another: the means agree, the distance is .4.
    #[test]
    fn opposite_errors_do_not_cancel() {
        let real = [score("brain", 0.7), score("trig", 0.3)];
        let skins = [[0.31, 0.69], [0.29, 0.71]].map(|[a, b]| vec![score("brain", a), score("trig", b)]);
        let bands = bands(ReadoutImages::Twin, &real, &skins);
        let distances = distances(&bands);
        assert_eq!(distances.len(), 1);
        assert_abs_diff_eq!(distances[0].difference_of_means, 0.0, epsilon = 1e-12);
        assert_abs_diff_eq!(distances[0].mean_abs_difference, 0.4, epsilon = 1e-12);
        assert_abs_diff_eq!(distances[0].between_skins, 0.02, epsilon = 1e-12);
        assert_eq!(distances[0].outside, "brain trig");
    }

    /// Four skins score .5 ± .1 on average: s = .1155, t = 2.353, √(5/4): the band reaches .304 to either side.
    #[test]
    fn a_real_skin_like_the_twin_s_lies_within_the_band() {
        let skins = [0.4, 0.6, 0.4, 0.6].map(|v| vec![score("brain", v)]);
        let within = |real: f64| bands(ReadoutImages::Twin, &[score("brain", real)], &skins)[0].inside;
        assert!(within(0.5) && within(0.79) && !within(0.81) && !within(0.19));
    }

    #[test]
    fn a_score_that_a_skin_lacks_has_no_band() {
        let skins = [vec![score("brain", 0.5)], vec![]];
        assert!(bands(ReadoutImages::Twin, &[score("brain", 0.5)], &skins).is_empty());
    }
}
