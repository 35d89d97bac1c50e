//! External programs that hang, answer too much, too little or nonsense: each ends `spts score` with one error within
//! its limit, and nothing of it stays.

mod programs;
mod run;

use crate::command::sessions;
use programs::{hostile, lines};
use run::{LIMIT_S, Run, SLACK_S};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

#[test]
fn hostile_programs_end_within_their_limit_and_leave_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let sessions = sessions(dir.path(), 1);
    let (table, next) = (hostile(), AtomicUsize::new(0));
    let work = || {
        let mut done = Vec::new();
        while let Some(program) = table.get(next.fetch_add(1, Ordering::Relaxed)) {
            done.push(tried(&sessions, program));
        }
        done
    };
    let tried: Vec<Tried> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..WORKERS).map(|_| scope.spawn(work)).collect();
        workers.into_iter().flat_map(|worker| worker.join().unwrap()).collect()
    });
    eprintln!(
        "{} programs, slowest {:.2} s, {} orphans",
        tried.len(),
        tried.iter().map(|t| t.took_s).fold(0.0, f64::max),
        tried.iter().map(|t| t.orphans).sum::<usize>(),
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
    /// What is not as it should be.
    wrong: Option<String>,
}

fn tried(sessions: &Path, (name, program, expected): &(&str, String, &str)) -> Tried {
    let run = Run::new();
    let output = run.output(sessions, program);
    let took_s = run.since_start_s();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let errors: Vec<&str> = said.lines().filter(|l| l.starts_with("error: ")).collect();
    let alive = run.orphans();
    eprintln!("{took_s:5.2} s  {name}: {}", errors.first().unwrap_or(&"no error"));
    let fits = output.status.code() == Some(2) && errors.len() == 1 && errors[0].contains(expected);
    let gone = took_s <= LIMIT_S + SLACK_S && alive.is_empty();
    let wrong = format!("{name}: {:?} {took_s:.2} s, {alive:?}\n{said}", output.status);
    Tried { took_s, orphans: alive.len(), wrong: (!fits || !gone).then_some(wrong) }
}

/// Programs that answer as they should: images, classes alone, and the image of the first class that the header has.
#[test]
fn good_programs_are_scored() {
    let dir = tempfile::tempdir().unwrap();
    let sessions = sessions(dir.path(), 16);
    let learned = "head = json.loads(sys.stdin.readline())\nimages = head[\"learn\"][\"images\"]\n\
                   assert len(images) == len(head[\"learn\"][\"labels\"]) > 9 and len(images[0]) == 100\n\
                   good = json.dumps(dict(image=images[0]))";
    let mut scores = Vec::new();
    for program in [
        lines("", "say(good)", ""),
        lines("", "say(json.dumps(dict(label=4 if k % 2 else None)))", ""),
        lines("", "say(good)", "").replacen("sys.stdin.readline()", learned, 1),
    ] {
        let run = Run::new();
        let mut command = run.command(&sessions, &program, 60.0);
        let output = command.arg("--json").output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{program}: {said}");
        assert!(run.orphans().is_empty());
        let board: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        scores.push(board["rows"][0]["iou"].clone());
    }
    let [all, labels, first] = [0, 1, 2].map(|k| scores[k].as_f64());
    assert!(all > Some(0.0) && labels.is_none() && first > all, "{scores:?}");
}

/// Three signals, while a program sleeps.
#[test]
fn signals_end_programs() {
    let dir = tempfile::tempdir().unwrap();
    let sessions = sessions(dir.path(), 1);
    for (signal, number) in [("TERM", 15), ("INT", 2), ("HUP", 1)] {
        if signal == "HUP" && ignores_hangups() {
            continue;
        }
        let run = Run::new();
        let mut command = run.command(&sessions, "trap '' TERM INT HUP; sleep 1000", 600.0);
        let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
        run.wait_for_start();
        sleep(Duration::from_millis(200));
        let sent = Instant::now();
        let kill = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status();
        assert!(kill.unwrap().success());
        let status = child.wait().unwrap();
        assert!(sent.elapsed().as_secs_f64() < SLACK_S, "{signal}: {:?}", sent.elapsed());
        assert_eq!(status.code(), Some(128 + number), "{signal}");
        assert!(run.orphans().is_empty(), "{signal}: {:?}", run.orphans());
    }
}

/// Whether these tests run under `nohup` or the like, which the program respects.
fn ignores_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap();
    u64::from_str_radix(ignored.trim(), 16).unwrap() & 1 == 1
}

/// A run that is killed ends its programs.
#[test]
fn a_killed_run_leaves_no_program() {
    let dir = tempfile::tempdir().unwrap();
    let sessions = sessions(dir.path(), 1);
    let run = Run::new();
    let mut command = run.command(&sessions, "trap '' TERM INT HUP; sleep 1000 & sleep 1000", 600.0);
    let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    run.wait_for_start();
    child.kill().unwrap();
    child.wait().unwrap();
    let begin = Instant::now();
    while !run.orphans().is_empty() && begin.elapsed().as_secs_f64() < SLACK_S {
        sleep(Duration::from_millis(20));
    }
    assert!(run.orphans().is_empty(), "{:?}", run.orphans());
}
