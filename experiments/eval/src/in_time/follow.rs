//! Tracks one contact with one decoder.

use super::event::FollowedContact;
use super::motion;
use super::tally::{Compared, Moment};
use crate::algorithm::DecodeError;
use crate::decoders::TrainedDecoder;
use crate::scorer::Scorer;
use spts_recon::localise::{centre_of_mass, distance};
use spts_recon::metrics::{SUPPORT_THRESHOLD, SupportScore, support};
use spts_recon::recover::{Gaussian, TrackedImage};
use std::sync::Arc;

/// What is scored of one contact, moment by moment.
pub(crate) type Followed = Vec<(Moment, Compared)>;

/// Follows `contact` on a sheet of `cols` columns by windows of `m` samples, with `decoder` for windows alone and
/// `prior`, its own, in time.
///
/// # Errors
/// [`DecodeError`] when a window cannot be followed.
pub(crate) fn follow(
    contact: &FollowedContact,
    decoder: &TrainedDecoder,
    prior: &Arc<Gaussian>,
    m: usize,
    cols: usize,
) -> Result<Followed, DecodeError> {
    let mut image = TrackedImage::new(Arc::clone(prior), motion(contact.rate_hz, contact.idle_noise_v))?;
    let mut scorer = Scorer::new(decoder);
    let mut followed = Followed::new();
    let taxels = prior.mean().len();
    // windows follow each other, one of them from the touch on
    let mut start = contact.touch % m;
    let mut last = start;
    let mut moments = contact.moments.iter().peekable();
    while let Some(moment) = moments.peek() {
        if start + m > moment.end {
            let moment = moments.next().filter(|_| start >= m);
            // the window that ends here, unless one of its samples was lost
            let Some((moment, window)) = moment.and_then(|at| Some((at, contact.press.window(start - m, m)?))) else {
                continue;
            };
            let long = contact.press.window(start.saturating_sub(taxels), taxels.min(start));
            let windows = [Some(window), long.filter(|_| m < taxels)];
            let mut scores = [None; 3];
            for (score, window) in scores.iter_mut().zip(windows) {
                let Some(window) = window else { continue };
                let answers = scorer.answers(std::slice::from_ref(&window))?;
                *score = answers.first().map(|answer| one(&answer.image, moment, cols));
            }
            scores[2] = Some(one(image.image(), moment, cols));
            followed.push((moment.at, Compared { scores }));
            continue;
        }
        if let Some(window) = contact.press.window(start, m) {
            image.observe((start + m - last) as f64, window.phi, window.y)?;
            last = start + m;
        }
        start += m;
    }
    Ok(followed)
}

/// Intersection over union of the support of `image`, and the distance of its centre from the true one, px.
fn one(image: &[f64], moment: &super::event::ScoredMoment, cols: usize) -> (f64, Option<f64>) {
    let mut found = Vec::new();
    support(image, SUPPORT_THRESHOLD, &mut found);
    let error_px = moment.centre.map(|truth| {
        let rows = image.len() / cols.max(1);
        let middle = [rows, cols].map(|n| n.saturating_sub(1) as f64 / 2.0);
        distance(centre_of_mass(image, cols, SUPPORT_THRESHOLD).unwrap_or(middle), truth)
    });
    (SupportScore::new(&found, &moment.support).iou, error_px)
}
