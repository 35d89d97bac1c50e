//! A program that is fed line by line.

use super::answer;
use crate::algorithm::{Algorithm, Answer, DecodeError, ExternalError};
use crate::labels::Labels;
use crate::training::TrainingData;
use crate::windows::Window;
use serde::Deserialize;
use serde_json::json;
use std::collections::BTreeMap;
use std::io::{self, BufRead as _, BufReader, BufWriter, Write as _};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Longest time that an answer may take.
const PATIENCE: Duration = Duration::from_secs(60);
/// Time that a program is given to end by itself, and between two looks whether it has.
const GRACE: [Duration; 2] = [Duration::from_secs(2), Duration::from_millis(5)];

/// The running program.
#[derive(Debug)]
pub(super) struct Stream {
    command: String,
    child: Child,
    /// `None` once it has been told that nothing comes any more.
    input: Option<BufWriter<ChildStdin>>,
    /// Lines of its output, which a thread of their own reads; `None` once nobody listens any more.
    lines: Option<Receiver<io::Result<String>>>,
    /// Whether it has kept an answer back for too long.
    silent: bool,
}

/// Hands over one line at a time, until the output ends or nobody listens.
fn read_lines(output: ChildStdout, lines: &SyncSender<io::Result<String>>) {
    for line in BufReader::new(output).lines() {
        let failed = line.is_err();
        if lines.send(line).is_err() || failed {
            return;
        }
    }
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
        data: &TrainingData,
        labels: &Labels,
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
        let (sender, lines) = sync_channel(1);
        thread::spawn(move || read_lines(output, &sender));
        let mut stream = Self {
            command: command.to_owned(),
            child,
            input: Some(BufWriter::new(input)),
            lines: Some(lines),
            silent: false,
        };
        let [rows, cols] = data.shape;
        stream.send(&json!({
            "taxels": data.images.nrows(), "rows": rows, "cols": cols,
            "left_out": left_out, "learn": learn, "classes": class_names(data, labels),
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

    /// Closes both pipes, which ends a program that reads or writes, and after some grace the program.
    fn finish(&mut self) -> Option<ExitStatus> {
        self.input = None;
        self.lines = None;
        let begin = Instant::now();
        while begin.elapsed() < GRACE[0] {
            if let Some(status) = self.child.try_wait().ok()? {
                return Some(status);
            }
            thread::sleep(GRACE[1]);
        }
        // one that has ended meanwhile cannot be killed, and need not be
        let _ = self.child.kill();
        self.child.wait().ok()
    }

    fn ended(&mut self) -> ExternalError {
        let status = self.finish();
        if self.silent {
            return ExternalError::Silent {
                command: self.command.clone(),
                seconds: PATIENCE.as_secs(),
            };
        }
        ExternalError::Ended {
            command: self.command.clone(),
            status: status.map_or_else(|| "unknown".to_owned(), |s| s.to_string()),
        }
    }

    /// The next line of the program.
    fn line(&mut self) -> Result<String, ExternalError> {
        let received = self.lines.as_ref().map(|lines| lines.recv_timeout(PATIENCE));
        match received {
            Some(Ok(Ok(line))) => Ok(line),
            Some(Ok(Err(source))) => Err(ExternalError::Pipe {
                command: self.command.clone(),
                source,
            }),
            Some(Err(RecvTimeoutError::Timeout)) => {
                self.silent = true;
                Err(self.ended())
            }
            Some(Err(RecvTimeoutError::Disconnected)) | None => Err(self.ended()),
        }
    }

    fn ask(&mut self, window: &Window<'_>) -> Result<Answer, ExternalError> {
        let taxels = window.phi.ncols();
        let rows = window.phi.values().chunks_exact(taxels);
        let phi = if window.signs.is_some() {
            json!(rows.map(signs).collect::<Vec<_>>())
        } else {
            json!(rows.collect::<Vec<_>>())
        };
        self.send(&json!({"m": window.y.len(), "phi": phi, "y": window.y, "volts": window.volts}))?;
        let line = self.line()?;
        let parsed: Line = serde_json::from_str(&line).map_err(|e| ExternalError::Answer {
            command: self.command.clone(),
            problem: format!("`{}`: {e}", line.trim_end().chars().take(80).collect::<String>()),
        })?;
        answer(&self.command, taxels, parsed.image, parsed.label)
    }
}

impl Drop for Stream {
    fn drop(&mut self) {
        self.finish();
    }
}

/// Names of the classes of the training images, by number.
fn class_names<'a>(data: &TrainingData, labels: &'a Labels) -> BTreeMap<usize, &'a str> {
    let numbers = data.library.labels().iter();
    numbers
        .filter_map(|&number| Some((number, labels.name(number)?)))
        .collect()
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
        // a thread that panicked while it held the program leaves it with an answer too few, which is noticed
        let mut stream = self.stream.lock().unwrap_or_else(PoisonError::into_inner);
        *answer = stream.ask(window)?;
        Ok(())
    }
}
