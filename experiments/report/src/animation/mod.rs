//! Contacts in motion: the pressure on the skin, the trace of its one wire, and the image decoded from that trace, as
//! one GIF.

mod figures;
mod gif;
mod picture;
#[cfg(test)]
mod tests;
mod timeline;

pub use figures::{MOTION_FIGURES, MotionFigure, simulate_motion};

use self::gif::{Palette, gif};
use crate::figures::canvas::{Canvas, paint, png_of};
use picture::COLUMNS;
use rayon::prelude::*;
use spts::Session;
use spts::output::unwritable;
use spts::scene::Task;
use spts::simulate::Prepared;
use spts_contact::Frame;
use spts_eval::Untouched;
use spts_eval::decode::{DecodeRequest, no_recording};
use spts_eval::in_time::{FollowedImage, followed_images};
use spts_eval::training::TrainingData;
use spts_input::Refusal;
use std::path::Path;
use timeline::{Timeline, Trace, pressure_pa};

/// Name of the file of `spts simulate --animate`.
pub(crate) const ANIMATION_FILE: &str = "animation.gif";

/// One press or drop in motion.
///
/// ```no_run
/// use spts::Refusal;
/// use spts::simulate::{Request, run};
/// use spts_report::animation::Animation;
///
/// let prepared = Request { scene: "bounce".to_owned(), assignments: Vec::new() }.prepare()?;
/// let mut frames = Vec::new();
/// let simulation = run(&prepared, true, &|| (), |piece| {
///     frames = piece.presses[0].frames.clone();
///     Ok::<_, Refusal>(())
/// })?;
/// let session = simulation.first.as_ref().expect("it was recorded");
/// let animation = Animation::new(&prepared, &frames, session, None)?;
/// std::fs::write("bounce.gif", animation.gif("bounce.gif".as_ref())?)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub struct Animation {
    title: String,
    /// Rows and columns of taxels.
    shape: (usize, usize),
    timeline: Timeline,
    trace: Trace,
    rate_hz: f64,
    /// Samples of a window.
    m: usize,
    /// Largest pressure of all, Pa.
    peak_pa: f64,
    /// Largest value of all decoded images, V; the reason where nothing is decoded.
    peak_v: Result<f64, String>,
    /// Largest output of all without that of the idle skin, V.
    largest_v: f64,
    /// Pressure at every instant, Pa.
    pressures: Vec<Vec<f64>>,
    /// Image and window at every instant.
    images: Vec<FollowedImage>,
    /// Output of the block without that of the idle skin, V.
    output_v: Vec<f64>,
}

