//! Where the bouncing ball is: from windows of measurements to places.

mod bounces;
mod contact;
mod locators;
mod rows;

pub use bounces::{RecordedBounce, contact_image, find_bounces};
pub use rows::{LocalisationRow, PlaceRow};

use crate::training::Dictionary;
use contact::Contact;
pub use locators::locator_label;
use locators::{LOCATORS, Locate, StartLocator, Tools, middle};
use rayon::prelude::*;
use rows::Located;
use spts_circuit::Recording;
use spts_recon::localise::{BlobConfig, Localiser, distance};
use spts_recon::{Matrix, RangeError};

/// The published locators.
const PUBLISHED: [&str; 2] = ["script_s5", "matched"];

/// Rows of the published locators at every M of `measurements`, of the contacts as recorded.
///
/// # Errors
/// [`RangeError`] when the sheet is no grid of `cols` columns.
pub(crate) fn localise(
    recording: &Recording,
    shifted: &Matrix,
    cols: usize,
    measurements: &[usize],
) -> Result<Vec<LocalisationRow>, RangeError> {
    let asked = PlacesRequest {
        locators: LOCATORS.iter().filter(|(name, _)| PUBLISHED.contains(name)).collect(),
        relabelled: false,
        measurements,
    };
    let found = asked.locate(recording, shifted.clone(), cols)?;
    Ok(found.iter().filter_map(Located::localisation_row).collect())
}

/// Rows of every locator at every M of `measurements`, as recorded and relabelled.
///
/// # Errors
/// [`RangeError`] when the sheet is no grid of `cols` columns.
pub(crate) fn places(
    recording: &Recording,
    shifted: Matrix,
    cols: usize,
    measurements: &[usize],
) -> Result<Vec<PlaceRow>, RangeError> {
    let asked = PlacesRequest {
        locators: LOCATORS.iter().collect(),
        relabelled: true,
        measurements,
    };
    let found = asked.locate(recording, shifted, cols)?;
    Ok(found.iter().filter_map(Located::place_row).collect())
}

/// Which places are asked for.
struct PlacesRequest<'a> {
    locators: Vec<&'a (&'static str, StartLocator)>,
    /// Whether contacts are also relabelled.
    relabelled: bool,
    measurements: &'a [usize],
}

impl PlacesRequest<'_> {
    /// The truth is the centre of mass of the contact's least-squares image; every window of M consecutive measurements
    /// in contact is located.
    fn locate(&self, recording: &Recording, shifted: Matrix, cols: usize) -> Result<Vec<Located>, RangeError> {
        let shape = [recording.taxels() / cols.max(1), cols];
        let tools = Tools {
            shape,
            dictionary: Dictionary::new(shifted),
            localiser: Localiser::new(&BlobConfig::new(shape[0], shape[1]))?,
        };
        let contacts: Vec<Contact> = find_bounces(recording)
            .iter()
            .filter_map(|bounce| Contact::new(recording, bounce, shape))
            .collect();
        let mut views: Vec<(bool, &Contact, [usize; 2])> = contacts.iter().flat_map(views).collect();
        views.retain(|(relabelled, ..)| self.relabelled || !relabelled);
        let errors: Vec<Vec<Vec<f64>>> = views
            .par_iter()
            .map(|&(_, contact, shift)| self.errors(&tools, contact, shift))
            .collect();
        let mut found = Vec::new();
        for relabelled in [false, true] {
            for (l, (locator, _)) in self.locators.iter().enumerate() {
                for (i, &m) in self.measurements.iter().enumerate() {
                    let of = views.iter().zip(&errors).filter(|(view, _)| view.0 == relabelled);
                    let each = of.flat_map(|(_, e)| e[l * self.measurements.len() + i].iter().copied());
                    found.push(Located {
                        locator,
                        m,
                        relabelled,
                        errors_px: each.collect(),
                    });
                }
            }
        }
        Ok(found)
    }

    /// Distances of every locator at every M.
    fn errors(&self, tools: &Tools, contact: &Contact, shift: [usize; 2]) -> Vec<Vec<f64>> {
        let (press, truth) = (contact.relabelled(shift), contact.moved(shift));
        let mut found = Vec::with_capacity(self.locators.len() * self.measurements.len());
        for (_, start) in &self.locators {
            let mut locator: Box<dyn Locate + '_> = start(tools, &press);
            for &m in self.measurements {
                // a window that a locator fails on counts as a guess, so that all are compared on the same ones
                let places = press
                    .windows(0..press.len(), m, m)
                    .map(|(start, window)| locator.locate(start, &window).unwrap_or(middle(tools.shape)));
                found.push(places.map(|p| distance(p, truth)).collect());
            }
        }
        found
    }
}

/// A contact as recorded and, relabelled, at every cyclic shift of the taxels that leaves its centre far enough from
/// the edge: as recorded, all drops fall on the middle of the sheet, which a guess finds too.
fn views(contact: &Contact) -> Vec<(bool, &Contact, [usize; 2])> {
    let relabelled = contact.shifts().into_iter().map(|shift| (true, contact, shift));
    std::iter::once((false, contact, [0, 0])).chain(relabelled).collect()
}
