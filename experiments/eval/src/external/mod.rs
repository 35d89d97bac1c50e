//! External algorithms: any command that reads windows and answers with images or labels.
//!
//! The command runs once and is sent lines. The first line is a header `{"taxels": …, "rows": …, "cols": …, "left_out":
//! …, "classes": {"1": "brain", …}, "learn": {"images": [[…], …], "labels": […]}}`, with the raster images that may be
//! learned from and their classes. Each further line is one window, `{"m": …, "phi": ["+-+…", …], "y": […], "volts":
//! […]}`, with one string of signs for each measurement or, if weights are not ±1, one array of numbers. The program
//! answers each window with a line `{"image": […]}` or `{"label": …}` (null: unknown) or both, before it waits for the
//! next window. When its input ends, it must end with status 0.
//!
//! A command may also be a Python file with a class of methods `fit(train)` and `predict(phi, y)`, for which a program
//! of ours speaks (docs/benchmark.md).
//!
//! A label must be one of the header's classes, and an image must have one finite value a taxel. Any other answer, an
//! additional answer, a bad exit status, or exceeding [`ExternalCommand::limit`] for a window ends the scoring with an
//! error. When `spts` ends, for whatever reason, it also ends the program and all processes in its group.

mod program;

use crate::algorithm::{Algorithm, Answer, Class, Contender, DecodeError, Trained};
use crate::labels::Labels;
use crate::training::TrainingData;
use crate::windows::Window;
use program::{Asked, Event, Pipes, Process, in_words};
use serde::Deserialize;
use serde_json::json;
use spts_input::Refusal;
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

/// A program and its name on the board.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ExternalCommand {
    /// Name.
    pub name: String,
    /// The command for the shell, or a Python file with a class.
    pub command: String,
    /// Time limit for the answer to a window, and for the end after the last answer. Range:
    /// [`ExternalCommand::LIMIT_S`].
    pub limit: Duration,
    /// Time limit for the first answer, which a program may have to learn for.
    pub first: Duration,
}

impl ExternalCommand {
    /// Range of [`ExternalCommand::limit`], s: from the time in which a shell starts to a day.
    pub const LIMIT_S: [f64; 2] = [0.1, 86_400.0];
    /// Default of [`ExternalCommand::limit`].
    pub const DEFAULT_LIMIT: Duration = Duration::from_secs(60);

    /// Parses `NAME=COMMAND`, or a command that is its own name. A name has only letters, digits, `-` and `_`. A class
    /// in a Python file has the name of the file.
    pub fn parse(text: &str) -> Self {
        let is_name = |s: &str| !s.is_empty() && s.chars().all(|c| c.is_alphanumeric() || "-_".contains(c));
        let own =
            if class_of(text).is_some() { Path::new(text).file_stem().and_then(|stem| stem.to_str()) } else { None };
        let own = (own.unwrap_or(text), text);
        let (name, command) = text.split_once('=').filter(|(name, _)| is_name(name)).unwrap_or(own);
        let (limit, first) = (Self::DEFAULT_LIMIT, Self::DEFAULT_LIMIT);
        Self { name: name.to_owned(), command: command.to_owned(), limit, first }
    }
}

/// Program in Python that speaks for a class.
const ADAPTER: &str = include_str!("../../assets/entrant.py");
/// Largest file of a class, bytes.
const MOST_BYTES: u64 = 10_000_000;

/// The text of the Python file `command`, if it is one with a class that has a method `predict` or `read`.
pub fn class_of(command: &str) -> Option<String> {
    let path = Path::new(command);
    let python = path.extension().is_some_and(|extension| extension == "py") && path.is_file();
    let text = if python { spts_input::read_text(path, MOST_BYTES).ok()? } else { return None };
    ["predict", "read"].iter().any(|method| text.contains(&format!("def {method}("))).then_some(text)
}

/// What the shell runs for `command`.
fn program_of(command: &str) -> String {
    let quoted = |text: &str| format!("'{}'", text.replace('\'', "'\\''"));
    match class_of(command) {
        Some(_) => format!("python3 -c {} {}", quoted(ADAPTER), quoted(command)),
        None => command.to_owned(),
    }
}

