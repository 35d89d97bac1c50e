//! Presses an object on the twin, keeps the session in a folder and decodes one image from 50 measurements of a single
//! wire.
//!
//! `cargo run --release -- [OBJECT] [FOLDER]`

use spts::recon::metrics::{SUPPORT_THRESHOLD, SupportScore, median, support};
use spts::recon::recover::{NnLasso, Penalty};
use spts::recon::{Matrix, Problem, Recover as _, Workspace};
use spts::{Mode, Scene, Session, Twin};

/// Measurements of one image.
const M: usize = 50;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let object = arguments.next().unwrap_or_else(|| "T".to_owned());
    let folder = arguments.next().unwrap_or_else(|| format!("out/{object}"));

    let scene = Scene::from_toml(&format!("[press]\nobject = {object:?}\npresses = 1"), ".".as_ref())?;
    Twin::new(&scene)?.record(Mode::Compressive)?.write(folder.as_ref())?;

    // what was written is all that a decoder needs; a folder recorded from a real skin reads the same
    let session = Session::read(folder.as_ref())?;
    let recorded = session
        .compressive
        .as_ref()
        .ok_or("the session has no compressive recording")?;
    let (recording, block) = (&recorded.recording, &recorded.recording.blocks()[0]);
    let idle = block.idle_frames.unwrap_or_default() * recording.measurements_per_frame();
    let idle_v = median(&block.volts[..idle]).ok_or("the skin is never at rest")?;
    let [start_s, _] = session.hold_s.ok_or("nothing is held")?;
    let start = (start_s * recording.sample_rate_hz()) as usize;

    let y: Vec<f64> = block.volts[start..start + M].iter().map(|v| v - idle_v).collect();
    let phi = Matrix::from_rows(M, recording.taxels(), recording.rows(0, start..start + M).to_vec())?;
    let solver = NnLasso::new(Penalty::Relative(0.02))?;
    let solution = solver.recover(&Problem::new(phi.view(), &y)?, &mut Workspace::default())?;
    let mut image = vec![0.0; recording.taxels()];
    solution.scatter(&mut image);

    let facts = recorded.facts(0).ok_or("nothing is known of the press")?;
    let conductance = facts.conductance.as_ref().ok_or("the true image is not known")?;
    let (mut found, mut truth) = (Vec::new(), Vec::new());
    support(&image, SUPPORT_THRESHOLD, &mut found);
    support(conductance.values(), SUPPORT_THRESHOLD, &mut truth);
    println!("{object}, {:.1} N, kept in {folder}", facts.force_n.unwrap_or_default());
    for row in found.chunks(recording.layout().cols()) {
        println!(
            "{}",
            row.iter().map(|on| if *on { " #" } else { " ." }).collect::<String>()
        );
    }
    println!("IoU with the true image: {:.2}", SupportScore::new(&found, &truth).iou);
    Ok(())
}
