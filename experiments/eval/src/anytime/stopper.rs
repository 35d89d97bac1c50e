//! Gives a decoder the samples of a window one by one, and records where it is confident enough.

use crate::algorithm::{Answer, Belief, Class, Confidence, DecodeError, Subject};
use crate::decoders::TrainedDecoder;
use crate::scorer::{ScoredPress, Scorer};
use crate::tally::bootstrap;
use crate::windows::Window;
use serde::{Deserialize, Serialize};
use spts_models::Streams;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::{StopRule, statistics};

/// When a window ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum End {
    /// As soon as the decoder is confident enough.
    Sure(StopRule),
    /// After a fixed number of samples.
    Fixed(usize),
}

impl End {
    /// The wanted confidence; `None` for a fixed number of samples.
    pub(crate) fn confidence(self) -> Option<f64> {
        match self {
            Self::Sure(rule) => Some(rule.confidence()),
            Self::Fixed(_) => None,
        }
    }

    /// Whether a window ends after `samples` with this confidence, and whether the end is the wanted one.
    fn after(self, samples: usize, confidence: f64) -> Option<bool> {
        match self {
            Self::Sure(rule) => rule.after(samples, confidence).map(|stopped| stopped.reached),
            Self::Fixed(m) => (samples == m).then_some(true),
        }
    }
}

/// A decoder that is stopped, at work for one thread.
pub(crate) struct Stopper<'a> {
    subject: Subject,
    confidence: Box<dyn Confidence + 'a>,
    scorer: Scorer<'a>,
}

/// The truth of a press.
#[derive(Clone, Copy)]
enum Right<'a> {
    Class(usize),
    Support(&'a [bool]),
}

/// What a decoder says about a sample that it cannot use, and from then on.
const LOST: Belief = Belief {
    confidence: 0.0,
    class: Some(Class::Unknown),
};

impl<'a> Stopper<'a> {
    /// Starts `decoder`; `None` for one that does not say how sure it is.
    pub(crate) fn new(decoder: &'a TrainedDecoder) -> Option<Self> {
        let (subject, confidence) = decoder.trained.confidence()?;
        Some(Self {
            subject,
            confidence,
            scorer: Scorer::new(decoder),
        })
    }

    /// Ends windows of `most` samples of a press in every way of `ends`, one result each. Classes need the right
    /// `label`: without it they have no windows.
    ///
    /// # Errors
    /// [`DecodeError::External`] alone.
    pub(crate) fn stops(
        &mut self,
        scored: &ScoredPress<'_>,
        ends: &[End],
        most: usize,
        label: Option<usize>,
    ) -> Result<Vec<PressStops>, DecodeError> {
        let (windows, right) = match (self.subject, label) {
            (Subject::Image, _) => (scored.image_windows(most), Right::Support(&scored.truth().support)),
            (Subject::Class, Some(label)) => (scored.class_runs(most), Right::Class(label)),
            (Subject::Class, None) => (Vec::new(), Right::Class(0)),
        };
        let mut stops = vec![PressStops::default(); ends.len()];
        for window in &windows {
            self.window(window, ends, right, &mut stops)?;
        }
        Ok(stops)
    }

