//! External algorithms: any command that reads windows and answers with images or labels.
//!
//! A command without placeholders runs once and is sent lines. The first line is a header `{"taxels": …, "rows": …,
//! "cols": …, "left_out": …, "learn": …, "classes": {"1": "brain", …}}`. Each further line is one window, `{"m": …,
//! "phi": ["+-+…", …], "y": […], "volts": […]}`, with one string of signs for each measurement or, if weights are not
//! ±1, one array of numbers. The program answers each window with a line `{"image": […]}` or `{"label": …}` (null:
//! unknown) or both, before it waits for the next window. When its input ends, it must end with status 0.
//!
//! A command with `{windows}` and `{answers}` runs once for every press and M. The first is an .npz file with `phi`
//! (windows × M × taxels, int8; float64 if weights are not ±1), `y` and `volts` (windows × M). The second is the .npz
//! file that the program writes, with only `images` (windows × taxels), `labels` (windows; −1: unknown), or both.
//! `{learn}`, like the header's `learn`, is an .npz file with the raster images (images × taxels) and labels for
//! training. Placeholders are written without quotes: each becomes one word of the shell, whatever the path contains.
//! The environment also holds the paths: `SPTS_LEARN`, `SPTS_WINDOWS`, `SPTS_ANSWERS`.
//!
//! A label must be one of the header's classes, and an image must have one finite value a taxel. Any other answer, an
//! additional answer, a bad exit status, or exceeding [`ExternalCommand::limit`] for a window or a run ends the scoring
//! with an error. When `spts` ends, for whatever reason, it also ends the program and all processes in its group. If
//! `spts` itself is killed (SIGKILL), the next run removes its temporary folder.

mod answers;
mod batch;
mod exchange;
mod pipes;
mod process;
mod stream;

use crate::algorithm::{Algorithm, Contender, DecodeError, ExternalError, Trained};
use crate::error::ScoreError;
use crate::labels::Labels;
use crate::npz::{self, NpzArray};
use crate::training::TrainingData;
use answers::Valid;
pub use answers::check_line;
use exchange::{Exchange, PLACEHOLDERS, shell};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};
use std::time::Duration;
use stream::Stream;

/// A program and its name on the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternalCommand {
    /// Name.
    pub name: String,
    /// The command for the shell.
    pub command: String,
    /// Time limit for the answer to a window, for the end after the last answer, and for one run on files. Range:
    /// [`ExternalCommand::LIMIT_S`].
    pub limit: Duration,
}

impl ExternalCommand {
    /// Range of [`ExternalCommand::limit`], s: from the time in which a shell starts to a day.
    pub const LIMIT_S: [f64; 2] = [0.1, 86_400.0];
    /// Default of [`ExternalCommand::limit`].
    pub const DEFAULT_LIMIT: Duration = Duration::from_secs(60);

    /// Parses `NAME=COMMAND`, or a command that is its own name. A name has only letters, digits, `-` and `_`.
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
            limit: Self::DEFAULT_LIMIT,
        }
    }
}

impl Contender for ExternalCommand {
    fn name(&self) -> &str {
        &self.name
    }

    fn learn(
        &self,
        data: &TrainingData,
        labels: &Labels,
        left_out: Option<&str>,
    ) -> Result<Arc<dyn Trained>, ScoreError> {
        Ok(Arc::new(External::start(self, data, labels, left_out)?))
    }
}

/// What every way of speaking with a program needs.
#[derive(Debug, Clone)]
struct Settings {
    /// The command as the user wrote it.
    command: String,
    limit: Duration,
    valid: Valid,
}

impl Settings {
    /// The error of what was waited for.
    fn late(&self, waited: String) -> ExternalError {
        ExternalError::Late {
            command: self.command.clone(),
            waited,
            limit: self.limit,
        }
    }
}

/// A command with its exchange folder.
pub(crate) struct External {
    settings: Settings,
    /// The program that is sent lines; `None` for one run a press. It ends before its folder is removed.
    stream: Option<Mutex<Stream>>,
    /// The first error of a run on files.
    failure: OnceLock<ExternalError>,
    /// File of the training data.
    learn: PathBuf,
    exchange: Exchange,
}

impl External {
    /// Starts `command` with the training data `data`, whose classes have their names in `labels`; without the object
    /// `left_out`.
    ///
    /// # Errors
    /// [`ExternalError`] when the exchange files cannot be written or the command does not start.
    pub(crate) fn start(
        command: &ExternalCommand,
        data: &TrainingData,
        labels: &Labels,
        left_out: Option<&str>,
    ) -> Result<Self, ExternalError> {
        let exchange = Exchange::new()?;
        let learn = exchange.path("learn.npz");
        write_training_data(&learn, data)?;
        let settings = Settings {
            command: command.command.clone(),
            limit: command.limit,
            valid: Valid::new(data, labels, left_out),
        };
        let [_, in_files @ ..] = PLACEHOLDERS;
        let stream = if in_files
            .iter()
            .any(|(placeholder, _)| settings.command.contains(placeholder))
        {
            None
        } else {
            let [rows, cols] = data.shape;
            let header = json!({
                "taxels": settings.valid.taxels, "rows": rows, "cols": cols, "left_out": left_out,
                "learn": learn.to_string_lossy(), "classes": settings.valid.classes,
            });
            let shell = shell(&settings.command, &[Some(&learn), None, None]);
            Some(Mutex::new(Stream::start(settings.clone(), shell, &header)?))
        };
        Ok(Self {
            settings,
            stream,
            failure: OnceLock::new(),
            learn,
            exchange,
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
        source: Arc::new(source),
    }
}

/// The error of a command or its pipes.
fn broken(command: &str, source: std::io::Error) -> ExternalError {
    ExternalError::Pipe {
        command: command.to_owned(),
        source: Arc::new(source),
    }
}

impl Trained for External {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        match &self.stream {
            Some(stream) => Box::new(stream::PipeLines::new(stream)),
            None => Box::new(batch::Files {
                settings: &self.settings,
                exchange: &self.exchange,
                learn: &self.learn,
                failure: &self.failure,
            }),
        }
    }

    fn finish(&self) -> Result<(), DecodeError> {
        let Some(stream) = &self.stream else {
            return Ok(());
        };
        Ok(stream.lock().unwrap_or_else(PoisonError::into_inner).finish()?)
    }
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
}
