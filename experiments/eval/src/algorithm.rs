//! Algorithms that turn windows into images or classes, and are scored on them.

use crate::labels::Labels;
use crate::training::TrainingData;
use crate::windows::Window;
use serde::{Deserialize, Serialize};
use spts_input::Refusal;
use spts_recon::recover::Gaussian;
use std::sync::Arc;

/// What a decoder makes of one window of samples: an image, a class, or both.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Answer {
    /// Tactile image, one value a taxel, in any unit; empty if the algorithm makes none.
    pub image: Vec<f64>,
    /// Class of the object. `None` leaves it to the scorer's classifier, which uses the image.
    pub class: Option<Class>,
    /// Whether the window could not be solved.
    pub failed: bool,
}

/// The class that a decoder names by itself: which object it takes the touch for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// One of the labels.
    Known(usize),
    /// None of the labels, or undecided.
    Unknown,
}

impl Class {
    /// The label; `None` for [`Class::Unknown`].
    pub fn label(self) -> Option<usize> {
        match self {
            Self::Known(label) => Some(label),
            Self::Unknown => None,
        }
    }
}

/// Why a window has no answer.
#[derive(Debug, thiserror::Error)]
pub enum DecodeError {
    /// The decoder cannot solve it. The window scores as an empty image without a class.
    #[error(transparent)]
    Refused(#[from] Refusal),
    /// An external program failed. This ends the run.
    #[error(transparent)]
    External(Refusal),
}

/// A trained decoder at work in one thread, with memory of its own: windows of samples in, answers out.
///
/// ```
/// use spts_eval::algorithm::{Algorithm, Answer, DecodeError};
/// use spts_eval::{PressRows, Press, Window};
/// use spts_recon::Matrix;
///
/// /// The image Φᵀ y, the simplest of all decoders.
/// struct BackProjection;
///
/// impl Algorithm for BackProjection {
///     fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
///         answer.image = vec![0.0; window.phi.ncols()];
///         for (row, y) in window.phi.values().chunks_exact(window.phi.ncols()).zip(window.y) {
///             answer.image.iter_mut().zip(row).for_each(|(x, w)| *x += w * y);
///         }
///         Ok(())
///     }
/// }
/// let phi = Matrix::from_rows(2, 3, vec![1.0, -1.0, 1.0, 1.0, 1.0, -1.0]).unwrap();
/// let press = Press::on(PressRows::of_matrix(&phi).into(), vec![2.0, 2.0], 0.0);
/// let mut answer = Answer::default();
/// BackProjection.decode(&press.window(0, 2).expect("two measurements"), &mut answer)?;
/// assert_eq!(answer.image, [4.0, 0.0, 0.0]);
/// # Ok::<(), DecodeError>(())
/// ```
pub trait Algorithm {
    /// Decodes `window` into `answer`, whose memory is reused.
    ///
    /// # Errors
    /// [`DecodeError`].
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError>;

    /// Decodes `windows` in order; all have the same M. A window that cannot be solved gets an empty answer.
    ///
    /// # Errors
    /// [`DecodeError::External`] only.
    fn decode_all(&mut self, windows: &[Window<'_>]) -> Result<Vec<Answer>, DecodeError> {
        let mut answers = vec![Answer::default(); windows.len()];
        let mut rows = Vec::new();
        for (window, answer) in windows.iter().zip(&mut answers) {
            let window = if self.takes_bits() { *window } else { window.with_rows(&mut rows) };
            match self.decode(&window, answer) {
                Err(error @ DecodeError::External(_)) => return Err(error),
                Err(_) => {
                    *answer =
                        Answer { image: vec![0.0; window.phi.ncols()], class: Some(Class::Unknown), failed: true };
                }
                Ok(()) => {}
            }
        }
        Ok(answers)
    }

    /// Whether rows as bits will do, so that windows of large skins need no rows of numbers.
    fn takes_bits(&self) -> bool {
        false
    }

    /// Whether windows are decoded in batches, so that the time of a single one has no meaning.
    fn batched(&self) -> bool {
        false
    }

    /// Class with the largest evidence summed over several windows; `None` for an algorithm without evidence.
    fn sum(&mut self, windows: &[Window<'_>]) -> Option<Class> {
        let _ = windows;
        None
    }
}

/// What a decoder is sure of when it states a confidence: its class or its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Subject {
    /// The class: the probability of the best one.
    Class,
    /// The image: the expected intersection over union of its support with the true one.
    Image,
}

/// A decoder's answer after the samples so far, and how sure it is of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Belief {
    /// Confidence of the algorithm in its answer, [0, 1].
    pub confidence: f64,
    /// The class, for an algorithm that classifies.
    pub class: Option<Class>,
}

/// Confidence of an algorithm after every sample of a window, with its own memory.
///
/// ```
/// use spts_eval::algorithm::{Belief, Class, Confidence, DecodeError};
/// use spts_eval::Window;
///
/// /// More and more sure of class 1, whatever it sees.
/// struct Naive(f64);
///
/// impl Confidence for Naive {
///     fn begin(&mut self) {
///         self.0 = 0.5;
///     }
///     fn observe(&mut self, _sample: &Window<'_>) -> Result<Belief, DecodeError> {
///         self.0 += 0.5 * (1.0 - self.0);
///         Ok(Belief { confidence: self.0, class: Some(Class::Known(1)) })
///     }
/// }
/// let mut naive = Naive(0.9);
/// naive.begin();
/// assert_eq!(naive.0, 0.5);
/// ```
pub trait Confidence {
    /// Starts the next window.
    fn begin(&mut self);

