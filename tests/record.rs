//! `spts record` with devices on pseudo-terminals that misbehave: what has arrived is a session, whatever happens.

use crate::command::{SPTS, files, refused, spts, succeeds};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::{Read as _, Write as _};
use std::os::fd::OwnedFd;
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

/// The device's end of a pseudo-terminal, and the host's, which is kept open until a host has come.
struct Device {
    end: File,
    host: OwnedFd,
    port: String,
}

impl Device {
    fn new() -> Self {
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&end).unwrap();
        unlockpt(&end).unwrap();
        let name = ptsname(&end, Vec::new()).unwrap();
        let host =
            rustix::fs::open(name.as_c_str(), OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty()).unwrap();
        let mut settings = tcgetattr(&host).unwrap();
        settings.make_raw();
        tcsetattr(&host, OptionalActions::Now, &settings).unwrap();
        Self { end: File::from(end), host, port: name.to_str().unwrap().to_owned() }
    }

    /// Starts `spts record` of this device in `dir`.
    fn recorder(&self, dir: &Path, arguments: &[&str]) -> Child {
        let all = [&["record", "--port", &self.port, "--object", "T", "--out", "rec"], arguments].concat();
        let mut command = Command::new(SPTS);
        command.args(all).current_dir(dir).stdout(Stdio::piped()).stderr(Stdio::piped());
        command.spawn().unwrap()
    }

    fn say(&mut self, text: &[u8]) {
        self.end.write_all(text).unwrap();
    }

    fn wait_for_star(&mut self) {
        let mut byte = [0];
        while byte[0] != b'*' {
            self.end.read_exact(&mut byte).unwrap();
        }
    }

    fn greet(&mut self) {
        self.wait_for_star();
        self.say(b"Sending.\r\nSent!.\r\n");
    }
}

/// Block number `number`, which ends with `end`.
fn block(number: usize, end: &str) -> String {
    let codes: String = (0..99_999).map(|k| format!("{},", 480 + k * 7 % 40)).collect();
    format!("{},{codes} {end}", 1000 * (number + 1) + 20)
}

