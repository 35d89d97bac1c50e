//! External programs that hang, answer too much, too little or nonsense: each ends `spts score` with one error within
//! its limit, and nothing of it stays.

use crate::command::SPTS;
use crate::recordings::recordings;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// Limit of a program, s.
const LIMIT_S: f64 = 3.0;
/// Time beyond the limit until the program and everything of it has to be gone, s.
const SLACK_S: f64 = 5.0;

/// A run of `spts score` with one program, in a folder for temporary files of its own.
struct Run {
    parent: tempfile::TempDir,
    temporary: PathBuf,
    started: PathBuf,
    /// What finds its processes again: a variable of their environment.
    marker: String,
}

impl Run {
    /// `temporary` is the name of the folder for temporary files.
    fn new(temporary: &str) -> Self {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join(temporary);
        std::fs::create_dir(&folder).unwrap();
        std::fs::write(parent.path().join("arrays.py"), ARRAYS).unwrap();
        Self {
            temporary: folder,
            started: parent.path().join("started"),
            marker: format!("SPTS_TEST_MARKER={}", parent.path().display()),
            parent,
        }
    }

    fn command(&self, recordings: &Path, program: &str, limit_s: f64) -> Command {
        let (name, value) = self.marker.split_once('=').unwrap();
        let mut command = Command::new(SPTS);
        command
            .args(["score", recordings.to_str().unwrap(), "--measurements", "100"])
            .args(["--object", "brain", "--no-ball", "--no-times", "--learn-from", "raster"])
            .args(["--external-timeout", &limit_s.to_string(), "--threads", "2"])
            .args([
                "--external",
                &format!("x=[ -e \"$STARTED\" ] || date +%s.%N > \"$STARTED\"; {program}"),
            ])
            .env("TMPDIR", &self.temporary)
            .env("STARTED", &self.started)
            .env("PYTHONPATH", self.parent.path())
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env_remove("PYTHONUNBUFFERED")
            .env(name, value)
            .current_dir(self.parent.path())
            .stdin(Stdio::null());
        command
    }

    fn output(&self, recordings: &Path, program: &str) -> Output {
        self.command(recordings, program, LIMIT_S).output().unwrap()
    }

    /// Time since the program began, s.
    fn since_start_s(&self) -> f64 {
        let began: f64 = std::fs::read_to_string(&self.started).unwrap().trim().parse().unwrap();
        SystemTime::now().duration_since(UNIX_EPOCH).unwrap().as_secs_f64() - began
    }

    /// Processes of the run that still are there.
    fn orphans(&self) -> Vec<String> {
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

    /// What is left in the folder for temporary files.
    fn left(&self) -> Vec<PathBuf> {
        let entries = std::fs::read_dir(&self.temporary).unwrap();
        entries.map(|entry| entry.unwrap().path()).collect()
    }
}

/// Module of the programs below: NumPy's files without NumPy.
const ARRAYS: &str = r#"
import struct, sys, zipfile

def shape(path, name):
    with zipfile.ZipFile(path) as archive:
        data = archive.read(name + ".npy")
    return eval(data[10:10 + struct.unpack("<H", data[8:10])[0]])["shape"]

def save(path, name, shape, values, descr="<f8", fortran=False):
    header = repr(dict(descr=descr, fortran_order=fortran, shape=tuple(shape)))
    header += " " * (63 - (10 + len(header)) % 64) + "\n"
    data = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode()
    code = {"<f8": "d", "<i8": "q", "<c16": "d", "<U1": "i"}[descr]
    data += struct.pack("<%d%s" % (len(values), code), *values)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name + ".npy", data)

n = shape(sys.argv[1], "y")[0]
out = sys.argv[2]
"#;

/// A Python program that answers a batch of `n` windows: `body` calls `save(out, name, shape, values)`.
fn batch(body: &str) -> String {
    format!("python3 -c 'from arrays import *\n{body}' {{windows}} {{answers}}")
}

/// A Python program that answers line by line: `body` is done for every window, after `before`.
fn lines(before: &str, body: &str, after: &str) -> String {
    format!(
        "python3 -c 'import sys, time, json\nsay = lambda text: print(text, flush=True)\n\
         good = json.dumps(dict(image=[1] * 100))\nsys.stdin.readline()\n{before}\nfor k, line in \
         enumerate(sys.stdin):\n    {body}\n{after}'"
    )
}

