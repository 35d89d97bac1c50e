//! External programs that hang, answer too much, too little or nonsense: each ends `spts score` with one error within
//! its limit, and nothing of it stays.

mod programs;
mod run;

use crate::recordings::recordings;
use programs::{batch, hostile, lines};
use run::{LIMIT_S, Run, SLACK_S};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::sleep;
use std::time::{Duration, Instant};

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
            run.wait_for_start();
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

/// A run that is killed ends its programs, and leaves its folder to the next run, which leaves folders alone that it
/// does not know.
#[test]
fn the_next_run_removes_what_a_killed_one_has_left() {
    let Some(recordings) = recordings() else { return };
    let run = Run::new("tmp");
    let mut command = run.command(&recordings, "trap '' TERM INT HUP; sleep 1000 & sleep 1000", 600.0);
    let mut child = command.stderr(Stdio::null()).stdout(Stdio::null()).spawn().unwrap();
    run.wait_for_start();
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

/// Small files of answers that unfold to 1.8 GB: as an array of that size, and behind the end of a good one.
#[test]
fn answers_that_grow_are_refused_with_little_memory() {
    const MEMORY_KB: &str = "2000000";
    let Some(recordings) = recordings() else { return };
    for (shape, expected) in [
        ("[9 * 10**6, n]", "needed is ["),
        ("[n, 100]", "goes on behind its last value"),
    ] {
        let run = Run::new("tmp");
        let grow = batch(&format!(
            "with zipfile.ZipFile(out, \"w\", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:\n\
             \x20 with archive.open(\"images.npy\", \"w\", force_zip64=True) as file:\n\
             \x20   file.write(header({shape}, \"<f8\"))\n\
             \x20   for _ in range(1800): file.write(bytes(10**6))"
        ));
        let score = run.command(&recordings, &grow, 60.0);
        let mut limited = Command::new("sh");
        limited.args(["-c", "ulimit -v $1; shift; exec \"$0\" \"$@\""]);
        limited.arg(score.get_program()).arg(MEMORY_KB).args(score.get_args());
        limited.current_dir(run.parent.path()).stdin(Stdio::null());
        for (name, value) in score.get_envs() {
            match value {
                Some(value) => limited.env(name, value),
                None => limited.env_remove(name),
            };
        }
        let output = limited.output().unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        let error = said.lines().find(|line| line.starts_with("error: ")).unwrap_or("");
        assert_eq!(output.status.code(), Some(2), "{shape}: {said}");
        assert!(error.contains(expected), "{shape}: {said}");
        assert!(run.orphans().is_empty() && run.left().is_empty(), "{:?}", run.left());
        eprintln!("{shape}: {error}");
    }
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
