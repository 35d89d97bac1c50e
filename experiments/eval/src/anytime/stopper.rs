//! Gives a decoder the samples of a window one by one, and records where it is confident enough.

use super::tally::{PressStops, WindowStop};
use crate::algorithm::{Answer, Belief, Class, Confidence, DecodeError, Subject};
use crate::decoders::TrainedDecoder;
use crate::scorer::{ScoredPress, Scorer};
use crate::windows::Window;
use spts_recon::StopRule;
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};

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
}
