//! The benchmark through its command: cards, programs that take part, and those that cheat.

use crate::command::{json, refused, spts, succeeds, words};
use serde_json::Value;
use std::path::Path;

fn run(dir: &Path, arguments: &[&str]) -> Value {
    json(dir, &[&["bench", "run"], arguments, &["--json"]].concat())
}

#[test]
fn a_card_does_not_depend_on_the_threads_and_is_verified() {
    let dir = tempfile::tempdir().unwrap();
    let tasks = "auto --quick --tasks small,ball,faults,contacts_3,wires_4 --save cards/1.json --threads 1";
    let card = run(dir.path(), &words(tasks));
    assert_eq!(
        (&card["suite"], &card["track"], &card["split"]),
        (&"touch-1".into(), &"decoder".into(), &"test".into())
    );
    assert_eq!(card["official"], false, "a few tasks are not the suite");
    for task in card["tasks"].as_array().unwrap() {
        let [floor, ceiling, points] = ["floor", "ceiling", "points"].map(|key| &task[key]);
        assert!(floor.as_f64() < ceiling.as_f64() && points["mean"].as_f64() > Some(20.0), "{task}");
        assert!(
            task["entries"]
                .as_array()
                .unwrap()
                .iter()
                .all(|e| e["score"]["low"].as_f64() <= e["score"]["high"].as_f64())
        );
    }
    let said = succeeds(dir.path(), &words("bench verify cards/1.json --threads 3"));
    assert!(String::from_utf8_lossy(&said.stdout).contains("equal"));
    // as a leaderboard
    succeeds(dir.path(), &words("bench table cards/1.json --out board"));
    for name in ["index.html", "cards.json", "tables/leaderboard.csv", "figures/decoder.png"] {
        assert!(dir.path().join("board").join(name).is_file(), "{name}");
    }
    // a task that is left out has no points, and is left out again
    let skipped = run(dir.path(), &words("auto --quick --tasks small,thin --skip thin --save cards/skip.json"));
    assert_eq!(skipped["tasks"][1]["refused"], "left out by --skip");
    assert_eq!(skipped["points"]["mean"].as_f64(), card["tasks"][0]["points"]["mean"].as_f64().map(|p| 0.5 * p));
    succeeds(dir.path(), &words("bench verify cards/skip.json"));
    // a card whose score was raised
    let file = dir.path().join("cards/skip.json");
    let text = std::fs::read_to_string(&file).unwrap();
    let mean = skipped["tasks"][0]["entries"][0]["score"]["mean"].to_string();
    std::fs::write(&file, text.replacen(&mean, "0.999", 1)).unwrap();
    let differs = spts(dir.path(), &words("bench verify cards/skip.json"));
    let said = String::from_utf8_lossy(&differs.stderr);
    assert!(differs.status.code() == Some(1) && said.contains("small.score at 7 measurements"), "{said}");
    refused(dir.path(), &words("bench table cards/skip.json"), &["`tasks[0]` small: `points`"]);
    std::fs::write(&file, text.replace("\"official\": false", "\"official\": true")).unwrap();
    refused(dir.path(), &words("bench table cards/skip.json"), &["`official` = true"]);
    let differs = spts(dir.path(), &words("bench verify cards/skip.json"));
    assert!(String::from_utf8_lossy(&differs.stderr).contains("`official`: the card has true; run again it is false"));
}

