//! Specs that cannot be are refused with field, value and what is valid.

use crate::spec::Spec;

fn refused(text: &str) -> String {
    Spec::from_toml(text, &toml::Table::new(), ".".as_ref())
        .unwrap_err()
        .to_string()
}

#[test]
fn nonsense_is_refused_with_its_name() {
    for (text, said) in [
        ("rows = 0", &["`rows` = 0", "[1, 10^12]"][..]),
        ("rows = -1", &["`rows` = -1"]),
        ("row = 1", &["unknown field `row`"]),
        ("name = \"a b\"", &["`name` = \"a b\"", "letters"]),
        ("name = \"\\u001b[31m\"", &["`name` = ", "\\u{1b}"]),
        ("seed = -1", &["`seed` = -1"]),
        ("rows_per_shard = 0", &["`rows_per_shard` = 0", "[1, 10^6]"]),
        (
            "rows_per_shard = 30\n[record]\nwindows = 20",
            &["`rows_per_shard` = 30", "`record.windows` = 20"],
        ),
        ("[record]\nwindows = 0", &["`record.windows` = 0", "[1, 10000]"]),
        ("[record]\nmeasurements = 0", &["`record.measurements` = 0"]),
        (
            "[record]\nmeasurements = 1000000\nphi = true",
            &["record.measurements × taxels", "[1, 2^22]"],
        ),
        ("[record]\nlabels = [\"image\"]", &["`record.labels`", "`pressure`"]),
        (
            "[transducer]\nexponent = { uniform = [0.4, 9.0] }",
            &["`transducer.exponent` = 9", "[0.05, 2]"],
        ),
        ("[object]\nrows_per_shape = 0", &["`object.rows_per_shape` = 0"]),
        ("[object]\ncount = 4", &["`object.count` = 4", "[1, 3]"]),
        ("[object]\nfrom = \"clouds\"", &["clouds"]),
        (
            "[object]\nnames = [\"cloud\"]",
            &["`object.names` = \"cloud\"", "known: plate"],
        ),
        ("[object]\nnames = []", &["`object.names` = []"]),
        (
            "[object]\nfrom = \"objects\"\nnames = [\"brian\"]",
            &["\"brian\"", "known: brain"],
        ),
        (
            "[object]\nfrom = \"objects\"\nsize_m = [0.1, 0.2]",
            &["`object.size_m` is not for this"],
        ),
        ("[object]\nsize_m = [0.2, 0.1]", &["`object.size_m[0]` = 0.2"]),
        ("[object]\nsize_m = [0.0, 0.1]", &["`object.size_m[0]` = 0", "m"]),
        ("[object]\nfrom = \"meshes\"", &["`object.folder` is needed"]),
        (
            "[object]\nfrom = \"meshes\"\nfolder = \"nowhere\"",
            &["`object.folder`: ", "nowhere"],
        ),
        ("[pose]\nabout = \"placement\"", &["`pose.about` = \"placement\""]),
        ("[pose]\nx_share = 2", &["`pose.x_share` = 2", "[-1, 1]"]),
        (
            "[pose]\nx_share = { uniform = [-3, 0] }",
            &["`pose.x_share` = -3", "[-1, 1]"],
        ),
        ("[pose]\nx_share = { normal = [0, 1] }", &["`pose.x_share` = -4"]),
        (
            "[pose]\nx_share = { beta = [0, 1] }",
            &["`pose.x_share", "`beta` is not a distribution"],
        ),
        ("[pose]\ntilt_x_deg = nan", &["`pose.tilt_x_deg`", "NaN is not finite"]),
        ("[press]\nforce_n = 0", &["`press.force_n` = 0", "[0.01, 1000] N"]),
        (
            "[press]\nforce_n = { log_uniform = [-1, 1] }",
            &["`press.force_n.log_uniform`", "-1 is not above 0"],
        ),
        (
            "[press]\nforce_n = \"much\"",
            &["`press.force_n`", "a number or a table"],
        ),
        ("[contact]\nmodel = \"glue\"", &["`contact.model` = \"glue\""]),
        (
            "[record]\nwhat = \"drop\"",
            &["`record.what` = \"drop\"", "`object.from` = \"ball\""],
        ),
        ("[object]\nfrom = \"ball\"", &["go together"]),
        ("[drop]\nheight_m = 1", &["`[drop]` is for"]),
        (
            "[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[drop]\nheight_m = 9",
            &["`drop.height_m` = 9", "[0.001, 5] m"],
        ),
        (
            "[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[contact]\nmodel = \"footprint\"",
            &["\"footprint\"", "\"winkler\""],
        ),
        (
            "[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[press]\nforce_n = 3",
            &["`[press]` is not for drops"],
        ),
        (
            "[object]\nfrom = \"ball\"\n[record]\nwhat = \"drop\"\n[pose]\ntilt_x_deg = 3",
            &["`pose.tilt_x_deg` is not for drops"],
        ),
        (
            "[object]\ncount = 2\n[record]\nwhat = \"course\"",
            &["`object.count` = 2", "valid: 1"],
        ),
        (
            "[press]\nhold_s = 0.3\n[record]\nwhat = \"course\"",
            &["`press.hold_s` = 0.3", "above 0.451 s"],
        ),
        (
            "[press]\nforce_n = 200\n[contact]\nmodel = \"layer\"",
            &["`press.force_n` = 200", "[0.5, 100] N"],
        ),
        ("[record]\nbefore_s = 0.1", &["`record.before_s` is not for"]),
        (
            "[press]\nhold_s = 100\n[contact]\nmodel = \"winkler\"",
            &["length of what is followed in time", "[0, 59.5] s"],
        ),
        (
            "[skin]\nrows = 1000\ncols = 1000\n[contact]\nmodel = \"winkler\"\ncells_per_taxel = 1",
            &["frames × taxels", "[1, 2^27]"],
        ),
        (
            "[record]\ninterval_s = 1e-4",
            &["`record.interval_s` = 0.0001", "sample rate"],
        ),
        ("[record]\ninterval_s = nan", &["`record.interval_s` = NaN"]),
        (
            "[skin]\nrows = 64\ncols = 64\n[record]\nwindows = 10000\ninterval_s = 0.01",
            &["record.windows × taxels", "[1, 2^24]"],
        ),
        (
            "[object]\nfrom = \"objects\"\ncount = 2\n[split]\nby = \"object\"",
            &["`split.by` = \"object\"", "`object.count` = 1"],
        ),
        ("[contact]\ncells_per_taxel = 0", &["`contact.cells_per_taxel` = 0"]),
        ("[skin]\nrows = 0", &["`skin.rows` = 0"]),
        ("[skin]\npitch_m = 1e308", &["`skin.pitch_m` = 1e308"]),
        ("[skin]\nrows_per_skin = 0", &["`skin.rows_per_skin` = 0"]),
        ("[skin]\nseed = -1", &["`skin.seed` = -1", "[0, 2^53]"]),
        ("[transducer]\nmodel = \"rubber\"", &["\"rubber\"", "velostat"]),
        ("[transducer]\ntemperature_c = 500", &["temperature_c", "500"]),
        (
            "[transducer]\ntemperature_c = { uniform = [9, 3] }",
            &["`transducer.temperature_c", "9 is above 3"],
        ),
        ("readout = \"perfect\"", &["\"perfect\"", "as_built"]),
        ("readout = \"nowhere.toml\"", &["nowhere.toml"]),
        ("[weights]\nseeds = [1, 2]", &["`weights.seeds`", "valid: 100"]),
        ("[faults]\ncount = 101", &["`faults.count` = 101"]),
        ("[faults]\nnames = [\"gremlin\"]", &["\"gremlin\"", "known: dead"]),
        (
            "[split]\ntest = 0.7\nvalidation = 0.7",
            &["split.validation + split.test", "1.4"],
        ),
        ("rows = ", &["rows"]),
    ] {
        let error = refused(text);
        for fact in said {
            assert!(error.contains(fact), "{text:?}: `{fact}` is not in: {error}");
        }
        assert!(!error.contains('\n') && !error.contains('\u{1b}'), "{error:?}");
    }
}

