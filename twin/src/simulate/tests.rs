//! Notes: everything that changes what a recording is worth is said, and nothing is said of a sound scene. And one path
//! to a recording: what a twin records is what a simulated scene holds.

use super::{Prepared, Request, Simulation, Summary, run};
use crate::record::Twin;
use crate::scene::{Assignment, Scene};
use crate::session::{Recorded, Session};
use spts_circuit::{Mode, PROFILES, Profile, Recording};
use spts_contact::mesh::cuboid;
use spts_input::Refusal;
use std::path::Path;

fn prepared(scene: &str, assignments: &[&str]) -> Prepared {
    let request = Request {
        scene: scene.to_owned(),
        assignments: assignments.iter().map(|text| text.parse::<Assignment>().unwrap()).collect(),
    };
    request.prepare().unwrap()
}

/// The one note of `notes` with all of `facts` in it.
fn assert_said(notes: &[String], facts: &[&str]) {
    let said = notes.iter().filter(|note| facts.iter().all(|fact| note.contains(fact)));
    assert_eq!(said.count(), 1, "{facts:?}: {notes:?}");
}

/// Runs the scene, and puts its recordings together as one session.
fn whole(prepared: &Prepared) -> (Simulation, Session) {
    let mut recorded: [Vec<Recorded>; 2] = Default::default();
    let simulation = run(prepared, true, &|| (), |piece| {
        for (all, piece) in recorded.iter_mut().zip([piece.raster, piece.compressive]) {
            all.extend(piece);
        }
        Ok::<_, Refusal>(())
    });
    let [raster, compressive] = recorded.map(|pieces| {
        let info = pieces.first()?.recording.info().clone();
        let blocks = pieces.iter().flat_map(|p| p.recording.blocks().to_vec()).collect();
        let presses = pieces.iter().flat_map(|p| p.presses.clone()).collect();
        Some(Recorded { presses, ..Recorded::new(Recording::new(info, blocks).unwrap()) })
    });
    let simulation = simulation.unwrap();
    let session = Session { raster, compressive, ..simulation.first.clone().unwrap() };
    (simulation, session)
}

/// Runs the scene and gives the notes of its summary.
fn notes(prepared: &Prepared) -> Vec<String> {
    let simulation = run(prepared, true, &|| (), |_| Ok::<_, Refusal>(())).unwrap();
    Summary::new(prepared, &simulation).notes
}

fn write(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.to_str().unwrap().to_owned()
}

/// The shipped profile `name` with `more` behind it.
fn profile(name: &str, more: &str) -> String {
    let (_, text) = PROFILES.iter().find(|(known, _)| *known == name).unwrap();
    format!("{more}\n{text}")
}

/// Sound scenes on skins of three sizes.
#[test]
fn there_is_nothing_to_say_of_a_sound_scene() {
    // seeds that are addresses make rows of equal signs, which would saturate where so many taxels are pressed
    let fine = ["skin.pitch_m=0.005", "skin.rows=32", "skin.cols=32", "rows.seeding=mixed", "press.force_n=8"];
    for more in [&[][..], &fine, &["skin.rows=12", "skin.cols=20"]] {
        let scene = prepared("press/rec", &[&["contact.model=footprint"], more].concat());
        assert!(notes(&scene).is_empty(), "{more:?}: {:?}", notes(&scene));
    }
}

/// A block of 40 mm × 20 mm with its middle 5 mm within the edge of the sheet: 15 mm of it hang over. In the middle
/// nothing does.
#[test]
fn an_object_over_the_edge_is_measured() {
    let folder = tempfile::tempdir().unwrap();
    let block = cuboid([40e-3, 20e-3, 10e-3]);
    let mesh = format!("press.mesh={}", write(folder.path(), "block.obj", &block.to_obj("block")));
    let at = |place: &str| prepared("press", &[&mesh, "contact.model=footprint", place]).notes;
    assert_said(&at("press.position_m=[0.07, 0]"), &["hangs 15.0 mm over the edge at the last column:"]);
    assert_said(&at("press.position_m=[0, -0.07]"), &["hangs 5.0 mm over the edge at the last row:"]);
    assert_said(
        &at("press.position_share=[-0.5, 0.5]"),
        &["10.0 mm over the edge at row 0, 20.0 mm over the edge at column 0"],
    );
    assert!(at("press.position_m=[0.054, 0.064]").is_empty());
}