/// Programs in POSIX shell and Python without packages, as anybody may write them.
#[test]
fn programs_take_part_and_cheats_gain_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(dir.path().join(name), text).unwrap();
    // knows all touches of the public split by heart: answers with the one whose samples are nearest
    write(
        "heart.py",
        "import json, sys\nheader = json.loads(sys.stdin.readline())\nknown = json.load(open('known.json'))\n\
         for line in sys.stdin:\n    y = json.loads(line)['y']\n    m = len(y)\n\
         \x20   error = lambda k: sum((a - b) ** 2 for a, b in zip(known['y'][k], y))\n\
         \x20   best = min(range(len(known['y'])), key=error)\n\
         \x20   print(json.dumps({'image': known['images'][best]}), flush=True)\n",
    );
    succeeds(dir.path(), &words("bench data thin --out data"));
    let array = |name: &str| spts::session::read_npy(&dir.path().join("data").join(name)).unwrap();
    let (y, images) = (array("y.npy"), array("images.npy"));
    let rows =
        |a: &spts::session::NpyArray| -> Vec<Vec<f64>> { a.values.chunks(a.shape[1]).map(<[f64]>::to_vec).collect() };
    write("known.json", &serde_json::json!({"y": rows(&y), "images": rows(&images)}).to_string());
    let points = |arguments: &[&str]| {
        let card = run(dir.path(), arguments);
        let score = card["tasks"][0]["entries"].as_array().unwrap().last().unwrap()["score"]["mean"].as_f64().unwrap();
        (score, card["points"]["mean"].as_f64().unwrap())
    };
    let by_heart = ["heart=python3 heart.py", "--tasks", "thin"];
    let (public, _) = points(&[&by_heart[..], &["--public"]].concat());
    let (test, gained) = points(&by_heart);
    assert!(public > 0.95, "{public} on what it knows by heart");
    assert!(test < 0.5 && gained < 40.0, "{test}, {gained} points on what it does not");

    // its own rows: one that shows what a row is, and one with a level that no row has
    let own = |row: &str| {
        format!(
            "import json, sys\nheader = json.loads(sys.stdin.readline())\nn = header['taxels']\nfor line in sys.stdin:\n\
             \x20   asked = json.loads(line)\n\
             \x20   answer = {{'rows': [{row} for i in range(asked['rows'])]}} if 'rows' in asked else {{'image': [1.0] * n}}\n\
             \x20   print(json.dumps(answer), flush=True)\n"
        )
    };
    write("rows.py", &own("'+' * (n - i) + '-' * i"));
    let card = run(dir.path(), &["rows=python3 rows.py", "--track", "rows", "--tasks", "small", "--quick"]);
    assert_eq!((&card["track"], &card["entrant"]), (&"rows".into(), &"rows".into()));
    write("level.py", &own("'0' * n"));
    refused(
        dir.path(),
        &["bench", "run", "python3 level.py", "--track", "rows", "--tasks", "small"],
        &["rows that are not 7 strings of 100 signs"],
    );

    // a whole readout: a scan of what it may measure; and one that measures more
    let scan = |count: &str| {
        format!(
            "import json, sys\nheader = json.loads(sys.stdin.readline())\nn = header['taxels']\nfor line in sys.stdin:\n\
             \x20   asked = json.loads(line)\n    if 'read' in asked:\n        m = min({count}, n)\n\
             \x20       answer = {{'measure': ['0' * k + '+' + '0' * (n - k - 1) for k in range(m)]}}\n\
             \x20   else:\n        answer = {{'image': [max(v, 0) for v in asked['y']] + [0] * (n - m)}}\n\
             \x20   print(json.dumps(answer), flush=True)\n"
        )
    };
    write("scan.py", &scan("asked['read']"));
    let card = run(dir.path(), &["python3 scan.py", "--track", "readout", "--tasks", "small", "--quick"]);
    let entries = card["tasks"][0]["entries"].as_array().unwrap();
    let whole = entries.iter().find(|e| e["measurements"] == 100).unwrap();
    assert!(whole["score"]["mean"].as_f64() > Some(0.5), "{whole}");
    write("more.py", &scan("asked['read'] + 1"));
    refused(
        dir.path(),
        &["bench", "run", "python3 more.py", "--track", "readout", "--tasks", "small"],
        &["8 rows to measure; 7 are left"],
    );
}

#[test]
fn the_help_has_examples_and_the_list_names_all() {
    let dir = tempfile::tempdir().unwrap();
    let help = succeeds(dir.path(), &words("bench run --help"));
    assert!(String::from_utf8_lossy(&help.stdout).contains("spts bench run mine.py --quick"));
    let listed = json(dir.path(), &words("bench list --json"));
    let tasks = listed["tasks"].as_array().unwrap();
    assert_eq!((tasks.len(), &listed["suite"]), (16, &"touch-1".into()));
}
