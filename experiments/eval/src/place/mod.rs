//! Locates the bouncing ball or a finger from windows of measurements.

mod contacts;
mod locators;

pub use contacts::{RecordedBounce, RecordedTouch, contact_image, find_bounces, find_touches};
pub(crate) use contacts::{beginning_of, touch_of};
pub use locators::locator_label;

use crate::sensing::{Sensing, chosen_places};
use crate::training::Dictionary;
use crate::windows::Press;
use locators::{LOCATORS, LocatorSpec, Measured, TAXEL, Tools, middle, taxel};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::localise::{Localiser, centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, median};
use spts_recon::statistics::mean;

/// The published locators.
const PUBLISHED: [&str; 2] = ["script_s5", "matched"];

/// Rows of the published locators at every M of `measurements`, of the contacts as recorded.
///
/// # Errors
/// [`Refusal`] when the sheet is no grid of `cols` columns.
pub(crate) fn localise(
    recording: &Recording,
    shifted: &Matrix,
    cols: usize,
    measurements: &[usize],
) -> Result<Vec<LocalisationRow>, Refusal> {
    let asked = PlacesRequest::new(measurements, |name| PUBLISHED.contains(&name));
    let tools = Tools::new(recording, shifted.clone(), cols)?;
    let found = asked.locate(BALL, &tools, &bounces(recording, tools.shape))?;
    let row = |(row, median_px): (PlaceRow, f64)| LocalisationRow {
        decode: row.decoder,
        m: row.m,
        mean_px: row.mean_px,
        median_px,
        share_under_1px: row.share_under_1px,
    };
    Ok(found.into_iter().map(row).collect())
}

/// Rows of every locator at every M of `measurements` for the drops `name`, as recorded and relabelled, by windows of
/// every kind of `sensing`.
///
/// # Errors
/// [`Refusal`] when the sheet is no grid of `cols` columns, or when no rows can be chosen.
pub(crate) fn places(
    name: &str,
    recording: &Recording,
    shifted: Matrix,
    cols: usize,
    measurements: &[usize],
    sensing: &[Sensing],
) -> Result<Vec<PlaceRow>, Refusal> {
    let asked = PlacesRequest { relabelled: true, sensing, ..PlacesRequest::new(measurements, |name| name != TAXEL) };
    let tools = Tools::new(recording, shifted, cols)?;
    let found = asked.locate(name, &tools, &bounces(recording, tools.shape))?;
    Ok(found.into_iter().map(|(row, _)| row).collect())
}

/// Rows of every locator at every M of `measurements` for the touches of the session `name`, by windows of measurements
/// that follow each other; none when no touch is found. Without a dictionary at all places, `shifted`, the locators
/// that need one have no rows.
///
/// # Errors
/// [`Refusal`] when the sheet is no grid of `cols` columns.
pub(crate) fn touch_places(
    name: &str,
    recording: &Recording,
    shifted: Option<&Matrix>,
    measurements: &[usize],
) -> Result<Vec<PlaceRow>, Refusal> {
    let asked = PlacesRequest::new(measurements, |name| shifted.is_some() || !PUBLISHED.contains(&name));
    let shifted = shifted.cloned().unwrap_or_else(|| Matrix::zeros(recording.taxels(), 1));
    let tools = Tools::new(recording, shifted, recording.layout().cols())?;
    let contacts = touches(recording, &find_touches(recording), tools.shape);
    let found = asked.locate(name, &tools, &contacts)?;
    Ok(found.into_iter().map(|(row, _)| row).collect())
}

/// Mean distance, taxels, between the touched taxel of `touches` and the taxel that alone explains most of a window
/// (locator `taxel`), over all windows, for every M of `measurements`; `None` without a window.
pub fn touch_errors_px(recording: &Recording, touches: &[RecordedTouch], measurements: &[usize]) -> Vec<Option<f64>> {
    let cols = recording.layout().cols();
    let shape = [recording.layout().rows(), cols];
    let contacts = self::touches(recording, touches, shape);
    let mean_px = |m: usize| {
        let mut errors_px = Vec::new();
        for contact in &contacts {
            let (press, truth) = (contact.relabelled([0, 0]), contact.moved([0, 0]));
            for (_, window) in press.windows(0..press.len(), m, m) {
                let place = taxel(shape, &window).unwrap_or(middle(shape));
                errors_px.push(distance(place, truth));
            }
        }
        mean(&errors_px)
    };
    measurements.iter().map(|m| mean_px(*m)).collect()
}

/// Contacts of the ball.
fn bounces(recording: &Recording, shape: [usize; 2]) -> Vec<Contact> {
    let bounces = find_bounces(recording);
    bounces.iter().filter_map(|bounce| Contact::new(recording, bounce, shape)).collect()
}

