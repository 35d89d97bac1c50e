//! What frames of any skin say of it: how well presses repeat, how they drift, and how far the transducer's laws hold.

use serde::Serialize;
use spts::data::Courses;
use spts::session::Session;
use spts_eval::unique;
use spts_input::Refusal;
use spts_models::VelostatConfig;
use spts_recon::metrics::{SUPPORT_THRESHOLD, median, pearson, support};
use spts_recon::statistics::mean;

/// Presses of one object.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectFrames {
    /// Name.
    pub object: String,
    /// Number of presses.
    pub presses: usize,
    /// Taxels above 23 % of the largest in the mean image of the holds.
    pub touched: usize,
    /// Median over the presses of the correlation of their image with the mean of the others; `None` for one press.
    pub repeatability: Option<f64>,
    /// Standard deviation over the presses of the sum of the touched taxels, over its mean; `None` for one press.
    pub spread: Option<f64>,
    /// Median over the presses of the growth of that sum from the first to the last fifth of the hold, a share; `None`
    /// for a hold of fewer than five frames.
    pub drift: Option<f64>,
}

/// A law of the transducer, fitted to every other object and held against the remaining ones. Errors are root mean
/// squares over objects, of shares of the signal.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LawCheck {
    /// `creep`: the signal of a hold grows by this share a decade of time since the touch. `conditioning`: it grows
    /// from press to press by this share for each unit of the logarithm of the press's number.
    pub law: &'static str,
    /// Value that fits the objects that are learned from.
    pub fitted: f64,
    /// Default of the simulated transducer.
    pub twin: f64,
    /// Objects that the value was fitted to, and others that it is held against.
    pub objects: [usize; 2],
    /// Error on the others without the law.
    pub without: f64,
    /// Error on the others with the fitted value.
    pub with_fitted: f64,
    /// Error on the others with the simulation's default.
    pub with_twin: f64,
    /// The object with the largest error with the fitted value, and that error.
    pub worst: (String, f64),
}

/// What the frames of all sessions say.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct FramesReport {
    /// Object by object, in order of the sessions.
    pub objects: Vec<ObjectFrames>,
    /// Creep and conditioning; those that there are enough objects and presses for.
    pub laws: Vec<LawCheck>,
}

/// Points (x, share of the mean signal) of one object that a law y = 1 + s·(x − mean x) is held against.
struct Points {
    object: String,
    xy: Vec<(f64, f64)>,
}

/// Share of the signal of a hold above which the skin is touched.
const TOUCHED: f64 = 0.5;
/// Fewest points of an object for a law.
const FEWEST_POINTS: usize = 5;
/// Fewest objects for a law: two to fit, two to predict.
const FEWEST_OBJECTS: usize = 4;

/// Everything about `sessions`, whose frames are in a raster recording each. Sessions of one object count together.
///
/// # Errors
/// [`Refusal`] for a session without frames.
pub fn frames_report(sessions: &[&Session]) -> Result<FramesReport, Refusal> {
    let mut report = FramesReport::default();
    let (mut creep, mut conditioning) = (Vec::new(), Vec::new());
    for object in unique(sessions.iter().map(|session| session.object.as_str())) {
        let own = sessions.iter().filter(|session| session.object == object);
        let courses = own.map(|session| Courses::of(session).map_err(|e| e.at(&session.name)));
        let courses = courses.collect::<Result<Vec<_>, Refusal>>()?;
        let presses: Vec<Course> = courses.iter().flat_map(Course::all).collect();
        let images: Vec<&[f64]> = presses.iter().map(|press| &press.image[..]).collect();
        let mut touched = Vec::new();
        let total = sum(&images);
        support(&total, SUPPORT_THRESHOLD, &mut touched);
        let others = |own: &[f64]| total.iter().zip(own).map(|(all, own)| all - own).collect::<Vec<f64>>();
        let alike: Vec<f64> = images.iter().filter_map(|image| pearson(image, &others(image))).collect();
        let signals: Vec<Vec<f64>> = presses.iter().map(|press| press.signal(&touched)).collect();
        let sums: Vec<f64> = presses.iter().zip(&signals).filter_map(|(p, s)| mean(&s[p.hold.clone()])).collect();
        let drifts: Vec<f64> = presses.iter().zip(&signals).filter_map(|(p, s)| drift(&s[p.hold.clone()])).collect();
        report.objects.push(ObjectFrames {
            object: object.to_owned(),
            presses: presses.len(),
            touched: touched.iter().filter(|on| **on).count(),
            repeatability: median(&alike).filter(|_| presses.len() > 1),
            spread: spread(&sums).filter(|_| presses.len() > 1),
            drift: median(&drifts),
        });
        let times = presses.iter().zip(&signals).filter_map(|(press, signal)| press.since_touch(signal));
        // a press that is touched at the end of the hold alone, or hardly at all, has no course
        let times = times.filter(|xy| xy.len() >= FEWEST_POINTS && xy.iter().all(|(_, y)| *y > 0.0));
        creep.push(Points { object: object.to_owned(), xy: mean_course(&times.collect::<Vec<_>>()) });
        let numbered = sums.iter().zip(1_u32..).map(|(sum, k)| (f64::from(k).ln(), *sum)).collect();
        conditioning.push(Points { object: object.to_owned(), xy: of_mean(numbered) });
    }
    let twin = VelostatConfig::default();
    let laws =
        [("creep", creep, twin.creep.per_decade), ("conditioning", conditioning, twin.conditioning.per_ln_press)];
    report.laws = laws.into_iter().filter_map(|(law, points, twin)| held_against(law, points, twin)).collect();
    Ok(report)
}

