//! The table of designers. A new one has a file beside this one and a line here.

use super::classes::Classes;
use super::cosine::CosineSigns;
use super::greedy::Greedy;
use super::random::Random;
use super::separable::Separable;
use super::task::DesignRows;

/// What a designer needs to know about the images.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RowNeeds {
    /// Only the grid.
    Nothing,
    /// Their second moments.
    Moments,
    /// Classes to distinguish.
    Classes,
}

/// A designer of rows in the table [`DESIGNERS`]: its names, what it needs to know, and how it is built.
#[derive(Clone, Copy)]
pub struct Designer {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in figures and printed tables.
    pub label: &'static str,
    /// What it needs to know about the images.
    pub needs: RowNeeds,
    /// Description.
    pub about: &'static str,
    /// Builds the designer.
    pub build: fn() -> Box<dyn DesignRows>,
}

const fn line(
    name: &'static str,
    label: &'static str,
    needs: RowNeeds,
    about: &'static str,
    build: fn() -> Box<dyn DesignRows>,
) -> Designer {
    Designer {
        name,
        label,
        needs,
        about,
        build,
    }
}

use RowNeeds::{Moments, Nothing};

/// Every designer: name, label, needs, description, builder.
pub const DESIGNERS: &[Designer] = &[
    line("random", "random", Nothing, "independent random signs", || {
        Box::new(Random)
    }),
    line(
        "cosine_signs",
        "cosine signs",
        Nothing,
        "signs of two-dimensional cosines, low frequencies first",
        || Box::new(CosineSigns),
    ),
    line(
        "greedy",
        "greedy",
        Moments,
        "row by row, the one that lowers the posterior variance most",
        || Box::new(Greedy::default()),
    ),
    line(
        "separable",
        "separable",
        Moments,
        "products of greedy rows along the two axes, for sheets of any size",
        || Box::new(Separable),
    ),
    line(
        "classes",
        "for classes",
        RowNeeds::Classes,
        "row by row, the one that lowers the bound of classification errors most",
        || Box::new(Classes::default()),
    ),
];

/// The designer called `name` in [`DESIGNERS`]; `None` if there is none.
///
/// ```
/// use spts_recon::rows::{DESIGNERS, RowNeeds, designer};
///
/// assert_eq!(designer("cosine_signs").map(|d| d.needs), Some(RowNeeds::Nothing));
/// assert!(DESIGNERS.iter().all(|d| designer(d.name).is_some()));
/// ```
#[must_use]
pub fn designer(name: &str) -> Option<&'static Designer> {
    DESIGNERS.iter().find(|d| d.name == name)
}

#[cfg(test)]
mod tests {
    use super::super::conformance;
    use super::*;

    #[test]
    fn every_designer_conforms() {
        for designer in DESIGNERS {
            conformance(designer);
        }
    }
}
