//! Running ngspice.

use std::path::Path;
use std::process::{Command, Output};
use std::time::{Duration, Instant};

/// What one run left.
pub(crate) struct Run {
    dir: tempfile::TempDir,
    printed: String,
    pub(crate) wall: Duration,
}

/// Whether ngspice can be started; says so where it cannot.
pub(crate) fn found() -> bool {
    let found = Command::new("ngspice").arg("--version").output().is_ok();
    if !found {
        eprintln!("skipped: ngspice is not installed (scripts/setup.sh installs it)");
    }
    found
}

/// Runs `netlist` in a folder of its own.
pub(crate) fn run(netlist: &str) -> Run {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("circuit.cir"), netlist).unwrap();
    let start = Instant::now();
    let output = batch(dir.path());
    let wall = start.elapsed();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let run = Run { dir, printed, wall };
    assert!(output.status.success(), "{}\n{}", run.printed, String::from_utf8_lossy(&output.stderr));
    run
}

fn batch(dir: &Path) -> Output {
    Command::new("ngspice")
        .args(["-b", "circuit.cir"])
        .current_dir(dir)
        // one run, one thread: the cases run beside each other
        .env("OMP_NUM_THREADS", "1")
        .output()
        .unwrap()
}

impl Run {
    /// Number after `name =` in what was printed.
    pub(crate) fn printed(&self, name: &str) -> f64 {
        let value = self.printed.lines().find_map(|line| {
            let (left, right) = line.split_once('=')?;
            (left.trim() == name).then(|| right.trim().parse().ok())?
        });
        value.unwrap_or_else(|| panic!("no `{name}` in:\n{}", self.printed))
    }

    /// Pairs of numbers in the file that `wrdata` wrote.
    pub(crate) fn data(&self, name: &str) -> Vec<(f64, f64)> {
        let text = std::fs::read_to_string(self.dir.path().join(name))
            .unwrap_or_else(|error| panic!("{name}: {error}\n{}", self.printed));
        let pair = |line: &str| {
            let mut numbers = line.split_whitespace().map(|word| word.parse::<f64>().unwrap());
            Some((numbers.next()?, numbers.next()?))
        };
        text.lines().filter_map(pair).collect()
    }
}

/// Straight line through the two points beside `x`.
pub(crate) fn interpolate(data: &[(f64, f64)], x: f64) -> f64 {
    let right = data.partition_point(|(at, _)| *at < x).clamp(1, data.len() - 1);
    let ((a, u), (b, v)) = (data[right - 1], data[right]);
    u + (v - u) * (x - a) / (b - a)
}