impl ExternalCommand {
    /// Starts the program with its header, which has `more` entries of its own beside the usual ones. An answer has at
    /// most `values` numbers.
    ///
    /// # Errors
    /// [`Refusal`] if it cannot be started.
    pub fn begin(
        &self,
        data: &TrainingData,
        labels: &Labels,
        left_out: Option<&str>,
        more: &serde_json::Map<String, serde_json::Value>,
        values: usize,
    ) -> Result<External, Refusal> {
        let valid = Valid::new(data, labels, left_out);
        let ([rows, cols], images) = (data.shape, data.library.images());
        let images: Vec<Vec<f64>> = (0..images.ncols()).map(|k| images.column(k)).collect();
        let mut header = json!({
            "taxels": valid.taxels, "rows": rows, "cols": cols, "left_out": left_out, "classes": valid.classes,
            "learn": {"images": images, "labels": data.library.labels()},
        });
        if let Some(header) = header.as_object_mut() {
            header.extend(more.clone());
        }
        Ok(External(Mutex::new(Stream::start(self, valid, &header, values)?)))
    }
}

impl Contender for ExternalCommand {
    fn name(&self) -> &str {
        &self.name
    }

    fn learn(&self, data: &TrainingData, labels: &Labels, left_out: Option<&str>) -> Result<Arc<dyn Trained>, Refusal> {
        Ok(Arc::new(self.begin(data, labels, left_out, &serde_json::Map::new(), data.images.nrows())?))
    }
}

/// A program at work, asked by all threads in turn.
pub struct External(Mutex<Stream>);

impl External {
    /// Sends `question` as a line, and reads the line that answers it.
    ///
    /// # Errors
    /// [`Refusal`] of a program that does not answer, or not with JSON.
    pub fn ask(&self, question: &serde_json::Value) -> Result<serde_json::Value, Refusal> {
        let mut stream = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(failure) = &stream.failure {
            return Err(failure.clone());
        }
        let answer = stream.exchange(question).and_then(|line| {
            let text = String::from_utf8_lossy(&line).into_owned();
            serde_json::from_str(&text).map_err(|e| stream.refused(&stream.window(), &format!("no JSON ({e})")))
        });
        if let Err(error) = &answer {
            stream.fail(error);
        }
        answer
    }

    /// Ends the program, which answered with this `problem`.
    pub fn refused(&self, problem: &str) -> Refusal {
        let mut stream = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let error = stream.refused(&stream.window(), problem);
        stream.fail(&error);
        error
    }
}

impl Trained for External {
    fn start(&self) -> Box<dyn Algorithm + '_> {
        Box::new(Turn(&self.0))
    }

    fn finish(&self) -> Result<(), DecodeError> {
        let mut stream = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        stream.finish().map_err(DecodeError::External)
    }
}

/// The error of a command or its pipes.
fn broken(command: &str, source: std::io::Error) -> Refusal {
    Refusal::from_error(source).at(format_args!("`{command}`"))
}

/// Time for a program that has closed a pipe to end by itself, so that the error can say with which status; no longer
/// than the limit of an answer.
const GRACE: Duration = Duration::from_secs(1);

/// The running program.
#[derive(Debug)]
struct Stream {
    /// The command as the user wrote it.
    command: String,
    limit: Duration,
    first: Duration,
    valid: Valid,
    process: Process,
    pipes: Pipes,
    /// Number of windows sent.
    asked: usize,
    /// Why no more windows are sent. All threads that come later get this error at once.
    failure: Option<Refusal>,
    finished: bool,
}

