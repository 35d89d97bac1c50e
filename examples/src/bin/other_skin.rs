//! A skin of other rows, columns and pitch than the published one. Nothing but the scene has to say so: layout, weights
//! and rate travel with the recording.
//!
//! `cargo run --release --bin other_skin -- [ROWS] [COLUMNS] [PITCH_M]`

use examples::{Result, decode, held, show, truth, window};
use spts::{Mode, Scene, Twin};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let rows = arguments.next().unwrap_or_else(|| "16".to_owned());
    let cols = arguments.next().unwrap_or_else(|| "24".to_owned());
    let pitch_m = arguments.next().unwrap_or_else(|| "0.0075".to_owned());

    let scene = format!(
        "[skin]
        rows = {rows}
        cols = {cols}
        pitch_m = {pitch_m}
        # the seeds of the cells: `address`, as published, gives rows that depend on each other; `mixed` does not
        [rows]
        seeding = 'mixed'
        [press]
        object = 'tape'
        presses = 1"
    );
    let session = Twin::new(&Scene::from_toml(&scene, ".".as_ref())?)?.record(Mode::Compressive)?;

    let (recording, start_s) = held(&session)?;
    let taxels = recording.taxels();
    // half as many measurements as taxels
    let window = window(recording, start_s, taxels / 2)?;
    println!(
        "a roll of tape on {rows} x {cols} taxels, from {} measurements, acquired in {:.1} ms:",
        window.y.len(),
        1e3 * window.y.len() as f64 / recording.sample_rate_hz()
    );
    show(&decode(&window)?, truth(&session)?, recording.layout().cols());
    Ok(())
}
