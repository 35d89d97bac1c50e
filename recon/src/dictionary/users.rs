//! The images that use each atom.

use crate::problem::Solution;

/// The images that use each atom, and where in their codes.
#[derive(Debug, Default)]
pub(super) struct Users {
    /// First entry of every atom in `entries`, and the end of the last.
    starts: Vec<usize>,
    entries: Vec<(usize, usize)>,
}

impl Users {
    /// Collects the users of `n_atoms` atoms from the codes of all images.
    pub(super) fn collect(&mut self, codes: &[Solution], n_atoms: usize) {
        self.starts.clear();
        self.starts.resize(n_atoms + 1, 0);
        for &atom in codes.iter().flat_map(|c| &c.support) {
            self.starts[atom + 1] += 1;
        }
        for atom in 0..n_atoms {
            self.starts[atom + 1] += self.starts[atom];
        }
        let mut next = self.starts.clone();
        self.entries.clear();
        self.entries.resize(self.starts[n_atoms], (0, 0));
        for (image, code) in codes.iter().enumerate() {
            for (slot, &atom) in code.support.iter().enumerate() {
                self.entries[next[atom]] = (image, slot);
                next[atom] += 1;
            }
        }
    }

    /// (image, place in its code) of every user of `atom`, in the order of the images.
    pub(super) fn of(&self, atom: usize) -> &[(usize, usize)] {
        &self.entries[self.starts[atom]..self.starts[atom + 1]]
    }
}
