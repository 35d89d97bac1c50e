use super::{Event, PressFacts, PressPose, Recorded, SESSION_FILE, Session};
use proptest::prelude::*;
use spts_circuit::{
    Block, CodeScale, Converter, ConverterConfig, Patterns, Recording, RecordingInfo, Seeding, WeightMode, Weights,
};
use spts_models::{Grid, SkinLayout};
use std::path::Path;

/// Bits of everything that a NaN would keep from being compared.
fn bits(session: &Session) -> Vec<u64> {
    let of = |recorded: &Option<Recorded>| -> Vec<u64> {
        let Some(recorded) = recorded else { return Vec::new() };
        let samples = recorded.recording.blocks().iter().flat_map(|block| &block.volts);
        samples.map(|volts| volts.to_bits()).collect()
    };
    [of(&session.raster), of(&session.compressive)].concat()
}

/// The session with its missing samples set to 0, which `==` compares.
fn comparable(mut session: Session) -> Session {
    for recorded in [&mut session.raster, &mut session.compressive].into_iter().flatten() {
        let blocks = recorded.recording.blocks().to_vec();
        let filled = blocks.into_iter().map(|mut block| {
            block.volts.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = 0.0);
            block
        });
        recorded.recording = Recording::new(recorded.recording.info().clone(), filled.collect()).unwrap();
    }
    session
}

fn converter(max_code: u32, raster: bool) -> Converter {
    Converter::new(ConverterConfig {
        offset_v: if raster { 4.3 } else { 32.0 },
        scale: CodeScale::StepV(60.0 / f64::from(max_code)),
        max_code,
        subtract_v: raster.then_some(0.0),
    })
    .unwrap()
}

/// Every kind of weights.
fn weights(kind: u8, taxels: u32) -> Weights {
    let n = taxels as usize;
    match kind {
        0 => Weights::new(WeightMode::Binary, Seeding::Address, taxels),
        1 => Weights::new(WeightMode::Binary, Seeding::Mixed, taxels),
        2 => Weights::new(WeightMode::Analog, Seeding::Mixed, taxels),
        3 => Weights::with_seeds(WeightMode::Binary, (0..taxels).map(|k| k * k + 77).collect::<Vec<_>>()).unwrap(),
        4 => {
            let codes = (0..3 * n).map(|k| if k * 7 % 5 > 2 { 255 } else { 0 }).collect();
            Weights::with_patterns(WeightMode::Binary, Patterns::new(3, codes).unwrap()).unwrap()
        }
        _ => {
            let codes = (0..5 * n).map(|k| u8::try_from(k * 37 % 256).unwrap()).collect();
            Weights::with_patterns(WeightMode::Analog, Patterns::new(5, codes).unwrap()).unwrap()
        }
    }
}

prop_compose! {
    fn recorded(raster: bool, (rows, cols, pitch_mm): (usize, usize, f64))(
        kind in 0_u8..6,
        max_code in prop_oneof![Just(None), Just(Some(1023_u32)), Just(Some(65_535)), Just(Some(1 << 20))],
        blocks in 1_usize..4, frames in 1_usize..5, per_frame in 1_usize..9, noise in any::<u64>(), known in any::<bool>(), conditioning in 0_usize..4,
    ) -> Recorded {
        let layout = SkinLayout::new(rows, cols, pitch_mm * 1e-3, pitch_mm * 0.6e-3).unwrap();
        let taxels = u32::try_from(layout.taxels()).unwrap();
        let weights = if raster { Weights::new(WeightMode::Raster, Seeding::Address, taxels) } else { weights(kind, taxels) };
        let converter = max_code.map(|max_code| converter(max_code, raster));
        let per_frame = if raster { layout.taxels() } else { per_frame };
        let info = RecordingInfo {
            measurements_per_frame: per_frame,
            converter,
            ..RecordingInfo::new(layout, weights, 64_300.0 / pitch_mm)
        };
        let mut state = noise;
        let mut random = move || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            u32::try_from(state >> 33).unwrap()
        };
        let volts = |code: u32| match &converter {
            Some(converter) => converter.volts(code % (converter.max_code() + 1)),
            None => f64::from(code) / 7.0 - 1e6,
        };
        let made = (0..blocks).map(|k| Block {
            frame_position: (k as u64 + 1) * 1000 + u64::from(random() % 1000),
            idle_frames: known.then_some(frames / 2),
            volts: (0..frames * per_frame).map(|_| if random() % 9 == 0 { f64::NAN } else { volts(random()) }).collect(),
        });
        let recording = Recording::new(info, made.collect()).unwrap();
        // from before a block to its end
        let block_s = recording.time_s(recording.frames());
        let facts = |k: usize| PressFacts {
            time_s: Some(block_s * (1.0 - k as f64)),
            pose: Some(PressPose { position_m: [0.1, -0.3, 1.0 / 3.0], quaternion: [1.0, 0.0, 0.0, 0.0] }),
            force_n: k.is_multiple_of(2).then_some(20.0 / 3.0),
            pressure: Some(Grid::from_values(rows, cols, (0..rows * cols).map(|i| i as f64 / 3.0).collect())),
            conductance: (k > 0).then(|| Grid::from_values(rows, cols, vec![1e-5 / 3.0; rows * cols])),
            course: None,
        };
        Recorded { recording, conditioning: conditioning.min(blocks), presses: if known { (0..blocks).map(facts).collect() } else { Vec::new() } }
    }
}

