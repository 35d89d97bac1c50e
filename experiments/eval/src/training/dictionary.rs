//! Dictionaries: atoms with look-up tables for rows of Φ·D, and how they are learned.

use rand::seq::SliceRandom as _;
use spts_input::Refusal;
use spts_models::Streams;
use spts_recon::dictionary::{Ksvd, Selection, select};
use spts_recon::{Matrix, MatrixView, SignTables};
use std::ops::Range;

/// Images (atoms) that a sparse decoder composes its image of, with look-up tables for their sums under rows of ±1.
///
/// ```
/// use spts_eval::training::Dictionary;
/// use spts_recon::Matrix;
///
/// let dictionary = Dictionary::new(Matrix::from_columns(3, 1, &[1.0, 2.0, 4.0]).unwrap());
/// let phi = Matrix::from_rows(1, 3, vec![1.0, -1.0, 1.0]).unwrap();
/// let mut row = [0.0];
/// dictionary.project(phi.view(), None, &mut row);
/// assert_eq!(row, [3.0]);
/// dictionary.to_unit_weights(&mut row); // the weights {1, 0, 1}
/// assert_eq!(row, [5.0]);
/// ```
#[derive(Debug, Clone)]
pub struct Dictionary {
    /// Atoms, taxels × K.
    pub atoms: Matrix,
    /// Look-up tables of the atoms.
    pub tables: SignTables<f64>,
    /// Sum over the taxels of every atom. Φ·D with weights {0, 1} is (Φ·D with ±1 + this sum) / 2.
    pub sums: Vec<f64>,
}

impl Dictionary {
    /// The dictionary of `atoms`, taxels × K.
    #[must_use]
    pub fn new(atoms: Matrix) -> Self {
        Self {
            tables: SignTables::new(atoms.view()),
            sums: atoms.column_sums(),
            atoms,
        }
    }

    /// Computes rows of Φ·D for the rows `phi` of Φ, by look-up if `signs` holds the weights as bits.
    pub fn project(&self, phi: MatrixView<'_>, signs: Option<&[u64]>, out: &mut [f64]) {
        if let Some(signs) = signs {
            return self.tables.fill_rows(signs, out);
        }
        let (taxels, atoms) = (phi.ncols().max(1), self.sums.len().max(1));
        for (row, out) in phi.values().chunks_exact(taxels).zip(out.chunks_exact_mut(atoms)) {
            out.fill(0.0);
            self.atoms.accumulate_row(row, out);
        }
    }

    /// Turns rows of Φ·D with weights ±1 into rows with weights {0, 1}.
    pub fn to_unit_weights(&self, rows: &mut [f64]) {
        for row in rows.chunks_exact_mut(self.sums.len().max(1)) {
            row.iter_mut().zip(&self.sums).for_each(|(a, s)| *a = 0.5 * (*a + s));
        }
    }
}

/// How much the published decoder learns from: presses, images, and sweeps of the dictionary learning.
#[derive(Debug, Clone)]
pub struct Learning {
    /// Raster presses of every object that are used for training.
    pub presses: Range<usize>,
    /// Largest number of training images of the dictionary.
    pub training_images: usize,
    /// Number of sweeps of the dictionary learning.
    pub sweeps: usize,
}

impl Learning {
    /// Which images a dictionary is learned from, and how.
    pub(super) fn dictionary(&self) -> (Selection, Ksvd) {
        let selection = Selection {
            max_images: self.training_images,
            ..Selection::default()
        };
        let ksvd = Ksvd {
            n_iter: self.sweeps,
            ..Ksvd::default()
        };
        (selection, ksvd)
    }
}

/// K-SVD on what `selection` keeps of the `candidates`.
pub(super) fn learn_dictionary(
    mut candidates: Vec<Vec<f64>>,
    (selection, ksvd): &(Selection, Ksvd),
    streams: Streams,
) -> Result<Matrix, Refusal> {
    // the limit on their number then treats all objects, presses and frames alike
    candidates.shuffle(&mut streams.rng("training", 0));
    let chosen: Vec<Vec<f64>> = select(&candidates, selection)
        .into_iter()
        .map(|i| candidates[i].clone())
        .collect();
    ksvd.learn(&chosen, &mut streams.rng("ksvd", 0))
}
