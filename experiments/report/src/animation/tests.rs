//! Animations are small, whole, the same on any number of threads, and never a panic.

use super::gif::Palette;
use super::gif::gif;
use super::timeline::{Timeline, pressure_pa};
use super::{Animation, MOTION_FIGURES};
use gif::{ColorOutput, DecodeOptions};
use spts::Refusal;
use spts::Session;
use spts::simulate::{Prepared, Request, run};
use spts_contact::Frame;
use spts_eval::training::TrainingData;
use spts_models::{PressureMap, Streams};
use std::path::Path;

struct Simulated {
    prepared: Prepared,
    frames: Vec<Frame>,
    session: Session,
    training: TrainingData,
}

fn simulated(scene: &str, assignments: &[&str]) -> Simulated {
    let assignments = assignments.iter().map(|text| text.parse().unwrap()).collect();
    let scene = scene.to_owned();
    let prepared = Request { scene, assignments }.prepare().unwrap();
    let mut frames = Vec::new();
    let simulation = run(&prepared, true, &|| (), |piece| {
        if piece.first == 0 {
            frames.clone_from(&piece.presses[0].frames);
        }
        Ok::<_, Refusal>(())
    });
    Simulated {
        training: TrainingData::for_layout(prepared.scene.skin(), Streams::new(1)).unwrap(),
        session: simulation.unwrap().first.unwrap(),
        prepared,
        frames,
    }
}

impl Simulated {
    fn animation(&self) -> Animation {
        Animation::new(&self.prepared, &self.frames, &self.session, Some(&self.training)).unwrap()
    }
}

/// The pictures of a GIF file as they are seen one after the other, in colour, with their size.
fn decoded(bytes: &[u8]) -> (Vec<Vec<[u8; 3]>>, [usize; 2]) {
    let mut options = DecodeOptions::new();
    options.set_color_output(ColorOutput::RGBA);
    let mut decoder = options.read_info(bytes).unwrap();
    let [width, height] = [decoder.width(), decoder.height()].map(usize::from);
    let mut seen = vec![[0; 3]; width * height];
    let mut pictures = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let pixels = frame.buffer.as_chunks::<4>().0;
        for (k, [r, g, b, opaque]) in pixels.iter().enumerate() {
            let (x, y) = (k % usize::from(frame.width), k / usize::from(frame.width));
            if *opaque > 0 {
                seen[(usize::from(frame.top) + y) * width + usize::from(frame.left) + x] = [*r, *g, *b];
            }
        }
        pictures.push(seen.clone());
    }
    (pictures, [width, height])
}

/// What is seen are the pictures that were given, pixel by pixel: also where nothing changes, or one corner alone.
#[test]
fn pictures_come_back() {
    let palette = Palette::new();
    let first: Vec<u8> = (0..12).map(|k| 1 + 7 * k).collect();
    let mut third = first.clone();
    third[11] = 3;
    let pictures = [first.clone(), first, third, vec![5; 12]];
    let bytes = gif(&pictures, (4, 3), &palette).unwrap();
    let (seen, size) = decoded(&bytes);
    let colours = palette.bytes();
    let colour = |number: &u8| colours.as_chunks::<3>().0[usize::from(*number)];
    let expected: Vec<Vec<[u8; 3]>> = pictures.iter().map(|p| p.iter().map(colour).collect()).collect();
    assert_eq!((seen, size), (expected, [4, 3]));
}

/// A press and a bounce, as the report shows them: within their sizes, with every picture, in steps of one speed, and
/// the bounce of the same bytes on one thread and on two. What is decoded is the touched place: at the largest force
/// the largest taxel of the image is one under pressure.
#[test]
fn the_animations_of_the_report() {
    for (figure, most_bytes) in MOTION_FIGURES.iter().zip([400_000, 400_000]) {
        let simulated = simulated(figure.scene, &[]);
        let animation = simulated.animation();
        let path = Path::new(figure.file);
        let on = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| simulated.animation().gif(path).unwrap())
        };
        let bytes = on(2);
        assert!(figure.scene != "bounce" || bytes == on(1), "{}", figure.file);
        assert!(bytes.len() < most_bytes, "{}: {} bytes", figure.file, bytes.len());
        let (pictures, [width, height]) = decoded(&bytes);
        assert_eq!((pictures.len(), width, height), (animation.len(), 840, 704));
        assert!((42..=100).contains(&pictures.len()), "{}", pictures.len());
        assert!(pictures.windows(2).all(|pair| pair[0] != pair[1]));

        let strongest = |values: &[f64]| (0..values.len()).max_by(|a, b| values[*a].total_cmp(&values[*b])).unwrap();
        let sums: Vec<f64> = animation.pressures.iter().map(|p| p.iter().sum()).collect();
        let at = strongest(&sums);
        let taxel = strongest(&animation.images[at].image);
        assert!(animation.pressures[at][taxel] > 0.0, "{}: taxel {taxel}", figure.file);
        for image in &animation.images {
            assert!(image.image.iter().all(|v| v.is_finite()));
            let (instant, rate_hz) = (image.window.end, animation.rate_hz);
            assert!(instant as f64 <= animation.timeline.to_s * rate_hz + 1.0);
        }
    }
}