/// Name, program, and what the error says.
fn hostile() -> Vec<(&'static str, String, &'static str)> {
    let mut table = vec![
        (
            "answers without reading",
            "yes '{\"label\": 1}'".to_owned(),
            "windows had been asked",
        ),
        (
            "answers without reading, slowly",
            "while :; do echo '{\"label\": 1}'; sleep .2; done".to_owned(),
            "",
        ),
        (
            "reads nothing",
            "sleep 1000".to_owned(),
            "took longer than the limit of 3 s",
        ),
        (
            "ignores SIGTERM",
            "trap '' TERM HUP INT; while :; do sleep 1; done".to_owned(),
            "took longer than the limit",
        ),
        (
            "closes its output",
            "exec >&-; cat > /dev/null".to_owned(),
            "closed its output before it had answered window 1",
        ),
        (
            "closes both",
            "exec >&- <&-; sleep 1000".to_owned(),
            "before it had answered window 1",
        ),
        ("grandchild holds the pipe", "sleep 1000 & exit 0".to_owned(), "`"),
        (
            "a line without an end",
            "cat /dev/zero".to_owned(),
            "a line of more than 10496 bytes",
        ),
        (
            "floods standard error",
            "yes >&2 2>/dev/null | cat > /dev/null".to_owned(),
            "took longer",
        ),
        (
            "batch that sleeps",
            "sleep 1000 # {windows} {answers}".to_owned(),
            "took longer than the limit of 3 s",
        ),
        (
            "batch with a grandchild",
            "sleep 1000 & wait # {answers}".to_owned(),
            "took longer than the limit of 3 s",
        ),
        (
            "batch that ignores SIGTERM",
            "trap '' TERM; while :; do sleep 1; done # {answers}".to_owned(),
            "longer",
        ),
        (
            "batch answers a pipe",
            "mkfifo {answers}".to_owned(),
            "not a regular file",
        ),
        (
            "batch answers a device",
            "ln -s /dev/zero {answers}".to_owned(),
            "not a regular file",
        ),
        ("batch answers nothing", "true {answers}".to_owned(), "No such file"),
        (
            "batch fails",
            "exit 3 # {answers}".to_owned(),
            "ended (exit status: 3) before it had answered",
        ),
    ];
    let in_lines = [
        (
            "reads, then waits",
            "",
            "time.sleep(1000)",
            "",
            "the answer to window 1",
        ),
        ("never flushes", "", "print(good)", "", "does it flush its output?"),
        (
            "stops at the fifth",
            "",
            "say(good) if k < 4 else time.sleep(1000)",
            "",
            "the answer to window 5",
        ),
        (
            "one answer ahead",
            "say(good)\ntime.sleep(.5)",
            "say(good)",
            "",
            "of its output when",
        ),
        (
            "two answers each",
            "",
            "say(good + chr(10) + good)",
            "",
            "of its output when",
        ),
        (
            "an answer after the last",
            "",
            "say(good)",
            "say(good)",
            "of its output when",
        ),
        (
            "bad status at the end",
            "",
            "say(good)",
            "sys.exit(7)",
            "(exit status: 7) after its last answer",
        ),
        (
            "killed at the end",
            "",
            "say(good)",
            "import os; os.kill(os.getpid(), 11)",
            "after its last answer",
        ),
        (
            "does not end",
            "",
            "say(good)",
            "time.sleep(1000)",
            "its end after the last answer took longer",
        ),
        (
            "label out of the list",
            "",
            "say(json.dumps(dict(label=99)))",
            "",
            "`label` = 99; valid: ",
        ),
        (
            "negative label",
            "",
            "say(json.dumps(dict(label=-2)))",
            "",
            "`label` = -2; valid: ",
        ),
        (
            "label and a half",
            "",
            "say(json.dumps(dict(label=1.5)))",
            "",
            "`label` = 1.5; valid: ",
        ),
        (
            "label not a number",
            "",
            "say(json.dumps(dict(label=float(\"nan\"))))",
            "",
            "answered window 1 with",
        ),
        (
            "image not a number",
            "",
            "say(json.dumps(dict(image=[float(\"nan\")] * 100)))",
            "",
            "answered window 1 with",
        ),
        (
            "image too short",
            "",
            "say(json.dumps(dict(image=[1] * 99)))",
            "",
            "an image of 99 values; needed are 100",
        ),
        (
            "empty image",
            "",
            "say(json.dumps(dict(image=[], label=1)))",
            "",
            "an image of 0 values; needed are 100",
        ),
    ];
    table.extend(in_lines.map(|(name, before, body, after, said)| (name, lines(before, body, after), said)));
    let in_batch = [
        (
            "batch transposed",
            r#"save(out, "images", [100, n], [1] * (n * 100))"#,
            "needed is [",
        ),
        (
            "batch with a row more",
            r#"save(out, "images", [n + 1, 100], [1] * (n * 100 + 100))"#,
            "needed is [",
        ),
        (
            "batch flat",
            r#"save(out, "images", [n * 100], [1] * (n * 100))"#,
            "needed is [",
        ),
        (
            "batch of labels in a column",
            r#"save(out, "labels", [n, 1], [1] * n)"#,
            "`labels` has shape [",
        ),
        (
            "batch with a wrong name",
            r#"save(out, "image", [n, 100], [1] * (n * 100))"#,
            "\"image\"; valid: images, labels",
        ),
        (
            "batch of text",
            r#"save(out, "labels", [n], [97] * n, "<U1")"#,
            "`labels` has type",
        ),
        (
            "batch of complex numbers",
            r#"save(out, "labels", [n], [1] * (2 * n), "<c16")"#,
            "`labels` has type",
        ),
        (
            "batch with infinity",
            r#"save(out, "images", [n, 100], [1] * 107 + [float("inf")] + [1] * (n * 100 - 108))"#,
            "answered window 2 of 20 with an image with inf at taxel 7 (from 0)",
        ),
        (
            "batch label not a number",
            r#"save(out, "labels", [n], [float("nan")] * n)"#,
            "`label` = NaN; valid: ",
        ),
        (
            "batch label -2",
            r#"save(out, "labels", [n], [-2] * n, "<i8")"#,
            "`label` = -2; valid: ",
        ),
        (
            "batch label 1.5",
            r#"save(out, "labels", [n], [1.5] * n)"#,
            "`label` = 1.5; valid: ",
        ),
        (
            "batch label out of the list",
            r#"save(out, "labels", [n], [99] * n, "<i8")"#,
            "`label` = 99; valid: ",
        ),
    ];
    table.extend(in_batch.map(|(name, body, said)| (name, batch(body), said)));
    table
}

