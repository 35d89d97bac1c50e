//! Checks of answers.

use crate::algorithm::{Answer, Class, ExternalError};
use crate::labels::Labels;
use crate::training::TrainingData;
use serde::Deserialize;
use std::collections::BTreeMap;

/// Longest piece of an answer that an error quotes, characters.
const QUOTED: usize = 80;

/// A line of a program's output.
#[derive(Debug, Deserialize)]
struct Line {
    image: Option<Vec<f64>>,
    #[serde(default, deserialize_with = "given")]
    label: Option<Option<f64>>,
}

/// Tells `"label": null` from no label.
fn given<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Option<f64>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

/// The answers that make sense for one skin and one set of training data.
#[derive(Debug, Clone)]
pub(super) struct Valid {
    /// Number of values in an image.
    pub(super) taxels: usize,
    /// Names of the classes by number, as sent to the program.
    pub(super) classes: BTreeMap<usize, String>,
    /// Number of the left-out object: a correct answer, although not one of the classes.
    left_out: Option<usize>,
}

impl Valid {
    /// Classes are those of the training images; all of `labels` where the images have none.
    pub(super) fn new(data: &TrainingData, labels: &Labels, left_out: Option<&str>) -> Self {
        let all = (0..).map_while(|number| Some((number, labels.name(number)?.to_owned())));
        let learned = data.library.labels();
        let known: BTreeMap<usize, String> = all.collect();
        let mut classes = known.clone();
        classes.retain(|number, _| learned.contains(number));
        Self {
            taxels: data.images.nrows(),
            classes: if classes.is_empty() { known } else { classes },
            left_out: left_out.and_then(|object| labels.number(object)),
        }
    }

    /// The class of number `value`.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn label(&self, value: f64) -> Result<usize, String> {
        let mut known = self.classes.keys().copied().chain(self.left_out);
        #[expect(clippy::float_cmp, reason = "class numbers are small whole numbers")]
        known.find(|number| *number as f64 == value).ok_or_else(|| {
            let valid: Vec<String> = self.classes.keys().map(usize::to_string).collect();
            format!("`label` = {value}; valid: {}, or no class at all", valid.join(", "))
        })
    }

    /// The answer that a line of output gives.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn line(&self, line: &[u8]) -> Result<Answer, String> {
        let text = String::from_utf8_lossy(line);
        let parsed: Line = serde_json::from_str(&text).map_err(|e| {
            let start: String = text.trim_end().chars().take(QUOTED).collect();
            format!("`{}` ({e})", start.escape_debug())
        })?;
        let label = parsed
            .label
            .map(|label| label.map(|value| self.label(value)).transpose());
        self.answer(parsed.image, label.transpose()?)
    }

    /// The answer with `image` and `label`; a label of `None` is an unknown class.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn answer(&self, image: Option<Vec<f64>>, label: Option<Option<usize>>) -> Result<Answer, String> {
        if let Some(image) = &image {
            if image.len() != self.taxels {
                let (found, needed) = (image.len(), self.taxels);
                return Err(format!("an image of {found} values; needed are {needed}, one a taxel"));
            }
            if let Some(taxel) = image.iter().position(|value| !value.is_finite()) {
                return Err(format!("an image with {} at taxel {taxel} (from 0)", image[taxel]));
            }
        }
        if image.is_none() && label.is_none() {
            return Err("neither an image nor a label".to_owned());
        }
        Ok(Answer {
            image: image.unwrap_or_default(),
            class: label.map(|l| l.map_or(Class::Unknown, Class::Known)),
            failed: false,
        })
    }
}

/// Checks `line` as the answer of a program that must return images of `taxels` values or classes 1 to `classes`.
///
/// # Errors
/// A message that says what is wrong.
pub fn check_line(line: &[u8], taxels: usize, classes: usize) -> Result<Answer, String> {
    let valid = Valid {
        taxels,
        classes: (1..=classes).map(|number| (number, number.to_string())).collect(),
        left_out: None,
    };
    valid.line(line)
}

/// The error of the answer to a window.
pub(super) fn refused(command: &str, window: &str, problem: &str) -> ExternalError {
    ExternalError::Answer {
        command: command.to_owned(),
        problem: format!("{window} with {problem}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn answers_are_checked() {
        let valid = Valid {
            taxels: 2,
            classes: [(1, "brain".to_owned()), (4, "rec".to_owned())].into(),
            left_out: Some(7),
        };
        for bad in [-2.0, -1.0, 0.0, 1.5, 2.0, 99.0, 1e300, f64::NAN, f64::INFINITY] {
            let said = valid.label(bad).unwrap_err();
            assert!(said.contains("valid: 1, 4"), "{said}");
        }
        assert_eq!((valid.label(4.0), valid.label(7.0)), (Ok(4), Ok(7)));
        assert!(valid.answer(Some(vec![1.0]), None).is_err());
        assert!(valid.answer(Some(vec![]), Some(Some(1))).is_err());
        assert!(
            valid
                .answer(Some(vec![1.0, f64::NAN]), None)
                .unwrap_err()
                .contains("NaN at taxel 1")
        );
        assert!(valid.answer(None, None).is_err());
        assert_eq!(valid.answer(None, Some(None)).unwrap().class, Some(Class::Unknown));
        assert_eq!(valid.answer(Some(vec![1.0, 2.0]), None).unwrap().class, None);
    }
}
