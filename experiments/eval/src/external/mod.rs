//! Algorithms outside this program: any command that reads windows and answers images or labels.
//!
//! Without placeholders the command runs once and is fed line by line: first a header
//! `{"taxels": …, "rows": …, "cols": …, "left_out": …, "learn": …, "classes": {"1": "brain", …}}`, then one JSON object
//! a window `{"m": …, "phi": ["+-+…", …], "y": […], "volts": […]}` with one string of signs a measurement, or, where
//! weights are not ±1, one array of numbers a measurement; it answers each with a line `{"image": […]}` or `{"label":
//! …}` (null: unknown) or both, and must not wait for the next one before it does. With `{windows}` and `{answers}` in
//! it the command runs for every press and M: the first is an .npz file with `phi` (windows × M × taxels, int8; float64
//! where weights are not ±1), `y` and `volts` (windows × M), the second the .npz file that it writes, with `images`
//! (windows × taxels) or `labels` (windows; −1: unknown). `{learn}`, like the header's `learn`, is an .npz file with
//! the raster images (images × taxels) and labels that may be learned from.

mod batch;
mod stream;

use crate::algorithm::{Algorithm, Answer, Class, ExternalError, Trained};
use crate::labels::Labels;
use crate::npz::{self, NpzArray};
use crate::training::TrainingData;
use std::path::Path;
use std::sync::Mutex;
use stream::Stream;
use tempfile::TempDir;

/// A program and its name on the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternalCommand {
    /// Name.
    pub name: String,
    /// What the shell runs.
    pub command: String,
}

impl ExternalCommand {
    /// `NAME=COMMAND`, or a command that is its own name. A name has letters, digits, `-` and `_` only.
    #[must_use]
    pub fn parse(text: &str) -> Self {
        let is_name = |s: &str| !s.is_empty() && s.chars().all(|c| c.is_alphanumeric() || "-_".contains(c));
        let (name, command) = text
            .split_once('=')
            .filter(|(name, _)| is_name(name))
            .unwrap_or((text, text));
        Self {
            name: name.to_owned(),
            command: command.to_owned(),
        }
    }
}

/// A command with its exchange folder.
pub(crate) struct External {
    command: String,
    /// Line by line, or `None` for a run a press.
    stream: Option<Mutex<Stream>>,
    /// Folder of the files that it is given; gone when dropped.
    exchange: TempDir,
    taxels: usize,
}

impl External {
    /// Starts `command` with the training data `data`, whose classes have their names in `labels`; without the object
    /// `left_out`.
    ///
    /// # Errors
    /// [`ExternalError`] when the exchange files cannot be written or the command does not start.
    pub(crate) fn start(
        command: &str,
        data: &TrainingData,
        labels: &Labels,
        left_out: Option<&str>,
    ) -> Result<Self, ExternalError> {
        let exchange = tempfile::Builder::new().prefix("spts-external-").tempdir();
        let exchange = exchange.map_err(|source| ExternalError::File {
            path: std::env::temp_dir(),
            source,
        })?;
        let learn = exchange.path().join("learn.npz");
        write_training_data(&learn, data)?;
        let command = command.replace("{learn}", &learn.display().to_string());
        let in_files = command.contains("{windows}") || command.contains("{answers}");
        let stream = if in_files {
            None
        } else {
            Some(Mutex::new(Stream::start(&command, data, labels, left_out, &learn)?))
        };
        Ok(Self {
            command,
            stream,
            exchange,
            taxels: data.images.nrows(),
        })
    }
}

fn write_training_data(path: &Path, data: &TrainingData) -> Result<(), ExternalError> {
    let (images, labels) = (data.library.images(), data.library.labels());
    let columns: Vec<f64> = (0..images.ncols()).flat_map(|k| images.column(k)).collect();
    let labels: Vec<f64> = labels.iter().map(|l| *l as f64).collect();
    npz::write(
        path,
        &[
            ("images", NpzArray::Doubles(&[labels.len(), images.nrows()], &columns)),
            ("labels", NpzArray::Doubles(&[labels.len()], &labels)),
        ],
    )
    .map_err(|source| in_file(path, source))
}

/// The error of an exchange file.
fn in_file(path: &Path, source: std::io::Error) -> ExternalError {
    ExternalError::File {
        path: path.to_owned(),
        source,
    }
}

impl Trained for External {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        match &self.stream {
            Some(stream) => Box::new(stream::PipeLines::new(stream)),
            None => Box::new(batch::Files::new(&self.command, self.exchange.path(), self.taxels)),
        }
    }
}

/// The answer with `image` and `label`, checked: an image has one finite value a taxel.
fn answer(
    command: &str,
    taxels: usize,
    image: Option<Vec<f64>>,
    label: Option<Option<usize>>,
) -> Result<Answer, ExternalError> {
    let image = image.unwrap_or_default();
    let complete = image.len() == taxels && image.iter().all(|v| v.is_finite());
    if !image.is_empty() && !complete {
        return Err(ExternalError::Answer {
            command: command.to_owned(),
            problem: format!("an image of {} values, needed are {taxels} finite ones", image.len()),
        });
    }
    if image.is_empty() && label.is_none() {
        return Err(ExternalError::Answer {
            command: command.to_owned(),
            problem: "neither an image nor a label".to_owned(),
        });
    }
    Ok(Answer {
        image,
        class: label.map(|l| l.map_or(Class::Unknown, Class::Known)),
        failed: false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_may_have_a_name() {
        let parsed = |text| {
            let parsed = ExternalCommand::parse(text);
            (parsed.name, parsed.command)
        };
        let own = |a: &str, b: &str| (a.to_owned(), b.to_owned());
        assert_eq!(parsed("mine=python3 x.py"), own("mine", "python3 x.py"));
        assert_eq!(parsed("A=1 B=2 run"), own("A", "1 B=2 run"));
        assert_eq!(parsed("run --key=value"), own("run --key=value", "run --key=value"));
    }

    #[test]
    fn answers_are_checked() {
        assert!(answer("c", 2, Some(vec![1.0]), None).is_err());
        assert!(answer("c", 2, Some(vec![1.0, f64::NAN]), None).is_err());
        assert!(answer("c", 2, None, None).is_err());
        assert_eq!(answer("c", 2, None, Some(None)).unwrap().class, Some(Class::Unknown));
        assert_eq!(answer("c", 2, Some(vec![1.0, 2.0]), None).unwrap().class, None);
    }
}