    /// Takes the next sample of the window into account, and returns the answer so far and how sure the algorithm is of
    /// it. `sample` is a window of one measurement: the sample and its row.
    ///
    /// # Errors
    /// [`DecodeError`].
    fn observe(&mut self, sample: &Window<'_>) -> Result<Belief, DecodeError>;
}

/// A decoder that has learned from training data. All threads share it; each starts an [`Algorithm`] from it.
///
/// ```
/// use spts_eval::algorithm::{Algorithm, Answer, DecodeError, Trained};
/// use spts_eval::Window;
///
/// /// The mean image of the training data, whatever is measured.
/// struct MeanImage(Vec<f64>);
/// struct Running<'a>(&'a MeanImage);
///
/// impl Trained for MeanImage {
///     fn start(&self) -> Box<dyn Algorithm + '_> {
///         Box::new(Running(self))
///     }
/// }
/// impl Algorithm for Running<'_> {
///     fn decode(&mut self, _: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
///         answer.image.clone_from(&self.0.0);
///         Ok(())
///     }
/// }
/// let trained = MeanImage(vec![0.5; 100]);
/// assert!(!trained.start().batched() && trained.prior().is_none());
/// ```
pub trait Trained: Send + Sync {
    /// An algorithm for one thread.
    fn start(&self) -> Box<dyn Algorithm + '_>;

    /// Confidence of the algorithm in one property of the contact, for one thread; `None` if it cannot state one.
    fn confidence(&self) -> Option<(Subject, Box<dyn Confidence + '_>)> {
        None
    }

    /// The zero-mean Gaussian prior of its images, with which a contact can be tracked in time; `None` for an algorithm
    /// without one.
    fn prior(&self) -> Option<Arc<Gaussian>> {
        None
    }

    /// Called after all windows are decoded. An external program ends here and reports whether it succeeded. Further
    /// calls do nothing.
    ///
    /// # Errors
    /// [`DecodeError::External`] only.
    fn finish(&self) -> Result<(), DecodeError> {
        Ok(())
    }
}

/// A decoder of your own, to be scored beside those in the table of decoders: implement [`Contender::learn`].
///
/// ```
/// use spts_eval::external::ExternalCommand;
/// use spts_eval::algorithm::Contender as _;
///
/// let contender = ExternalCommand::parse("mine=python3 decoder.py {windows} {answers}");
/// assert_eq!(contender.name(), "mine");
/// ```
pub trait Contender: Send + Sync {
    /// Name on the board.
    fn name(&self) -> &str;

    /// Trains the algorithm on `data`, whose classes are numbered as in `labels`. `left_out` is the object that is
    /// excluded from `data`, if any.
    ///
    /// # Errors
    /// [`Refusal`] if it cannot be trained or started.
    fn learn(&self, data: &TrainingData, labels: &Labels, left_out: Option<&str>) -> Result<Arc<dyn Trained>, Refusal>;
}

impl From<DecodeError> for Refusal {
    fn from(error: DecodeError) -> Self {
        match error {
            DecodeError::Refused(refusal) | DecodeError::External(refusal) => refusal,
        }
    }
}
