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

/// A line of the table.
pub(super) struct FigureLine {
    /// Section of the page.
    pub(super) section: &'static str,
    /// File, with `.png` where the page shows pixels.
    pub(super) file: &'static str,
    /// What is to be seen, for those who cannot see it.
    pub(super) alt: &'static str,
    /// What it means.
    pub(super) caption: &'static str,
    /// What the caption says more when the real skin stands beside the twin.
    pub(super) compared: Option<&'static str>,
    draw: fn(&Shown<'_>) -> Drawing,
}

/// Every figure, in the order of the page.
pub(super) const FIGURES: &[FigureLine] = &[
    FigureLine {
        section: "objects",
        file: "s5_objects.png",
        alt: "Seventeen rows of pictures: each object on the skin, the pressure on the 10 by 10 taxels, and the raster image.",
        caption: "As Fig. S5 of the paper: its 17 objects, rebuilt from their names and raster images. The raster images are \
                  mottled where the pressure is even: every taxel has a gain of its own, as on a real skin, and they differ by \
                  some 20 %.",
        compared: Some(
            "The simulated gains are drawn at random, so the mottle of twin and real skin cannot agree; r is the correlation of \
             their raster images (median over presses), which the gains keep below 1.",
        ),
        draw: |s| Images(sheets::objects(s.dataset, s.skins, s.correlations)),
    },
    FigureLine {
        section: "classification",
        file: "3b_classification",
        alt: "Curves of the share of correctly classified windows, which rise with the number of measurements M; stars mark what the paper states.",
        caption: "As Fig. 3B: how often the right object is named, of 17, mean over the objects. A vote of 20 windows takes 20 \
                  times as long as a single window.",
        compared: Some(
            "Means are over the objects that both skins recorded in compressed form. The published library holds some of the \
             very frames that the real skin's raster scan is scored on; nothing else is scored on what was learned.",
        ),
        draw: |s| Charts(s.skins.fig_3b()),
    },
    FigureLine {
        section: "classification",
        file: "3c_support",
        alt: "Curves of support accuracy and of intersection over union, which rise with the number of measurements M; shades mark the ranges of the paper.",
        caption: "As Fig. 3C: how well the decoded image shows which taxels are touched, mean over the objects. Support accuracy \
                  is the paper's measure. It counts untouched taxels too, so an empty image already scores well; IoU does not reward it.",
        compared: None,
        draw: |s| Charts(s.skins.fig_3c()),
    },
    FigureLine {
        section: "classification",
        file: "3d_frequency",
        alt: "Falling lines of frames a second over the number of measurements M, acquired and decoded, with two stars from the paper.",
        caption: "As Fig. 3D: images a second. The wire delivers the blue line; decoding keeps up where the green line lies above it.",
        compared: None,
        draw: |s| Charts(s.skins.fig_3d(s.timings)),
    },
    FigureLine {
        section: "classification",
        file: "3e_latency",
        alt: "Curves of the share of presses classified correctly over milliseconds, for several M.",
        caption: "As Fig. 3E: how soon a press is recognised, by the published decoder; mean over presses. Left: the published \
                  rule begins 100 frames after contact. Right: from first contact on, while the force still rises.",
        compared: None,
        draw: |s| Charts(s.skins.fig_3e()),
    },
    FigureLine {
        section: "adaptive",
        file: "4_adaptive.png",
        alt: "Rows of tactile images that sharpen from 2 to 15 measurements, above them bars of the measurements used.",
        caption: "As Fig. 4, where the paper's T is distinct at 15 measurements. This is one window of one press, neither the \
                  best nor the worst: from how many measurements on a T is seen differs from window to window. The \
                  evidence decoder has learned from raster images of this very object. It shows a mixture of objects until \
                  it recognises one, and then the whole T; of an object that it has never felt it would show another.",
        compared: Some("The published compressed recordings hold no T; the rectangle stands in for both skins."),
        draw: |s| Images(sheets::adaptive(s.skins, s.dataset.cols)),
    },
    FigureLine {
        section: "adaptive",
        file: "s4_examples.png",
        alt: "Rows of tactile images of five objects at 5 to 100 measurements, beside their raster images.",
        caption: "As Fig. S4: one window of each object at several M. The paper finds 15 to 20 measurements enough for small \
                  objects and 25 to 30 for large ones.",
        compared: None,
        draw: |s| Images(sheets::examples(s.skins, s.dataset.cols)),
    },
    FigureLine {
        section: "adaptive",
        file: "s6_dictionary.png",
        alt: "Small tactile images: the first 40 atoms of the dictionary.",
        caption: "As Fig. S6: the patterns from which the published decoder composes an image, 40 of 100.",
        compared: Some("Below the twin's, those that were published with the real skin."),
        draw: |s| Images(sheets::dictionaries(s.skins, s.dataset.cols)),
    },
    FigureLine {
        section: "bounce",
        file: "5b_change",
        alt: "Two charts over the measurements a frame: the mean change from frame to frame rises, the frames in a contact fall.",
        caption: "As Fig. 5B: the fewer measurements a frame has, the more frames fall into one contact, and the less changes \
                  from one to the next. Means over all bounces.",
        compared: None,
        draw: |s| Charts(s.skins.fig_5b()),
    },
    FigureLine {
        section: "bounce",
        file: "5c_peak",
        alt: "Humps of the largest taxel over milliseconds for 25, 50 and 100 measurements a frame, with shades of their scatter.",
        caption: "As Fig. 5C: the largest taxel of the decoded image while the ball touches. Lines are medians over all bounces, \
                  shades hold the middle half of them, and every marker is a frame.",
        compared: None,
        draw: |s| Charts(s.skins.fig_5c()),
    },
    FigureLine {
        section: "bounce",
        file: "6_localisation",
        alt: "Falling curves of the distance to the true centre over the number of measurements M, with the level of a guess and two stars from the paper.",
        caption: "As Fig. 6: how far the estimated centre of the contact is from the true one, mean over all bounces. All drops fall \
                  near the middle of the skin, so to say “the middle” without a measurement is already as good as the dotted \
                  line: only what lies below it has learned a place from the wire.",
        compared: None,
        draw: |s| Charts(s.skins.fig_6()),
    },
];

/// Writes every figure, as .svg and .png, into the folder `dir`.
///
/// # Errors
/// [`ReportError`] when a file cannot be written.
pub(super) fn draw(dir: &Path, shown: &Shown<'_>) -> Result<(), ReportError> {
    for figure in FIGURES {
        let name = figure.file.trim_end_matches(".png");
        match (figure.draw)(shown) {
            Charts(charts) => save_charts(&charts, dir, name)?,
            Images(sheet) => save_sheet(&sheet, dir, name)?,
        }
    }
    Ok(())
}
