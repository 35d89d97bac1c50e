//! Presses a mesh of your own. Without an argument it writes one first: a prism, as it would come from a CAD program in
//! millimetres.
//!
//! `cargo run --release --bin own_mesh -- [FILE.obj|.glb|.stl] [METRES_A_UNIT]`

use examples::{Result, decode, held, show, truth, window};
use spts::{Mode, Scene, Twin};

/// A triangular prism, 80 mm wide and 20 mm high. The face that is pressed looks down, to −z; the arm holds the mesh at
/// its origin.
const PRISM: &str = "\
v -40 -35 0
v 40 -35 0
v 0 45 0
v -40 -35 20
v 40 -35 20
v 0 45 20
f 1 3 2
f 4 5 6
f 1 2 5
f 1 5 4
f 2 3 6
f 2 6 5
f 3 1 4
f 3 4 6
";

fn main() -> Result<()> {
    let mut arguments = std::env::args().skip(1);
    let file = match arguments.next() {
        Some(file) => file,
        None => {
            let file = "out/prism.obj";
            std::fs::create_dir_all("out")?;
            std::fs::write(file, PRISM)?;
            file.to_owned()
        }
    };
    let scale: f64 = arguments.next().map_or(Ok(1e-3), |text| text.parse())?;

    let scene = format!("[press]\nmesh = {file:?}\nscale = {scale}\nforce_n = 15\nrotation_deg = 20\npresses = 1");
    let scene = Scene::from_toml(&scene, ".".as_ref())?;
    let session = Twin::new(&scene)?.record(Mode::Compressive)?;

    let (recording, start_s) = held(&session)?;
    println!("{file}, 15 N, turned by 20 degrees, from 50 measurements:");
    show(&decode(&window(recording, start_s, 50)?)?, truth(&session)?, recording.layout().cols());
    Ok(())
}
