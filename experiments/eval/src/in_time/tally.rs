//! Scores of tracked contacts.

use super::follow::Followed;
use crate::tally::bootstrap;
use serde::{Deserialize, Serialize};
use spts_models::Streams;
use spts_recon::statistics::mean;

/// When an image is scored.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Moment {
    /// This long after the touch, s.
    After(f64),
    /// While the contact is steady.
    Hold,
}

impl Moment {
    /// Time since the touch, s; `None` for the hold.
    pub(crate) fn since_touch_s(self) -> Option<f64> {
        match self {
            Self::After(time_s) => Some(time_s),
            Self::Hold => None,
        }
    }
}

/// Intersection over union and, for a ball, distance of its place, px: of the last window alone, of a longer window and
/// in time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Compared {
    pub(super) scores: [Option<(f64, Option<f64>)>; 3],
}

/// 95 % interval.
pub type Interval = Option<[f64; 2]>;

/// Scores at one moment: of the last window alone, of a longer window with as many samples as taxels, and with
/// tracking. Intervals are 95 % confidence intervals, by resampling presses or drops. `None` where nothing was scored.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct InTimeScores {
    /// Mean intersection over union of the last window alone.
    pub iou_alone: Option<f64>,
    /// Its interval.
    pub iou_alone_ci: Interval,
    /// Mean intersection over union of the longer window.
    pub iou_longer: Option<f64>,
    /// Mean intersection over union with tracking.
    pub iou_in_time: Option<f64>,
    /// Its interval.
    pub iou_in_time_ci: Interval,
    /// Mean of the differences between tracking and the last window alone.
    pub iou_gain: Option<f64>,
    /// Its interval.
    pub iou_gain_ci: Interval,
    /// For drops: mean distance of the image's centre from the true one, of the last window alone, taxels.
    pub error_alone_px: Option<f64>,
    /// Mean distance of the longer window, taxels.
    pub error_longer_px: Option<f64>,
    /// Mean distance with tracking, taxels.
    pub error_in_time_px: Option<f64>,
    /// Mean distance with tracking minus that of the last window alone, taxels; negative is better.
    pub error_gain_px: Option<f64>,
    /// Its interval.
    pub error_gain_ci: Interval,
}

/// Sum and count of the six numbers of [`Compared`] and the two differences, of one contact.
type Sums = [[f64; 2]; 8];

fn sums(followed: &Followed, at: Moment) -> Sums {
    let mut sums = [[0.0; 2]; 8];
    for (_, compared) in followed.iter().filter(|(moment, _)| *moment == at) {
        let [alone, longer, in_time] = compared.scores;
        let iou = [alone, longer, in_time].map(|score| score.map(|s| s.0));
        let error = [alone, longer, in_time].map(|score| score.and_then(|s| s.1));
        let less = |[alone, _, in_time]: [Option<f64>; 3]| Some(in_time? - alone?);
        let all = [
            iou[0],
            iou[1],
            iou[2],
            less(iou),
            error[0],
            error[1],
            error[2],
            less(error),
        ];
        for (sum, value) in sums.iter_mut().zip(all) {
            if let Some(value) = value {
                *sum = [sum[0] + value, sum[1] + 1.0];
            }
        }
    }
    sums
}

/// Means over the objects of their means; an object without a value has no say.
fn means(objects: &[Vec<&Sums>]) -> [Option<f64>; 8] {
    std::array::from_fn(|k| {
        let each = objects.iter().filter_map(|contacts| {
            let [sum, count] = contacts.iter().fold([0.0; 2], |[s, n], c| [s + c[k][0], n + c[k][1]]);
            (count > 0.0).then(|| sum / count)
        });
        mean(each)
    })
}

/// Scores at the moment `at` of the contacts of every object, and how many contacts have them.
pub(crate) fn scores(objects: &[Vec<&Followed>], at: Moment) -> (InTimeScores, usize) {
    let objects = objects.iter().map(|contacts| {
        let sums = contacts.iter().map(|followed| sums(followed, at));
        sums.filter(|s| s[2][1] > 0.0).collect()
    });
    let mut objects: Vec<Vec<Sums>> = objects.collect();
    objects.retain(|contacts| !contacts.is_empty());
    let all: Vec<Vec<&Sums>> = objects.iter().map(|contacts| contacts.iter().collect()).collect();
    let m = means(&all);
    let ci = bootstrap(&objects, Streams::new(1), |drawn| {
        let m = means(drawn);
        [m[0], m[2], m[3]]
    });
    let error_ci = bootstrap(&objects, Streams::new(1), |drawn| [means(drawn)[7]]);
    let scores = InTimeScores {
        iou_alone: m[0],
        iou_alone_ci: ci[0],
        iou_longer: m[1],
        iou_in_time: m[2],
        iou_in_time_ci: ci[1],
        iou_gain: m[3],
        iou_gain_ci: ci[2],
        error_alone_px: m[4],
        error_longer_px: m[5],
        error_in_time_px: m[6],
        error_gain_px: m[7],
        error_gain_ci: error_ci[0],
    };
    (scores, objects.iter().map(Vec::len).sum())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn followed(ious: &[(f64, f64)]) -> Followed {
        let each = ious.iter().map(|&(alone, in_time)| {
            let scores = [Some((alone, None)), None, Some((in_time, None))];
            (Moment::Hold, Compared { scores })
        });
        each.collect()
    }

    /// Objects count alike, and so do the contacts that an interval draws; moments that nobody has are empty.
    #[test]
    fn objects_count_alike() {
        let (few, many) = (followed(&[(0.2, 0.8)]), followed(&[(0.6, 0.6); 9]));
        let (found, contacts) = scores(&[vec![&few], vec![&many]], Moment::Hold);
        let near = |found: Option<f64>, value: f64| found.is_some_and(|found| (found - value).abs() < 1e-12);
        assert!(near(found.iou_alone, 0.4) && near(found.iou_in_time, 0.7) && near(found.iou_gain, 0.3));
        assert!(
            found
                .iou_gain_ci
                .is_some_and(|ci| ci.iter().all(|v| near(Some(*v), 0.3)))
        );
        assert_eq!((contacts, found.iou_longer, found.error_gain_px), (2, None, None));
        let (nothing, contacts) = scores(&[vec![&few]], Moment::After(0.001));
        assert_eq!((nothing.iou_alone, contacts), (None, 0));
    }
}
