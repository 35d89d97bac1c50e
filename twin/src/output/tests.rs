use super::*;
use std::io::Write as _;

fn names(dir: &std::path::Path) -> Vec<String> {
    let mut names: Vec<String> = std::fs::read_dir(dir)
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn an_array_is_read_back_bit_for_bit() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.npy");
    let values = [0.1, -0.0, f64::NAN, f64::INFINITY, 5e-324, 1.0 / 3.0];
    write_npy(&path, &[2, 3], &values).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    let npy = npyz::NpyFile::new(&bytes[..]).unwrap();
    assert_eq!(
        (npy.shape(), npy.order(), npy.dtype().descr()),
        (&[2, 3][..], npyz::Order::C, "'<f8'".to_owned())
    );
    let back: Vec<f64> = npy.into_vec().unwrap();
    assert!(back.iter().zip(&values).all(|(b, v)| b.to_bits() == v.to_bits()));
    write_npy(&path, &[2, 3], &values).unwrap();
    assert_eq!(std::fs::read(&path).unwrap(), bytes, "same values, other bytes");
    assert!(matches!(
        write_npy(&path, &[4], &values),
        Err(OutputError::Shape { .. })
    ));
}

#[test]
fn a_table_has_the_shortest_numbers_that_read_back() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("t.csv");
    write_csv(
        &path,
        &["press", "time_s", "x", "y"],
        [(0_usize, 0.1, [1e-7, 2.0 / 3.0])],
    )
    .unwrap();
    let text = std::fs::read_to_string(&path).unwrap();
    assert_eq!(text, "press,time_s,x,y\n0,0.1,1e-7,0.6666666666666666\n");
    assert!(write_csv(&path, &["one"], [(1, 2)]).is_err());
    assert_eq!(
        std::fs::read_to_string(&path).unwrap(),
        text,
        "damaged by a refused row"
    );
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("result.csv");
    write_bytes(&path, b"old").unwrap();
    let error = write_with(&path, |out| {
        out.write_all(b"new, and then the disk is full")?;
        Err(std::io::ErrorKind::StorageFull.into())
    })
    .unwrap_err();
    assert!(error.to_string().contains("result.csv"), "{error}");
    assert_eq!(std::fs::read(&path).unwrap(), b"old");
    assert_eq!(names(dir.path()), ["result.csv"]);
}

/// Opens `dir`, writes files with these contents, and commits them.
fn run(dir: &std::path::Path, files: &[(&str, &str)]) -> Result<Vec<String>, OutputError> {
    let out = OutputFolder::open(dir, &[])?;
    for (name, content) in files {
        if let Some((folder, _)) = name.rsplit_once('/') {
            out.folder(folder)?;
        }
        write_bytes(&out.path(name), content.as_bytes())?;
    }
    out.commit()
}

#[test]
fn results_of_a_run_appear_together_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("deep/er");
    assert_eq!(
        run(&out, &[("a", "old"), ("tables/b", "old")]).unwrap(),
        ["a", "tables/b"]
    );
    let dropped = OutputFolder::open(&out, &["a"]).unwrap();
    write_bytes(&dropped.path("a"), b"half").unwrap();
    drop(dropped);
    assert_eq!(std::fs::read(out.join("a")).unwrap(), b"old");
    run(&out, &[("a", "new"), ("c", "new")]).unwrap();
    assert_eq!(std::fs::read(out.join("a")).unwrap(), b"new");
    // what the earlier run has left would stand beside the new results
    assert_eq!(names(&out), ["a", "c", MANIFEST_FILE]);
    assert_eq!(names(&dir.path().join("deep")), ["er"]);
    // a folder that was made for nothing goes again
    drop(OutputFolder::open(&dir.path().join("x/y"), &[]).unwrap());
    assert_eq!(names(dir.path()), ["deep"]);
}

/// However the files of others lie in the folder: few of them, which are linked, or such that results move one by one.
#[test]
fn files_of_others_stay() {
    for others in [
        &["notes.txt", "tables/mine.csv"][..],
        &["mine/deep/er.txt", "notes.txt"],
    ] {
        let dir = tempfile::tempdir().unwrap();
        let out = dir.path().join("out");
        run(&out, &[("a", "old"), ("tables/b", "old")]).unwrap();
        for name in others {
            std::fs::create_dir_all(out.join(name).parent().unwrap()).unwrap();
            std::fs::write(out.join(name), name).unwrap();
        }
        run(&out, &[("a", "new")]).unwrap();
        for name in others {
            assert_eq!(std::fs::read_to_string(out.join(name)).unwrap(), *name);
        }
        assert_eq!(std::fs::read(out.join("a")).unwrap(), b"new");
        assert!(!out.join("tables/b").exists());
        // nor is one replaced
        let error = run(&out, &[("notes.txt", "new")]).unwrap_err();
        assert!(matches!(error, OutputError::NotOurs { .. }), "{error}");
        let error = OutputFolder::open(&out, &["notes.txt"]).unwrap_err().to_string();
        assert!(
            error.starts_with(&out.join("notes.txt").display().to_string()),
            "{error}"
        );
        assert_eq!(std::fs::read_to_string(out.join("notes.txt")).unwrap(), "notes.txt");
    }
}