#[test]
fn faults_are_named_with_their_place() {
    let scene = prepared(
        "press/rec",
        &[
            "skin.rows=12",
            "skin.cols=20",
            "faults.+={ name = \"dead\", taxel = 47 }",
            "faults.+={ name = \"stuck\", taxel = 0 }",
        ],
    );
    assert_said(&scene.notes, &["`dead`, taxel 47 (row 2, column 7)"]);
    assert_said(&scene.notes, &["`stuck`, taxel 0 (row 0, column 0)"]);
}

/// What a tolerance chose, and the same words when the saved scene is prepared again; a contact of one's own ends that.
#[test]
fn the_choice_of_a_tolerance_is_said() {
    let scene = prepared("press/rec", &["tolerance=0.3"]);
    let model = scene.scene.mechanics().config().contact["model"].to_string();
    assert_said(&scene.notes, &["tolerance of 0.3", &model, "cells along a taxel"]);
    let folder = tempfile::tempdir().unwrap();
    let saved = write(folder.path(), "scene.toml", &scene.scene_toml);
    let again = prepared(&saved, &["name=rec"]);
    assert_eq!((&again.notes, &again.scene_hash), (&scene.notes, &scene.scene_hash));
    assert!(prepared(&saved, &["contact.model=footprint"]).notes.is_empty());
}

/// A resistor as it is on an electrode of a ninth of the area: 0.07 V of a taxel against 0.1 V of noise. Scaled, it
/// is not below the noise.
#[test]
fn a_taxel_below_the_noise_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let fixed = write(folder.path(), "fixed.toml", &profile("as_built", "feedback_scales = false"));
    let readout = format!("readout={fixed}");
    let small = prepared("press/rec", &["skin.pitch_m=0.005", "skin.rows=30", "skin.cols=30", &readout]);
    assert_said(&small.notes, &["a taxel under 10 kPa", "is below the noise", "electrode of 3.3 mm"]);
    assert!(prepared("press/rec", &[&readout]).notes.is_empty());
    for name in ["ideal", "as_published", "as_designed"] {
        let scaled = format!("readout={name}");
        let scene = prepared("press/rec", &["skin.pitch_m=0.005", "skin.rows=30", "skin.cols=30", &scaled]);
        assert!(scene.notes.is_empty(), "{name}: {:?}", scene.notes);
    }
}

/// A drive of twenty times the volts leaves the ranges in both modes, and in each the share is that of the samples at
/// an end.
#[test]
fn saturated_samples_are_counted_in_each_mode() {
    let folder = tempfile::tempdir().unwrap();
    let (_, as_built) = PROFILES.iter().find(|(name, _)| *name == "as_built").unwrap();
    let strong = as_built.replace("drive_v = 4.3", "drive_v = 86.0");
    assert!((Profile::from_toml(&strong).unwrap().drive_v - 86.0).abs() < 1e-12);
    let readout = format!("readout={}", write(folder.path(), "strong.toml", &strong));
    let scene = prepared("press/rec", &["contact.model=footprint", &readout]);
    let (simulation, session) = whole(&scene);
    let notes = Summary::new(&scene, &simulation).notes;
    for recording in [session.raster().unwrap(), session.compressive().unwrap()] {
        let converter = recording.converter().unwrap();
        let ends = [converter.volts(0), converter.volts(1), converter.volts(converter.max_code())].map(f64::to_bits);
        let volts = &recording.blocks()[0].volts;
        // a rail of 32 V lies within a code of the last volts of the compressive converter
        let ends = if recording.mode() == Mode::Raster { &ends[..1] } else { &ends[..] };
        let count = volts.iter().filter(|v| ends.contains(&v.to_bits()) || v.abs() >= 32.0 - 0.0631).count();
        assert!(count > 100, "{count}");
        let fact = format!("{}: {count} of {} samples", recording.mode().name(), volts.len());
        assert_said(&notes, &[&fact, "at the end of the converter's or the amplifier's range"]);
    }
}