impl Stream {
    /// Starts `command` and sends it `header`.
    fn start(
        ExternalCommand { command, limit, first, .. }: &ExternalCommand,
        valid: Valid,
        header: &serde_json::Value,
        values: usize,
    ) -> Result<Self, Refusal> {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(program_of(command)).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = Process::start(&mut shell).map_err(|e| broken(command, e))?;
        let child = process.child();
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(broken(command, std::io::ErrorKind::BrokenPipe.into()));
        };
        let pipes = Pipes::new(input, output, values);
        pipes.send(header.to_string());
        Ok(Self {
            command: command.clone(),
            limit: *limit,
            first: *first,
            valid,
            process,
            pipes,
            asked: 0,
            failure: None,
            finished: false,
        })
    }

    fn answer(&mut self, window: &Window<'_>) -> Result<Answer, Refusal> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        let answer = self.ask(window);
        if let Err(error) = &answer {
            self.fail(error);
        }
        answer
    }

    /// Ends the program, which is not asked any more.
    fn fail(&mut self, error: &Refusal) {
        self.failure = Some(error.clone());
        // it has failed already
        let _ = self.process.end();
    }

    fn ask(&mut self, window: &Window<'_>) -> Result<Answer, Refusal> {
        let mut numbers = Vec::new();
        let rows = window.with_rows(&mut numbers).phi;
        let rows = rows.values().chunks_exact(rows.ncols());
        let phi = if window.signs.is_some() {
            json!(rows.map(signs).collect::<Vec<_>>())
        } else {
            json!(rows.collect::<Vec<_>>())
        };
        let line = self.exchange(&json!({"m": window.y.len(), "phi": phi, "y": window.y, "volts": window.volts}))?;
        self.valid.line(&line).map_err(|problem| self.refused(&self.window(), &problem))
    }

    /// Sends `question`, and gives the line that answers it.
    fn exchange(&mut self, question: &serde_json::Value) -> Result<Vec<u8>, Refusal> {
        let deadline = Instant::now() + self.now();
        // what waits here was written before the question
        match self.pipes.waiting() {
            None | Some(Event::InputClosed) => {}
            Some(event) => return Err(self.unexpected(&event, deadline)),
        }
        self.asked += 1;
        self.pipes.ask(question.to_string());
        match self.pipes.next_by(deadline) {
            Ok(Event::Line(line)) => Ok(line),
            Ok(event) => Err(self.unexpected(&event, deadline)),
            Err(_) => Err(self.late()),
        }
    }

    /// The limit of what is asked now.
    fn now(&self) -> Duration {
        if self.asked == 0 { self.first } else { self.limit }
    }

    /// The window that was asked last, in words.
    fn window(&self) -> String {
        format!("window {}", self.asked)
    }

    /// The error of what was waited for.
    fn too_late(&self, waited: String) -> Refusal {
        Refusal::new(format!(
            "`{}` was ended: {waited} took longer than the limit of {} s",
            self.command,
            if self.asked > 1 { self.limit } else { self.first }.as_secs_f64()
        ))
    }

    /// The error of an answer to `window` with a problem.
    fn refused(&self, window: &str, problem: &str) -> Refusal {
        Refusal::new(format!("`{}` answered {window} with {problem}", self.command))
    }

    fn late(&self) -> Refusal {
        let waited = match self.pipes.waits_for() {
            Asked::Write(0) => "reading the header".to_owned(),
            Asked::Write(window) => format!("reading window {window}"),
            Asked::Answer => format!("the answer to {} (does it flush its output?)", self.window()),
        };
        self.too_late(waited)
    }

    /// The error of `event` in place of an answer.
    fn unexpected(&mut self, event: &Event, deadline: Instant) -> Refusal {
        match event {
            Event::Failed(error) => broken(&self.command, error.kind().into()),
            Event::Line(_) => self.surplus(self.asked + 1),
            Event::Surplus(line) => self.surplus(*line),
            Event::TooLong => {
                let problem = format!("a line of more than {} bytes", self.pipes.most_bytes());
                self.refused(&format!("window {}", self.asked.max(1)), &problem)
            }
            Event::OutputEnd | Event::InputClosed => {
                let by = deadline.min(Instant::now() + GRACE);
                let has_ended = self.process.ends_by(by);
                let how = match event {
                    _ if has_ended => format!("ended ({})", in_words(&self.process.end())),
                    Event::OutputEnd => "closed its output".to_owned(),
                    _ => "closed its input".to_owned(),
                };
                let (command, waited) = (&self.command, self.asked.max(1));
                Refusal::new(format!("`{command}` {how} before it had answered window {waited}"))
            }
        }
    }

    fn surplus(&self, line: usize) -> Refusal {
        let Self { command, asked, .. } = self;
        Refusal::new(format!(
            "`{command}` wrote line {line} of its output before it had read window {line} ({asked} windows had been \
             sent); it must write one line a window, after reading the window"
        ))
    }

    /// Tells the program that nothing comes any more, and waits for its end: it must write nothing else, and end well.
    /// Does nothing for a second time.
    fn finish(&mut self) -> Result<(), Refusal> {
        if let Some(failure) = &self.failure {
            return Err(failure.clone());
        }
        if self.finished {
            return Ok(());
        }
        self.finished = true;
        let finished = self.wait_for_end();
        if let Err(error) = &finished {
            self.fail(error);
        }
        finished
    }

    fn wait_for_end(&mut self) -> Result<(), Refusal> {
        let deadline = Instant::now() + self.limit;
        self.pipes.close();
        // the program may write for as long as it runs
        if !self.process.ends_by(deadline) {
            return match self.pipes.waiting() {
                Some(event @ (Event::Line(_) | Event::Surplus(_) | Event::TooLong)) => {
                    Err(self.unexpected(&event, deadline))
                }
                _ => Err(self.too_late("its end after the last answer".to_owned())),
            };
        }
        // what it has started ends with it, so that nothing holds its output open
        let status = self.process.end();
        loop {
            match self.pipes.next_by(Instant::now() + GRACE) {
                Ok(Event::InputClosed) => {}
                // a process that has left the group may hold the output open
                Ok(Event::OutputEnd) | Err(RecvTimeoutError::Timeout | RecvTimeoutError::Disconnected) => break,
                Ok(event) => return Err(self.unexpected(&event, deadline)),
            }
        }
        match status {
            Ok(status) if status.success() => Ok(()),
            status => Err(Refusal::new(format!(
                "`{}` ended with an error ({}) after its last answer; its answers are not scored",
                self.command,
                in_words(&status)
            ))),
        }
    }
}

