//! Locates the bouncing ball or a finger from windows of measurements.

mod bounces;
mod contact;
mod locators;
mod rows;
mod touches;

pub use bounces::{RecordedBounce, contact_image, find_bounces};
pub use rows::{LocalisationRow, PlaceRow};
pub(crate) use touches::touch_of;
pub use touches::{RecordedTouch, find_touches};

use crate::error::ScoreError;
use crate::sensing::{Sensing, chosen_places};
use crate::training::Dictionary;
use contact::Contact;
pub use locators::locator_label;
use locators::{LOCATORS, Locate, LocatorSpec, TAXEL, Taxel, Tools, middle};
use rayon::prelude::*;
use rows::{BALL, Located};
use spts_circuit::Recording;
use spts_input::Refusal;
use spts_recon::Matrix;
use spts_recon::localise::{BlobConfig, Localiser, distance};
use spts_recon::statistics::mean;

/// The published locators.
const PUBLISHED: [&str; 2] = ["script_s5", "matched"];

/// Rows of the published locators at every M of `measurements`, of the contacts as recorded.
///
/// # Errors
/// [`ScoreError::Refused`] when the sheet is no grid of `cols` columns.
pub(crate) fn localise(
    recording: &Recording,
    shifted: &Matrix,
    cols: usize,
    measurements: &[usize],
) -> Result<Vec<LocalisationRow>, ScoreError> {
    let asked = PlacesRequest {
        locators: LOCATORS.iter().filter(|spec| PUBLISHED.contains(&spec.name)).collect(),
        relabelled: false,
        measurements,
        sensing: &[Sensing::Random],
    };
    let tools = Tools::new(recording, shifted.clone(), cols)?;
    let found = asked.locate(&tools, &bounces(recording, tools.shape))?;
    Ok(found.iter().filter_map(Located::localisation_row).collect())
}

/// Rows of every locator at every M of `measurements`, as recorded and relabelled, by windows of every kind of
/// `sensing`.
///
/// # Errors
/// [`ScoreError::Refused`] when the sheet is no grid of `cols` columns, [`ScoreError::Rows`] when no rows can be chosen.
pub(crate) fn places(
    recording: &Recording,
    shifted: Matrix,
    cols: usize,
    measurements: &[usize],
    sensing: &[Sensing],
) -> Result<Vec<PlaceRow>, ScoreError> {
    let asked = PlacesRequest {
        locators: LOCATORS.iter().filter(|spec| spec.name != TAXEL).collect(),
        relabelled: true,
        measurements,
        sensing,
    };
    let tools = Tools::new(recording, shifted, cols)?;
    let found = asked.locate(&tools, &bounces(recording, tools.shape))?;
    Ok(found.iter().filter_map(|row| row.place_row(BALL)).collect())
}

/// Rows of every locator at every M of `measurements` for the touches of the session `name`, by windows of measurements
/// that follow each other; none when no touch is found. Without a dictionary at all places, `shifted`, the locators
/// that need one have no rows.
///
/// # Errors
/// [`ScoreError::Refused`] when the sheet is no grid of `cols` columns.
pub(crate) fn touch_places(
    name: &str,
    recording: &Recording,
    shifted: Option<&Matrix>,
    measurements: &[usize],
) -> Result<Vec<PlaceRow>, ScoreError> {
    let usable = |name: &str| shifted.is_some() || !PUBLISHED.contains(&name);
    let asked = PlacesRequest {
        locators: LOCATORS.iter().filter(|spec| usable(spec.name)).collect(),
        relabelled: false,
        measurements,
        sensing: &[Sensing::Random],
    };
    let shifted = shifted.cloned().unwrap_or_else(|| Matrix::zeros(recording.taxels(), 1));
    let tools = Tools::new(recording, shifted, recording.layout().cols())?;
    let touches = find_touches(recording);
    let touches = touches
        .iter()
        .filter_map(|touch| Contact::of_touch(recording, touch, tools.shape));
    let found = asked.locate(&tools, &touches.collect::<Vec<_>>())?;
    Ok(found.iter().filter_map(|row| row.place_row(name)).collect())
}