/// A result that somebody has changed is somebody's file: it is not replaced, and not removed.
#[test]
fn changed_results_stay() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), &[("a", "old"), ("b", "old")]).unwrap();
    std::fs::write(dir.path().join("a"), "mine").unwrap();
    let error = run(dir.path(), &[("a", "new")]).unwrap_err();
    assert!(matches!(error, OutputError::Changed { .. }), "{error}");
    assert_eq!(names(dir.path()), ["a", "b", MANIFEST_FILE]);
    run(dir.path(), &[("b", "new")]).unwrap();
    assert_eq!(std::fs::read_to_string(dir.path().join("a")).unwrap(), "mine");
    // a manifest of somebody's own is nobody's leave to replace what it lists
    std::fs::write(
        dir.path().join(MANIFEST_FILE),
        r#"{"format": "mine", "files": {"b": {}}}"#,
    )
    .unwrap();
    let error = OutputFolder::open(dir.path(), &[]).unwrap_err();
    assert!(error.to_string().contains(MANIFEST_FILE), "{error}");
}

#[test]
fn one_run_at_a_time() {
    let dir = tempfile::tempdir().unwrap();
    let first = OutputFolder::open(dir.path(), &[]).unwrap();
    write_bytes(&first.path("a"), b"first").unwrap();
    let error = OutputFolder::open(dir.path(), &[]).unwrap_err();
    assert!(matches!(error, OutputError::Locked { .. }), "{error}");
    first.commit().unwrap();
    assert_eq!(names(dir.path()), ["a", MANIFEST_FILE]);
    run(dir.path(), &[("a", "second")]).unwrap();
    assert_eq!(std::fs::read(dir.path().join("a")).unwrap(), b"second");
}

/// Results of two runs beside each other are noticed, whoever put them there.
#[test]
fn mixed_results_are_noticed() {
    let dir = tempfile::tempdir().unwrap();
    run(dir.path(), &[("a", "one"), ("below/b", "one")]).unwrap();
    check_whole(dir.path(), &["a", "not listed"]).unwrap();
    check_whole(&dir.path().join("below"), &["b"]).unwrap();
    std::fs::write(dir.path().join("below/b"), "two").unwrap();
    check_whole(dir.path(), &["a"]).unwrap();
    let error = check_whole(&dir.path().join("below"), &["b"]).unwrap_err().to_string();
    assert!(error.contains("below/b") && error.contains(MANIFEST_FILE), "{error}");
    std::fs::create_dir(dir.path().join(".spts-placing")).unwrap();
    let error = check_whole(dir.path(), &["a"]).unwrap_err();
    assert!(matches!(error, OutputError::HalfMade { .. }), "{error}");
}

#[test]
fn what_is_not_a_folder_or_not_a_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    write_bytes(&file, b"precious").unwrap();
    for path in [file.clone(), file.join("below")] {
        let error = OutputFolder::open(&path, &[]).unwrap_err();
        assert!(error.to_string().contains("is a file"), "{error}");
    }
    assert_eq!(std::fs::read(&file).unwrap(), b"precious");
    let error = write_bytes(dir.path(), b"").unwrap_err();
    assert!(matches!(error, OutputError::NotRegular { .. }), "{error}");
    assert!(write_bytes(std::path::Path::new("/dev/full"), b"x").is_err());
}

/// Whatever fails while results wait, the message names where they would have been.
#[test]
fn errors_name_the_final_place() {
    let dir = tempfile::tempdir().unwrap();
    let staged = OutputFolder::open(dir.path(), &[]).unwrap();
    write_bytes(&staged.path("figures"), b"in the way").unwrap();
    let in_the_way = staged.folder("figures").unwrap_err();
    let wrong_shape = write_npy(&staged.path("a.npy"), &[4], &[1.0]).unwrap_err();
    for (error, name) in [(in_the_way, "figures"), (wrong_shape, "a.npy")] {
        let text = staged.unstaged(error).to_string();
        let place = dir.path().join(name).display().to_string();
        assert!(text.starts_with(&format!("{place}: ")), "{text}");
    }
}

/// A half-made folder that somebody has made up: nothing in it is waited for, and nothing outside is touched.
#[test]
fn a_journal_is_read_without_trust() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    let placing = out.join(".spts-placing");
    for below in ["new", "old"] {
        std::fs::create_dir_all(placing.join(below)).unwrap();
    }
    std::fs::write(dir.path().join("precious"), "mine").unwrap();
    for list in ["../precious\n", "/etc/hostname\n"] {
        std::fs::write(placing.join("list"), list).unwrap();
        let error = OutputFolder::open(&out, &[]).unwrap_err().to_string();
        assert!(error.contains("is not below the folder"), "{error}");
    }
    std::fs::remove_file(placing.join("list")).unwrap();
    let made = std::process::Command::new("mkfifo").arg(placing.join("list")).status();
    assert!(made.unwrap().success());
    let error = OutputFolder::open(&out, &[]).unwrap_err().to_string();
    assert!(error.contains("not a regular file"), "{error}");
    assert_eq!(std::fs::read(dir.path().join("precious")).unwrap(), b"mine");
}
