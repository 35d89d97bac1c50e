//! Problems that people had with their own files, here and in neighbouring projects: each is an input in
//! `tests/reports` and a case in `tests/reports/cases.toml`.

use crate::command::spts;
use serde::Deserialize;
use serde_json::Value;
use std::collections::BTreeMap;
use std::path::Path;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Cases {
    /// Words that stand for others.
    short: BTreeMap<String, String>,
    case: Vec<Case>,
}

/// A command, and what a user gets of it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Case {
    /// What went wrong.
    what: String,
    /// Arguments, as a shell would have them, in the folder `tests/reports`; `OUT` is an empty folder.
    run: String,
    /// Status of the end.
    #[serde(default)]
    exit: i32,
    /// What is printed, and what is not.
    #[serde(default)]
    says: Vec<String>,
    #[serde(default)]
    silent: Vec<String>,
    /// Least and greatest value of numbers in the JSON that is printed, by their JSON pointers.
    #[serde(default)]
    values: BTreeMap<String, [f64; 2]>,
}

impl Case {
    /// What is not as it has to be.
    fn faults(&self, short: &BTreeMap<String, String>, folder: &Path) -> Vec<String> {
        let out = tempfile::tempdir().expect("a folder for results");
        let line = short.iter().fold(self.run.clone(), |run, (word, long)| run.replace(word, long));
        let line = line.replace("OUT", &out.path().join("out").to_string_lossy());
        let words = shlex::split(&line).expect("`run` is as a shell would have it");
        let words: Vec<&str> = words.iter().map(String::as_str).collect();
        let output = spts(folder, &words);
        let printed = String::from_utf8_lossy(&output.stdout);
        let said = format!("{printed}{}", String::from_utf8_lossy(&output.stderr));
        let mut faults = Vec::new();
        if output.status.code() != Some(self.exit) {
            faults.push(format!("status {:?} in place of {}", output.status.code(), self.exit));
        }
        faults
            .extend(self.says.iter().filter(|text| !said.contains(*text)).map(|text| format!("{text:?} is not said")));
        faults.extend(self.silent.iter().filter(|text| said.contains(*text)).map(|text| format!("{text:?} is said")));
        let json: Value = serde_json::from_str(&printed).unwrap_or_default();
        for (pointer, [least, most]) in &self.values {
            let value = json.pointer(pointer).and_then(Value::as_f64);
            if !value.is_some_and(|value| (*least..=*most).contains(&value)) {
                faults.push(format!("{pointer} = {value:?} is outside [{least}, {most}]"));
            }
        }
        if !faults.is_empty() {
            faults.insert(0, format!("\n{}: spts {}", self.what, self.run));
            faults.push(said);
        }
        faults
    }
}

#[test]
fn what_people_bring_is_read_right_or_refused_with_a_reason() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("reports");
    let text = std::fs::read_to_string(folder.join("cases.toml")).unwrap();
    let cases: Cases = toml::from_str(&text).unwrap();
    assert!(!cases.case.is_empty());
    let faults: Vec<String> = cases.case.iter().flat_map(|case| case.faults(&cases.short, &folder)).collect();
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