/// Strips, skins of another shape, a bent one, and a contact of which the wire shows nothing.
#[test]
fn any_skin_and_no_contact_are_drawn() {
    let footprint = "contact.model=footprint";
    let skins: [(&str, &[&str]); 3] = [
        ("press/rec", &["skin.rows=1", "skin.cols=12", footprint]),
        ("press/rec", &["skin.rows=7", "skin.cols=16", "rows.seeding=mixed", footprint]),
        ("arm", &[]),
    ];
    for (scene, assignments) in skins {
        let simulated = simulated(scene, assignments);
        let bytes = simulated.animation().gif(Path::new("skin.gif")).unwrap();
        assert!(!decoded(&bytes).0.is_empty() && bytes.len() < 600_000, "{scene}: {}", bytes.len());
    }
    let mut nothing = simulated("press/rec", &[footprint]);
    for frame in &mut nothing.frames {
        let (rows, cols) = (frame.pressure.rows(), frame.pressure.cols());
        frame.pressure = PressureMap::from_values(rows, cols, vec![0.0; rows * cols]);
        frame.wrench.force_n = [0.0; 3];
    }
    let animation = nothing.animation();
    assert_eq!(animation.timeline.touch_s, None);
    let bytes = animation.gif(Path::new("nothing.gif")).unwrap();
    assert_eq!(decoded(&bytes).0.len(), animation.len());
    // and of a skin that is too large to decode
    let undecoded = Animation::new(&nothing.prepared, &nothing.frames, &nothing.session, None).unwrap();
    let bytes = undecoded.gif(Path::new("undecoded.gif")).unwrap();
    assert_eq!(decoded(&bytes).0.len(), animation.len());
    let none = Session { compressive: None, ..nothing.session };
    assert!(Animation::new(&nothing.prepared, &nothing.frames, &none, None).is_err());
}

/// Instants are a step of one speed apart and stay within the block; the speed is a round number.
#[test]
fn times_are_those_of_the_contact() {
    let bounce = simulated("bounce", &["drop.duration_s=0.6"]);
    let timeline = Timeline::of(&bounce.frames, 0.6);
    let (touch_s, instants_s) = (timeline.touch_s.unwrap(), &timeline.instants_s);
    // a ball is on the skin for 8 to 9 ms, of which a frame on each side is counted too
    let shown_s = timeline.to_s - timeline.from_s;
    assert!((0.0105..0.0145).contains(&shown_s) && touch_s > timeline.from_s, "{timeline:?}");
    assert!([300.0, 500.0].iter().any(|speed| (timeline.slower - speed).abs() < 1e-9));
    let step_s = 0.07 / timeline.slower;
    // times of up to 0.6 s, to a few parts in 10^16
    assert!(instants_s.windows(2).all(|pair| (pair[1] - pair[0] - step_s).abs() < 1e-15));
    assert!(instants_s.iter().all(|t| (timeline.from_s..=timeline.to_s).contains(t)));
    assert_eq!(timeline.clock(touch_s + 1.23e-3), "1.2 ms after the touch");
    assert_eq!(timeline.clock(touch_s - 0.5e-3), "0.5 ms before the touch");

    // pressure on a straight line between two frames
    let mut pairs = bounce.frames.windows(2);
    let pair = pairs.find(|pair| pair[1].pressure.max() > 0.0).unwrap();
    let middle = pressure_pa(pair, 0.5 * (pair[0].time_s + pair[1].time_s));
    let both = pair[0].pressure.values().iter().zip(pair[1].pressure.values());
    // half of a difference, rounded
    let near = |(found, (a, b)): (&f64, (&f64, &f64))| (found - 0.5 * (a + b)).abs() <= 1e-9 * 0.5 * (a + b);
    assert!(middle.iter().zip(both).all(near));
    assert!(Timeline::of(&[], 0.0).instants_s.is_empty());
}
