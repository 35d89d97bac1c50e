//! The report's page.

mod cards;
mod glossary;
mod tables;

use super::ReproductionSummary;
use super::best::BEST;
use super::curves::BothSkins;
use super::figures::FIGURES;
use super::tables::CorrelationRow;
use crate::labels::object_label;
use crate::{Page, PageFigure, Section};
use spts_eval::decoders::label;

/// What the page is made of.
pub(super) struct PageContent<'a> {
    /// Main figures and provenance.
    pub(super) summary: &'a ReproductionSummary,
    /// The scored skins.
    pub(super) skins: &'a BothSkins<'a>,
    /// How alike their raster images are; none without recordings.
    pub(super) correlations: &'a [CorrelationRow],
    /// Recordings of the real skin that are not there.
    pub(super) missing: &'a [String],
    /// Whether it was a short run.
    pub(super) quick: bool,
    /// Twin and skin object by object.
    pub(super) per_object: Option<Section>,
    /// Moving pictures.
    pub(super) animations: Vec<PageFigure>,
}

/// The page, but for the section of the readout.
#[must_use]
pub(super) fn page(content: &PageContent<'_>) -> Page {
    let compared = content.skins.real.is_some();
    let mut sections: Vec<Section> = content.per_object.iter().cloned().collect();
    if !content.animations.is_empty() {
        sections.push(Section {
            id: "motion".to_owned(),
            title: "In motion".to_owned(),
            lead: "The pressure on the skin, and beside it the image that is decoded from the one wire at the same instant."
                .to_owned(),
            figures: content.animations.clone(),
            tables: vec![],
        });
    }
    let mut objects = section("objects", "The objects", &objects_lead(compared), compared);
    if !content.correlations.is_empty() {
        objects.tables.push(tables::correlations(content.correlations));
    }
    let mut scores = section(
        "classification",
        "Classification and images",
        &scores_lead(compared),
        compared,
    );
    scores.tables.push(tables::means(content.skins));
    sections.push(objects);
    sections.push(scores);
    sections.push(section(
        "adaptive",
        "More measurements, better images",
        "An image can be decoded from the first few measurements and refined with every one that follows. Cyan lines mark \
         the true contact: the taxels above 0.23 of the maximum of a raster scan.",
        compared,
    ));
    sections.push(section("bounce", "The bouncing ball", &ball_lead(compared), compared));
    Page {
        title: "A tactile skin with one wire, and its digital twin".to_owned(),
        summary: summary(content),
        cards: cards::cards(&content.summary.headline),
        sections,
        glossary: glossary::terms(compared),
        provenance: [origin(content.summary), not_recorded(content.missing)].concat(),
    }
}

/// A section with its figures.
fn section(id: &str, title: &str, lead: &str, compared: bool) -> Section {
    let figures = FIGURES.iter().filter(|figure| figure.section == id);
    let figures = figures.map(|figure| {
        let caption = match figure.compared {
            Some(more) if compared => format!("{} {more}", figure.caption),
            _ => figure.caption.to_owned(),
        };
        PageFigure::new(figure.file, figure.alt, caption)
    });
    Section {
        id: id.to_owned(),
        title: title.to_owned(),
        lead: lead.to_owned(),
        figures: figures.collect(),
        tables: vec![],
    }
}

fn summary(content: &PageContent<'_>) -> String {
    let mut text = String::from(
        "This page shows what a simulated copy of the single-pixel tactile skin feels, recognises and locates, figure by \
         figure as in the paper that introduced the skin.",
    );
    text.push_str(
        "\n\nA robot presses 17 objects on the simulated skin, and a tennis ball bounces on it. The skin's 100 taxels share \
         one wire. Decoders turn M samples of that wire into an image of the contact and the name of the object.",
    );
    text.push_str(if content.skins.real.is_some() {
        " Beside the twin stands the real skin: its published recordings, scored by the same code."
    } else {
        " No recordings of the real skin were given; `spts reproduce --recordings DIR` shows them beside the twin."
    });
    if content.quick {
        text.push_str(" This was a quick run with few presses and windows, so the scores scatter by a few per cent.");
    }
    if !content.missing.is_empty() {
        text.push_str(" Twin and real skin are compared by what both recorded; Provenance lists what is missing.");
    }
    text
}

fn objects_lead(compared: bool) -> String {
    let beside = if compared {
        " The last column is the raster image that was recorded with the real skin."
    } else {
        ""
    };
    format!(
        "A UR5 robot presses each of 17 objects on the skin with 20 N. The pictures show the object, the pressure on the taxels, and the raster image that the wire gives of it.{beside} Every image has a \
         colour scale of its own, from its smallest to its largest value."
    )
}

fn scores_lead(compared: bool) -> String {
    let from = if compared {
        " The twin's decoders have learned from simulated raster images alone. The real skin's published decoders use the \
         published dictionary and library; its best decoders have learned from those of its raster presses that are not \
         scored."
    } else {
        " All decoders have learned from simulated raster images alone."
    };
    format!(
        "Windows of M measurements are decoded into images and classified: by the two decoders that were published with \
         the skin, and by the two that do best here, “{}” and “{}”.{from}",
        label(BEST[0]),
        label(BEST[1])
    )
}

fn ball_lead(compared: bool) -> String {
    let both = if compared {
        " Contacts are found in the recordings of both skins by the same rule."
    } else {
        ""
    };
    format!("A tennis ball is dropped from half a metre on eight places near the middle of the skin.{both}")
}

/// Objects by what was not recorded of them, for the provenance; entries of `missing` have the form "object: what".
fn not_recorded(missing: &[String]) -> Vec<(String, String)> {
    let mut groups: Vec<(&str, Vec<&str>)> = Vec::new();
    for entry in missing {
        let (object, what) = entry.split_once(": ").unwrap_or((entry, ""));
        match groups.iter_mut().find(|(known, _)| *known == what) {
            Some((_, objects)) => objects.push(object_label(object)),
            None => groups.push((what, vec![object_label(object)])),
        }
    }
    let rows = groups.iter();
    rows.map(|(what, objects)| (format!("no {what} of"), objects.join(", ")))
        .collect()
}

fn origin(summary: &ReproductionSummary) -> Vec<(String, String)> {
    let (p, m) = (&summary.provenance.provenance, &summary.provenance.machine);
    [
        ("seed", p.seed.to_string()),
        ("hash of the scenes", p.scene_hash.clone()),
        ("version", p.version.to_owned()),
        ("git revision", p.git_revision.clone()),
        ("MuJoCo", p.mujoco_version.to_owned()),
        ("processor", m.cpu.clone()),
        ("platform", m.platform.clone()),
        ("threads", m.threads.to_string()),
        ("wall time", format!("{:.0} s", summary.headline.wall_s)),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}
