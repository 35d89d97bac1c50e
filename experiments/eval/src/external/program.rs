//! A program run by the shell in its own process group, which is ended as a whole, and its two pipes. Each pipe has a
//! thread, so that a program that does not read or does not write cannot delay anybody beyond a deadline.

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use spts::cleanup::{Entry, Leftover, listed};
use std::io::{self, BufRead as _, BufReader, Read as _, Write as _};
use std::os::unix::process::CommandExt as _;
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Weak};
use std::thread;
use std::time::{Duration, Instant};

/// Time between two looks whether a program has ended.
const LOOK: Duration = Duration::from_millis(5);

/// What the keeper of a group runs: nobody writes to its input, which ends when `spts` does.
const KEEPER: &str = "read -r _; kill -KILL 0";

/// The running program. When dropped, it is ended with everything it has started, and so it is when `spts` ends, even
/// by SIGKILL. Processes that leave the group (`setsid`) are not followed.
#[derive(Debug)]
pub(super) struct Process {
    child: Child,
    leader: Pid,
    /// A member of the group that ends it if `spts` disappears.
    keeper: Option<Child>,
    /// `None` after the group was ended.
    entry: Option<Entry>,
}

impl Process {
    /// Starts `command` in a group of its own.
    ///
    /// # Errors
    /// [`io::Error`] when it does not start.
    pub(super) fn start(command: &mut Command) -> io::Result<Self> {
        let start = || {
            let child = command.process_group(0).spawn()?;
            let leader = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
            Ok((child, leader.ok_or(io::ErrorKind::InvalidData)?))
        };
        let ((child, leader), entry) = listed(start, |(_, leader)| Leftover::Group(*leader))?;
        // from here on an error ends the group
        let mut process = Self { child, leader, keeper: None, entry: Some(entry) };
        let mut keeper = Command::new("sh");
        keeper.args(["-c", KEEPER]).process_group(leader.as_raw_nonzero().get());
        keeper.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null());
        process.keeper = Some(keeper.spawn()?);
        Ok(process)
    }

    /// The pipes of the program.
    pub(super) fn child(&mut self) -> &mut Child {
        &mut self.child
    }

    /// Waits until the program has ended or the time is `deadline`. Returns whether it has ended. Its process number
    /// stays taken, so that [`Process::end`] finds no other group under it.
    pub(super) fn ends_by(&self, deadline: Instant) -> bool {
        loop {
            let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
            match waitid(WaitId::Pid(self.leader), look) {
                Ok(None) if Instant::now() < deadline => thread::sleep(LOOK),
                Ok(None) => return false,
                _ => return true,
            }
        }
    }

    /// Ends what still runs of the group. The exit status is the program's own if it had ended before.
    pub(super) fn end(&mut self) -> io::Result<ExitStatus> {
        if let Some(entry) = self.entry.take() {
            // a group of which nothing runs any more is no error
            let _ = kill_process_group(self.leader, Signal::KILL);
            drop(entry);
        }
        if let Some(mut keeper) = self.keeper.take() {
            // it has been ended with its group
            let _ = keeper.wait();
        }
        self.child.wait()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // a status that nobody has asked for
        let _ = self.end();
    }
}

/// The words of an exit status, or why there is none.
pub(super) fn in_words(status: &io::Result<ExitStatus>) -> String {
    match status {
        Ok(status) => status.to_string(),
        Err(error) => error.to_string(),
    }
}

/// Longest line of an answer: bytes a taxel, of which the 17 digits of a double, its sign, exponent and comma are 26,
/// and bytes for all else.
const LINE_BYTES: [usize; 2] = [64, 4096];

/// What comes of the pipes.
#[derive(Debug)]
pub(super) enum Event {
    /// A line of the output.
    Line(Vec<u8>),
    /// The line with this number, from 1, came before its window was sent or read. Reading ends.
    Surplus(usize),
    /// A line longer than any valid answer. Reading ends.
    TooLong,
    /// The output has ended.
    OutputEnd,
    /// The program has closed its input.
    InputClosed,
    /// The system reports an error.
    Failed(io::Error),
}

/// What a program has not done yet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    /// To read the line with this number: the header is 0, windows count from 1.
    Write(usize),
    /// To answer.
    Answer,
}

