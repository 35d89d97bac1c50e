//! The table of designers. A new one has a file beside this one and a line here.

use super::classes::Classes;
use super::cosine::CosineSigns;
use super::greedy::Greedy;
use super::hadamard::Hadamard;
use super::random::Random;
use super::seeds::SeedsSearch;
use super::separable::Separable;
use super::task::DesignRows;
use crate::operator::SignGenerator;

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

/// Weights that a designer's rows may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Levels {
    /// ±1.
    Signs,
    /// Levels of an 8-bit converter.
    Analog,
}

/// A designer of rows in the table [`DESIGNERS`]: its names, what it needs to know, and how it is built.
#[derive(Clone, Copy)]
pub struct Designer {
    /// Name on the command line and in files.
    pub name: &'static str,
    /// Name in figures and printed tables.
    pub label: &'static str,
    /// Description.
    pub about: &'static str,
    /// What it needs to know about the images.
    pub needs: RowNeeds,
    /// Levels of its rows.
    pub levels: Levels,
    /// Builds the designer.
    pub build: fn() -> Box<dyn DesignRows>,
}

const fn line(
    name: &'static str,
    label: &'static str,
    needs: RowNeeds,
    levels: Levels,
    build: fn() -> Box<dyn DesignRows>,
    about: &'static str,
) -> Designer {
    Designer {
        name,
        label,
        about,
        needs,
        levels,
        build,
    }
}

use Levels::{Analog, Signs};
use RowNeeds::{Moments, Nothing};

/// Sets of seeds that are tried.
const SEED_SETS: usize = 200;

/// Every designer: name, label, needs, levels, builder, description.
pub const DESIGNERS: &[Designer] = &[
    line(
        "random",
        "random",
        Nothing,
        Signs,
        || Box::new(Random),
        "independent random signs",
    ),
    line(
        "seeds_search",
        "searched seeds",
        Nothing,
        Signs,
        || {
            Box::new(SeedsSearch {
                generator: SignGenerator::NUMERICAL_RECIPES,
                budget: SEED_SETS,
            })
        },
        "the cells' generators, with seeds whose rows are least alike",
    ),
    line(
        "cosine_signs",
        "cosine signs",
        Nothing,
        Signs,
        || Box::new(CosineSigns),
        "signs of two-dimensional cosines, low frequencies first",
    ),
    line(
        "hadamard",
        "Hadamard",
        Nothing,
        Signs,
        || Box::new(Hadamard::Sequency),
        "two-dimensional Walsh functions by sequency",
    ),
    line(
        "cake_cutting",
        "Hadamard, cake-cutting",
        Nothing,
        Signs,
        || Box::new(Hadamard::CakeCutting),
        "two-dimensional Walsh functions by their number of blocks",
    ),
    line(
        "greedy",
        "greedy",
        Moments,
        Signs,
        || Box::new(Greedy::signs()),
        "row by row, the one that lowers the posterior variance most",
    ),
    line(
        "separable",
        "separable",
        Moments,
        Signs,
        || Box::new(Separable),
        "products of greedy rows along the two axes, for sheets of any size",
    ),
    line(
        "analog",
        "greedy, analog",
        Moments,
        Analog,
        || Box::new(Greedy::analog()),
        "greedy with the 256 levels of an 8-bit converter",
    ),
    line(
        "classes",
        "for classes",
        RowNeeds::Classes,
        Signs,
        || Box::new(Classes::default()),
        "row by row, the one that lowers the bound of classification errors most",
    ),
];

/// The designer called `name` in [`DESIGNERS`]; `None` if there is none.
///
/// ```
/// use spts_recon::rows::{DESIGNERS, RowNeeds, designer};
///
/// assert_eq!(designer("hadamard").map(|d| d.needs), Some(RowNeeds::Nothing));
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
