//! Which measurements of a recording form a window: consecutive ones, or those with selected rows.
//!
//! A held press contains thousands of random rows of a constant image. Any set of rows that a rule selects without
//! looking at the samples can therefore be scored on real samples. The order in time is lost: memory effects of the
//! cells, and changes during the press, are those of the recording and not of the window.

mod chosen;

pub use chosen::RowChooser;
pub(crate) use chosen::chosen_places;

use serde::{Deserialize, Serialize};

/// How the rows of a window are obtained.
///
/// ```
/// use spts_eval::Sensing;
///
/// assert_eq!(Sensing::ALL.map(Sensing::name), ["random", "chosen"]);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sensing {
    /// Consecutive measurements, with the rows that the cells put out.
    #[default]
    Random,
    /// Rows selected from those of a press for the decoder's training data, before any sample is used.
    Chosen,
}

impl Sensing {
    /// Both ways.
    pub const ALL: [Self; 2] = [Self::Random, Self::Chosen];

    /// Name on the command line and in files.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Random => "random",
            Self::Chosen => "chosen",
        }
    }
}