fn signs(row: &[f64]) -> String {
    row.iter().map(|w| if *w > 0.0 { '+' } else { '-' }).collect()
}

/// A turn at the program.
struct Turn<'a>(&'a Mutex<Stream>);

impl Algorithm for Turn<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        // a thread that panicked while it held the program leaves it with an answer too many, which is noticed
        let mut stream = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        *answer = stream.answer(window).map_err(DecodeError::External)?;
        Ok(())
    }
}

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
struct Valid {
    /// Number of values in an image.
    taxels: usize,
    /// Names of the classes by number, as sent to the program.
    classes: BTreeMap<usize, String>,
    /// Number of the left-out object: a correct answer, although not one of the classes.
    left_out: Option<usize>,
}

impl Valid {
    /// Classes are those of the training images; all of `labels` where the images have none.
    fn new(data: &TrainingData, labels: &Labels, left_out: Option<&str>) -> Self {
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
    fn label(&self, value: f64) -> Result<usize, String> {
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
    fn line(&self, line: &[u8]) -> Result<Answer, String> {
        let text = String::from_utf8_lossy(line);
        let parsed: Line = serde_json::from_str(&text).map_err(|e| {
            let start: String = text.trim_end().chars().take(QUOTED).collect();
            format!("`{}` ({e})", start.escape_debug())
        })?;
        let label = parsed.label.map(|label| label.map(|value| self.label(value)).transpose());
        self.answer(parsed.image, label.transpose()?)
    }

    /// The answer with `image` and `label`; a label of `None` is an unknown class.
    ///
    /// # Errors
    /// What is wrong with it.
    fn answer(&self, image: Option<Vec<f64>>, label: Option<Option<usize>>) -> Result<Answer, String> {
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
    let valid =
        Valid { taxels, classes: (1..=classes).map(|number| (number, number.to_string())).collect(), left_out: None };
    valid.line(line)
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
        let valid =
            Valid { taxels: 2, classes: [(1, "brain".to_owned()), (4, "rec".to_owned())].into(), left_out: Some(7) };
        for bad in [-2.0, -1.0, 0.0, 1.5, 2.0, 99.0, 1e300, f64::NAN, f64::INFINITY] {
            let said = valid.label(bad).unwrap_err();
            assert!(said.contains("valid: 1, 4"), "{said}");
        }
        assert_eq!((valid.label(4.0), valid.label(7.0)), (Ok(4), Ok(7)));
        assert!(valid.answer(Some(vec![1.0]), None).is_err());
        assert!(valid.answer(Some(vec![]), Some(Some(1))).is_err());
        assert!(valid.answer(Some(vec![1.0, f64::NAN]), None).unwrap_err().contains("NaN at taxel 1"));
        assert!(valid.answer(None, None).is_err());
        assert_eq!(valid.answer(None, Some(None)).unwrap().class, Some(Class::Unknown));
        assert_eq!(valid.answer(Some(vec![1.0, 2.0]), None).unwrap().class, None);
    }
}
