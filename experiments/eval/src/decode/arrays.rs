//! The decoded windows of a session as one NumPy archive.

use super::DecodedSession;
use crate::npz::{self, NpzArray};
use crate::unique;
use spts::output::OutputError;
use std::path::Path;

/// Writes the archive `path`. For every M: `phi_mM` (windows × M × taxels), `y_mM` (windows × M, V), `block_mM` and
/// `window_mM`, and for every decoder `image_DECODER_mM` (windows × rows × cols). `truth` is blocks × rows × cols, NaN
/// where none is known.
///
/// # Errors
/// [`OutputError`] when the file cannot be written.
pub(super) fn write(path: &Path, session: &DecodedSession) -> Result<(), OutputError> {
    let [rows, cols] = session.shape;
    let taxels = rows * cols;
    let mut arrays: Vec<(String, Vec<usize>, Vec<f64>)> = Vec::new();
    let mut sizes: Vec<usize> = session.measured.iter().map(|w| w.m).collect();
    sizes.dedup();
    for m in sizes {
        let windows: Vec<_> = session.measured.iter().filter(|w| w.m == m).collect();
        let n = windows.len();
        let column = |of: fn(&super::MeasuredWindow) -> usize| windows.iter().map(|w| of(w) as f64).collect();
        arrays.push((
            format!("phi_m{m}"),
            vec![n, m, taxels],
            windows.iter().flat_map(|w| w.phi.clone()).collect(),
        ));
        arrays.push((
            format!("y_m{m}"),
            vec![n, m],
            windows.iter().flat_map(|w| w.y.clone()).collect(),
        ));
        arrays.push((format!("block_m{m}"), vec![n], column(|w| w.block)));
        arrays.push((format!("window_m{m}"), vec![n], column(|w| w.window)));
        let decoders = unique(session.rows.iter().filter(|row| row.m == m).map(|row| row.decoder));
        for decoder in decoders {
            let of = session.rows.iter().filter(|row| row.m == m && row.decoder == decoder);
            let mut of: Vec<_> = of.collect();
            of.sort_by_key(|row| (row.block, row.window));
            let mut images = Vec::with_capacity(of.len() * taxels);
            for row in &of {
                // a decoder that answers labels only has no image
                let mut image = row.image.clone();
                image.resize(taxels, f64::NAN);
                images.extend(image);
            }
            arrays.push((format!("image_{decoder}_m{m}"), vec![of.len(), rows, cols], images));
        }
    }
    let unknown = vec![f64::NAN; taxels];
    let truth = session
        .truth
        .iter()
        .flat_map(|t| t.as_ref().unwrap_or(&unknown).clone())
        .collect();
    arrays.push(("truth".to_owned(), vec![session.truth.len(), rows, cols], truth));
    let named: Vec<(&str, NpzArray<'_>)> = arrays
        .iter()
        .map(|(name, shape, values)| (name.as_str(), NpzArray::Doubles(shape, values)))
        .collect();
    npz::write(path, &named).map_err(OutputError::write(path))
}