/// One press: its frames, its hold, and its mean image there.
struct Course<'a> {
    frames: Vec<&'a [f64]>,
    hold: std::ops::Range<usize>,
    frame_s: f64,
    image: Vec<f64>,
}

impl<'a> Course<'a> {
    /// All presses of `courses`.
    fn all(courses: &'a Courses) -> impl Iterator<Item = Self> {
        let [presses, count, ..] = courses.shape();
        (0..presses).map(move |press| {
            let frames: Vec<&[f64]> = (0..count).map(|frame| courses.frame(press, frame)).collect();
            let hold = courses.hold();
            Self { image: sum(&frames[hold.clone()]), frames, hold, frame_s: courses.frame_s() }
        })
    }

    /// Sum of the `touched` taxels, frame by frame.
    fn signal(&self, touched: &[bool]) -> Vec<f64> {
        let of = |frame: &&[f64]| frame.iter().zip(touched).filter(|(_, on)| **on).map(|(v, _)| *v).sum();
        self.frames.iter().map(of).collect()
    }

    /// Logarithm to base 10 of the time since the touch, and the signal, over the hold; `None` if the touch is not in
    /// the frames.
    fn since_touch(&self, signal: &[f64]) -> Option<Vec<(f64, f64)>> {
        let held = mean(&signal[self.hold.clone()])?;
        let touch = signal.iter().position(|v| *v > TOUCHED * held).filter(|touch| *touch > 0)?;
        let frames = self.hold.clone().filter(|frame| *frame > touch);
        Some(frames.map(|k| (((k - touch) as f64 * self.frame_s).log10(), signal[k])).collect())
    }
}

/// The sum of `frames`, taxel by taxel.
fn sum(frames: &[&[f64]]) -> Vec<f64> {
    let mut total = vec![0.0; frames.first().map_or(0, |frame| frame.len())];
    for frame in frames {
        total.iter_mut().zip(*frame).for_each(|(total, v)| *total += v);
    }
    total
}

/// Growth from the first to the last fifth; `None` for fewer than five values, or nothing to begin with.
fn drift(signal: &[f64]) -> Option<f64> {
    let fifth = signal.len() / 5;
    let first = mean(&signal[..fifth])?;
    let last = mean(&signal[signal.len() - fifth..])?;
    (first > 0.0).then(|| last / first - 1.0)
}

/// Standard deviation over the mean.
fn spread(values: &[f64]) -> Option<f64> {
    let middle = mean(values)?;
    let squares = mean(values.iter().map(|v| (v - middle).powi(2)))?;
    let n = values.len() as f64;
    (middle > 0.0 && n > 1.0).then(|| (squares * n / (n - 1.0)).sqrt() / middle)
}

/// The points with y over its mean.
fn of_mean(mut xy: Vec<(f64, f64)>) -> Vec<(f64, f64)> {
    let middle = mean(xy.iter().map(|p| p.1)).unwrap_or(0.0);
    xy.iter_mut().for_each(|p| p.1 /= middle);
    xy
}

/// The mean over presses of their courses, point by point, each over its mean.
fn mean_course(presses: &[Vec<(f64, f64)>]) -> Vec<(f64, f64)> {
    let points = presses.iter().map(Vec::len).min().unwrap_or(0);
    let presses: Vec<Vec<(f64, f64)>> = presses.iter().map(|xy| of_mean(xy[..points].to_vec())).collect();
    let at = |k: usize, of: fn(&(f64, f64)) -> f64| mean(presses.iter().map(|xy| of(&xy[k]))).unwrap_or(f64::NAN);
    (0..points).map(|k| (at(k, |p| p.0), at(k, |p| p.1))).collect()
}

