//! The study on its smallest scale.

use super::*;

/// A study of two scenes on the levels at one coarse and the reference's own resolution.
fn study(scenes: &[&str]) -> FidelityReport {
    let meshes = tempfile::tempdir().unwrap();
    let study = FidelityStudy {
        scenes: scenes.iter().map(|&s| s.to_owned()).collect(),
        grid: SettingGrid {
            cells_per_taxel: vec![2],
            press_steps_s: vec![5e-4],
            drop_steps_s: vec![1e-4],
            reference_cells: 4,
        },
        seed: 1,
    };
    study.run(meshes.path(), &()).unwrap()
}

/// The reference has no error; every other level has one, and the layer's own coarser resolution a smaller one than the
/// half-space, which has no base under it.
#[test]
fn errors_are_ordered() {
    let report = study(&["T", "drop"]);
    let row = |scene: &str, level: &str, cells: usize| {
        let found = |r: &&MeasuredSetting| r.scene == scene && r.level == level && r.cells_per_taxel == cells;
        report.rows.iter().find(found).unwrap()
    };
    for scene in ["T", "drop"] {
        let reference = row(scene, "layer", 4);
        assert!(
            reference.taxel_rms_rel <= 0.0 && reference.pressure_rms_rel <= 0.0,
            "{reference:?}"
        );
        let (layer, half_space) = (row(scene, "layer", 2), row(scene, "half_space", 2));
        assert!(
            layer.taxel_rms_rel > 0.0 && layer.taxel_rms_rel < half_space.taxel_rms_rel,
            "{layer:?} {half_space:?}"
        );
        assert!(row(scene, "winkler", 2).cost_us_per_step > 0.0);
    }
    assert!(report.rows.iter().all(|r| r.scene != "drop" || r.level != "footprint"));
}

#[test]
fn unknown_scenes_are_refused_by_name() {
    let dir = tempfile::tempdir().unwrap();
    let names = ["spher".to_owned()];
    let error = scenes::build(&names, 1, dir.path()).unwrap_err().to_string();
    assert!(error.contains("spher") && error.contains("sphere, punch"), "{error}");
}