    /// Adds how `window` ends to `stops`.
    fn window(
        &mut self,
        window: &Window<'_>,
        ends: &[End],
        right: Right<'_>,
        stops: &mut [PressStops],
    ) -> Result<(), DecodeError> {
        self.confidence.begin();
        let mut open: Vec<usize> = (0..ends.len()).collect();
        let mut lost = false;
        for (k, sample) in window.samples().enumerate() {
            let belief = match self.confidence.observe(&sample) {
                _ if lost => LOST,
                Ok(belief) => belief,
                Err(error @ DecodeError::External(_)) => return Err(error),
                Err(_) => {
                    lost = true;
                    stops.iter_mut().for_each(|stops| stops.failed += 1);
                    LOST
                }
            };
            let samples = k + 1;
            let mut attained = None;
            let mut failed = None;
            open.retain(|&end| {
                let Some(reached) = ends[end].after(samples, belief.confidence) else {
                    return true;
                };
                // the same answer for all ends at this sample
                let score = match attained {
                    Some(score) => score,
                    None => match self.attained(&window.first(samples), belief, right) {
                        Ok(score) => *attained.insert(score),
                        Err(error) => {
                            failed = Some(error);
                            return false;
                        }
                    },
                };
                stops[end].windows.push(WindowStop {
                    samples,
                    reached,
                    stated: belief.confidence,
                    attained: score,
                });
                false
            });
            if let Some(error) = failed {
                return Err(error);
            }
            if open.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// The score of what the decoder answers to the samples so far.
    fn attained(&mut self, window: &Window<'_>, belief: Belief, right: Right<'_>) -> Result<f64, DecodeError> {
        let truth = match right {
            Right::Class(label) => {
                let found = belief.class.and_then(Class::label);
                return Ok(if found == Some(label) { 1.0 } else { 0.0 });
            }
            Right::Support(truth) => truth,
        };
        let answers: Vec<Answer> = self.scorer.answers(std::slice::from_ref(window))?;
        let mut found = Vec::new();
        for answer in &answers {
            support(&answer.image, SUPPORT_THRESHOLD, &mut found);
        }
        found.resize(truth.len(), false);
        Ok(SupportScore::new(&found, truth).iou)
    }
}

/// How one window ended.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WindowStop {
    /// Number of samples.
    pub(super) samples: usize,
    /// Whether the wanted confidence was reached.
    pub(super) reached: bool,
    /// Confidence at the end.
    pub(super) stated: f64,
    /// For a class 1 if right and 0 if wrong; for an image the intersection over union.
    pub(super) attained: f64,
}

/// How the windows of one press ended.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct PressStops {
    pub(super) windows: Vec<WindowStop>,
    /// Number of windows that the algorithm could not process.
    pub(crate) failed: usize,
}

/// How many samples a decoder took until it stopped, and how good its answers were.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct StopScores {
    /// Mean number of samples. A window that never reached the wanted confidence counts with all of its samples.
    /// `None`, like all scores, without windows.
    pub samples: Option<f64>,
    /// Median number of samples.
    pub samples_median: Option<f64>,
    /// Number of samples that is sufficient for 90 % of the windows.
    pub samples_p90: Option<f64>,
    /// Score over all windows: share of right classes, or mean intersection over union.
    pub attained: Option<f64>,
    /// Score over the windows that reached the wanted confidence; `None` if none did.
    pub attained_reached: Option<f64>,
    /// Mean final confidence of the windows that reached the wanted one. For a calibrated decoder it equals
    /// `attained_reached`.
    pub stated: Option<f64>,
    /// Share of windows that never reached the wanted confidence.
    pub never: Option<f64>,
}

impl PressStops {
    /// Number of windows.
    pub(crate) fn len(&self) -> usize {
        self.windows.len()
    }
}

/// Scores of several presses together.
pub(crate) fn pool<'a>(presses: impl IntoIterator<Item = &'a PressStops>) -> StopScores {
    let windows: Vec<&WindowStop> = presses.into_iter().flat_map(|press| &press.windows).collect();
    let mut samples: Vec<usize> = windows.iter().map(|w| w.samples).collect();
    samples.sort_unstable();
    let of = |kept: &dyn Fn(&WindowStop) -> bool, value: fn(&WindowStop) -> f64| {
        let (mut sum, mut count) = (0.0, 0.0);
        for window in windows.iter().filter(|w| kept(w)) {
            sum += value(window);
            count += 1.0;
        }
        (count > 0.0).then(|| sum / count)
    };
    StopScores {
        samples: of(&|_| true, |w| w.samples as f64),
        samples_median: quantile(&samples, 1, 2),
        samples_p90: quantile(&samples, 9, 10),
        attained: of(&|_| true, |w| w.attained),
        attained_reached: of(&|w| w.reached, |w| w.attained),
        stated: of(&|w| w.reached, |w| w.stated),
        never: of(&|_| true, |w| if w.reached { 0.0 } else { 1.0 }),
    }
}

