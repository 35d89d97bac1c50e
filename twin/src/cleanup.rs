//! Clean-up when a signal ends the program: temporary folders and processes that the program has started.
//!
//! A signal ends a program without running destructors. Whatever they would remove is therefore listed here, and
//! [`end_on_signals`] removes everything listed before SIGINT, SIGTERM or SIGHUP ends the program.
//!
//! ```
//! use spts::cleanup::{Leftover, listed};
//! let parent = tempfile::tempdir()?;
//! let path = parent.path().join("stage");
//! let make = || std::fs::create_dir(&path);
//! let ((), entry) = listed(make, |()| Leftover::Folder(path.clone()))?;
//! // a signal that comes now removes the folder; once it is gone, so is its entry
//! std::fs::remove_dir(&path)?;
//! drop(entry);
//! # Ok::<(), std::io::Error>(())
//! ```

use rustix::process::{Pid, Signal, kill_process_group};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use std::collections::BTreeMap;
use std::io;
use std::path::PathBuf;
use std::sync::atomic::{AtomicI32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Times that a folder is removed anew when a thread or a dying process has put another file into it meanwhile.
const ATTEMPTS: usize = 20;
/// Time between two such attempts.
const PAUSE: Duration = Duration::from_millis(10);

/// Something that is removed or ended when the program is stopped by a signal.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum Leftover {
    /// A folder, removed with its contents.
    Folder(PathBuf),
    /// Files and folders, removed in this order; a folder only if it is empty.
    Each(Vec<PathBuf>),
    /// A process group, given by its leader's process number, and ended by SIGKILL.
    Group(Pid),
}

/// What is listed, by the number of its entry: what came last goes first.
#[derive(Debug)]
struct List {
    next: u64,
    entries: BTreeMap<u64, Leftover>,
}

static LIST: Mutex<List> = Mutex::new(List { next: 0, entries: BTreeMap::new() });

fn list() -> MutexGuard<'static, List> {
    // a thread that panicked while it made something has listed nothing
    LIST.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An entry of the list, removed when dropped. Its owner removes the resource itself.
#[derive(Debug)]
#[must_use = "an entry that is dropped is off the list"]
pub struct Entry(u64);

impl Entry {
    /// Takes the entry off the list and calls `last`. A signal that comes meanwhile waits until `last` has returned.
    /// `last` must neither list anything nor drop another entry.
    pub fn finish<T>(self, last: impl FnOnce() -> T) -> T {
        let mut list = list();
        list.entries.remove(&self.0);
        std::mem::forget(self);
        last()
    }
}

impl Drop for Entry {
    fn drop(&mut self) {
        list().entries.remove(&self.0);
    }
}

/// Calls `make` and lists its result as `leftover` says. No signal is handled between the two. `make` must neither list
/// anything nor drop an [`Entry`].
///
/// # Errors
/// The error of `make`; nothing is listed then.
pub fn listed<T>(
    make: impl FnOnce() -> io::Result<T>,
    leftover: impl FnOnce(&T) -> Leftover,
) -> io::Result<(T, Entry)> {
    let mut list = list();
    let made = make()?;
    let number = list.next;
    list.next += 1;
    list.entries.insert(number, leftover(&made));
    Ok((made, Entry(number)))
}

/// While it exists, the first signal that would end the program only sets it, so that work that would be lost can be
/// completed. A second signal ends the program as ever.
#[derive(Debug)]
pub struct Deferred(());

impl Deferred {
    /// Begins to defer signals.
    pub fn begin() -> Self {
        DEFERRED.store(WAITING, Ordering::SeqCst);
        Self(())
    }

    /// Number of the signal that has come, if one has.
    pub fn signal(&self) -> Option<i32> {
        Some(DEFERRED.load(Ordering::SeqCst)).filter(|signal| *signal > 0)
    }
}

impl Drop for Deferred {
    fn drop(&mut self) {
        DEFERRED.store(NONE, Ordering::SeqCst);
    }
}

/// The signal that was deferred, or whether one would be.
static DEFERRED: AtomicI32 = AtomicI32::new(NONE);
const NONE: i32 = -1;
const WAITING: i32 = 0;

/// Installs the handler: SIGINT, SIGTERM and SIGHUP remove everything listed and end the program with status 128 + the
/// number of the signal. If SIGHUP is ignored, as under `nohup`, it stays ignored.
///
/// # Errors
/// [`io::Error`] if the operating system refuses the handler or its thread.
pub fn end_on_signals() -> io::Result<()> {
    let mut signals = vec![SIGINT, SIGTERM];
    if !is_ignored(SIGHUP) {
        signals.push(SIGHUP);
    }
    let mut signals = Signals::new(signals)?;
    let wait = move || {
        for signal in signals.forever() {
            if DEFERRED.compare_exchange(WAITING, signal, Ordering::SeqCst, Ordering::SeqCst).is_ok() {
                continue;
            }
            // held to the end, so that nothing new is made any more
            let list = list();
            remove(&list);
            signal_hook::low_level::exit(128 + signal);
        }
    };
    thread::Builder::new().name("signals".to_owned()).spawn(wait)?;
    Ok(())
}

/// Ends the processes first, so that they put nothing into folders that are being removed.
fn remove(list: &List) {
    for entry in list.entries.values() {
        if let Leftover::Group(leader) = entry {
            // a group that has ended by itself is no error
            let _ = kill_process_group(*leader, Signal::KILL);
        }
    }
    for entry in list.entries.values().rev() {
        match entry {
            Leftover::Folder(path) => {
                for _ in 0..ATTEMPTS {
                    match std::fs::remove_dir_all(path) {
                        Err(error) if error.kind() != io::ErrorKind::NotFound => thread::sleep(PAUSE),
                        _ => break,
                    }
                }
            }
            Leftover::Each(paths) => {
                // nothing more can be done about one that stays
                let remove = |path| std::fs::remove_file(path).or_else(|_| std::fs::remove_dir(path));
                paths.iter().for_each(|path| drop(remove(path)));
            }
            Leftover::Group(_) => {}
        }
    }
}

/// Whether the program was started with `signal` ignored; `false` where the system does not say.
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    mask.is_some_and(|mask| mask >> (signal - 1) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_listed_goes_and_what_is_not_stays() {
        let parent = tempfile::tempdir().unwrap();
        let [kept, lost] = ["kept", "lost"].map(|name| parent.path().join(name));
        let make = |path: &PathBuf| {
            listed(|| std::fs::create_dir(path).map(|()| path.clone()), |path| Leftover::Folder(path.clone()))
        };
        drop(make(&kept).unwrap());
        let (_, _entry) = make(&lost).unwrap();
        std::fs::write(lost.join("file"), "x").unwrap();
        // of the list what is this test's: others write beside it
        let own = |entry: &Leftover| matches!(entry, Leftover::Folder(path) if path.starts_with(parent.path()));
        let entries = list().entries.clone().into_iter().filter(|(_, entry)| own(entry)).collect();
        remove(&List { next: 0, entries });
        assert!(kept.exists() && !lost.exists());
    }
}
