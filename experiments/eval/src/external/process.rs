//! A program run by the shell in its own process group, which is ended as a whole.

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use spts::cleanup::{Entry, Leftover, listed};
use std::io;
use std::os::unix::process::CommandExt as _;
use std::process::{Child, Command, ExitStatus, Stdio};
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
        let mut process = Self {
            child,
            leader,
            keeper: None,
            entry: Some(entry),
        };
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

    /// Waits until the program has ended, the time is `deadline` or `stop` says so. Returns whether it has ended. Its
    /// process number stays taken, so that [`Process::end`] finds no other group under it.
    pub(super) fn ends_by(&self, deadline: Instant, stop: impl Fn() -> bool) -> bool {
        loop {
            let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
            match waitid(WaitId::Pid(self.leader), look) {
                Ok(None) if Instant::now() < deadline && !stop() => thread::sleep(LOOK),
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
