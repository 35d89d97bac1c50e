//! The evidence classifier for a stream of measurements.

use super::classifier::{Decision, EvidenceClassifier, Posterior};
use super::component::EvidenceError;
use super::filter::{Evidence, Preparation};
use crate::sign_rows::SignTables;
use crate::stop::{StopRule, Stopped};

/// Best class and its probability after every measurement, for weights ±1.
///
/// The weights of a row are known before its sample. Call [`Self::prepare`] for them while the skin settles; little
/// work is then left when the sample arrives. [`Self::next_window`], called after about twenty measurements, keeps the
/// evidence but lets the amplitude change.
///
/// ```
/// use spts_recon::classify::{AnytimeClassifier, EvidenceClassifier, Library, TemplateModel};
/// use spts_recon::{AmplitudeRange, Matrix};
///
/// // two shapes on 2 × 2 taxels, and signs of four weights a row: bit k set is +1 on taxel k
/// let images = Matrix::from_rows(4, 2, vec![1.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0])?;
/// let components = TemplateModel::new(2).classes(&Library::new(&images, &[10, 20])?)?;
/// let classifier = EvidenceClassifier::new(&components, AmplitudeRange::new(0.1, 10.0)?, 0.05)?;
/// let mut stream = AnytimeClassifier::new(classifier);
/// for (signs, y) in [(0b0011, 2.1), (0b1100, -1.9), (0b0110, 0.1), (0b1111, 2.0)] {
///     let decision = stream.push(&[signs], y)?;
///     assert_eq!(decision.label, Some(10));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct AnytimeClassifier {
    classifier: EvidenceClassifier,
    tables: SignTables<f32>,
    preparation: Preparation,
    evidence: Evidence,
    posterior: Posterior,
    row: Vec<f64>,
}

impl AnytimeClassifier {
    /// A stream without samples. Its tables take 1 kB · ⌈N/8⌉ for every column of the classifier's bank.
    #[must_use]
    pub fn new(classifier: EvidenceClassifier) -> Self {
        let mut out = Self {
            tables: SignTables::new(classifier.bank().view()),
            preparation: classifier.preparation(),
            evidence: classifier.evidence(),
            posterior: Posterior::default(),
            row: vec![0.0; classifier.bank().ncols()],
            classifier,
        };
        out.decide();
        out
    }

    /// Prepares the next row: does all work that needs no sample. `signs` has one row, as in [`SignTables::fill_rows`].
    ///
    /// # Errors
    /// [`EvidenceError`] if `signs` does not have ⌈N/64⌉ words, or a projection of the templates is beyond ±1e12.
    pub fn prepare(&mut self, signs: &[u64]) -> Result<(), EvidenceError> {
        if signs.len() != self.tables.words() {
            return Err(EvidenceError::Shape {
                what: "row of signs",
                len: signs.len(),
                expected: self.tables.words(),
            });
        }
        self.tables.fill_rows(signs, &mut self.row);
        self.preparation.push(&self.row)
    }

    /// Takes the next sample `y` into account and returns the decision after it: the most probable class, and how
    /// probable it is. The sample belongs to the earliest row that was prepared ([`Self::prepare`]) and has no sample
    /// yet.
    ///
    /// # Errors
    /// [`EvidenceError`] if `y` is not finite or beyond ±1e80, or no row is prepared for it. A row whose sample is lost
    /// cannot be skipped: start again with [`Self::next_window`], without it.
    pub fn observe(&mut self, y: f64) -> Result<Decision, EvidenceError> {
        self.evidence.observe(&self.preparation, y)?;
        Ok(self.decide())
    }

    /// [`Self::prepare`] and [`Self::observe`] in one call, for rows that were not prepared ahead.
    ///
    /// # Errors
    /// As both, and [`EvidenceError::RowsWaiting`] if prepared rows still wait for their samples, because `y` would be
    /// assigned to the first of them. The stream is then unchanged.
    pub fn push(&mut self, signs: &[u64], y: f64) -> Result<Decision, EvidenceError> {
        let waiting = self.preparation.rows() - self.evidence.count();
        if waiting > 0 {
            return Err(EvidenceError::RowsWaiting { waiting });
        }
        // a sample that is refused must not leave its row behind
        crate::checks::measurement(y)?;
        self.prepare(signs)?;
        self.observe(y)
    }