impl Points {
    /// Root mean square of y − 1 − slope·(x − mean x).
    fn error(&self, slope: f64) -> f64 {
        let middle = mean(self.xy.iter().map(|p| p.0)).unwrap_or(0.0);
        mean(self.xy.iter().map(|(x, y)| (y - 1.0 - slope * (x - middle)).powi(2))).unwrap_or(0.0).sqrt()
    }
}

/// The law's slope by least squares over every other object, held against the remaining ones.
fn held_against(law: &'static str, mut points: Vec<Points>, twin: f64) -> Option<LawCheck> {
    points.retain(|p| p.xy.len() >= FEWEST_POINTS && p.xy.iter().all(|(x, y)| x.is_finite() && y.is_finite()));
    if points.len() < FEWEST_OBJECTS {
        return None;
    }
    let half = |odd: usize| points.iter().skip(odd).step_by(2).collect::<Vec<_>>();
    let [fit, held] = [0, 1].map(half);
    let (mut xy, mut xx) = (0.0, 0.0);
    for object in &fit {
        let middle = mean(object.xy.iter().map(|p| p.0)).unwrap_or(0.0);
        // every object counts alike
        let n = object.xy.len() as f64;
        for (x, y) in &object.xy {
            xy += (x - middle) * (y - 1.0) / n;
            xx += (x - middle).powi(2) / n;
        }
    }
    let fitted = if xx > 0.0 { xy / xx } else { 0.0 };
    let error = |slope: f64| mean(held.iter().map(|p| p.error(slope).powi(2))).unwrap_or(0.0).sqrt();
    let worst = held.iter().max_by(|a, b| a.error(fitted).total_cmp(&b.error(fitted)))?;
    Some(LawCheck {
        law,
        fitted,
        twin,
        objects: [fit.len(), held.len()],
        without: error(0.0),
        with_fitted: error(fitted),
        with_twin: error(twin),
        worst: (worst.object.clone(), worst.error(fitted)),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_abs_diff_eq;
    use spts::data::{FrameArray, FrameOptions, Frames};
    use spts::{FrameUnit, SkinLayout};

    /// Three presses of 2 × 3 taxels at 100 Hz that creep by 10 % a decade, and grow by 5 % a unit of ln(number).
    fn session(name: &str, load: f64) -> Session {
        let mut values = Vec::new();
        for press in 1..=6 {
            let amplitude = load * (1.0 + 0.05 * f64::from(press).ln());
            for frame in 0..60 {
                let held_s = f64::from(frame - 9) / 100.0;
                let v = if frame < 10 { 0.0 } else { amplitude * (1.0 + 0.1 * held_s.log10()) };
                values.extend([0.0, v, 0.0, 0.0, 2.0 * v, 0.0]);
            }
        }
        let array = FrameArray { shape: vec![6, 60, 2, 3], values, ..FrameArray::default() };
        let layout = SkinLayout::with_pitch(2, 3, 0.01).unwrap();
        let options = FrameOptions {
            rate_hz: Some(100.0),
            idle: Some(10),
            hold_s: Some([0.2, 0.6]),
            ..FrameOptions::new(name, layout, FrameUnit::Codes)
        };
        Frames::new(array, [2, 3], None).unwrap().session(&options).unwrap().0
    }

    #[test]
    fn laws_are_found_and_hold_on_other_objects() {
        let all = [("a", 10.0), ("b", 20.0), ("c", 5.0), ("d", 40.0)].map(|(name, load)| session(name, load));
        let report = frames_report(&all.iter().collect::<Vec<_>>()).unwrap();
        let a = &report.objects[0];
        assert_eq!((a.presses, a.touched), (6, 2));
        assert_abs_diff_eq!(a.repeatability.unwrap(), 1.0, epsilon = 1e-9);
        // from .15 to .47 s, means of eight frames each
        let expected = (1.0 + 0.1 * 0.465_f64.log10()) / (1.0 + 0.1 * 0.145_f64.log10()) - 1.0;
        assert_abs_diff_eq!(a.drift.unwrap(), expected, epsilon = 2e-3);
        let [creep, conditioning] = &report.laws[..] else { panic!("{report:?}") };
        assert_eq!((creep.law, creep.objects), ("creep", [2, 2]));
        // a share of the mean over the hold, in which the signal is below that of a second after the touch
        assert!((0.1..0.12).contains(&creep.fitted), "{creep:?}");
        // the touch is seen a frame, .01 s, after it begins: .1·log10(1 − .01/t) from .11 s on
        assert!(creep.with_fitted < 5e-4 && creep.without > 5e-3 && creep.with_twin > 5e-3, "{creep:?}");
        assert!((0.045..0.05).contains(&conditioning.fitted) && conditioning.with_fitted < 1e-6, "{conditioning:?}");
        let few = frames_report(&all[..2].iter().collect::<Vec<_>>()).unwrap();
        assert!(few.laws.is_empty() && few.objects.len() == 2);
    }
}
