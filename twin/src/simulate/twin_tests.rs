//! One path to a recording: what a twin records is what a simulated scene holds.

use super::tests::whole;
use super::{Prepared, Request};
use crate::record::{Twin, TwinError};
use crate::scene::Scene;
use crate::session::{Recorded, Session};
use spts_circuit::Mode;

/// Presses that are not stepped, and drops of a third of a second.
const SCENES: [(&str, &[&str]); 2] = [
    ("press/T", &["press.presses=5", "contact.model=footprint"]),
    ("bounce", &["drop.drops=3", "drop.height_m=0.05", "drop.duration_s=0.3"]),
];

fn prepared(scene: &str, assignments: &[&str]) -> Prepared {
    let assignments = assignments.iter().map(|text| text.parse().unwrap()).collect();
    let scene = scene.to_owned();
    Request { scene, assignments }.prepare().unwrap()
}

/// All bits of the samples.
fn bits(recorded: &Recorded) -> Vec<u64> {
    let blocks = recorded.recording.blocks().iter();
    blocks
        .flat_map(|block| block.volts.iter().map(|v| v.to_bits()))
        .collect()
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
        for (alone, together) in [
            (&raster.raster, &whole.raster),
            (&compressive.compressive, &whole.compressive),
        ] {
            let (alone, together) = (alone.as_ref().unwrap(), together.as_ref().unwrap());
            assert_eq!(alone, together, "{scene}");
            assert!(bits(alone) == bits(together), "{scene}");
            assert_eq!(alone.presses.len(), prepared.scene.repeats());
        }
        // and all that is said of them
        let both = Session {
            raster: raster.raster,
            ..compressive
        };
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
    assert!(matches!(&error, TwinError::Chain(_)), "{error}");
    assert!(error.to_string().contains("a raster scan of 112 taxels"), "{error}");
}