    /// Adds `samples` (rows of signs, and measurements) until `rule` stops: the best outcome is probable enough, or the
    /// number of measurements is reached. Later samples stay in the iterator.
    ///
    /// # Errors
    /// As [`Self::push`].
    pub fn push_until<'s>(
        &mut self,
        rule: &StopRule,
        samples: impl IntoIterator<Item = (&'s [u64], f64)>,
    ) -> Result<(Decision, Stopped), EvidenceError> {
        let (mut decision, mut measurements) = (self.decide(), 0);
        for (signs, y) in samples {
            decision = self.push(signs, y)?;
            measurements += 1;
            if let Some(stopped) = rule.after(measurements, decision.probability) {
                return Ok((decision, stopped));
            }
        }
        let reached = false;
        Ok((decision, Stopped { measurements, reached }))
    }

    /// The best outcome and its probability; without a sample, that of the prior.
    pub fn decide(&mut self) -> Decision {
        self.classifier
            .decide(&self.preparation, &self.evidence, &mut self.posterior)
    }

    /// Probabilities and evidence of all outcomes at the last decision, in the order of
    /// [`EvidenceClassifier::outcomes`].
    #[must_use]
    pub fn posterior(&self) -> &Posterior {
        &self.posterior
    }

    /// The classifier.
    #[must_use]
    pub fn classifier(&self) -> &EvidenceClassifier {
        &self.classifier
    }

    /// Number of samples in this window.
    #[must_use]
    pub fn samples(&self) -> usize {
        self.evidence.count()
    }

    /// Ends the window. Its evidence is kept, rows without a sample are dropped, and the next image may have another
    /// amplitude and other deformations.
    pub fn next_window(&mut self) {
        self.classifier
            .next_window(&self.preparation, &mut self.evidence, &mut self.posterior);
        self.preparation.clear();
    }

    /// Removes all samples, rows and evidence.
    pub fn clear(&mut self) {
        self.preparation.clear();
        self.evidence.clear();
        self.decide();
    }
}

#[cfg(test)]
mod tests {
    use super::super::component::Component;
    use super::super::tests::planted::{PlantedWindow, planted};
    use super::*;
    use crate::amplitude::AmplitudeRange;

    /// The stream says what the parts say, whether rows are prepared ahead or not, and its windows add up.
    #[test]
    fn equals_its_parts() {
        let (classifier, images) = planted();
        let window = PlantedWindow::new(8, 24, &images[1], 1.4, 0.2);
        let (mut ahead, mut stream) = (
            AnytimeClassifier::new(classifier.clone()),
            AnytimeClassifier::new(classifier.clone()),
        );
        for signs in &window.signs {
            ahead.prepare(&[*signs]).unwrap();
        }
        let (mut preparation, mut evidence) = (classifier.preparation(), classifier.evidence());
        let mut posterior = Posterior::default();
        for (m, (&signs, &y)) in window.signs.iter().zip(&window.y).enumerate() {
            let mut row = vec![0.0; classifier.bank().ncols()];
            classifier.bank().accumulate_row(window.phi.row(m), &mut row);
            preparation.push(&row).unwrap();
            evidence.observe(&preparation, y).unwrap();
            let expected = classifier.decide(&preparation, &evidence, &mut posterior);
            let got = stream.push(&[signs], y).unwrap();
            assert_eq!(got, ahead.observe(y).unwrap());
            assert_eq!(got.label, expected.label);
            // tables in f32: 5 groups of sums near 1, 3e-7 of an innovation of a few deviations
            assert!(
                (got.probability - expected.probability).abs() < 1e-4,
                "{got:?}, {expected:?}"
            );
        }
        let once = stream.posterior().log_evidence.clone();
        stream.next_window();
        for (&signs, &y) in window.signs.iter().zip(&window.y) {
            stream.push(&[signs], y).unwrap();
        }
        for (twice, once) in stream.posterior().log_evidence.iter().zip(&once) {
            assert!((twice - 2.0 * once).abs() < 1e-9 * once.abs());
        }
        stream.clear();
        assert_eq!(stream.samples(), 0);
        assert_eq!(stream.posterior(), AnytimeClassifier::new(classifier).posterior());
    }

    #[test]
    fn stops_when_it_is_sure() {
        let (classifier, images) = planted();
        let window = PlantedWindow::new(9, 40, &images[0], 0.8, 0.2);
        let samples = || window.signs.chunks(1).zip(window.y.iter().copied());
        let rule = |confidence, most| StopRule::new(confidence, most).unwrap();
        let mut stream = AnytimeClassifier::new(classifier);
        let (decision, stopped) = stream.push_until(&rule(0.99, 40), samples()).unwrap();
        assert!(
            decision.label == Some(3) && decision.probability >= 0.99,
            "{decision:?}"
        );
        assert!(
            stopped.reached && (2..40).contains(&stopped.measurements),
            "{stopped:?}"
        );
        // a rule that ends a sample earlier, and samples that end earlier than the rule
        for (most, taken) in [(stopped.measurements - 1, 40), (40, stopped.measurements - 1)] {
            stream.clear();
            let (_, early) = stream.push_until(&rule(0.99, most), samples().take(taken)).unwrap();
            let measurements = stopped.measurements - 1;
            assert_eq!(
                early,
                Stopped {
                    measurements,
                    reached: false
                }
            );
        }
        stream.clear();
        let (prior, stopped) = stream.push_until(&rule(0.99, 40), []).unwrap();
        assert_eq!((stopped.measurements, stopped.reached), (0, false));
        assert!(prior.probability < 0.5);
    }