#[test]
fn hostile_programs_end_within_their_limit_and_leave_nothing() {
    let Some(recordings) = recordings() else { return };
    let (table, next) = (hostile(), AtomicUsize::new(0));
    let work = || {
        let mut done = Vec::new();
        while let Some(program) = table.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.push(tried(&recordings, program));
        }
        done
    };
    let tried: Vec<Tried> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..WORKERS).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    eprintln!(
        "{} programs, slowest {:.2} s, {} orphans, {} folders left",
        tried.len(),
        tried.iter().map(|t| t.took_s).fold(0.0, f64::max),
        tried.iter().map(|t| t.orphans).sum::<usize>(),
        tried.iter().map(|t| t.folders).sum::<usize>(),
    );
    assert_eq!(tried.len(), table.len());
    let wrong: Vec<&str> = tried.iter().filter_map(|t| t.wrong.as_deref()).collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

/// Runs at the same time: most of the time of each is one program's sleep.
const WORKERS: usize = 3;

/// What became of one program.
struct Tried {
    took_s: f64,
    orphans: usize,
    folders: usize,
    /// What is not as it should be.
    wrong: Option<String>,
}

fn tried(recordings: &Path, (name, program, expected): &(&str, String, &str)) -> Tried {
    let run = Run::new("tmp");
    let output = run.output(recordings, program);
    let took_s = run.since_start_s();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let errors: Vec<&str> = said.lines().filter(|l| l.starts_with("error: ")).collect();
    let (alive, left) = (run.orphans(), run.left());
    eprintln!("{took_s:5.2} s  {name}: {}", errors.first().unwrap_or(&"no error"));
    let fits = output.status.code() == Some(2) && errors.len() == 1 && errors[0].contains(expected);
    let gone = took_s <= LIMIT_S + SLACK_S && alive.is_empty() && left.is_empty();
    let wrong = format!("{name}: {:?} {took_s:.2} s, {alive:?}, {left:?}\n{said}", output.status);
    Tried {
        took_s,
        orphans: alive.len(),
        folders: left.len(),
        wrong: (!fits || !gone).then_some(wrong),
    }
}

