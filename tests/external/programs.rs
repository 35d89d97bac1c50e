//! External programs that hang, answer too much, too little or nonsense.

/// Module of the programs below: NumPy's files without NumPy.
pub(super) const ARRAYS: &str = r#"
import struct, sys, zipfile

def shape(path, name):
    with zipfile.ZipFile(path) as archive:
        data = archive.read(name + ".npy")
    return eval(data[10:10 + struct.unpack("<H", data[8:10])[0]])["shape"]

def header(shape, descr, fortran=False):
    text = repr(dict(descr=descr, fortran_order=fortran, shape=tuple(shape)))
    text += " " * (63 - (10 + len(text)) % 64) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()

def save(path, name, shape, values, descr="<f8", fortran=False):
    data = header(shape, descr, fortran)
    code = {"<f8": "d", "<i8": "q", "<c16": "d", "<U1": "i"}[descr]
    data += struct.pack("<%d%s" % (len(values), code), *values)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name + ".npy", data)

n = shape(sys.argv[1], "y")[0]
out = sys.argv[2]
"#;

/// A Python program that answers a batch of `n` windows: `body` calls `save(out, name, shape, values)`.
pub(super) fn batch(body: &str) -> String {
    format!("python3 -c 'from arrays import *\n{body}' {{windows}} {{answers}}")
}

/// A Python program that answers line by line: `body` is done for every window, after `before`.
pub(super) fn lines(before: &str, body: &str, after: &str) -> String {
    format!(
        "python3 -c 'import sys, time, json\nsay = lambda text: print(text, flush=True)\n\
         good = json.dumps(dict(image=[1] * 100))\nsys.stdin.readline()\n{before}\nfor k, line in \
         enumerate(sys.stdin):\n    {body}\n{after}'"
    )
}

/// Name, program, and what the error says.
pub(super) fn hostile() -> Vec<(&'static str, String, &'static str)> {
    let mut table = vec![
        (
            "answers without reading",
            "yes '{\"label\": 1}'".to_owned(),
            "windows had been sent",
        ),
        (
            "answers without reading, slowly",
            "while :; do echo '{\"label\": 1}'; sleep .2; done".to_owned(),
            "windows had been sent",
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
            "of its output before it had read window",
        ),
        (
            "two answers each",
            "",
            "say(good + chr(10) + good)",
            "",
            "of its output before it had read window",
        ),
        (
            "an answer after the last",
            "",
            "say(good)",
            "say(good)",
            "of its output before it had read window",
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
