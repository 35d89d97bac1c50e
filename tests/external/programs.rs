//! External programs that hang, answer too much, too little or nonsense.

/// A Python program that answers line by line: `body` is done for every window, after `before`.
pub(super) fn lines(before: &str, body: &str, after: &str) -> String {
    format!(
        "python3 -c 'import sys, time, json\nsay = lambda text: print(text, flush=True)\n\
         good = json.dumps(dict(image=[1] * 100))\nsys.stdin.readline()\n{before}\nfor k, line in \
         enumerate(sys.stdin):\n    {body}\n{after}'"
    )
}

/// Programs of a shell: name, program, and what the error says.
const OF_A_SHELL: &str = r#"
answers without reading ## yes '{"label": 0}' ## windows had been sent
answers without reading, slowly ## while :; do echo '{"label": 0}'; sleep .2; done ## windows had been sent
reads nothing ## sleep 1000 ## took longer than the limit of 3 s
ignores SIGTERM ## trap '' TERM HUP INT; while :; do sleep 1; done ## took longer than the limit
closes its output ## exec >&-; cat > /dev/null ## closed its output before it had answered window 1
closes both ## exec >&- <&-; sleep 1000 ## before it had answered window 1
grandchild holds the pipe ## sleep 1000 & exit 0 ## `
a line without an end ## cat /dev/zero ## a line of more than 10496 bytes
floods standard error ## yes | head -c 10000000 >&2; sleep 1000 ## took longer
"#;

/// Programs that go on line by line: name, what they do before, for every window, and after, and what the error says.
const OF_LINES: &str = r#"
reads, then waits ## ## time.sleep(1000) ## ## the answer to window 1
never flushes ## ## print(good) ## ## does it flush its output?
stops at the fifth ## ## say(good) if k < 4 else time.sleep(1000) ## ## the answer to window 5
one answer ahead ## say(good); time.sleep(.5) ## say(good) ## ## of its output before it had read window
two answers each ## ## say(good + chr(10) + good) ## ## of its output before it had read window
an answer after the last ## ## say(good) ## say(good) ## of its output before it had read window
bad status at the end ## ## say(good) ## sys.exit(7) ## (exit status: 7) after its last answer
killed at the end ## ## say(good) ## import os; os.kill(os.getpid(), 11) ## after its last answer
does not end ## ## say(good) ## time.sleep(1000) ## its end after the last answer took longer
label out of the list ## ## say(json.dumps(dict(label=99))) ## ## `label` = 99; valid:
negative label ## ## say(json.dumps(dict(label=-2))) ## ## `label` = -2; valid:
label and a half ## ## say(json.dumps(dict(label=1.5))) ## ## `label` = 1.5; valid:
label not a number ## ## say(json.dumps(dict(label=float("nan")))) ## ## answered window 1 with
image not a number ## ## say(json.dumps(dict(image=[float("nan")] * 100))) ## ## answered window 1 with
image too short ## ## say(json.dumps(dict(image=[1] * 99))) ## ## an image of 99 values; needed are 100
empty image ## ## say(json.dumps(dict(image=[], label=0))) ## ## an image of 0 values; needed are 100
"#;

/// Name, program, and what the error says.
pub(super) fn hostile() -> Vec<(&'static str, String, &'static str)> {
    let table = OF_A_SHELL.lines().chain(OF_LINES.lines()).filter(|line| !line.is_empty());
    let cells = table.map(|line| line.split("##").map(str::trim).collect::<Vec<_>>());
    let programs = cells.map(|cells| match cells[..] {
        [name, program, said] => (name, program.to_owned(), said),
        [name, before, body, after, said] => (name, lines(before, body, after), said),
        _ => panic!("{cells:?}"),
    });
    programs.collect()
}
