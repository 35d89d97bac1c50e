//! Properties that every designer of rows must have.

use super::expected::{Expected, Tolerances};
use crate::classify::Component;
use crate::matrix::Matrix;
use crate::recover::Gaussian;
use crate::rows::greedy::posterior_trace;
use crate::rows::{DesignRows, RowTask};
use crate::rows::{Designer, RowNeeds};
use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use spts_input::Refusal;

/// Grids: a single taxel, strips, sides that are no powers of two, a square.
const SHAPES: [[usize; 2]; 6] = [[1, 1], [1, 7], [9, 1], [3, 5], [4, 4], [10, 10]];

/// Checks `designer` on several grids, numbers of rows and extremes of its parameters. Rows must be of ±1 and
/// differ from each other. The result must be reproducible with any number of threads. Rows must respect the headroom,
/// or the designer returns the error that says so. No image may be measured worse than by random rows.
///
/// # Panics
/// If a property fails; the message names the designer.
pub fn conformance(designer: &Designer) {
    let (name, method) = (designer.name, (designer.build)());
    for shape in SHAPES {
        let n = shape[0] * shape[1];
        let classes = classes(n);
        for expected in expectations(shape) {
            for rows in [1, n.min(4), n / 2, n] {
                let task = RowTask { classes: &classes, ..RowTask::new(rows.max(1), &expected) };
                let found = method.design(&task);
                match &found {
                    Ok(found) => sound(designer, &task, found),
                    // there may be fewer rows than taxels, and classes that one taxel cannot hold
                    Err(e) if rows > 1 && is_too_many(e) => {}
                    Err(e) => panic!("{name}: {shape:?}, {rows} rows: {e}"),
                }
                assert_eq!(method.design(&task), found, "{name}: another answer to the same task");
            }
        }
    }
    refuses(name, &*method);
    extremes(designer, &*method);
    keeps_to_the_headroom(designer, &*method);
    does_not_see_threads(name, &*method);
    if designer.needs != RowNeeds::Classes {
        sees_more_than_chance(designer, &*method);
    }
}

/// Whether a designer has fewer rows than it was asked for.
fn is_too_many(error: &Refusal) -> bool {
    error.to_string().starts_with("`rows` = ")
}

fn expectations(shape: [usize; 2]) -> Vec<Expected> {
    let n = shape[0] * shape[1];
    let smooth = Expected::smooth(shape, 1.5).unwrap_or_else(|e| panic!("{e}"));
    let prior = Gaussian::new(vec![0.3; n], smooth.covariance()).ok();
    let tolerances = Tolerances { gain_log_sd: 0.3, shift: 1 };
    let like = prior.and_then(|prior| Expected::like(&prior, shape, tolerances).ok());
    std::iter::once(smooth).chain(like).collect()
}

/// Three classes of random images.
fn classes(n: usize) -> Vec<Component> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    (0..3)
        .map(|label| Component {
            label: Some(label),
            weight: 1.0,
            mean: (0..n).map(|_| rng.random::<f64>()).collect(),
            factors: vec![(0..n).map(|_| 0.1 * rng.random::<f64>()).collect()],
            noise_variance: 0.1,
        })
        .collect()
}

fn sound(designer: &Designer, task: &RowTask<'_>, rows: &Matrix) {
    let name = designer.name;
    assert_eq!((rows.nrows(), rows.ncols()), (task.rows, task.expected.taxels()), "{name}: shape");
    for (i, &level) in rows.view().values().iter().enumerate() {
        assert!(level.abs().to_bits() == 1.0_f64.to_bits(), "{name}: level {level} at {i}");
    }
}