/// Good programs, in both ways, with a folder for temporary files that a shell could misread; an array in Fortran order
/// scores as the same array in C order.
#[test]
fn good_programs_are_scored_whatever_the_temporary_folder_is_called() {
    let Some(recordings) = recordings() else { return };
    let programs = [
        lines("", "say(good)", ""),
        batch(r#"save(out, "images", [n, 100], [(w * 31 + t * 17) % 101 for w in range(n) for t in range(100)])"#),
        batch(
            r#"save(out, "images", [n, 100], [(w * 31 + t * 17) % 101 for t in range(100) for w in range(n)], fortran=True)"#,
        ),
        batch(r#"save(out, "labels", [n], [1 if k % 2 else -1 for k in range(n)], "<i8")"#),
    ];
    let mut scores = Vec::new();
    for (program, folder) in programs
        .iter()
        .zip(["tmp", "a b", "$(touch run)", "`touch run` '\"; {answers}"])
    {
        let run = Run::new(folder);
        let mut command = run.command(&recordings, program, 60.0);
        let output = command.arg("--json").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{folder}: {said}");
        assert!(!run.parent.path().join("run").exists(), "{folder}: the path was run");
        assert!(run.orphans().is_empty() && run.left().is_empty(), "{:?}", run.left());
        let board: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        scores.push(board["rows"][0]["iou"].clone());
    }
    assert_eq!(scores[1], scores[2]);
    assert!(scores[1].as_f64().unwrap() > 0.0, "{scores:?}");
    assert!(scores[3].is_null(), "{scores:?}");
}

/// Three signals, while a program sleeps, in both ways.
#[test]
fn signals_end_programs_and_remove_folders() {
    let Some(recordings) = recordings() else { return };
    let (mut orphans, mut folders) = (0, 0);
    for program in [
        "trap '' TERM INT HUP; sleep 1000",
        "sleep 1000 & sleep 1000 # {answers}",
    ] {
        for (signal, number) in [("TERM", 15), ("INT", 2), ("HUP", 1)] {
            if signal == "HUP" && ignores_hangups() {
                continue;
            }
            let run = Run::new("tmp");
            let mut command = run.command(&recordings, program, 600.0);
            let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
            let begin = Instant::now();
            while !run.started.exists() && begin.elapsed() < Duration::from_secs(120) {
                sleep(Duration::from_millis(20));
            }
            sleep(Duration::from_millis(200));
            assert_eq!(run.left().len(), 1);
            let sent = Instant::now();
            let kill = Command::new("kill")
                .args([format!("-{signal}"), child.id().to_string()])
                .status();
            assert!(kill.unwrap().success());
            let status = child.wait().unwrap();
            assert!(sent.elapsed().as_secs_f64() < SLACK_S, "{signal}: {:?}", sent.elapsed());
            assert_eq!(status.code(), Some(128 + number), "{signal} {program}");
            let (alive, left) = (run.orphans(), run.left());
            orphans += alive.len();
            folders += left.len();
            assert!(alive.is_empty() && left.is_empty(), "{signal}: {alive:?} {left:?}");
        }
    }
    eprintln!("signals: {orphans} orphans, {folders} folders left");
}

/// Whether these tests run under `nohup` or the like, which the program respects.
fn ignores_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(ignored.trim(), 16).unwrap() & 1 == 1
}

/// A run that is killed leaves its folder to the next run, which leaves folders alone that it does not know.
#[test]
fn the_next_run_removes_what_a_killed_one_has_left() {
    let Some(recordings) = recordings() else { return };
    let run = Run::new("tmp");
    let mut command = run.command(&recordings, "cat > /dev/null", 600.0);
    let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    let begin = Instant::now();
    while !run.started.exists() && begin.elapsed() < Duration::from_secs(120) {
        sleep(Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    let begin = Instant::now();
    while !run.orphans().is_empty() && begin.elapsed().as_secs_f64() < SLACK_S {
        sleep(Duration::from_millis(20));
    }
    assert!(run.orphans().is_empty(), "{:?}", run.orphans());
    assert_eq!(run.left().len(), 1);
    let foreign = run.temporary.join("spts-external-of-mine");
    std::fs::create_dir(&foreign).unwrap();
    let output = run.output(&recordings, &lines("", "say(good)", ""));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(run.left(), [foreign]);
}

#[test]
fn limits_out_of_range_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    for value in ["0", "-1", "nan", "inf", "86401"] {
        let arguments = ["score", "nowhere", "--external", "cat", "--external-timeout", value];
        let output = crate::command::spts(dir.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2));
        assert!(
            said.contains("`--external-timeout` = ") && said.contains("valid: [0.1, 86400] s"),
            "{said}"
        );
    }
}