/// Counts that the threads share.
#[derive(Debug, Default)]
struct Counts {
    /// Number of windows handed to the writing thread.
    asked: AtomicUsize,
    /// Number of lines written to the pipe.
    written: AtomicUsize,
}

/// Both pipes.
#[derive(Debug)]
pub(super) struct Pipes {
    /// `None` after the last line has been sent.
    input: Option<Sender<String>>,
    events: Receiver<Event>,
    counts: Arc<Counts>,
    most_bytes: usize,
}

impl Pipes {
    /// Starts the threads for a program whose images have `taxels` values.
    pub(super) fn new(input: ChildStdin, output: ChildStdout, taxels: usize) -> Self {
        let counts = Arc::new(Counts::default());
        let (lines, to_write) = channel();
        let (events, received) = channel();
        let [a_taxel, more] = LINE_BYTES;
        let most_bytes = taxels.saturating_mul(a_taxel).saturating_add(more);
        let (shared, told) = (Arc::clone(&counts), events.clone());
        let input = Arc::new(input);
        let unread = Arc::downgrade(&input);
        thread::spawn(move || write_lines(&input, &to_write, &shared, &told));
        let shared = Arc::clone(&counts);
        thread::spawn(move || read_lines(output, most_bytes, &shared, &unread, &events));
        Self { input: Some(lines), events: received, counts, most_bytes }
    }

    /// Most bytes of a line of the output.
    pub(super) fn most_bytes(&self) -> usize {
        self.most_bytes
    }

    /// Hands over a line that has no answer.
    pub(super) fn send(&self, line: String) {
        if let Some(input) = &self.input {
            // a writing thread that has ended has said why
            let _ = input.send(line);
        }
    }

    /// Hands over the next window.
    pub(super) fn ask(&self, line: String) {
        self.counts.asked.fetch_add(1, Ordering::SeqCst);
        self.send(line);
    }

    /// Closes the program's input once everything is written.
    pub(super) fn close(&mut self) {
        self.input = None;
    }

    /// What has come already.
    pub(super) fn waiting(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }

    /// What comes next, until `deadline`.
    pub(super) fn next_by(&self, deadline: Instant) -> Result<Event, RecvTimeoutError> {
        self.events.recv_timeout(deadline.saturating_duration_since(Instant::now()))
    }

    /// What the program has to do next.
    pub(super) fn waits_for(&self) -> Asked {
        let written = self.counts.written.load(Ordering::SeqCst);
        if written <= self.counts.asked.load(Ordering::SeqCst) { Asked::Write(written) } else { Asked::Answer }
    }
}

fn write_lines(mut input: &ChildStdin, lines: &Receiver<String>, counts: &Counts, events: &Sender<Event>) {
    for mut line in lines {
        line.push('\n');
        if let Err(error) = input.write_all(line.as_bytes()) {
            let event =
                if error.kind() == io::ErrorKind::BrokenPipe { Event::InputClosed } else { Event::Failed(error) };
            // nobody may listen any more
            let _ = events.send(event);
            return;
        }
        counts.written.fetch_add(1, Ordering::SeqCst);
    }
}

fn read_lines(
    output: ChildStdout,
    most_bytes: usize,
    counts: &Counts,
    input: &Weak<ChildStdin>,
    events: &Sender<Event>,
) {
    let mut output = BufReader::new(output);
    for number in 1.. {
        let mut line = Vec::new();
        let most = most_bytes as u64 + 1;
        let event = match output.by_ref().take(most).read_until(b'\n', &mut line) {
            Err(error) => Event::Failed(error),
            Ok(0) => Event::OutputEnd,
            Ok(_) if line.len() > most_bytes => Event::TooLong,
            Ok(_) if number > counts.asked.load(Ordering::SeqCst) || is_unread(input) => Event::Surplus(number),
            Ok(_) => Event::Line(line),
        };
        let goes_on = matches!(event, Event::Line(_));
        if events.send(event).is_err() || !goes_on {
            return;
        }
    }
}

/// Whether there is more in the program's input than the end of a line, which a reader may leave for the next one.
fn is_unread(input: &Weak<ChildStdin>) -> bool {
    let bytes = input.upgrade().and_then(|input| rustix::io::ioctl_fionread(&*input).ok());
    bytes.is_some_and(|bytes| bytes > 1)
}
