//! A program that is fed line by line.

use super::{ExternalError, answer};
use crate::board::algorithm::{Algorithm, Answer, DecodeError};
use crate::board::window::Window;
use crate::learn::Lessons;
use serde::Deserialize;
use serde_json::json;
use std::io::{BufRead as _, BufReader, BufWriter, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// The running program.
#[derive(Debug)]
pub(super) struct Stream {
    command: String,
    child: Child,
    /// `None` once it has been told that nothing comes any more.
    input: Option<BufWriter<ChildStdin>>,
    output: BufReader<ChildStdout>,
}

/// A line of the program's output.
#[derive(Debug, Deserialize)]
struct Line {
    image: Option<Vec<f64>>,
    #[serde(default, deserialize_with = "given")]
    label: Option<Option<usize>>,
}

/// Tells `"label": null` from no label.
fn given<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Option<Option<usize>>, D::Error> {
    Option::deserialize(deserializer).map(Some)
}

impl Stream {
    pub(super) fn start(
        command: &str,
        lessons: &Lessons,
        left_out: Option<&str>,
        learn: &Path,
    ) -> Result<Self, ExternalError> {
        let pipe = |source| ExternalError::Pipe {
            command: command.to_owned(),
            source,
        };
        let mut child = Command::new("sh")
            .args(["-c", command])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(pipe)?;
        let (Some(input), Some(output)) = (child.stdin.take(), child.stdout.take()) else {
            return Err(pipe(std::io::ErrorKind::BrokenPipe.into()));
        };
        let mut stream = Self {
            command: command.to_owned(),
            child,
            input: Some(BufWriter::new(input)),
            output: BufReader::new(output),
        };
        let [rows, cols] = lessons.shape;
        stream.send(&json!({
            "taxels": lessons.images.nrows(), "rows": rows, "cols": cols,
            "left_out": left_out, "learn": learn,
        }))?;
        Ok(stream)
    }

    fn send(&mut self, value: &serde_json::Value) -> Result<(), ExternalError> {
        let sent = self
            .input
            .as_mut()
            .map_or(Ok(()), |input| writeln!(input, "{value}").and_then(|()| input.flush()));
        match sent {
            Ok(()) => Ok(()),
            Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Err(self.ended()),
            Err(source) => Err(ExternalError::Pipe {
                command: self.command.clone(),
                source,
            }),
        }
    }

    fn ended(&mut self) -> ExternalError {
        self.input = None;
        let status = self.child.wait();
        ExternalError::Ended {
            command: self.command.clone(),
            status: status.map_or_else(|e| e.to_string(), |s| s.to_string()),
        }
    }

    fn ask(&mut self, window: &Window<'_>) -> Result<Answer, ExternalError> {
        let taxels = window.phi.ncols();
        let phi: Vec<String> = window.phi.values().chunks_exact(taxels).map(signs).collect();
        self.send(&json!({"m": window.y.len(), "phi": phi, "y": window.y, "volts": window.volts}))?;
        let mut line = String::new();
        match self.output.read_line(&mut line) {
            Ok(0) => return Err(self.ended()),
            Ok(_) => {}
            Err(source) => {
                return Err(ExternalError::Pipe {
                    command: self.command.clone(),
                    source,
                });
            }
        }
        let parsed: Line = serde_json::from_str(&line).map_err(|e| ExternalError::Answer {
            command: self.command.clone(),
            problem: format!("`{}`: {e}", line.trim_end().chars().take(80).collect::<String>()),
        })?;
        answer(&self.command, taxels, parsed.image, parsed.label)
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        // the end of its input ends the program; nothing is owed to one that does not listen
        self.input = None;
        let _ = self.child.wait();
    }
}

fn signs(row: &[f64]) -> String {
    row.iter().map(|w| if *w > 0.0 { '+' } else { '-' }).collect()
}

/// A turn at the program.
pub(super) struct Lines<'a> {
    stream: &'a Mutex<Stream>,
}

impl<'a> Lines<'a> {
    pub(super) fn new(stream: &'a Mutex<Stream>) -> Self {
        Self { stream }
    }
}

impl Algorithm for Lines<'_> {
    fn decode(&mut self, window: &Window<'_>, answer: &mut Answer) -> Result<(), DecodeError> {
        // a thread that panicked while it held the program leaves it with an answer too few, which is noticed
        let mut stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        *answer = stream.ask(window)?;
        Ok(())
    }
}