/// Mean distance, taxels, between the touched taxel of `touches` and the taxel that alone explains most of a window
/// (locator `taxel`), over all windows, for every M of `measurements`; `None` without a window.
#[must_use]
pub fn touch_errors_px(recording: &Recording, touches: &[RecordedTouch], measurements: &[usize]) -> Vec<Option<f64>> {
    let cols = recording.layout().cols();
    let shape = [recording.layout().rows(), cols];
    let contacts = touches
        .iter()
        .filter_map(|touch| Contact::of_touch(recording, touch, shape));
    let contacts: Vec<Contact> = contacts.collect();
    let mean_px = |m: usize| {
        let mut errors_px = Vec::new();
        for contact in &contacts {
            let (press, truth) = (contact.relabelled([0, 0]), contact.moved([0, 0]));
            for (start, window) in press.windows(0..press.len(), m, m) {
                let place = Taxel(shape).locate(start, &window).unwrap_or(middle(shape));
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
    let contacts = bounces
        .iter()
        .filter_map(|bounce| Contact::new(recording, bounce, shape));
    contacts.collect()
}

impl Tools {
    /// Tools for the skin of `recording`, with `cols` columns.
    fn new(recording: &Recording, shifted: Matrix, cols: usize) -> Result<Self, ScoreError> {
        let shape = [recording.taxels() / cols.max(1), cols];
        Ok(Self {
            shape,
            dictionary: Dictionary::new(shifted),
            localiser: Localiser::new(&BlobConfig::new(shape[0], shape[1]))?,
        })
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

impl PlacesRequest<'_> {
    /// The truth is the centre of mass of the ball's least-squares image, or the touched taxel; every window of M
    /// consecutive measurements in contact is located, or windows of rows that are chosen among those of the contact.
    fn locate(&self, tools: &Tools, contacts: &[Contact]) -> Result<Vec<Located>, ScoreError> {
        let mut views: Vec<(bool, &Contact, [usize; 2])> = contacts.iter().flat_map(views).collect();
        views.retain(|(relabelled, ..)| self.relabelled || !relabelled);
        let errors: Vec<Vec<Vec<f64>>> = views
            .par_iter()
            .map(|&(_, contact, shift)| self.errors(tools, contact, shift))
            .collect::<Result<_, Refusal>>()
            .map_err(ScoreError::Rows)?;
        let kinds = self
            .sensing
            .iter()
            .flat_map(|&sensing| [(false, sensing), (true, sensing)]);
        let mut found = Vec::new();
        for (k, (relabelled, sensing)) in kinds.enumerate() {
            for (l, spec) in self.locators.iter().enumerate() {
                for (i, &m) in self.measurements.iter().enumerate() {
                    let at = (k / 2 * self.locators.len() + l) * self.measurements.len() + i;
                    let of = views.iter().zip(&errors).filter(|(view, _)| view.0 == relabelled);
                    found.push(Located {
                        locator: spec.name,
                        m,
                        relabelled,
                        sensing,
                        errors_px: of.flat_map(|(_, e)| e[at].iter().copied()).collect(),
                    });
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
                Sensing::Chosen => chosen_places(&press, tools.shape, most)?,
            };
            for spec in &self.locators {
                let mut locators: Vec<Box<dyn Locate + '_>> =
                    presses.iter().map(|press| (spec.start)(tools, press)).collect();
                for &m in self.measurements {
                    let mut errors = Vec::new();
                    for (press, locator) in presses.iter().zip(&mut locators) {
                        // of chosen rows, the first are the choice for any M
                        let end = if *sensing == Sensing::Chosen { m } else { press.len() };
                        // a window that a locator fails on counts as a guess, so that all are compared on the same ones
                        let places = press
                            .windows(0..end, m, m)
                            .map(|(start, window)| locator.locate(start, &window).unwrap_or(middle(tools.shape)));
                        errors.extend(places.map(|p| distance(p, truth)));
                    }
                    found.push(errors);
                }
            }
        }
        Ok(found)
    }
}

/// A contact as recorded and, relabelled, at every cyclic shift of the taxels that leaves its centre far enough from
/// the edge: as recorded, all drops fall on the middle of the sheet, which a guess finds too.
fn views(contact: &Contact) -> Vec<(bool, &Contact, [usize; 2])> {
    let relabelled = contact.shifts().into_iter().map(|shift| (true, contact, shift));
    std::iter::once((false, contact, [0, 0])).chain(relabelled).collect()
}
