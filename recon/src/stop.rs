//! Decides when enough has been measured.

use spts_input::Refusal;

/// Stops a series of measurements at a wanted confidence: after at least one sample, and at most [`StopRule::most`].
///
/// The confidence comes from the algorithm: the probability of the best class
/// ([`crate::classify::EvidenceClassifier`]), or the expected intersection over union of an image
/// ([`crate::recover::SequentialEstimate`]).
///
/// Source of the rule for classes: C. W. Baum, V. V. Veeravalli, "A sequential procedure for multihypothesis testing",
/// IEEE Trans. Inf. Theory 40(6), 1994; with two classes it is Wald's sequential probability ratio test.
///
/// ```
/// use spts_recon::{StopRule, Stopped};
///
/// let rule = StopRule::new(0.95, 3)?;
/// assert_eq!(rule.after(1, 0.90), None);
/// assert_eq!(rule.after(2, 0.97), Some(Stopped { measurements: 2, reached: true }));
/// assert_eq!(rule.after(3, 0.90), Some(Stopped { measurements: 3, reached: false }));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StopRule {
    confidence: f64,
    most: usize,
}

/// After how many measurements a decoder stopped, and whether it was sure enough by then.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stopped {
    /// Number of measurements.
    pub measurements: usize,
    /// Whether the wanted confidence was reached. If not, the largest number of measurements was.
    pub reached: bool,
}

impl StopRule {
    /// A rule that stops when the confidence is at least `confidence`, in (0.5, 1), or after `most` measurements, at
    /// least 1.
    ///
    /// # Errors
    /// [`Refusal`] if one of them is outside its range.
    pub fn new(confidence: f64, most: usize) -> Result<Self, Refusal> {
        if !(confidence > 0.5 && confidence < 1.0) {
            return Err(Refusal::range("confidence", confidence, "(0.5, 1)"));
        }
        if most == 0 {
            return Err(Refusal::range("most", 0.0, "[1, ∞)"));
        }
        Ok(Self { confidence, most })
    }

    /// The wanted confidence, (0.5, 1).
    pub fn confidence(&self) -> f64 {
        self.confidence
    }

    /// Largest number of measurements.
    pub fn most(&self) -> usize {
        self.most
    }

    /// The end of the series, if it ends after `measurements` samples with this `confidence`. It never ends before the
    /// first sample. NaN never reaches the wanted confidence.
    pub fn after(&self, measurements: usize, confidence: f64) -> Option<Stopped> {
        let reached = confidence >= self.confidence;
        let ends = measurements > 0 && (reached || measurements >= self.most);
        ends.then_some(Stopped { measurements, reached })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_takes_a_sample_and_ends_at_the_most() {
        let rule = StopRule::new(0.75, 4).unwrap();
        assert_eq!(rule.after(0, 1.0), None, "the prior alone is no reason to stop");
        assert!(rule.after(1, 0.75).is_some_and(|s| s.reached));
        assert_eq!(rule.after(3, f64::NAN), None);
        assert!(rule.after(4, f64::NAN).is_some_and(|s| !s.reached));
    }
}