fn said(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Blocks of the session that was recorded in `dir`, as `session.json` has them.
fn blocks(dir: &Path) -> usize {
    let text = std::fs::read_to_string(dir.join("rec/session.json")).unwrap();
    let session: serde_json::Value = serde_json::from_str(&text).unwrap();
    session["compressive"]["blocks"].as_array().unwrap().len()
}

/// Of five blocks two arrive. Then the device is unplugged in the third, falls silent, or a signal comes.
#[test]
fn what_came_before_the_end_is_a_session() {
    for (end, status, reason) in [
        ("unplugged", 2, "block 2: the device went away after 50000 fields"),
        ("silent", 2, "block 2: nothing came for 2 s, before its first code"),
        ("INT", 130, "stopped by a signal"),
        ("TERM", 143, "stopped by a signal"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        let mut device = Device::new();
        let patience = if status == 2 { "2" } else { "60" };
        let child = device.recorder(dir.path(), &["--blocks", "5", "--timeout", patience, "--conditioning", "1"]);
        device.greet();
        for k in 0..2 {
            device.say(block(k, "\r\n").as_bytes());
        }
        match end {
            "unplugged" => {
                let half: String = block(2, "\r\n").split_inclusive(',').take(50_000).collect();
                device.say(half.as_bytes());
                // what was sent is read before the line is cut
                std::thread::sleep(Duration::from_millis(500));
                drop((device.end, device.host));
            }
            "silent" => {}
            signal => {
                std::thread::sleep(Duration::from_secs(1));
                let kill = Command::new("kill").args([&format!("-{signal}"), &child.id().to_string()]).status();
                assert!(kill.unwrap().success());
            }
        }
        let output = child.wait_with_output().unwrap();
        let said = said(&output);
        assert_eq!(output.status.code(), Some(status), "{end}: {said}");
        assert!(said.contains(reason) && said.contains("of the blocks before, 2 are in rec"), "{end}: {said}");
        assert!(status != 2 || said.contains("serial port /dev/pts/"), "{end}: {said}");
        assert_eq!(blocks(dir.path()), 2, "{end}");
        succeeds(dir.path(), &["decode", "rec"]);
        assert!(files(dir.path()).keys().all(|name| !name.contains(".spts-")), "{end}: {:?}", files(dir.path()).keys());
    }
}

#[test]
fn a_device_that_greets_in_its_own_way_is_recorded() {
    for mode in ["noise", "reset", "running", "twice", "lf", "cr"] {
        let dir = tempfile::tempdir().unwrap();
        let mut device = Device::new();
        let child = device.recorder(dir.path(), &["--blocks", "2", "--timeout", "20"]);
        let end = match mode {
            "lf" => "\n",
            "cr" => "\r",
            _ => "\r\n",
        };
        let greeting = format!("Sending.{end}Sent!.{end}");
        match mode {
            "noise" => device.say(b"\xf0\x00\xffBoot v1.2, 3\r\n\x1b[2JSending"),
            // the boot loader reads the first `*`
            "reset" => device.wait_for_star(),
            "running" => device.say(b"12,499,500,5"),
            _ => {}
        }
        if mode != "running" {
            device.wait_for_star();
            device.say(greeting.as_bytes());
        }
        if mode == "twice" {
            device.say(greeting.as_bytes());
        }
        let lost = usize::from(mode == "running");
        for k in 0..2 + lost {
            device.say(block(k, end).as_bytes());
        }
        let output = child.wait_with_output().unwrap();
        assert!(output.status.success(), "{mode}: {}", said(&output));
        assert_eq!(blocks(dir.path()), 2, "{mode}");
    }
}

#[test]
fn bad_codes_and_short_blocks_are_missing_samples_and_said() {
    let dir = tempfile::tempdir().unwrap();
    let mut device = Device::new();
    let child = device.recorder(dir.path(), &["--blocks", "5"]);
    device.greet();
    let codes = |k| block(k, "\r\n");
    device.say(codes(0).replacen("481,", "4x1,", 1).replacen("482,", "70000,", 1).as_bytes());
    let short: String = codes(1).split_inclusive(',').take(1 + 99_999 - 17).collect();
    device.say((short + " \r\n").as_bytes());
    device.say(b"what is this\r\n");
    device.say(codes(3).replacen("4020,", "20,", 1).as_bytes());
    device.say(codes(4).as_bytes());
    let output = child.wait_with_output().unwrap();
    let said = said(&output);
    assert!(output.status.success(), "{said}");
    for words in [
        "block 0: missing samples: 2 no code of [0, 1023], the first \"70000\" at 6",
        "block 1: missing samples: 17 that did not come, taken to be the last",
        "block 2 is left out: the device said \"what is this\"",
        "block 3 is left out: block 0 has `frame_position` = 20",
    ] {
        assert!(said.contains(words), "`{words}` is not in {said}");
    }
    assert_eq!(blocks(dir.path()), 3);
    let text = std::fs::read_to_string(dir.path().join("rec/session.json")).unwrap();
    let session: serde_json::Value = serde_json::from_str(&text).unwrap();
    // three last codes, two bad ones, and 17 that did not come
    assert_eq!(session["compressive"]["samples"]["missing"], 3 + 2 + 17);
    succeeds(dir.path(), &["decode", "rec"]);
}

/// What stands in the way of a recording is said before the device is woken.
#[test]
fn a_recording_that_cannot_be_written_is_not_begun() {
    let dir = tempfile::tempdir().unwrap();
    let here = dir.path();
    std::fs::write(here.join("file"), "mine").unwrap();
    std::fs::create_dir(here.join("foreign")).unwrap();
    std::fs::write(here.join("foreign/compressive_codes.npy"), "mine").unwrap();
    assert!(Command::new("mkfifo").arg(here.join("pipe")).status().unwrap().success());
    let mut device = Device::new();
    let port = device.port.clone();
    let before = files_but_pipe(here);
    for (arguments, facts) in [
        (&["--out", "file"][..], &["file: is a file"][..]),
        (&["--out", "foreign"], &["compressive_codes.npy: is not a result of an earlier run"]),
        (&["--out", "/"], &["/: "]),
        (&["--object", "a/b"], &["`name` = \"a/b\""]),
        (&["--blocks", "5500"], &["`--blocks` = 5500", "[1, 5000]"]),
        (&["--blocks", "2", "--conditioning", "2"], &["`--conditioning` = 2 is outside [0, 1]"]),
        (&["--idle", "600"], &["`--idle` = 600 is outside [0, 500]"]),
        (&["--port", "/dev/ttyNONE7"], &["`--port` = /dev/ttyNONE7: there is no such port; "]),
        (&["--port", "file"], &["`--port` = file: is not a serial port"]),
        (&["--port", "pipe"], &["`--port` = pipe: is not a serial port"]),
        (&["--port", "/dev/null"], &["`--port` = /dev/null: is not a serial port"]),
    ] {
        let named = if arguments[0] == "--port" { vec!["record"] } else { vec!["record", "--port", &port] };
        refused(here, &[&named[..], arguments].concat(), facts);
    }
    assert!(files_but_pipe(here) == before, "something was written");
    device.end.write_all(b"x").unwrap();
    let waiting = rustix::io::ioctl_fionread(&device.end).unwrap();
    assert_eq!(waiting, 0, "the device was woken");
}

fn files_but_pipe(dir: &Path) -> Vec<std::path::PathBuf> {
    let entries = std::fs::read_dir(dir).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    names.sort();
    names
}

#[test]
fn a_port_has_one_recorder() {
    let dir = tempfile::tempdir().unwrap();
    let mut device = Device::new();
    let mut first = device.recorder(dir.path(), &["--blocks", "1"]);
    device.wait_for_star();
    let second = spts(dir.path(), &["record", "--port", &device.port, "--out", "other"]);
    assert_eq!(second.status.code(), Some(2));
    assert!(said(&second).contains("another program reads this port"), "{}", said(&second));
    first.kill().unwrap();
    first.wait().unwrap();
}