/// The least of the `sorted` values that `share`/`of` of them do not exceed.
fn quantile(sorted: &[usize], share: usize, of: usize) -> Option<f64> {
    let rank = (sorted.len() * share).div_ceil(of).max(1);
    sorted.get(rank - 1).map(|samples| *samples as f64)
}

/// Means over the objects of their scores, `scores`, with quantiles over the windows of all of them, `all`. What an
/// object has no windows for has no mean; of what was reached, the objects count that reached it.
pub(crate) fn mean(scores: &[StopScores], all: &StopScores) -> StopScores {
    let every = |get: fn(&StopScores) -> Option<f64>| {
        let sum: Option<f64> = scores.iter().map(get).sum();
        sum.filter(|_| !scores.is_empty()).map(|sum| sum / scores.len() as f64)
    };
    let those = |get: fn(&StopScores) -> Option<f64>| statistics::mean(scores.iter().filter_map(get));
    StopScores {
        samples: every(|s| s.samples),
        samples_median: all.samples_median,
        samples_p90: all.samples_p90,
        attained: every(|s| s.attained),
        attained_reached: those(|s| s.attained_reached),
        stated: those(|s| s.stated),
        never: every(|s| s.never),
    }
}

/// Sums over the windows of a press: samples, attained, number.
type Sums = [f64; 3];

