//! What the programs in `src/bin` share: the window of a session that they decode, and how they print an image.

use spts::recon::Matrix;
use spts::recon::metrics::{SUPPORT_THRESHOLD, SupportScore, median, support};
use spts::{Recording, Session};
use std::error::Error;

/// Everything may go wrong in a program that is only to be read.
pub type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// Measurements of one wire, and the rows of weights that they were taken with: y = Φ x.
pub struct Window {
    /// Output, V, without that of the untouched skin.
    pub y: Vec<f64>,
    /// One row a measurement, one column a taxel.
    pub phi: Matrix,
}

/// The first `m` measurements of the first press of `recording`, from `start_s` on, while the object is held. A
/// recording of the real skin is read in the same way.
pub fn window(recording: &Recording, start_s: f64, m: usize) -> Result<Window> {
    let block = &recording.blocks()[0];
    // nothing touches the skin in the first frames of a block
    let idle = block.idle_frames.unwrap_or_default() * recording.measurements_per_frame();
    let idle_v = median(&block.volts[..idle]).ok_or("the skin is never at rest")?;
    let start = (start_s * recording.sample_rate_hz()) as usize;
    Ok(Window {
        y: block.volts[start..start + m].iter().map(|v| v - idle_v).collect(),
        phi: Matrix::from_rows(m, recording.taxels(), recording.rows(0, start..start + m).to_vec())?,
    })
}

/// The compressive recording of `session`, and the time at which its hold begins, s.
pub fn held(session: &Session) -> Result<(&Recording, f64)> {
    let recording = session.compressive().ok_or("the session has no compressive recording")?;
    let [start_s, _] = session.hold_s.ok_or("nothing is held")?;
    Ok((recording, start_s))
}

/// Prints the taxels that stand out of `image`, of a sheet of `cols` columns, and how well they match the true
/// conductance; returns that match, the intersection over union.
pub fn show(image: &[f64], truth: &[f64], cols: usize) -> f64 {
    let (mut found, mut true_support) = (Vec::new(), Vec::new());
    support(image, SUPPORT_THRESHOLD, &mut found);
    support(truth, SUPPORT_THRESHOLD, &mut true_support);
    for row in found.chunks(cols) {
        println!("{}", row.iter().map(|on| if *on { " #" } else { " ." }).collect::<String>());
    }
    let iou = SupportScore::new(&found, &true_support).iou;
    println!("intersection over union with the true image: {iou:.2}");
    iou
}

/// The conductance of the taxels in the first press of `session`, which the simulation knows.
pub fn truth(session: &Session) -> Result<&[f64]> {
    let facts = session.compressive.as_ref().and_then(|recorded| recorded.facts(0));
    let conductance = facts.and_then(|facts| facts.conductance.as_ref());
    Ok(conductance.ok_or("the true image is not known")?.values())
}

/// An image from `window`: non-negative, and as few taxels as explain the measurements.
pub fn decode(window: &Window) -> Result<Vec<f64>> {
    use spts::recon::recover::{NnLasso, Penalty};
    use spts::recon::{Problem, Recover as _, Workspace};

    let problem = Problem::new(window.phi.view(), &window.y)?;
    let solution = NnLasso::new(Penalty::Relative(0.02))?.recover(&problem, &mut Workspace::default())?;
    let mut image = vec![0.0; window.phi.ncols()];
    solution.scatter(&mut image);
    Ok(image)
}