fn touches(recording: &Recording, touches: &[RecordedTouch], shape: [usize; 2]) -> Vec<Contact> {
    touches.iter().filter_map(|touch| Contact::of_touch(recording, touch, shape)).collect()
}

impl Tools {
    /// Tools for the skin of `recording`, with `cols` columns.
    fn new(recording: &Recording, shifted: Matrix, cols: usize) -> Result<Self, Refusal> {
        let shape = [recording.taxels() / cols.max(1), cols];
        Ok(Self { shape, dictionary: Dictionary::new(shifted), localiser: Localiser::new(shape)? })
    }
}

/// Which places are asked for.
struct PlacesRequest<'a> {
    locators: Vec<&'a LocatorSpec>,
    /// Whether contacts are also relabelled.
    relabelled: bool,
    measurements: &'a [usize],
    sensing: &'a [Sensing],
}

impl<'a> PlacesRequest<'a> {
    /// The locators whose names are `wanted`, for contacts as recorded and measurements that follow each other.
    fn new(measurements: &'a [usize], wanted: impl Fn(&str) -> bool) -> Self {
        Self {
            locators: LOCATORS.iter().filter(|spec| wanted(spec.name)).collect(),
            relabelled: false,
            measurements,
            sensing: &[Sensing::Random],
        }
    }

    /// Rows of `contacts`, called `name`, each with the median of its distances; none without a window.
    ///
    /// # Errors
    /// [`Refusal`] when no rows can be chosen.
    fn locate(&self, name: &str, tools: &Tools, contacts: &[Contact]) -> Result<Vec<(PlaceRow, f64)>, Refusal> {
        let mut views: Vec<(bool, &Contact, [usize; 2])> = contacts.iter().flat_map(views).collect();
        views.retain(|(relabelled, ..)| self.relabelled || !relabelled);
        let errors: Vec<Vec<Vec<f64>>> = views
            .par_iter()
            .map(|&(_, contact, shift)| self.errors(tools, contact, shift))
            .collect::<Result<_, Refusal>>()
            .map_err(|e| e.at("rows"))?;
        let kinds = self.sensing.iter().flat_map(|&sensing| [(false, sensing), (true, sensing)]);
        let mut found = Vec::new();
        for (k, (relabelled, sensing)) in kinds.enumerate() {
            for (l, spec) in self.locators.iter().enumerate() {
                for (i, &m) in self.measurements.iter().enumerate() {
                    let at = (k / 2 * self.locators.len() + l) * self.measurements.len() + i;
                    let of = views.iter().zip(&errors).filter(|(view, _)| view.0 == relabelled);
                    let errors_px: Vec<f64> = of.flat_map(|(_, e)| e[at].iter().copied()).collect();
                    let Some(median_px) = median(&errors_px) else { continue };
                    let count = errors_px.len() as f64;
                    let row = PlaceRow {
                        contact: name.to_owned(),
                        decoder: spec.name.to_owned(),
                        m,
                        relabelled,
                        sensing,
                        mean_px: errors_px.iter().sum::<f64>() / count,
                        share_under_1px: errors_px.iter().filter(|e| **e < 1.0).count() as f64 / count,
                    };
                    found.push((row, median_px));
                }
            }
        }
        Ok(found)
    }

    /// Distances by every kind of windows, locator and M.
    fn errors(&self, tools: &Tools, contact: &Contact, shift: [usize; 2]) -> Result<Vec<Vec<f64>>, Refusal> {
        let (press, truth) = (contact.relabelled(shift), contact.moved(shift));
        let most = self.measurements.iter().copied().max().unwrap_or(1);
        let mut found = Vec::with_capacity(self.sensing.len() * self.locators.len() * self.measurements.len());
        for sensing in self.sensing {
            let presses = match sensing {
                Sensing::Random => vec![press.clone()],
                Sensing::Chosen | Sensing::WorstKind => {
                    chosen_places(&press, tools.shape, most, *sensing == Sensing::WorstKind)?
                }
            };
            let measured: Vec<_> = presses.iter().map(Measured::new).collect();
            for spec in &self.locators {
                let mut locators: Vec<_> = measured.iter().map(|measured| (spec.start)(tools, measured)).collect();
                for &m in self.measurements {
                    let mut errors = Vec::new();
                    for (press, locator) in presses.iter().zip(&mut locators) {
                        // of chosen rows, the first are the choice for any M
                        let end = if *sensing == Sensing::Random { press.len() } else { m };
                        // a window that a locator fails on counts as a guess, so that all are compared on the same ones
                        let places = press
                            .windows(0..end, m, m)
                            .map(|(start, window)| locator(start, &window).unwrap_or(middle(tools.shape)));
                        errors.extend(places.map(|p| distance(p, truth)));
                    }
                    found.push(errors);
                }
            }
        }
        Ok(found)
    }
}