impl Animation {
    /// The first press of `prepared`: its `frames`, and the first block of the compressive recording of `session`, from
    /// which alone the image is decoded. `training` says what images on the skin are like; without it nothing is
    /// decoded.
    ///
    /// # Errors
    /// [`Refusal`] when there is no recording, or it cannot be followed.
    pub fn new(
        prepared: &Prepared,
        frames: &[Frame],
        session: &Session,
        training: Option<&TrainingData>,
    ) -> Result<Self, Refusal> {
        let without = || no_recording(session);
        let recording = session.compressive().ok_or_else(without)?;
        let volts = &recording.blocks().first().ok_or_else(without)?.volts;
        let (layout, rate_hz) = (recording.layout(), recording.sample_rate_hz());
        let timeline = Timeline::of(frames, volts.len() as f64 / rate_hz);
        #[expect(clippy::cast_possible_truncation, reason = "clamped to the samples of the block")]
        let sample = |time_s: f64| ((time_s * rate_hz).round().max(0.0) as usize).min(volts.len());
        let ends: Vec<usize> = timeline.instants_s.iter().map(|time_s| sample(*time_s)).collect();

        // a fifth of the taxels, and no more samples than come between two pictures
        let shares = DecodeRequest::default_measurements(layout.taxels());
        let between = ends.windows(2).map(|pair| pair[1] - pair[0]).min();
        let m = shares.get(1).copied().unwrap_or(1).min(between.unwrap_or(usize::MAX)).max(1);
        let images = match training {
            Some(training) => followed_images(session, 0, training, m, &ends)?,
            None => {
                let undecoded = |&end: &usize| FollowedImage { window: end.saturating_sub(m)..end, image: Vec::new() };
                ends.iter().map(undecoded).collect()
            }
        };
        let pressures = timeline.instants_s.iter().map(|time_s| pressure_pa(frames, *time_s));
        let pressures: Vec<Vec<f64>> = pressures.collect();
        let output_v = Untouched::flat(recording, 0).without(recording, 0, 0..volts.len());
        let shown = sample(timeline.from_s)..sample(timeline.to_s);
        let largest = |values: &mut dyn Iterator<Item = f64>| values.filter(|v| v.is_finite()).fold(0.0, f64::max);
        Ok(Self {
            title: title(prepared),
            shape: (layout.rows(), layout.cols()),
            trace: Trace::new(volts, shown.clone(), COLUMNS),
            rate_hz,
            m,
            peak_pa: largest(&mut pressures.iter().flatten().copied()),
            peak_v: match training {
                Some(_) => Ok(largest(&mut images.iter().flat_map(|at| &at.image).copied())),
                None => Err(format!("a skin of {} taxels is not decoded here", layout.taxels())),
            },
            largest_v: largest(&mut output_v[shown].iter().map(|v| v.abs())).max(f64::MIN_POSITIVE),
            timeline,
            pressures,
            images,
            output_v,
        })
    }

    /// Number of pictures.
    pub fn len(&self) -> usize {
        self.images.len()
    }

    /// True without a picture: the block is too short for one.
    pub fn is_empty(&self) -> bool {
        self.images.is_empty()
    }

    /// The animation as the bytes of a GIF file that repeats for ever; the same on any number of threads. `path` is the
    /// file they are for, named in errors.
    ///
    /// # Errors
    /// [`Refusal`] when there is not enough memory.
    pub fn gif(&self, path: &Path) -> Result<Vec<u8>, Refusal> {
        let palette = Palette::new();
        let paint = |k: usize| {
            let (width, height, rgb) = paint(&self.picture(k))?;
            Ok((palette.numbers(&rgb), [width, height]))
        };
        let painted = (0..self.len()).into_par_iter().map(paint);
        let painted: std::io::Result<Vec<_>> = painted.collect();
        let painted = painted.map_err(unwritable(path))?;
        let size = painted.first().map_or([1; 2], |(_, size)| *size);
        let [width, height] = size.map(|side| u16::try_from(side).unwrap_or(u16::MAX));
        let pictures: Vec<Vec<u8>> = painted.into_iter().map(|(picture, _)| picture).collect();
        gif(&pictures, (width, height), &palette).map_err(unwritable(path))
    }

    /// The picture with the largest pressure, as the bytes of a PNG file; `path` is the file they are for, named in
    /// errors.
    ///
    /// # Errors
    /// As [`Animation::gif`].
    pub fn still(&self, path: &Path) -> Result<Vec<u8>, Refusal> {
        let sum = |k: &usize| self.pressures[*k].iter().sum::<f64>();
        let strongest = (0..self.len()).max_by(|a, b| sum(a).total_cmp(&sum(b)));
        let canvas = strongest.map_or_else(|| Canvas::new(1.0, 1.0, ""), |k| self.picture(k));
        png_of(&canvas).map_err(unwritable(path))
    }
}

/// What happens, in a few words.
fn title(prepared: &Prepared) -> String {
    match prepared.scene.task() {
        Task::Press(press) => {
            let mut body = prepared.body().chars();
            let first: String = body.next().into_iter().flat_map(char::to_uppercase).collect();
            format!("{first}{} pressed on the skin with {} N", body.as_str(), press.force_n)
        }
        Task::Drop(drop) => format!("A ball dropped on the skin from {} m", drop.height_m),
    }
}