prop_compose! {
    fn session()(skin in (1_usize..6, 1_usize..8, 1.0..30.0_f64))(
        raster in prop::option::of(recorded(true, skin)), compressive in prop::option::of(recorded(false, skin)),
        hold in any::<bool>(), event in prop_oneof![Just(Event::Press), Just(Event::Drop), Just(Event::Touch)],
        name in "[a-zA-Z0-9_ äß\"]{1,12}",
    ) -> Session {
        Session {
            object: format!("{name}!"),
            hold_s: hold.then_some([0.1 + 0.2, 1.0 / 3.0]),
            raster,
            compressive,
            ..Session::new(&name, event)
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn session_to_folder_to_session_is_the_identity(session in session()) {
        let dir = tempfile::tempdir().unwrap();
        session.write(dir.path()).unwrap();
        let back = Session::read(dir.path()).unwrap();
        let expected: Vec<u64> = bits(&session);
        let found = bits(&back);
        prop_assert_eq!(expected.len(), found.len());
        for (a, b) in expected.iter().zip(&found) {
            prop_assert!(a == b || (f64::from_bits(*a).is_nan() && f64::from_bits(*b).is_nan()));
        }
        prop_assert_eq!(comparable(back), comparable(session));
    }
}

/// A session of one block, in `dir`.
fn written(dir: &Path) -> Session {
    let layout = SkinLayout::new(2, 4, 5e-3, 3e-3).unwrap();
    let info = RecordingInfo {
        converter: Some(converter(1023, false)),
        ..RecordingInfo::new(layout, Weights::new(WeightMode::Binary, Seeding::Mixed, 8), 64_300.0)
    };
    let volts = (0..80).map(|k| converter(1023, false).volts(k)).collect();
    let block = Block { frame_position: 10, idle_frames: Some(2), volts };
    let session = Session {
        compressive: Some(Recorded::new(Recording::new(info, vec![block]).unwrap())),
        ..Session::new("cup", Event::Press)
    };
    session.write(dir).unwrap();
    session
}

/// Samples are stored as they left the converter: two bytes each for ten bits.
#[test]
fn codes_are_stored_where_there_is_a_converter() {
    let dir = tempfile::tempdir().unwrap();
    written(dir.path());
    let file = dir.path().join("compressive_codes.npy");
    let length = std::fs::metadata(&file).unwrap().len();
    assert!(length < 80 * 2 + 256, "{length} bytes");
}

/// A recording of one block of two frames.
fn of_mode(mode: WeightMode, cols: usize, per_frame: usize, conditioning: usize) -> Recorded {
    let layout = SkinLayout::new(1, cols, 5e-3, 3e-3).unwrap();
    let weights = Weights::new(mode, Seeding::Mixed, u32::try_from(cols).unwrap());
    let info = RecordingInfo { measurements_per_frame: per_frame, ..RecordingInfo::new(layout, weights, 64_300.0) };
    let block = Block { frame_position: 2, idle_frames: None, volts: vec![0.5; 2 * per_frame] };
    let recording = Recording::new(info, vec![block]).unwrap();
    Recorded { conditioning, ..Recorded::new(recording) }
}

/// The cases of a table: a line each, of what is replaced, by what, and what the error says.
fn cases(table: &'static str) -> impl Iterator<Item = (&'static str, &'static str, &'static str)> {
    table.lines().filter(|line| !line.is_empty()).map(|line| {
        let mut parts = line.split(" | ");
        let mut next = || parts.next().unwrap();
        (next(), next(), next())
    })
}

/// What cannot be read is not written, and the other way round.
#[test]
fn contradictions_are_refused_by_writer_and_reader() {
    let sound = Session {
        hold_s: Some([0.0, 0.5]),
        raster: Some(of_mode(WeightMode::Raster, 4, 4, 1)),
        compressive: Some(of_mode(WeightMode::Binary, 4, 3, 0)),
        ..Session::new("a cup, twice..", Event::Press)
    };
    let dir = tempfile::tempdir().unwrap();
    sound.write(dir.path()).unwrap();
    assert_eq!(Session::read(dir.path()).unwrap(), sound);
    let with = |change: &dyn Fn(&mut Session)| {
        let mut session = sound.clone();
        change(&mut session);
        session
    };
    let raster = |recorded: Recorded| with(&|session| session.raster = Some(recorded.clone()));
    let compressive = |recorded: Recorded| with(&|session| session.compressive = Some(recorded.clone()));
    let hold = |span| with(&|session| session.hold_s = Some(span));
    let mut wrong = vec![
        (
            raster(of_mode(WeightMode::Binary, 4, 4, 0)),
            "`raster.info.weights.mode` = \"binary\" is outside {\"raster\"}",
        ),
        (
            compressive(of_mode(WeightMode::Raster, 4, 4, 0)),
            "`compressive.info.weights.mode` = \"raster\" is outside {\"binary\", \"analog\"}",
        ),
        (raster(of_mode(WeightMode::Raster, 4, 3, 0)), "`raster.info.measurements_per_frame` = 3 is outside {4}"),
        (compressive(of_mode(WeightMode::Binary, 5, 3, 0)), "`compressive.info.layout` = 1 × 5 taxels"),
        (compressive(of_mode(WeightMode::Analog, 4, 3, 2)), "`compressive.conditioning` = 2 is outside [0, 1]"),
        (hold([0.5, 0.5]), "`hold_s` = [0.5, 0.5]"),
        (hold([-1.0, 0.5]), "`hold_s` = [-1, 0.5]"),
        (hold([0.0, f64::INFINITY]), "`hold_s` = [0, inf]"),
        (hold([f64::NAN, 1.0]), "`hold_s` = [NaN, 1]"),
    ];
    for name in ["", ".", "..", "a/b", "/a", "a\\b", "a\nb", "\u{7f}"] {
        wrong.push((with(&|session| name.clone_into(&mut session.name)), "`name` = "));
    }
    for (session, expected) in wrong {
        let empty = tempfile::tempdir().unwrap();
        let said = session.write(empty.path()).unwrap_err().to_string();
        let place = empty.path().join(SESSION_FILE).display().to_string();
        assert!(said.contains(expected) && said.contains(&place), "{expected}: {said}");
        assert_eq!(std::fs::read_dir(empty.path()).unwrap().count(), 0, "{expected}");
    }
    let path = dir.path().join(SESSION_FILE);
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, expected) in cases(
        r#"
"a cup, twice..",\n  "object" | "../x",\n  "object" | `name` = "../x"
"mode": "raster" | "mode": "binary" | `raster.info.weights.mode` = "binary"
"mode": "binary" | "mode": "raster" | `compressive.info.weights.mode` = "raster"
"conditioning": 1 | "conditioning": 7 | `raster.conditioning` = 7 is outside [0, 1]
"#,
    ) {
        let (from, to) = (&*from.replace("\\n", "\n"), &*to.replace("\\n", "\n"));
        assert!(text.contains(from), "{from} in {text}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let said = Session::read(dir.path()).unwrap_err().to_string();
        assert!(said.contains(expected) && said.contains(SESSION_FILE), "{to}: {said}");
    }
}

#[test]
fn what_is_wrong_is_named() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join(SESSION_FILE);
    let session = written(dir.path());
    assert_eq!(Session::read(dir.path()).unwrap(), session);
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, expected) in cases(
        r#"
"schema": 1 | "schema": 999 | `schema` = 999 is not known; this program reads 1 and 2
"spts-session" | "other" | `format` = "other"
"name" | "nam" | nam
"hold_s": null | "hold_s": [2, 1] | `hold_s` = [2, 1]
"missing": 0 | "missing": 3 | `compressive.samples.missing` = 3
compressive_codes.npy | ../x.npy | beside session.json
compressive_codes.npy | gone.npy | gone.npy
"frames": 10 | "frames": 11 | expected [1, 11, 8]
"frame_position": 10 | "frame_position": 9 | `frame_position` = 9, outside [10, ∞)
"rows": 2 | "rows": 3 | 12
"rows": 2, |  | missing field `rows`
"#,
    ) {
        assert!(text.contains(from), "{from} in {text}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let said = Session::read(dir.path()).unwrap_err().to_string();
        assert!(said.contains(expected) && said.contains(&dir.path().display().to_string()), "{to}: {said}");
    }
    std::fs::write(&path, &text).unwrap();
    let codes = dir.path().join("compressive_codes.npy");
    let mut bytes = std::fs::read(&codes).unwrap();
    let last = bytes.len() - 2;
    bytes[last..].copy_from_slice(&2000_u16.to_le_bytes());
    std::fs::write(&codes, bytes).unwrap();
    let said = Session::read(dir.path()).unwrap_err().to_string();
    assert!(said.contains("entry 79 is 2000; the converter has the codes 0 to 1023"), "{said}");
}