/// A contact as recorded and, relabelled, at cyclic shifts of the taxels that leave its centre far enough from the
/// edge: as recorded, all drops fall on the middle of the sheet, which a guess finds too.
fn views(contact: &Contact) -> Vec<(bool, &Contact, [usize; 2])> {
    let relabelled = contact.shifts().into_iter().map(|shift| (true, contact, shift));
    std::iter::once((false, contact, [0, 0])).chain(relabelled).collect()
}

/// A relabelled contact's centre keeps this distance from the outer taxels, taxels.
const MARGIN_PX: f64 = 1.2;

/// Distance of neighbouring shifts along an axis, taxels. All shifts see the same measurements, so that those between
/// tell little more.
const SHIFT_STEP: usize = 2;

/// Measurements of a touch in which it is located: some hundred windows of the usual sizes.
const TOUCH_MEASUREMENTS: usize = 2000;

/// Measurements and true centre.
struct Contact {
    shape: [usize; 2],
    centre: [f64; 2],
    press: Press,
}

impl Contact {
    /// `None` when a sample is lost or the contact has no image.
    fn new(recording: &Recording, bounce: &RecordedBounce, shape: [usize; 2]) -> Option<Self> {
        let centre = centre_of_mass(&contact_image(recording, bounce)?, shape[1], SUPPORT_THRESHOLD)?;
        let press = bounce.untouched.press(recording, bounce.block, bounce.start..bounce.end);
        Some(Self { shape, centre, press })
    }

    /// The middle of a touch, at most [`TOUCH_MEASUREMENTS`]; its centre is the touched taxel. `None` without an image.
    fn of_touch(recording: &Recording, touch: &RecordedTouch, shape: [usize; 2]) -> Option<Self> {
        let taxel = touch.taxel(recording)?;
        Some(Self {
            shape,
            centre: [taxel / shape[1], taxel % shape[1]].map(|at| at as f64),
            press: touch.press(recording, TOUCH_MEASUREMENTS),
        })
    }

    /// The centre after a cyclic shift by whole taxels.
    fn moved(&self, shift: [usize; 2]) -> [f64; 2] {
        [0, 1].map(|k| (self.centre[k] + shift[k] as f64) % self.shape[k] as f64)
    }

    /// Shifts that leave the centre far enough from the edge, every [`SHIFT_STEP`]th along an axis.
    fn shifts(&self) -> Vec<[usize; 2]> {
        let along = |k: usize| {
            let inside = move |s: &usize| {
                let at = (self.centre[k] + *s as f64) % self.shape[k] as f64;
                (MARGIN_PX..=self.shape[k] as f64 - 1.0 - MARGIN_PX).contains(&at)
            };
            (0..self.shape[k]).filter(inside).step_by(SHIFT_STEP)
        };
        along(0).flat_map(|r| along(1).map(move |c| [r, c])).collect()
    }

    /// The contact with taxel (r, c) called (r + shift₀, c + shift₁), cyclically.
    fn relabelled(&self, shift: [usize; 2]) -> Press {
        let [rows, cols] = self.shape;
        self.press.renamed(|k| (k / cols + shift[0]) % rows * cols + (k % cols + shift[1]) % cols)
    }
}

/// The contact of rows that do not say it.
pub(crate) const BALL: &str = "ball";

fn ball() -> String {
    BALL.to_owned()
}

/// How well one decoder at one M finds the place of a bouncing ball or of touches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PlaceRow {
    /// "ball", or the name of a session: of touches, and of drops where there are several.
    #[serde(default = "ball")]
    pub contact: String,
    /// Algorithm.
    pub decoder: String,
    /// Number of measurements, M.
    pub m: usize,
    /// Whether the taxels were relabelled cyclically, so that the contact may be anywhere. As recorded, all drops fall
    /// near the middle.
    pub relabelled: bool,
    /// How the rows of a window are obtained.
    #[serde(default)]
    pub sensing: Sensing,
    /// Mean distance from the true centre, taxels.
    pub mean_px: f64,
    /// Share of windows within one taxel.
    pub share_under_1px: f64,
}

/// How well one variant of the published decoder at one M finds the place of the bouncing ball.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LocalisationRow {
    /// Decoding variant.
    pub decode: String,
    /// Number of measurements.
    pub m: usize,
    /// Mean distance between the estimated and the true centre, taxels.
    pub mean_px: f64,
    /// Median distance, taxels.
    pub median_px: f64,
    /// Share of windows within one taxel.
    pub share_under_1px: f64,
}
