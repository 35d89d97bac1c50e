//! The report's page.

use super::ReproductionSummary;
use super::figures::FIGURES;
use super::headline::cards;
use super::results::{BEST, BothSkins};
use super::tables::{CorrelationRow, REAL, TWIN, skin_file};
use crate::labels::object_label;
use crate::{Page, PageFigure, PageTable, Section};
use spts_eval::decoders::label;
use spts_eval::{BaselineRow, RASTER, ScoreRow, Table};

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
        objects.tables.push(correlations_table(content.correlations));
    }
    let mut scores = section(
        "classification",
        "Classification and images",
        &scores_lead(compared),
        compared,
    );
    scores.tables.push(means_table(content.skins));
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
        cards: cards(&content.summary.headline),
        sections,
        glossary: terms(compared),
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
        (
            "wall time",
            format!("{:.0} s", summary.headline.number("wall_s").unwrap_or_default()),
        ),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

/// Numbers of measurements shown in the table of mean scores; its files have all.
const SHOWN: [usize; 7] = [5, 7, 10, 20, 25, 50, 100];

/// A row of the table of mean scores: whose, and scores with measurements or without.
#[derive(Clone, Copy)]
enum MeanRow<'a> {
    Decoded(&'static str, &'a ScoreRow),
    Baseline(&'static str, &'a BaselineRow),
}

/// Table of the mean scores.
fn means_table(skins: &BothSkins<'_>) -> PageTable {
    use MeanRow::{Baseline, Decoded};
    let compared = skins.real.is_some();
    let mut shown = vec![("twin", skins.twin, skins.common())];
    if let Some(real) = skins.real {
        shown.extend([
            ("real skin", real, skins.common()),
            ("twin, all 17 objects", skins.twin, "mean"),
        ]);
    }
    let mut rows = Vec::new();
    for (whose, results, object) in shown {
        let scored = results
            .scores
            .rows
            .iter()
            .filter(|r| r.object == object && SHOWN.contains(&r.m));
        rows.extend(scored.map(|r| Decoded(whose, r)));
        let level = results.scores.baselines.iter().filter(|b| b.object == object);
        rows.extend(level.map(|b| Baseline(whose, b)));
    }
    let mut table = Table::new("", rows);
    if compared {
        table = table.shown("skin", |(Decoded(whose, _) | Baseline(whose, _))| whose);
    }
    table = table
        .shown("decoder", |r| match r {
            Decoded(_, r) => label(r.decode),
            Baseline(_, b) => label(b.baseline),
        })
        .shown("M", |r| match r {
            Decoded(_, r) => r.m,
            Baseline(..) => 0,
        });
    /// What a score is called, and its value for a decoder and, if it has one, a baseline.
    type Score = (&'static str, fn(&ScoreRow) -> f64, Option<fn(&BaselineRow) -> f64>);
    let scores: [Score; 6] = [
        ("mean support accuracy", |r| r.support, Some(|b| b.support)),
        ("mean IoU", |r| r.iou, Some(|b| b.iou)),
        ("mean F1", |r| r.f1, Some(|b| b.f1)),
        (
            "mean balanced accuracy",
            |r| r.balanced_accuracy,
            Some(|b| b.balanced_accuracy),
        ),
        ("single windows", |r| r.class_single, None),
        ("votes of 20", |r| r.class_vote20, None),
    ];
    for (name, decoded, level) in scores {
        let value = move |row| match row {
            Decoded(_, r) => Some(decoded(r)),
            Baseline(_, b) => level.map(|level| level(b)),
        };
        table = table.shown(name, value).digits(3);
    }
    let caption = if compared {
        "Means over the objects that both skins recorded in compressed form, and over all 17 objects of the twin"
    } else {
        "Means over the 17 objects"
    };
    let whose = std::iter::once(TWIN).chain(compared.then_some(REAL));
    let files = whose.flat_map(|whose| [skin_file("scores", whose), skin_file("baselines", whose)]);
    PageTable {
        files: files.collect(),
        ..PageTable::new(caption, &table, "")
    }
}

/// How alike the raster images are.
fn correlations_table(rows: &[CorrelationRow]) -> PageTable {
    let table = Table::new("", rows)
        .shown("object", |c| object_label(&c.object))
        .shown("r", |c| c.pearson_r)
        .digits(3);
    let caption = "Correlation (Pearson's r) of the twin's and the real skin's median raster images";
    PageTable::new(caption, &table, "raster_correlation.csv")
}

/// Terms that need the real skin.
const COMPARED: [(&str, &str); 2] = [
    (
        "band",
        "Where the score of one more simulated skin lies nine times in ten. Every simulated skin has taxels, mounting and noise of its own.",
    ),
    (
        "real skin",
        "The skin that the recordings were made with, published with the paper.",
    ),
];

/// Terms of every page.
const ALWAYS: [(&str, &str); 10] = [
    (
        "taxel",
        "One touch-sensitive element of the skin, as a pixel of an image. The skin has 10 × 10, 15 mm apart.",
    ),
    (
        "measurement",
        "One sample of the wire: the sum of all taxels, each with a weight of +1 or −1.",
    ),
    (
        "M",
        "How many measurements a decoder makes one image from. A raster scan needs 100.",
    ),
    ("window", "M measurements that follow each other, decoded together."),
    (
        "raster scan",
        "Reading the taxels one after another: the true image, and the slow way to get it.",
    ),
    (
        "support",
        "The touched taxels: those above 0.23 of the largest value of an image.",
    ),
    (
        "support accuracy",
        "Share of taxels that decoded and true image agree on, touched or not.",
    ),
    (
        "IoU",
        "Intersection over union: taxels touched in both the decoded and the true image, over those touched in either. 1 is perfect, 0 is no overlap.",
    ),
    ("vote of 20", "The object that most of 20 windows in a row name."),
    (
        "gain",
        "How much a taxel answers to a pressure. It differs from taxel to taxel by some 20 %, and a raster image shows it as mottle.",
    ),
];

/// Decoders and the control of every page, which stand there under their labels.
const SCORED: [(&str, &str); 4] = [
    (
        RASTER,
        "The control: M taxels of a raster scan, the others filled in between them. It takes as long as M measurements.",
    ),
    (
        "matched",
        "The published decoder with weights of ±1, as the skin has them, and the output without contact taken off. The published script uses weights of 0 and 1.",
    ),
    (
        "evidence",
        "A decoder that knows typical images of every object. It weighs which object explains the measurements best, and the image is the mean of what remains possible.",
    ),
    (
        "nn_lmmse",
        "Linear minimum mean square error with no negative pressure: a decoder that knows how touched taxels usually go together. It needs no object to be known.",
    ),
];

/// Terms, in the order of the alphabet.
fn terms(compared: bool) -> Vec<(String, String)> {
    let more: &[_] = if compared { &COMPARED } else { &[] };
    let mut all: Vec<(String, String)> = ALWAYS
        .iter()
        .chain(more)
        .copied()
        .chain(SCORED.map(|(name, meaning)| (label(name), meaning)))
        .map(|(term, meaning)| (term.to_owned(), meaning.to_owned()))
        .collect();
    all.sort_by_key(|(term, _)| term.to_lowercase());
    all
}
