//! The page of the report: its sections, tables and words.

use super::ReproductionSummary;
use super::headline::Headline;
use super::results::{BEST, BothSkins};
use super::tables::{CorrelationRow, REAL, TWIN, skin_file};
use crate::labels::{object_label, object_list};
use crate::{Card, Page, PageFigure, PageTable, Section};
use serde::Deserialize;
use spts_eval::Table;
use spts_eval::decoders::label;
use std::sync::LazyLock;

/// The words of the page, which `page.toml` has.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Words {
    title: String,
    summary: SummaryWords,
    sections: Vec<SectionWords>,
    pub(super) figures: Vec<FigureWords>,
    pub(super) cards: Vec<CardWords>,
    terms: Vec<Term>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SummaryWords {
    text: String,
    compared: String,
    alone: String,
    quick: String,
    missing: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SectionWords {
    id: String,
    title: String,
    lead: String,
    #[serde(default)]
    compared: String,
    #[serde(default)]
    alone: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct FigureWords {
    pub(super) file: String,
    section: String,
    alt: String,
    caption: String,
    compared: Option<String>,
}

/// A card that shows a number of the headline: the first of `keys` that is known, beside others.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CardWords {
    label: String,
    #[serde(default = "twin_published")]
    of: String,
    keys: Vec<String>,
    #[serde(default = "three")]
    digits: usize,
    #[serde(default)]
    unit: String,
    #[serde(default)]
    pub(super) others: Vec<OtherWords>,
    note: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct OtherWords {
    of: String,
    #[serde(default)]
    keys: Vec<String>,
    text: Option<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Term {
    term: String,
    meaning: String,
    /// Whether it is used where the real skin is shown alone.
    #[serde(default)]
    compared: bool,
    /// Whether the term is the name of a decoder, which its label stands for.
    #[serde(default)]
    decoder: bool,
}

fn twin_published() -> String {
    "twin, published decoder".to_owned()
}

fn three() -> usize {
    3
}

pub(super) static WORDS: LazyLock<Words> =
    LazyLock::new(|| toml::from_str(include_str!("page.toml")).unwrap_or_else(|e| panic!("page.toml: {e}")));

/// What the page is made of.
pub(super) struct PageContent<'a> {
    pub(super) summary: &'a ReproductionSummary,
    pub(super) skins: &'a BothSkins<'a>,
    pub(super) correlations: &'a [CorrelationRow],
    pub(super) missing: &'a [String],
    pub(super) quick: bool,
    pub(super) per_object: Option<Section>,
    pub(super) animations: Vec<PageFigure>,
}

/// The page of the report.
pub(super) fn page(content: &PageContent<'_>) -> Page {
    let compared = content.skins.real.is_some();
    let section = |id| section(id, compared);
    let motion = Section { figures: content.animations.clone(), ..section("motion") };
    let mut objects = section("objects");
    if !content.correlations.is_empty() {
        objects.tables.push(correlations_table(content.correlations));
    }
    let mut scores = section("classification");
    scores.tables.push(means_table(content.skins));
    let mut sections: Vec<Section> = content.per_object.iter().cloned().collect();
    sections.extend(Some(motion).filter(|motion| !motion.figures.is_empty()));
    sections.extend([objects, scores, section("adaptive"), section("bounce")]);
    let words = &WORDS.summary;
    let summary = [
        (true, &words.text),
        (compared, &words.compared),
        (!compared, &words.alone),
        (content.quick, &words.quick),
        (!content.missing.is_empty(), &words.missing),
    ];
    let summary = summary.into_iter().filter(|(said, _)| *said).map(|(_, words)| words.as_str());
    Page {
        title: WORDS.title.clone(),
        summary: summary.collect(),
        cards: cards(&content.summary.headline),
        sections,
        glossary: terms(compared),
        provenance: [origin(content.summary), not_recorded(content.missing)].concat(),
    }
}

/// The section `id` with its figures.
pub(super) fn section(id: &str, compared: bool) -> Section {
    let figures = WORDS.figures.iter().filter(|figure| figure.section == id).map(|figure| {
        let more = figure.compared.as_ref().filter(|_| compared);
        let caption = more.map_or_else(|| figure.caption.clone(), |more| format!("{} {more}", figure.caption));
        PageFigure::new(&figure.file, &figure.alt, caption)
    });
    let found = WORDS.sections.iter().find(|section| section.id == id);
    debug_assert!(found.is_some(), "no section is called {id}");
    let (title, lead) = found.map_or_else(Default::default, |words| {
        let more = if compared { &words.compared } else { &words.alone };
        let best = BEST.map(|name| format!("“{}”", label(name))).join(" and ");
        (words.title.clone(), words.lead.replace("{best}", &best).replace("{compared}", more))
    });
    Section { id: id.to_owned(), title, lead, figures: figures.collect(), tables: vec![] }
}

/// A card for every number that the headline has.
pub(super) fn cards(h: &Headline) -> Vec<Card> {
    let say = |key: &str, words: &dyn Fn(f64) -> String| h.number(key).map_or_else(String::new, words);
    let outside = match object_list(h.words("iou_m20_matched_outside")) {
        none if none.is_empty() => {
            "Every object of the real skin lies within the band of the simulated skins.".to_owned()
        }
        objects => format!("Outside the band of the simulated skins: {objects}."),
    };
    let over = if h.number("support_m20_matched_real").is_some() {
        "mean over the objects that both skins recorded in compressed form"
    } else {
        "mean over the 17 objects"
    };
    let [contact, restitution] = ["bounce_contact_ms_twin", "bounce_cor_twin"].map(|key| h.number(key));
    let mechanics = contact.zip(restitution).map_or_else(String::new, |(ms, cor)| {
        format!(
            " In the twin's mechanics the contact takes {ms:.2} ms, and the ball keeps {cor:.3} of its speed (means)."
        )
    });
    let phrases = [
        ("{skins}", h.number("per_object_skins").unwrap_or(0.0).to_string()),
        ("{outside}", outside),
        ("{over}", over.to_owned()),
        ("{mechanics}", mechanics),
        ("{least}", say("raster_corr_min", &|r| format!(" The least is {r:.2}."))),
        (
            "{off}",
            say("press_plateau_error_max_n", &|n| format!(" No press deviates by more than {n:.3} N while it holds.")),
        ),
    ];
    let card = |words: &CardWords| {
        let text = |keys: &[String]| {
            let value = h.first(keys).filter(|value| value.is_finite())?;
            Some(format!("{value:.*}{}", words.digits, words.unit))
        };
        let other = |other: &OtherWords| {
            let value = other.text.clone().or_else(|| text(&other.keys))?;
            Some((label(&other.of).to_owned(), value))
        };
        let note = phrases.iter().fold(words.note.clone(), |note, (name, phrase)| note.replace(name, phrase));
        Some(Card {
            label: words.label.clone(),
            of: words.of.clone(),
            value: text(&words.keys)?,
            others: words.others.iter().filter_map(other).collect(),
            note,
        })
    };
    WORDS.cards.iter().filter_map(card).collect()
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
    rows.map(|(what, objects)| (format!("no {what} of"), objects.join(", "))).collect()
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
        ("wall time", format!("{:.0} s", summary.headline.number("wall_s").unwrap_or_default())),
    ]
    .map(|(name, value)| (name.to_owned(), value))
    .to_vec()
}

/// Numbers of measurements shown in the table of mean scores; its files have all.
const SHOWN: [usize; 7] = [5, 7, 10, 20, 25, 50, 100];

/// Skin, decoder, M and scores of a line of the table of means.
type MeanRow = (&'static str, &'static str, usize, [Option<f64>; 6]);

/// Scores of decoders and baselines, mean over the objects.
fn means_table(skins: &BothSkins<'_>) -> PageTable {
    const HEADS: [&str; 6] =
        ["mean support accuracy", "mean IoU", "mean F1", "mean balanced accuracy", "single windows", "votes of 20"];
    let compared = skins.real.is_some();
    let mut shown = vec![("twin", skins.twin, skins.common())];
    if let Some(real) = skins.real {
        shown.extend([("real skin", real, skins.common()), ("twin, all 17 objects", skins.twin, "mean")]);
    }
    let mut rows: Vec<MeanRow> = Vec::new();
    for (whose, results, object) in shown {
        let scored = results.scores.rows.iter().filter(|r| r.object == object && SHOWN.contains(&r.m));
        rows.extend(scored.map(|r| {
            let images = [r.support, r.iou, r.f1, r.balanced_accuracy];
            let [a, b, c, d] = images.map(Some);
            (whose, r.decode, r.m, [a, b, c, d, Some(r.class_single), Some(r.class_vote20)])
        }));
        let level = results.scores.baselines.iter().filter(|b| b.object == object);
        rows.extend(level.map(|b| {
            let [support, iou, f1, balanced] = [b.support, b.iou, b.f1, b.balanced_accuracy].map(Some);
            (whose, b.baseline, 0, [support, iou, f1, balanced, None, None])
        }));
    }
    let mut table = Table::new("", &rows);
    if compared {
        table = table.shown("skin", |r: &MeanRow| r.0);
    }
    table = table.shown("decoder", |r: &MeanRow| label(r.1)).shown("M", |r| r.2);
    for (k, head) in HEADS.into_iter().enumerate() {
        table = table.number(head, 3, move |r| r.3[k]);
    }
    let caption = if compared {
        "Means over the objects that both skins recorded in compressed form, and over all 17 objects of the twin"
    } else {
        "Means over the 17 objects"
    };
    let whose = std::iter::once(TWIN).chain(compared.then_some(REAL));
    let files = whose.flat_map(|whose| [skin_file("scores", whose), skin_file("baselines", whose)]);
    PageTable { files: files.collect(), ..PageTable::new(caption, &table, "") }
}

/// How alike the raster images are.
fn correlations_table(rows: &[CorrelationRow]) -> PageTable {
    let table = Table::new("", rows).shown("object", |c| object_label(&c.object)).shown("r", |c| c.pearson_r).digits(3);
    let caption = "Correlation (Pearson's r) of the twin's and the real skin's median raster images";
    PageTable::new(caption, &table, "raster_correlation.csv")
}

/// The glossary, in the order of its terms.
fn terms(compared: bool) -> Vec<(String, String)> {
    let said = WORDS.terms.iter().filter(|term| compared || !term.compared);
    let named = said.map(|term| {
        let name = if term.decoder { label(&term.term) } else { &term.term };
        (name.to_owned(), term.meaning.clone())
    });
    let mut all: Vec<(String, String)> = named.collect();
    all.sort_by_key(|(term, _)| term.to_lowercase());
    all
}

#[cfg(test)]
mod tests {
    use super::super::figures::FIGURES;
    use super::*;

    /// Figures that other sections draw.
    const ELSEWHERE: [&str; 3] = ["residuals", "quantiles", "scores"];

    #[test]
    fn cards_show_numbers_of_the_headline_and_figures_are_drawn() {
        let shown = cards(&Headline::of(0.5));
        assert_eq!(shown.len(), WORDS.cards.len());
        for (card, words) in shown.iter().zip(&WORDS.cards) {
            assert_eq!(card.others.len(), words.others.len(), "{}", card.label);
            assert!(!card.note.contains('{'), "{}", card.note);
        }
        assert!(cards(&Headline::of(f64::NAN)).is_empty());
        let drawn = FIGURES.iter().map(|(file, _)| *file).chain(ELSEWHERE);
        let (mut drawn, mut told): (Vec<&str>, Vec<&str>) =
            (drawn.collect(), WORDS.figures.iter().map(|figure| figure.file.as_str()).collect());
        drawn.sort_unstable();
        told.sort_unstable();
        assert_eq!(drawn, told);
    }
}