fn refuses(name: &str, method: &dyn DesignRows) {
    let expected = Expected::smooth([4, 4], 1.5).unwrap_or_else(|e| panic!("{e}"));
    let classes = classes(16);
    let task = RowTask { classes: &classes, ..RowTask::new(3, &expected) };
    let bad = [
        RowTask { rows: 0, ..task },
        RowTask { rows: usize::MAX, ..task },
        RowTask { noise: 0.0, ..task },
        RowTask { noise: f64::NAN, ..task },
        RowTask { largest_sum: Some(f64::NAN), ..task },
        RowTask { largest_sum: Some(0.0), ..task },
    ];
    for (k, task) in bad.into_iter().enumerate() {
        assert!(method.design(&task).is_err(), "{name}: the bad task {k} was not refused");
    }
}

/// Hardly any noise and nothing but noise, images of huge and of tiny numbers.
fn extremes(designer: &Designer, method: &dyn DesignRows) {
    let classes = classes(16);
    for scale in [1e-100, 1.0, 1e100] {
        let mut covariance = Matrix::zeros(16, 16);
        for i in 0..16 {
            covariance.row_mut(i)[i] = scale * (1.0 + i as f64);
        }
        let prior = Gaussian::new(vec![0.0; 16], covariance).unwrap_or_else(|e| panic!("{e}"));
        let expected = Expected::like(&prior, [4, 4], Tolerances::default()).unwrap_or_else(|e| panic!("{e}"));
        for noise in [1e-6, 1e3] {
            let task = RowTask { classes: &classes, noise, ..RowTask::new(5, &expected) };
            let rows = method.design(&task).unwrap_or_else(|e| panic!("{}: {e}", designer.name));
            sound(designer, &task, &rows);
        }
    }
}

fn keeps_to_the_headroom(designer: &Designer, method: &dyn DesignRows) {
    let expected = Expected::smooth([6, 6], 1.5).unwrap_or_else(|e| panic!("{e}"));
    let classes = classes(36);
    for limit in [0.05, 0.6, 1.0, 2.0, 1e3] {
        let task = RowTask { classes: &classes, largest_sum: Some(limit), ..RowTask::new(4, &expected) };
        match method.design(&task) {
            Ok(rows) => {
                let largest = limit * expected.random_square().sqrt();
                for r in 0..4 {
                    let rms = expected.square_of_sum(rows.row(r)).sqrt();
                    // sums are kept up to date level by level
                    assert!(rms <= largest * (1.0 + 1e-9), "{}: {rms} above {largest}", designer.name);
                }
            }
            Err(e) if limit < 2.0 && (is_too_many(&e) || e.to_string().starts_with("no row of levels ±1")) => {}
            Err(e) => panic!("{}: {e}", designer.name),
        }
    }
}

fn does_not_see_threads(name: &str, method: &dyn DesignRows) {
    let expected = Expected::smooth([6, 6], 1.5).unwrap_or_else(|e| panic!("{e}"));
    let classes = classes(36);
    let task = RowTask { classes: &classes, ..RowTask::new(6, &expected) };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
        pool.unwrap_or_else(|e| panic!("{e}")).install(|| method.design(&task))
    };
    assert_eq!(on(1), on(3), "{name}: the answer depends on the threads");
}

/// Of smooth images, no more is left than by rows of chance.
fn sees_more_than_chance(designer: &Designer, method: &dyn DesignRows) {
    let expected = Expected::smooth([10, 10], 1.5).unwrap_or_else(|e| panic!("{e}"));
    let left = |method: &dyn DesignRows, seed| {
        let task = RowTask { seed, ..RowTask::new(20, &expected) };
        let trace = method.design(&task).and_then(|rows| posterior_trace(&task, &rows));
        trace.unwrap_or_else(|e| panic!("{}: {e}", designer.name))
    };
    let random: Vec<f64> = (0..8).map(|seed| left(&crate::rows::simple::Random, seed)).collect();
    let worst = random.iter().copied().fold(0.0, f64::max);
    let own = left(method, 1);
    // rows of chance scatter by a few per cent about their mean
    assert!(own <= worst * 1.05, "{}: {own} is left, by chance {worst}", designer.name);
}
