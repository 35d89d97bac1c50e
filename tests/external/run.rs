//! A run of `spts score` with an external program, and the processes that it leaves behind.

use crate::command::SPTS;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Limit of a program, s.
pub(super) const LIMIT_S: f64 = 3.0;
/// Time beyond the limit until the program and everything of it has to be gone, s.
pub(super) const SLACK_S: f64 = 5.0;

/// Longest time until the program begins.
const START: Duration = Duration::from_secs(120);

/// Every copy of the program runs this first: the time is in the file before any copy goes on, even
/// if another copy is ended while it writes.
const STARTS: &str = "[ -e \"$STARTED\" ] || \
    { date +%s.%N > \"$STARTED.$$\"; mv \"$STARTED.$$\" \"$STARTED\"; }; ";

/// A run of `spts score` with one program, in a folder of its own.
pub(super) struct Run {
    parent: tempfile::TempDir,
    /// File that the program writes when it begins.
    started: PathBuf,
    /// What finds its processes again: a variable of their environment.
    marker: String,
}

impl Run {
    pub(super) fn new() -> Self {
        let parent = tempfile::tempdir().unwrap();
        Self {
            started: parent.path().join("started"),
            marker: format!("SPTS_TEST_MARKER={}", parent.path().display()),
            parent,
        }
    }

    pub(super) fn command(&self, sessions: &Path, program: &str, limit_s: f64) -> Command {
        let (name, value) = self.marker.split_once('=').unwrap();
        let mut command = Command::new(SPTS);
        command
            .args([
                "score",
                sessions.to_str().unwrap(),
                "--measurements",
                "100",
                "--no-times",
                "--learn-from",
                "raster",
            ])
            .args(["--external-timeout", &limit_s.to_string(), "--threads", "2"])
            .args(["--external", &format!("x={STARTS}{program}")])
            .env("STARTED", &self.started)
            .env_remove("PYTHONUNBUFFERED")
            .env(name, value)
            .current_dir(self.parent.path())
            .stdin(Stdio::null());
        command
    }

    pub(super) fn output(&self, sessions: &Path, program: &str) -> Output {
        self.command(sessions, program, LIMIT_S).output().unwrap()
    }

    /// Waits until the program has begun.
    pub(super) fn wait_for_start(&self) {
        let begin = Instant::now();
        while !self.started.exists() && begin.elapsed() < START {
            sleep(Duration::from_millis(20));
        }
    }

    /// Time since the program began, s.
    pub(super) fn since_start_s(&self) -> f64 {
        let began: f64 = std::fs::read_to_string(&self.started).unwrap().trim().parse().unwrap();
        SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64() - began
    }

    /// Processes of the run that still are there.
    pub(super) fn orphans(&self) -> Vec<String> {
        let mut found = Vec::new();
        for entry in std::fs::read_dir("/proc").unwrap().flatten() {
            let environment = std::fs::read(entry.path().join("environ")).unwrap_or_default();
            if environment.split(|b| *b == 0).any(|v| v == self.marker.as_bytes()) {
                let command = std::fs::read(entry.path().join("cmdline")).unwrap_or_default();
                found.push(String::from_utf8_lossy(&command).replace('\0', " "));
            }
        }
        found
    }
}
