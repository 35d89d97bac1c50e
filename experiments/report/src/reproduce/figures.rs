//! The table of the report's figures. A new one is a function in `curves` or `sheets` and a line here.

use super::curves::BothSkins;
use super::dataset::SimulatedData;
use super::sheets;
use super::tables::CorrelationRow;
use super::timing::TimingRow;
use crate::ReportError;
use crate::figures::{Chart, Sheet, save_charts, save_sheet};
use std::path::Path;

/// What figures are drawn from.
pub(super) struct Shown<'a> {
    pub(super) dataset: &'a SimulatedData,
    pub(super) skins: &'a BothSkins<'a>,
    pub(super) correlations: &'a [CorrelationRow],
    pub(super) timings: &'a [TimingRow],
}

/// A figure before it is written.
pub(super) enum Drawing {
    /// Panels of curves.
    Charts(Vec<Chart>),
    /// Images.
    Sheet(Sheet),
}

use Drawing::{Charts, Sheet as Images};

/// A line of the table: section of the page, file (with `.png` where the page shows pixels), caption, and what draws
/// it.
pub(super) struct FigureLine(
    pub(super) &'static str,
    pub(super) &'static str,
    pub(super) &'static str,
    Draw,
);

type Draw = fn(&Shown<'_>) -> Drawing;

/// Every figure, in the order of the page.
pub(super) const FIGURES: &[FigureLine] = &[
    FigureLine(
        "objects",
        "s5_objects.png",
        "As Fig. S5, the paper’s seventeen objects. Median raster images; r is Pearson's correlation of twin and recording.",
        |s| Images(sheets::objects(s.dataset, s.skins, s.correlations)),
    ),
    FigureLine(
        "classification",
        "3b_classification",
        "As Fig. 3B. Share of correct decisions over M. Curves are means over the objects that both skins recorded compressively. \
         The published library holds some of the very frames that the real raster control is scored on; nothing else is scored on \
         what was learned.",
        |s| Charts(s.skins.fig_3b()),
    ),
    FigureLine(
        "classification",
        "3c_support",
        "As Fig. 3C. Support accuracy counts every taxel, so an empty image already scores well; IoU does not reward it.",
        |s| Charts(s.skins.fig_3c()),
    ),
    FigureLine(
        "classification",
        "3d_frequency",
        "As Fig. 3D. Frames a second over M: acquired, and decoded on this machine.",
        |s| Charts(s.skins.fig_3d(s.timings)),
    ),
    FigureLine(
        "classification",
        "3e_latency",
        "As Fig. 3E. Left: the published rule, which begins 100 frames after contact. Right: from first contact on, while the force \
         still rises.",
        |s| Charts(s.skins.fig_3e()),
    ),
    FigureLine(
        "adaptive",
        "4_adaptive.png",
        "As Fig. 4, where the T is distinct at 15 measurements. The published compressive recordings hold no T; “rec” stands in for \
         both skins.",
        |s| Images(sheets::adaptive(s.skins, s.dataset.cols)),
    ),
    FigureLine(
        "adaptive",
        "s4_examples.png",
        "As Fig. S4. One window of each object at several M; the paper finds 15–20 enough for small objects and 25–30 for large ones.",
        |s| Images(sheets::examples(s.skins, s.dataset.cols)),
    ),
    FigureLine(
        "adaptive",
        "s6_dictionary.png",
        "As Fig. S6. First atoms of the learned dictionaries, 100 atoms each.",
        |s| Images(sheets::dictionaries(s.skins, s.dataset.cols)),
    ),
    FigureLine(
        "bounce",
        "5b_change",
        "As Fig. 5B. Change from frame to frame, and frames in a contact, over M.",
        |s| Charts(s.skins.fig_5().0),
    ),
    FigureLine(
        "bounce",
        "5c_peak",
        "As Fig. 5C. Largest taxel over time at several M.",
        |s| Charts(s.skins.fig_5().1),
    ),
    FigureLine(
        "bounce",
        "6_localisation",
        "As Fig. 6. Distance between the centre of mass of the decoded image and of the whole contact's.",
        |s| Charts(s.skins.fig_6()),
    ),
];

/// Writes every figure, as .svg and .png, into the folder `dir`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub(super) fn draw(dir: &Path, shown: &Shown<'_>) -> Result<(), ReportError> {
    for FigureLine(_, file, _, draw) in FIGURES {
        let name = file.trim_end_matches(".png");
        match draw(shown) {
            Charts(charts) => save_charts(&charts, dir, name)?,
            Images(sheet) => save_sheet(&sheet, dir, name)?,
        }
    }
    Ok(())
}
