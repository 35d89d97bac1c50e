//! A program that is sent lines.

use super::answers::refused;
use super::pipes::{Asked, Event, Pipes};
use super::process::{Process, in_words};
use super::{Settings, broken};
use crate::algorithm::{Algorithm, Answer, DecodeError, ExternalError};
use crate::windows::Window;
use serde_json::json;
use std::process::{Command, Stdio};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Time for a program that has closed a pipe to end by itself, so that the error can say with which status; no longer
/// than the limit of an answer.
const GRACE: Duration = Duration::from_secs(1);

/// The running program.
#[derive(Debug)]
pub(super) struct Stream {
    settings: Settings,
    process: Process,
    pipes: Pipes,
    /// Number of windows sent.
    asked: usize,
    /// Why no more windows are sent. All threads that come later get this error at once.
    failure: Option<ExternalError>,
    finished: bool,
}

impl Stream {
    /// Starts the program `shell` and sends it `header`.
    pub(super) fn start(
        settings: Settings,
        mut shell: Command,
        header: &serde_json::Value,
    ) -> Result<Self, ExternalError> {
        let command = &settings.command;
        let shell = shell.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = Process::start(shell).map_err(|e| broken(command, e))?;
        let child = process.child();
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(broken(command, std::io::ErrorKind::BrokenPipe.into()));
        };
        let pipes = Pipes::new(input, output, settings.valid.taxels);
        pipes.send(header.to_string());
        Ok(Self {
            settings,
            process,
            pipes,
            asked: 0,
            failure: None,
            finished: false,
        })
    }

    fn answer(&mut self, window: &Window<'_>) -> Result<Answer, ExternalError> {
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
    fn fail(&mut self, error: &ExternalError) {
        self.failure = Some(error.clone());
        // it has failed already
        let _ = self.process.end();
    }

    fn ask(&mut self, window: &Window<'_>) -> Result<Answer, ExternalError> {
        let deadline = Instant::now() + self.settings.limit;
        // what waits here was written before the question
        match self.pipes.waiting() {
            None | Some(Event::InputClosed) => {}
            Some(event) => return Err(self.unexpected(&event, deadline)),
        }
        let rows = window.phi.values().chunks_exact(window.phi.ncols());
        let phi = if window.signs.is_some() {
            json!(rows.map(signs).collect::<Vec<_>>())
        } else {
            json!(rows.collect::<Vec<_>>())
        };
        let question = json!({"m": window.y.len(), "phi": phi, "y": window.y, "volts": window.volts});
        self.asked += 1;
        self.pipes.ask(question.to_string());
        let line = match self.pipes.next_by(deadline) {
            Ok(Event::Line(line)) => line,
            Ok(event) => return Err(self.unexpected(&event, deadline)),
            Err(_) => return Err(self.late()),
        };
        self.settings
            .valid
            .line(&line)
            .map_err(|problem| refused(&self.settings.command, &self.window(), &problem))
    }

    /// The window that was asked last, in words.
    fn window(&self) -> String {
        format!("window {}", self.asked)
    }

    fn late(&self) -> ExternalError {
        let waited = match self.pipes.waits_for() {
            Asked::Write(0) => "reading the header".to_owned(),
            Asked::Write(window) => format!("reading window {window}"),
            Asked::Answer => format!("the answer to {} (does it flush its output?)", self.window()),
        };
        self.settings.late(waited)
    }

    /// The error of `event` in place of an answer.
    fn unexpected(&mut self, event: &Event, deadline: Instant) -> ExternalError {
        let command = self.settings.command.clone();
        match event {
            Event::Failed(error) => broken(&command, error.kind().into()),
            Event::Line(_) => self.surplus(self.asked + 1),
            Event::Surplus(line) => self.surplus(*line),
            Event::TooLong => {
                let problem = format!("a line of more than {} bytes", self.pipes.most_bytes());
                refused(&command, &format!("window {}", self.asked.max(1)), &problem)
            }
            Event::OutputEnd | Event::InputClosed => {
                let by = deadline.min(Instant::now() + GRACE);
                let has_ended = self.process.ends_by(by, || false);
                let how = match event {
                    _ if has_ended => format!("ended ({})", in_words(&self.process.end())),
                    Event::OutputEnd => "closed its output".to_owned(),
                    _ => "closed its input".to_owned(),
                };
                let waited = format!("window {}", self.asked.max(1));
                ExternalError::Ended { command, how, waited }
            }
        }
    }

    fn surplus(&self, line: usize) -> ExternalError {
        ExternalError::Surplus {
            command: self.settings.command.clone(),
            line,
            asked: self.asked,
        }
    }

    /// Tells the program that nothing comes any more, and waits for its end: it must write nothing else, and end well.
    /// Does nothing for a second time.
    pub(super) fn finish(&mut self) -> Result<(), ExternalError> {
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

    fn wait_for_end(&mut self) -> Result<(), ExternalError> {
        let deadline = Instant::now() + self.settings.limit;
        self.pipes.close();
        // the program may write for as long as it runs
        if !self.process.ends_by(deadline, || false) {
            return match self.pipes.waiting() {
                Some(event @ (Event::Line(_) | Event::Surplus(_) | Event::TooLong)) => {
                    Err(self.unexpected(&event, deadline))
                }
                _ => Err(self.settings.late("its end after the last answer".to_owned())),
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
            status => Err(ExternalError::Status {
                command: self.settings.command.clone(),
                status: in_words(&status),
            }),
        }
    }
}

fn signs(row: &[f64]) -> String {
    row.iter().map(|w| if *w > 0.0 { '+' } else { '-' }).collect()
}

/// A turn at the program.
pub(super) struct PipeLines<'a> {
    stream: &'a Mutex<Stream>,
}

impl<'a> PipeLines<'a> {
    pub(super) fn new(stream: &'a Mutex<Stream>) -> Self {
        Self { stream }
    }
}

impl Algorithm for PipeLines<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        // a thread that panicked while it held the program leaves it with an answer too many, which is noticed
        let mut stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        *answer = stream.answer(window)?;
        Ok(())
    }
}