/// 95 % intervals of the means over objects of `samples` and `attained`, see [`bootstrap`].
pub(crate) fn intervals(objects: &[Vec<&PressStops>]) -> [Option<[f64; 2]>; 2] {
    let sums = |press: &&PressStops| -> Sums {
        let windows = press.windows.iter();
        windows.fold([0.0; 3], |[samples, attained, count], w| {
            [samples + w.samples as f64, attained + w.attained, count + 1.0]
        })
    };
    let objects: Vec<Vec<Sums>> = objects
        .iter()
        .map(|presses| presses.iter().map(sums).collect())
        .collect();
    bootstrap(&objects, Streams::new(1), |drawn| {
        let mut means = [(!drawn.is_empty()).then_some(0.0); 2];
        for presses in drawn {
            let mut total = [0.0; 3];
            for sums in presses {
                total.iter_mut().zip(*sums).for_each(|(total, v)| *total += v);
            }
            for (mean, sum) in means.iter_mut().zip(total) {
                let own = (total[2] > 0.0).then(|| sum / total[2] / drawn.len() as f64);
                *mean = mean.zip(own).map(|(mean, own)| mean + own);
            }
        }
        means
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algorithm::{Algorithm, Trained};
    use crate::training::TrainingData;
    use crate::windows::{Press, PressRows};
    use spts_input::Refusal;
    use spts_models::Streams;
    use spts_recon::Matrix;
    use std::sync::Arc;

    /// Is as sure as the samples say, is of class `samples so far`, and loses itself at a sample of −1.
    #[derive(Debug, Clone, Default)]
    struct Told(usize);

    impl Trained for Told {
        fn start(&self) -> Box<dyn Algorithm + '_> {
            Box::new(self.clone())
        }

        fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
            Some((Subject::Class, Box::new(self.clone())))
        }
    }

    impl Algorithm for Told {
        fn decode(&mut self, _: &Window<'_>, _: &mut Answer) -> Result<(), DecodeError> {
            Ok(())
        }
    }

    impl Confidence for Told {
        fn begin(&mut self) {
            self.0 = 0;
        }

        fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError> {
            assert_eq!((sample.y.len(), sample.phi.nrows()), (1, 1));
            self.0 += 1;
            if sample.y[0] < 0.0 {
                return Err(Refusal::new("lost").into());
            }
            Ok(Belief {
                confidence: sample.y[0],
                class: Some(Class::Known(self.0)),
            })
        }
    }

    fn stopped(y: &[f64], label: usize) -> Vec<PressStops> {
        let images = Matrix::from_column_slices(2, &[&[1.0, 0.0]]);
        let data = TrainingData::of_images(images, &[1], 2, Streams::new(1)).unwrap();
        let decoder = TrainedDecoder::of(Arc::new(Told::default()), &data);
        let mut stopper = Stopper::new(&decoder).unwrap();
        let rows = PressRows::of_matrix(&Matrix::from_rows(y.len(), 2, vec![1.0; 2 * y.len()]).unwrap());
        let press = Press::on(Arc::new(rows), y.to_vec(), 0.0);
        let rule = |confidence| End::Sure(StopRule::new(confidence, y.len()).unwrap());
        let ends = [rule(0.8), rule(0.9), End::Fixed(3)];
        let mut stops = vec![PressStops::default(); ends.len()];
        // a second window begins anew
        for _ in 0..2 {
            let window = press.window(0, y.len()).unwrap();
            stopper.window(&window, &ends, Right::Class(label), &mut stops).unwrap();
        }
        stops
    }

    /// The first sample that is sure enough ends a window, whatever follows; the answer is that of this sample.
    #[test]
    fn a_window_ends_at_the_first_sample_that_is_sure() {
        let stops = stopped(&[0.6, 0.85, 0.1, 0.7], 2);
        let seen = |stops: &PressStops| stops.windows.iter().map(|w| (w.samples, w.reached)).collect::<Vec<_>>();
        assert_eq!(seen(&stops[0]), [(2, true); 2]);
        // never sure enough: all of its samples
        assert_eq!(seen(&stops[1]), [(4, false); 2]);
        assert_eq!(seen(&stops[2]), [(3, true); 2]);
        let attained: Vec<f64> = stops.iter().map(|s| s.windows[0].attained).collect();
        // the class is the number of samples, and 2 is right
        assert!(
            attained[0] > 0.5 && attained[1] < 0.5 && attained[2] < 0.5,
            "{attained:?}"
        );
    }

    #[test]
    fn a_window_that_cannot_be_followed_is_never_sure_and_wrong() {
        let stops = stopped(&[0.6, -1.0, 0.99, 0.99], 3);
        for stops in &stops {
            assert_eq!(stops.failed, 2);
            assert!(stops.windows.iter().all(|w| w.attained < 0.5 && w.stated < 0.5));
        }
        assert!(stops[0].windows.iter().all(|w| w.samples == 4 && !w.reached));
    }

    fn press(windows: &[(usize, bool, f64)]) -> PressStops {
        let window = |&(samples, reached, attained): &(usize, bool, f64)| WindowStop {
            samples,
            reached,
            stated: 0.9,
            attained,
        };
        PressStops {
            windows: windows.iter().map(window).collect(),
            failed: 0,
        }
    }

    fn near(found: Option<f64>, expected: f64) -> bool {
        found.is_some_and(|found| (found - expected).abs() < 1e-12)
    }

    /// Ten windows of one press by hand: the share that never reached, and the quantiles.
    #[test]
    fn windows_of_a_press_by_hand() {
        let mut windows: Vec<(usize, bool, f64)> = (1..=9).map(|k| (k, true, 1.0)).collect();
        windows.push((100, false, 0.0));
        let scores = pool([&press(&windows)]);
        assert!(near(scores.samples, 14.5) && near(scores.samples_median, 5.0) && near(scores.samples_p90, 9.0));
        assert!(near(scores.attained, 0.9) && near(scores.attained_reached, 1.0) && near(scores.never, 0.1));
        assert!(near(scores.stated, 0.9));
        assert_eq!(pool([&PressStops::default()]), StopScores::default());
    }

    /// Objects count alike, however many windows they have. A single press an object leaves nothing to draw anew.
    #[test]
    fn objects_count_alike() {
        let (few, many) = (press(&[(10, true, 1.0)]), press(&[(2, true, 0.5); 7]));
        let scores = [pool([&few]), pool([&many])];
        let all = pool([&few, &many]);
        let mean = mean(&scores, &all);
        assert!(near(mean.samples, 6.0) && near(mean.attained, 0.75) && near(mean.samples_median, 2.0));
        let [samples, attained] = intervals(&[vec![&few], vec![&many]]);
        let is = |interval: Option<[f64; 2]>, value| interval.is_some_and(|i| i.iter().all(|v| near(Some(*v), value)));
        assert!(is(samples, 6.0) && is(attained, 0.75), "{samples:?}, {attained:?}");
        assert_eq!(intervals(&[]), [None, None]);
        assert_eq!(super::mean(&[], &all).samples, None);
    }
}
