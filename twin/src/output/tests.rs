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

#[test]
fn results_of_a_run_appear_together_or_not_at_all() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("deep/er");
    let folder = OutputFolder::create(&out).unwrap();
    write_bytes(&out.join("a"), b"old").unwrap();
    let dropped = folder.stage().unwrap();
    write_bytes(&dropped.path("a"), b"half").unwrap();
    drop(dropped);
    assert_eq!(std::fs::read(out.join("a")).unwrap(), b"old");
    let staged = folder.stage().unwrap();
    write_bytes(&staged.path("a"), b"new").unwrap();
    write_bytes(&staged.path("b"), b"new").unwrap();
    assert_eq!(staged.commit().unwrap(), ["a", "b"]);
    assert_eq!(std::fs::read(out.join("a")).unwrap(), b"new");
    assert_eq!(names(&out), ["a", "b"]);
}

#[test]
fn what_is_not_a_folder_or_not_a_file_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    write_bytes(&file, b"precious").unwrap();
    for path in [file.clone(), file.join("below")] {
        let error = OutputFolder::create(&path).unwrap_err();
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
    let staged = OutputFolder::create(dir.path()).unwrap().stage().unwrap();
    write_bytes(&staged.path("figures"), b"in the way").unwrap();
    let in_the_way = staged.folder("figures").unwrap_err();
    let wrong_shape = write_npy(&staged.path("a.npy"), &[4], &[1.0]).unwrap_err();
    for (error, name) in [(in_the_way, "figures"), (wrong_shape, "a.npy")] {
        let text = staged.unstaged(error).to_string();
        let place = dir.path().join(name).display().to_string();
        assert!(text.starts_with(&format!("{place}: ")), "{text}");
    }
}
