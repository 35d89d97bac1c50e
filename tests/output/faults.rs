//! Every operation on the disk of a run that puts its results in place, each made to fail, and each the last one.

use crate::command::files;
use spts::output::{DiskOperation, OutputError, OutputFolder, check_whole, watching_disk, write_bytes};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::fmt;
use std::io;
use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Files of a run, by their names below its folder.
pub(super) struct Results(BTreeMap<String, Vec<u8>>);

/// What became of the folder, counted over all steps.
#[derive(Default)]
pub(super) struct Counts {
    steps: usize,
    old: usize,
    new: usize,
    marked: usize,
}

impl fmt::Display for Counts {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} steps, each failed once, failed for good, and was the last: {} times the earlier results, {} times the new ones, {} times \
             marked as half-made and put back; 0 mixtures, 0 files of others lost",
            self.steps, self.old, self.new, self.marked
        )
    }
}

/// When a step is made to fail.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    /// This step alone, as when a network folder is away for a moment.
    Once,
    /// This one and all that follow, as on a full disk.
    FromThen,
    /// None, but what the disk holds before this step is what a killed run leaves.
    Killed,
}

impl Results {
    /// The results in `dir`.
    pub(super) fn of(dir: &Path) -> Self {
        let mut found = files(dir);
        found.retain(|name, _| !name.ends_with('/') && name != "manifest.json");
        Self(found)
    }

    /// Puts the results into `out` as every command does.
    fn put(&self, out: &Path) -> Result<(), OutputError> {
        let folder = OutputFolder::open(out, &[])?;
        for (name, bytes) in &self.0 {
            if let Some((parent, _)) = name.rsplit_once('/') {
                folder.folder(parent)?;
            }
            write_bytes(&folder.path(name), bytes)?;
        }
        folder.commit().map(drop)
    }
}

/// All files of `dir` but hidden ones.
fn visible(dir: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = files(dir);
    found.retain(|name, _| !name.ends_with('/') && !name.starts_with(".spts"));
    found
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let entry = entry.unwrap();
        if entry.file_type().unwrap().is_dir() {
            copy(&entry.path(), &to.join(entry.file_name()));
        } else {
            std::fs::copy(entry.path(), to.join(entry.file_name())).unwrap();
        }
    }
}

/// A folder that the disk does not slow down, where there is one: the same steps in a hundredth of the time.
fn in_memory() -> tempfile::TempDir {
    tempfile::tempdir_in("/dev/shm").unwrap_or_else(|_| tempfile::tempdir().unwrap())
}

/// Replaces the results `old` by `new` in a folder with files of `others`, once for every step and every fault.
pub(super) fn check_every_step(old: &Results, new: &Results, others: &[&str]) -> Counts {
    let dir = in_memory();
    let base = dir.path().join("base");
    old.put(&base.join("out")).unwrap();
    for name in others {
        let path = base.join("out").join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, name).unwrap();
    }
    let before = visible(&base.join("out"));
    let whole = dir.path().join("whole");
    copy(&base, &whole);
    let steps = Rc::new(Cell::new(0));
    let count = Rc::clone(&steps);
    let watcher = Rc::new(move |_: DiskOperation, _: &Path| {
        count.set(count.get() + 1);
        Ok(())
    });
    watching_disk(watcher, || new.put(&whole.join("out"))).unwrap();
    let check = Check {
        new,
        others,
        before,
        after: visible(&whole.join("out")),
    };
    assert_ne!(check.before, check.after);
    let mut counts = Counts {
        steps: steps.get(),
        ..Counts::default()
    };
    assert!(counts.steps > 30, "{} steps", counts.steps);
    for step in 0..counts.steps {
        for fault in [Fault::Once, Fault::FromThen, Fault::Killed] {
            let work = tempfile::tempdir_in(dir.path()).unwrap();
            copy(&base, &work.path().join("run"));
            check.one(work.path(), step, fault, &mut counts);
        }
    }
    counts
}

struct Check<'a> {
    new: &'a Results,
    others: &'a [&'a str],
    before: BTreeMap<String, Vec<u8>>,
    after: BTreeMap<String, Vec<u8>>,
}

impl Check<'_> {
    fn one(&self, work: &Path, step: usize, fault: Fault, counts: &mut Counts) {
        let (run, killed) = (work.join("run"), work.join("killed"));
        let at = Cell::new(0);
        let (from, to) = (run.clone(), killed.clone());
        let watcher = Rc::new(move |_: DiskOperation, _: &Path| {
            let now = at.replace(at.get() + 1);
            match fault {
                Fault::Once if now == step => Err(io::ErrorKind::StorageFull.into()),
                Fault::FromThen if now >= step => Err(io::ErrorKind::StorageFull.into()),
                Fault::Killed if now == step => {
                    copy(&from, &to);
                    Ok(())
                }
                _ => Ok(()),
            }
        });
        let result = watching_disk(watcher, || self.new.put(&run.join("out")));
        let what = format!("step {step}, {fault:?}, {result:?}");
        let left = if fault == Fault::Killed { &killed } else { &run };
        let out = left.join("out");
        let found = visible(&out);
        for name in self.others {
            assert_eq!(
                found.get(*name).map(Vec::as_slice),
                Some(name.as_bytes()),
                "{what}: {name}"
            );
        }
        if found == self.before {
            counts.old += 1;
        } else if found == self.after {
            counts.new += 1;
        } else {
            let noticed = check_whole(&out, &[]);
            assert!(
                matches!(noticed, Err(OutputError::HalfMade { .. })),
                "{what}: a mixture: {:?}",
                found.keys().collect::<Vec<_>>()
            );
            counts.marked += 1;
        }
        if fault != Fault::Killed && result.is_err() && fault == Fault::Once {
            assert_eq!(found, self.before, "{what}");
        }
        if fault != Fault::Killed && result.is_ok() {
            assert_eq!(found, self.after, "{what}");
        }
        // what was marked is put back, by a run that does not write itself
        drop(opened(&out));
        let again = visible(&out);
        assert!(again == self.before || again == self.after, "{what}: not put back");
        // and the next run leaves nothing of this one
        self.new.put(&out).unwrap();
        assert_eq!(visible(&out), self.after, "{what}: the run after");
        let hidden = files(left);
        let hidden: Vec<&String> = hidden.keys().filter(|name| name.contains(".spts")).collect();
        assert!(hidden.is_empty(), "{what}: left behind: {hidden:?}");
    }
}

/// `folder`, opened. A child that another test starts at this moment has a copy of the lock of a run that "was killed",
/// until it runs its own program.
fn opened(folder: &Path) -> OutputFolder {
    let begin = Instant::now();
    loop {
        match OutputFolder::open(folder, &[]) {
            Err(OutputError::Locked { .. }) if begin.elapsed() < Duration::from_secs(10) => {
                std::thread::sleep(Duration::from_millis(5));
            }
            opened => return opened.unwrap(),
        }
    }
}
