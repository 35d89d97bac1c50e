//! One press or drop of a scene with one level: frames, fine pressure at the strongest instant, and cost.

use spts::record::TwinError;
use spts::scene::{Scene, Task};
use spts_contact::Frame;
use spts_sim::World;
use spts_sim::world::{Bounce, SimError};
use std::time::Instant;

/// Pressure on every square of the grid on which contact is computed.
#[derive(Debug, Clone, PartialEq)]
pub struct FinePressure {
    /// Rows of the grid.
    pub rows: usize,
    /// Columns of the grid.
    pub cols: usize,
    /// Pressure on every square, Pa, row-major.
    pub pressure_pa: Vec<f64>,
}

impl FinePressure {
    /// "rows x cols", as in "60x60".
    pub(super) fn shape(&self) -> String {
        format!("{}x{}", self.rows, self.cols)
    }
}

/// What one run gave.
#[derive(Debug, Clone)]
pub(super) struct ContactRun {
    pub(super) frames: Vec<Frame>,
    pub(super) bounces: Vec<Bounce>,
    pub(super) fine: FinePressure,
    /// Span of the scores, s: plateau of a press, first contact of a drop.
    pub(super) span_s: [f64; 2],
    pub(super) cost_us_per_step: f64,
    pub(super) cost_s_per_s: f64,
}

/// Runs that are needed when nobody asks for the cost, and those that are timed at most.
pub(super) const ONCE: usize = 1;
pub(super) const TIMED: usize = 5;
/// Time after which no further run is started, s.
const ENOUGH_S: f64 = 0.3;

/// Runs press or drop `index` of `scene`. The cost is that of the quickest of at most `most_runs` runs, set-up
/// included; long runs are made once.
pub(super) fn run(scene: &Scene, index: usize, most_runs: usize) -> Result<ContactRun, TwinError> {
    let (mut least_s, mut spent_s) = (f64::INFINITY, 0.0);
    let mut last = None;
    for _ in 0..most_runs {
        let start = Instant::now();
        let mut world = World::repeat(scene.mechanics(), index)?;
        let frames = world.frames().collect::<Result<Vec<Frame>, _>>()?;
        let wall_s = start.elapsed().as_secs_f64();
        last = Some((frames, world.bounces().to_vec()));
        least_s = wall_s.min(least_s);
        spent_s += wall_s;
        if spent_s > ENOUGH_S {
            break;
        }
    }
    let (frames, bounces) = last.unwrap_or_default();
    let span_s = match scene.task() {
        Task::Press(press) => press.plateau_s(),
        Task::Drop(_) => bounces.first().map_or([0.0, scene.duration_s()], |b| {
            // the ends, where hardly anything touches, say little about the shape
            [b.start_s + 0.15 * b.contact_s, b.start_s + 0.85 * b.contact_s]
        }),
    };
    Ok(ContactRun {
        fine: fine(scene, &frames, span_s)?,
        bounces,
        span_s,
        cost_us_per_step: 1e6 * least_s * scene.mechanics().timestep_s() / scene.duration_s(),
        cost_s_per_s: least_s / scene.duration_s(),
        frames,
    })
}

/// Fine pressure in the middle of the span.
fn fine(scene: &Scene, frames: &[Frame], [start_s, end_s]: [f64; 2]) -> Result<FinePressure, TwinError> {
    let mut field = scene.mechanics().build_contact().map_err(SimError::from)?;
    let cells = field.cells_per_taxel();
    let (rows, cols) = (scene.skin().rows() * cells, scene.skin().cols() * cells);
    let middle_s = 0.5 * (start_s + end_s);
    let Some(frame) = nearest(frames, middle_s).map(|i| &frames[i]) else {
        return Ok(FinePressure {
            rows,
            cols,
            pressure_pa: vec![0.0; rows * cols],
        });
    };
    let body = scene.mechanics().posed(&frame.pose);
    let mut pressure_pa = field.respond(&body).pressure_pa.to_vec();
    let force_n = frame.wrench.force_n[2];
    if let Some(refined) = field.refine(&body, force_n) {
        pressure_pa.copy_from_slice(refined);
    } else if let Some(reason) = field.failure() {
        let time_s = frame.time_s;
        return Err(SimError::NoPressure {
            force_n,
            time_s,
            reason,
        }
        .into());
    }
    Ok(FinePressure {
        rows,
        cols,
        pressure_pa,
    })
}

/// Index of the frame nearest to `time_s`; `None` without a frame.
pub(super) fn nearest(frames: &[Frame], time_s: f64) -> Option<usize> {
    let after = frames.partition_point(|f| f.time_s < time_s);
    let Some(before) = after.checked_sub(1) else {
        return (!frames.is_empty()).then_some(0);
    };
    let Some(next) = frames.get(after) else {
        return Some(before);
    };
    let nearer = time_s - frames[before].time_s <= next.time_s - time_s;
    Some(if nearer { before } else { after })
}