    /// Two classes that differ in one number: t = ±1 seen with noise of variance v and an amplitude that is as good as
    /// known. The posterior is that of Wald's test, 1 / (1 + exp(−2 Σ y / v)), after every sample.
    #[test]
    fn two_classes_in_one_dimension_have_the_known_posterior() {
        let variance = 2.0;
        let class = |label, mean| Component {
            label: Some(label),
            weight: 1.0,
            mean: vec![mean],
            factors: Vec::new(),
            noise_variance: variance,
        };
        // the amplitude is 1 to 1e-9, and ln p changes with it by less than y²/v of that
        let range = AmplitudeRange::new(1.0, 1.0 + 1e-9).unwrap();
        let classifier = EvidenceClassifier::new(&[class(1, 1.0), class(2, -1.0)], range, 0.5).unwrap();
        let mut stream = AnytimeClassifier::new(classifier);
        let samples = [0.3, -0.2, 1.4, 0.9, -0.6, 2.1, 0.8];
        let mut sum = 0.0;
        let mut first = None;
        for (k, y) in samples.into_iter().enumerate() {
            sum += y;
            let decision = stream.push(&[1], y).unwrap();
            let expected = 1.0 / (1.0 + (-2.0 * sum.abs() / variance).exp());
            assert_eq!(decision.label, Some(if sum > 0.0 { 1 } else { 2 }));
            assert!(
                (decision.probability - expected).abs() < 1e-7,
                "sample {k}: {}, expected {expected}",
                decision.probability
            );
            // Wald's boundary: Σ y ≥ v/2 · ln(p/(1 − p))
            if first.is_none() && sum >= 0.5 * variance * (0.9_f64 / 0.1).ln() {
                first = Some(k + 1);
            }
        }
        stream.clear();
        let rule = StopRule::new(0.9, samples.len()).unwrap();
        let (_, stopped) = stream.push_until(&rule, samples.map(|y| (&[1][..], y))).unwrap();
        assert_eq!((Some(stopped.measurements), stopped.reached), (first, true));
    }

    #[test]
    fn lost_samples_are_refused_and_leave_nothing_behind() {
        let (classifier, _) = planted();
        let mut stream = AnytimeClassifier::new(classifier);
        assert!(stream.push(&[1, 2], 1.0).is_err());
        assert!(matches!(stream.observe(1.0), Err(EvidenceError::NotPrepared { .. })));
        for y in [f64::NAN, f64::INFINITY, 1e90] {
            assert!(stream.push(&[5], y).is_err());
        }
        assert_eq!((stream.samples(), stream.preparation.rows()), (0, 0));
        assert!(stream.push(&[5], 1.0).is_ok());
    }

    /// A pushed sample never meets the weights of a row prepared before it.
    #[test]
    fn rows_that_wait_for_samples_refuse_a_push() {
        let (classifier, _) = planted();
        let mut stream = AnytimeClassifier::new(classifier.clone());
        let mut pushed = AnytimeClassifier::new(classifier);
        stream.prepare(&[5]).unwrap();
        stream.prepare(&[6]).unwrap();
        assert_eq!(stream.push(&[7], 1.0), Err(EvidenceError::RowsWaiting { waiting: 2 }));
        stream.observe(0.5).unwrap();
        assert_eq!(stream.push(&[7], 1.0), Err(EvidenceError::RowsWaiting { waiting: 1 }));
        assert_eq!((stream.samples(), stream.preparation.rows()), (1, 2));
        // with all samples there, rows can be pushed again, and nothing of the refused ones is left
        stream.observe(-0.5).unwrap();
        let got = stream.push(&[7], 1.0).unwrap();
        pushed.push(&[5], 0.5).unwrap();
        pushed.push(&[6], -0.5).unwrap();
        assert_eq!(got, pushed.push(&[7], 1.0).unwrap());
        // a new window forgets the rows that wait
        stream.prepare(&[8]).unwrap();
        stream.next_window();
        assert!(stream.push(&[7], 1.0).is_ok());
    }
}
