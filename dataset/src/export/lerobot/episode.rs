//! The frames of one press.

use super::features::{Feature, STATE, Scalar, Source};
use crate::error::DatasetError;
use crate::export::rows::RowView;
use crate::spec::Spec;

/// The frames of one press, in the order of their windows.
pub(super) struct Episode {
    pub(super) task: String,
    pub(super) length: usize,
    /// Values of every feature, frame by frame, with the precision of the file.
    pub(super) values: Vec<Vec<f64>>,
}

/// Where an episode stands in the export.
#[derive(Clone, Copy)]
pub(super) struct Place {
    /// Number of the episode.
    pub(super) episode: u64,
    /// Number of its first frame.
    pub(super) first: u64,
    /// Number of its task.
    pub(super) task: usize,
    /// Frames a second.
    pub(super) fps: u32,
}

impl Episode {
    /// An episode without frames, whose task is that of `row`.
    ///
    /// # Errors
    /// [`DatasetError`] when the row has no object.
    pub(super) fn new(spec: &Spec, features: &[Feature], row: &RowView<'_>) -> Result<Self, DatasetError> {
        Ok(Self {
            task: format!(
                "{} {}",
                if spec.drops() { "drop" } else { "press" },
                row.text("object")?
            ),
            length: 0,
            values: features.iter().map(|_| Vec::new()).collect(),
        })
    }

    /// Adds the frame of `row`.
    ///
    /// # Errors
    /// [`DatasetError`] when the row lacks a value or is not the next one of its press.
    pub(super) fn add(&mut self, features: &[Feature], row: &RowView<'_>) -> Result<(), DatasetError> {
        let window = row.number("window")?;
        #[expect(clippy::float_cmp, reason = "both are whole numbers")]
        if window != self.length as f64 {
            let problem = format!("`window` = {window}: the rows of a press are not in order");
            return Err(DatasetError::file(row.path(), problem));
        }
        for (feature, values) in features.iter().zip(&mut self.values) {
            if let Source::Row(fill) = feature.source {
                fill(row, values)?;
            }
        }
        self.length += 1;
        Ok(())
    }

    /// Fills the features that follow from others or from the place, and rounds all to the types of the file.
    pub(super) fn complete(&mut self, features: &[Feature], place: Place) {
        let state = features.iter().position(|feature| feature.key == STATE);
        let state = state.map_or_else(Vec::new, |k| self.values[k].clone());
        let width = state.len() / self.length.max(1);
        for (feature, values) in features.iter().zip(&mut self.values) {
            let frames = 0..self.length;
            match feature.source {
                Source::Row(_) => {}
                Source::NextState => {
                    values.extend_from_slice(&state[width..]);
                    values.extend_from_slice(&state[state.len() - width..]);
                }
                Source::Timestamp => values.extend(frames.map(|k| k as f64 / f64::from(place.fps))),
                Source::Frame => values.extend(frames.map(|k| k as f64)),
                Source::Episode => values.extend(frames.map(|_| place.episode as f64)),
                Source::Index => values.extend(frames.map(|k| (place.first + k as u64) as f64)),
                Source::Task => values.extend(frames.map(|_| place.task as f64)),
            }
            if feature.scalar == Scalar::F32 {
                values.iter_mut().for_each(|value| *value = f64::from(single(*value)));
            }
        }
    }
}

/// A value as files of single precision hold it.
#[expect(clippy::cast_possible_truncation, reason = "files hold single precision")]
pub(super) fn single(value: f64) -> f32 {
    value as f32
}

/// A value of a feature of whole numbers.
#[expect(clippy::cast_possible_truncation, reason = "whole numbers below 2^53")]
pub(super) fn integer(value: f64) -> i64 {
    value as i64
}
