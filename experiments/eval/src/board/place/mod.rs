//! Where the bouncing ball is: the localisation part of the board.

mod contact;
mod locators;

use super::rows::PlaceRow;
use crate::learn::Dictionary;
use crate::score::find_bounces;
use contact::Contact;
use locators::{LOCATORS, Locate, middle};
use rayon::prelude::*;
use spts_circuit::Recording;
use spts_recon::localise::{BlobConfig, Localiser, distance};
use spts_recon::{Matrix, RangeError};

/// What locators work with.
struct Tools {
    shape: [usize; 2],
    /// Dictionary at all places.
    dictionary: Dictionary,
    localiser: Localiser,
}

/// Rows of every locator at every M of `measurements`, as recorded and relabelled. The truth is the centre of mass of the contact's
/// least-squares image, as [`crate::score::localise`] has it; every window of M consecutive measurements in contact is located.
///
/// # Errors
/// [`RangeError`] when the sheet is no grid of `cols` columns.
pub(super) fn places(
    recording: &Recording,
    shifted: Matrix,
    cols: usize,
    measurements: &[usize],
) -> Result<Vec<PlaceRow>, RangeError> {
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
    let views: Vec<(bool, &Contact, [usize; 2])> = contacts.iter().flat_map(views).collect();
    let errors: Vec<Vec<Vec<f64>>> = views
        .par_iter()
        .map(|&(_, contact, shift)| errors(&tools, contact, shift, measurements))
        .collect();
    let mut rows = Vec::new();
    for relabelled in [false, true] {
        for (l, (name, _)) in LOCATORS.iter().enumerate() {
            for (i, &m) in measurements.iter().enumerate() {
                let of = views.iter().zip(&errors).filter(|(view, _)| view.0 == relabelled);
                let all: Vec<f64> = of
                    .flat_map(|(_, e)| e[l * measurements.len() + i].iter().copied())
                    .collect();
                rows.extend(row(name, m, relabelled, &all));
            }
        }
    }
    Ok(rows)
}

/// A contact as recorded and, relabelled, at every cyclic shift of the taxels that leaves its centre far enough from the edge: as recorded,
/// all drops fall on the middle of the sheet, which a guess finds too.
fn views(contact: &Contact) -> Vec<(bool, &Contact, [usize; 2])> {
    let relabelled = contact.shifts().into_iter().map(|shift| (true, contact, shift));
    std::iter::once((false, contact, [0, 0])).chain(relabelled).collect()
}

fn row(name: &str, m: usize, relabelled: bool, errors: &[f64]) -> Option<PlaceRow> {
    let share = |part: f64| part / errors.len() as f64;
    (!errors.is_empty()).then(|| PlaceRow {
        decoder: name.to_owned(),
        m,
        relabelled,
        mean_px: share(errors.iter().sum()),
        share_under_1px: share(errors.iter().map(|e| f64::from(u8::from(*e < 1.0))).sum()),
    })
}

/// Distances of every locator at every M.
fn errors(tools: &Tools, contact: &Contact, shift: [usize; 2], measurements: &[usize]) -> Vec<Vec<f64>> {
    let (moved, truth) = (contact.relabelled(shift), contact.moved(shift));
    let mut found = Vec::with_capacity(LOCATORS.len() * measurements.len());
    for (_, start) in LOCATORS {
        let mut locator: Box<dyn Locate + '_> = start(tools, &moved);
        for &m in measurements {
            let starts = (0..(moved.y.len() + 1).saturating_sub(m)).step_by(m.max(1));
            // a window that a locator fails on counts as a guess, so that all are compared on the same ones
            let places = starts.map(|s| locator.locate(s, m).unwrap_or(middle(tools.shape)));
            found.push(places.map(|p| distance(p, truth)).collect());
        }
    }
    found
}