/// The firmware's raster selects 100 taxels: on 7 × 16 the compressive recording is made alone, with 112 emulated cells
/// that put out the model's codes, and the note says why there is no scan.
#[test]
fn cells_that_cannot_scan_record_compressively_alone() {
    let folder = tempfile::tempdir().unwrap();
    let slow = profile("ideal", "").replace("64300.0", "8000.0");
    let readout = format!("readout={}", write(folder.path(), "slow.toml", &slow));
    let mut settings = vec![
        readout.as_str(),
        "skin.rows=7",
        "skin.cols=16",
        "contact.model=footprint",
        "weights=firmware",
        "rows.seeding=mixed",
        "press.duration_s=0.8",
        "press.onset_s=0.28",
        "press.rise_s=0.1",
        "press.lift_s=0.75",
    ];
    let emulated = prepared("press/rec", &settings);
    let (simulation, session) = whole(&emulated);
    let notes = Summary::new(&emulated, &simulation).notes;
    assert_said(&notes, &["no raster scan", "112 taxels", "firmware's raster has 100"]);
    assert!(session.raster.is_none());
    settings.push("weights=model");
    let (_, model) = whole(&prepared("press/rec", &settings));
    assert!(model.raster.is_some());
    assert_eq!(session.compressive(), model.compressive());
}

/// Presses that are not stepped, and drops of a third of a second.
const SCENES: [(&str, &[&str]); 2] = [
    ("press/T", &["press.presses=5", "contact.model=footprint"]),
    ("bounce", &["drop.drops=3", "drop.height_m=0.05", "drop.duration_s=0.3"]),
];

/// All bits of the samples.
fn bits(recorded: &Recorded) -> Vec<u64> {
    let blocks = recorded.recording.blocks().iter();
    blocks.flat_map(|block| block.volts.iter().map(|v| v.to_bits())).collect()
}

/// Every recording that a scene can have, made alone and at once on all threads, is that of the whole run, piece by
/// piece on one thread, bit for bit.
#[test]
fn one_mode_alone_is_the_same_as_in_a_run() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for (scene, assignments) in SCENES {
        let prepared = prepared(scene, assignments);
        let (_, whole) = pool.install(|| whole(&prepared));
        let twin = Twin::new(&prepared.scene).unwrap();
        let raster = twin.record(Mode::Raster).unwrap();
        let compressive = twin.record(Mode::Compressive).unwrap();
        assert!(raster.compressive.is_none() && compressive.raster.is_none());
        for (alone, together) in [(&raster.raster, &whole.raster), (&compressive.compressive, &whole.compressive)] {
            let (alone, together) = (alone.as_ref().unwrap(), together.as_ref().unwrap());
            assert_eq!(alone, together, "{scene}");
            assert!(bits(alone) == bits(together), "{scene}");
            assert_eq!(alone.presses.len(), prepared.scene.repeats());
        }
        // and all that is said of them
        let both = Session { raster: raster.raster, ..compressive };
        assert_eq!(both, whole);
    }
}

/// The raster of emulated cells has a hundred taxels: a larger skin is refused before the first press, and only in this
/// mode.
#[test]
fn a_mode_that_the_weights_do_not_have_is_refused() {
    let scene =
        "weights = \"firmware\"\ncontact.model = \"footprint\"\n[skin]\nrows = 8\ncols = 14\n[press]\nobject = \"T\"";
    let twin = Twin::new(&Scene::from_toml(scene, "".as_ref()).unwrap()).unwrap();
    assert!(twin.check(Mode::Compressive).is_ok());
    let error = twin.record(Mode::Raster).unwrap_err();
    assert!(error.to_string().contains("a raster scan of 112 taxels"), "{error}");
}
