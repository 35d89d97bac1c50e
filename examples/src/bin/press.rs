//! Presses an object on the twin, keeps the session in a folder, and decodes one image from 50 measurements of a single
//! wire.
//!
//! `cargo run --release --bin press -- [OBJECT] [FOLDER]`

use examples::{Result, decode, held, show, truth, window};
use spts::{Mode, Scene, Session, Twin};

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let object = arguments.next().unwrap_or_else(|| "T".to_owned());
    let folder = arguments.next().unwrap_or_else(|| format!("out/{object}"));

    // a scene says what presses on which skin, and how the skin is read out; what it leaves out has a default
    let scene = Scene::from_toml(&format!("[press]\nobject = {object:?}\npresses = 1"), ".".as_ref())?;
    Twin::new(&scene)?.record(Mode::Compressive)?.write(folder.as_ref())?;

    // what was written is all that a decoder needs; a folder recorded from a real skin reads the same
    let session = Session::read(folder.as_ref())?;
    let (recording, start_s) = held(&session)?;
    let window = window(recording, start_s, 50)?;
    println!("{object} in {folder}, from {} measurements:", window.y.len());
    show(&decode(&window)?, truth(&session)?, recording.layout().cols());
    Ok(())
}