/// What is written comes back, and two specs that differ have two identities.
#[test]
fn a_spec_is_its_text() {
    let overrides: toml::Table = toml::from_str("rows = 77").unwrap();
    let spec = Spec::load("random-shapes", &overrides).unwrap();
    let again = Spec::from_toml(spec.text(), &toml::Table::new(), ".".as_ref()).unwrap();
    assert_eq!((spec.identity(), again.config().rows), (again.identity(), 77));
    let other = Spec::load("random-shapes", &toml::Table::new()).unwrap();
    assert_ne!(spec.identity(), other.identity());
    assert!(
        Spec::load("random_shapes", &toml::Table::new())
            .unwrap_err()
            .to_string()
            .contains("random-shapes")
    );
}

/// A folder of meshes is read, and its files are a part of what the data set is.
#[test]
fn mesh_files_are_part_of_a_spec() {
    let dir = tempfile::tempdir().unwrap();
    let meshes = dir.path().join("meshes");
    std::fs::create_dir(&meshes).unwrap();
    let write = |name: &str, side_m: f64| {
        let block = spts_contact::mesh::cuboid([side_m, 0.03, 0.02]);
        std::fs::write(meshes.join(name), block.to_obj("block")).unwrap();
    };
    write("a.obj", 0.04);
    write("b.OBJ", 0.05);
    std::fs::write(meshes.join("notes.txt"), "no mesh").unwrap();
    let text = "rows = 30\n[object]\nfrom = \"meshes\"\nfolder = \"meshes\"\nrows_per_shape = 10";
    let read = || Spec::from_toml(text, &toml::Table::new(), dir.path());
    let spec = read().unwrap();
    let mut maker = crate::Maker::new(&spec);
    let names: Vec<String> = [0, 10, 20]
        .map(|k| maker.row(k).unwrap().object(0).unwrap().choice.name.to_string())
        .into();
    assert_eq!(names, ["a", "b", "a"]);
    write("a.obj", 0.06);
    assert_ne!(read().unwrap().identity(), spec.identity());
    std::fs::write(meshes.join("a.obj"), "v 1 2 3").unwrap();
    assert!(read().unwrap_err().to_string().contains("a.obj"));
}
